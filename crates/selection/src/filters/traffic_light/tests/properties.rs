//! What holds for every scene: the place of the world, the order and the company of candidates change no verdict.

use super::*;
use motion::geometry::Point2;
use proptest::prelude::*;

/// A light with its stop line: where it is, which way it lies, how it is bent.
#[derive(Debug, Clone)]
struct Line {
    place: Point2,
    yaw: f64,
    bend: f64,
}

/// Turns and shifts the world.
#[derive(Debug, Clone, Copy)]
struct Move {
    yaw: f64,
    x: f64,
    y: f64,
}

const STAY: Move = Move { yaw: 0.0, x: 0.0, y: 0.0 };

impl Move {
    fn point(self, p: Point2) -> Point2 {
        let (sin, cos) = self.yaw.sin_cos();
        Point2::new(cos * p.x - sin * p.y + self.x, sin * p.x + cos * p.y + self.y)
    }
}

fn ray(yaw: f64, length_m: f64) -> motion::Vector2 {
    motion::Vector2::new(yaw.cos(), yaw.sin()) * length_m
}

/// One lanelet ruled by all lights; light i has id 1000 + i.
fn map_of(lines: &[Line], moved: Move) -> Map {
    let mut builder = MapBuilder::new();
    builder.point(1, [0.0; 3], &[]).unwrap();
    builder.line_string(1, &[1], &[]).unwrap();
    builder.lanelet(LANELET, 1, 1, &[]).unwrap();
    for (id, line) in (1000..).zip(lines) {
        let ends = [line.place + ray(line.yaw, 6.0), line.place, line.place - ray(line.yaw + line.bend, 6.0)];
        let ids = [3 * id, 3 * id + 1, 3 * id + 2];
        for (point_id, end) in ids.iter().zip(ends) {
            let place = moved.point(end);
            builder.point(*point_id, [place.x, place.y, 0.0], &[]).unwrap();
        }
        builder.line_string(id, &ids, &[]).unwrap();
        let members = [("ref_line", Member::LineString(id))];
        builder.regulatory_element(id, &members, &[("subtype", "traffic_light")]).unwrap();
        builder.attach(LANELET, id).unwrap();
    }
    builder.build().unwrap()
}

/// A candidate: start of its time, start speed, and speed change and turn per step of 0.4 s.
type Drive = (f64, f64, Vec<(f64, f64)>);

fn points_of(drive: &Drive, moved: Move) -> Vec<TrajectoryPoint> {
    let (mut time_s, mut speed, steps) = (drive.0, drive.1, &drive.2);
    let (mut place, mut heading) = (Point2::origin(), 0.0);
    let mut points = Vec::new();
    for (change, turn) in steps {
        let moved_place = moved.point(place);
        points.push(TrajectoryPoint {
            acceleration_mps2: (change / 0.4) as f32,
            pose: Pose::from_xy_yaw(moved_place.x, moved_place.y, heading + moved.yaw),
            ..point(time_s, 0.0, speed)
        });
        place += ray(heading, speed * 0.4);
        (time_s, speed, heading) = (time_s + 0.4, (speed + change).max(0.0), heading + turn);
    }
    points
}

fn any_line() -> impl Strategy<Value = Line> {
    (2.0..40.0_f64, -4.0..4.0_f64, 1.0..2.1_f64, -0.5..0.5_f64).prop_map(|(x, y, yaw, bend)| Line {
        place: Point2::new(x, y),
        yaw,
        bend,
    })
}

fn any_drive() -> impl Strategy<Value = Drive> {
    let steps = prop::collection::vec((-1.5..1.0_f64, -0.05..0.05_f64), 2..25);
    (-1.0..0.1_f64, 0.0..14.0_f64, steps)
}

fn any_lamps() -> impl Strategy<Value = &'static [Lamp]> {
    prop::sample::select(vec![RED, AMBER, GREEN, UNKNOWN, RED_AND_AMBER])
}

fn any_parameters() -> impl Strategy<Value = TrafficLightParameters> {
    let bools = prop::collection::vec(any::<bool>(), 3);
    (bools, 0.0..0.5_f64, 0.0..1.0_f64, 0.0..20.0_f64, 0.0..40.0_f64).prop_map(
        |(bools, stable_s, hysteresis_s, allow_m, look_m)| TrafficLightParameters {
            treat_amber_light_as_red_light: bools[0],
            treat_unknown_light_as_red_light: bools[1],
            stable_duration_threshold_red: stable_s,
            stable_duration_threshold_amber: stable_s * 0.5,
            allow_if_cannot_stop_distance: allow_m,
            min_lookahead_distance: look_m,
            amber_rejection: AmberRejection {
                hysteresis_duration: hysteresis_s,
                reject_if_stop_detected: bools[2],
            },
            ..TrafficLightParameters::default()
        },
    )
}

/// Lamps of each light and drive of each candidate, cycle by cycle.
type Story = Vec<(Vec<&'static [Lamp]>, Vec<Drive>)>;

const CANDIDATES: usize = 3;

fn any_story() -> impl Strategy<Value = Story> {
    let cycle = (prop::collection::vec(any_lamps(), 3), prop::collection::vec(any_drive(), CANDIDATES));
    prop::collection::vec(cycle, 1..6)
}

/// Judgements of those candidates, by cycle, in their own order whatever the order of judging.
fn run(
    lines: &[Line],
    parameters: &TrafficLightParameters,
    story: &Story,
    moved: Move,
    order: &[usize],
) -> Vec<Vec<Judgement>> {
    let mut world = World::on(map_of(lines, moved), parameters.clone(), 3.8);
    let mut told = Vec::new();
    for (number, (lamps, drives)) in story.iter().enumerate() {
        world.ego(drives[0].1, 0.0).at(100.0 + 0.3 * number as f64);
        world.signals((1000..).zip(lamps).map(|(id, lamps)| group(id, lamps)).collect());
        let candidate = |index: &usize| {
            let mut candidate = candidate_of(points_of(&drives[*index], moved));
            candidate.key = CandidateKey { generator: Uuid::default(), sample: *index as u32 };
            candidate
        };
        let judgements = world.cycle(&order.iter().map(candidate).collect::<Vec<_>>());
        let mut by_index: Vec<_> = order.iter().copied().zip(judgements).collect();
        by_index.sort_by_key(|(index, _)| *index);
        told.push(by_index.into_iter().map(|(_, judgement)| judgement).collect());
    }
    told
}

proptest! {
    #[test]
    fn moving_the_world_changes_no_verdict(
        lines in prop::collection::vec(any_line(), 3), parameters in any_parameters(), story in any_story(),
        yaw in -3.0..3.0_f64, x in -5e3..5e3_f64, y in -5e3..5e3_f64,
    ) {
        let all: Vec<_> = (0..CANDIDATES).collect();
        let here = run(&lines, &parameters, &story, STAY, &all);
        let there = run(&lines, &parameters, &story, Move { yaw, x, y }, &all);
        for (here, there) in here.iter().flatten().zip(there.iter().flatten()) {
            prop_assert_eq!(&here.metrics.iter().map(|m| m.risk).collect::<Vec<_>>(),
                            &there.metrics.iter().map(|m| m.risk).collect::<Vec<_>>());
            prop_assert_eq!(here.feasible, there.feasible);
        }
    }

    #[test]
    fn order_and_company_of_candidates_change_nothing(
        lines in prop::collection::vec(any_line(), 3), parameters in any_parameters(), story in any_story(),
        order in Just((0..CANDIDATES).collect::<Vec<_>>()).prop_shuffle(),
    ) {
        let all: Vec<_> = (0..CANDIDATES).collect();
        let together = format!("{:?}", run(&lines, &parameters, &story, STAY, &all));
        prop_assert_eq!(&together, &format!("{:?}", run(&lines, &parameters, &story, STAY, &order)));
        for index in all {
            let alone = run(&lines, &parameters, &story, STAY, &[index]);
            let company = run(&lines, &parameters, &story, STAY, &[0, 1, 2]);
            for (alone, company) in alone.iter().zip(&company) {
                prop_assert_eq!(format!("{:?}", alone[0]), format!("{:?}", company[index]));
            }
        }
    }

    /// A light that must not be passed is never passed by an accepted candidate whose front was before it.
    #[test]
    fn a_red_line_ahead_is_never_crossed(line in any_line(), drive in any_drive(), speed in 0.0..14.0_f64) {
        let mut world = World::on(map_of(std::slice::from_ref(&line), STAY), TrafficLightParameters::default(), 3.8);
        world.ego(speed, 0.0).signals(vec![group(1000, RED)]);
        let points = points_of(&drive, STAY);
        if world.ok(points.clone()) {
            let future: Vec<_> = points.iter().filter(|p| p.time_from_start.nanos() >= 0).collect();
            let ends = [line.place + ray(line.yaw, 6.0), line.place, line.place - ray(line.yaw + line.bend, 6.0)];
            let mut driven_m = 0.0;
            for pair in future.windows(2) {
                let piece = motion::Segment::new(pair[0].pose.point(), pair[1].pose.point());
                driven_m += piece.length();
                // Beyond the look-ahead and after a planned stop nobody looks.
                if driven_m > 20.0 || pair[0].longitudinal_velocity_mps <= 0.01 {
                    break;
                }
                for side in ends.windows(2) {
                    let crossed = piece.first_contact(&motion::Segment::new(side[0], side[1])).is_some();
                    let stops = pair[1].longitudinal_velocity_mps <= 0.01;
                    prop_assert!(!crossed || stops, "{pair:?}");
                }
            }
        }
    }
}
