//! Promises for scenes drawn at random: moving the world, reordering it, and company change no verdict.

use super::*;
use proptest::prelude::*;

/// People on a grid, so that nobody can be taken for somebody else; each stands or walks, with or without a path.
fn people() -> impl Strategy<Value = Vec<PredictedObject>> {
    let person = (0..24_u8, -180.0..180.0_f64, 0..4_u8, 0.0..1.0_f32, -9.0..9.0_f64);
    prop::collection::btree_map(0..24_u8, person, 0..8).prop_map(|people| {
        let build = |(place, (number, yaw_deg, kind, confidence, y)): (u8, (u8, f64, u8, f32, f64))| {
            let _ = number;
            let column = f64::from(place % 12);
            let side = if place < 12 { -6.7 } else { 6.9 };
            let standing = pedestrian(place, 7.2 + 0.51 * column, side);
            match kind {
                0 => standing,
                1 => walking(standing, yaw_deg, 1.1),
                2 => with_path(walking(standing, yaw_deg, 1.1), confidence, &[(9.9, y)]),
                _ => PredictedObject {
                    classification: vec![class(ObjectClassification::CAR, 0.9)],
                    ..standing
                },
            }
        };
        people.into_iter().map(build).collect()
    })
}

/// A candidate along the road with changing speed.
fn candidates() -> impl Strategy<Value = Vec<Candidate>> {
    let rows = (0.0..15.0_f64, prop::collection::vec((0.05..3.0_f64, 0.0..6.0_f32), 3..30));
    let one = rows.prop_map(|(start, steps)| {
        let mut x = start;
        let row = |(k, (step, speed)): (usize, (f64, f32))| {
            x += step;
            (x, speed, 0.1 * k as f64 - 0.2)
        };
        candidate(&steps.into_iter().enumerate().map(row).collect::<Vec<_>>())
    });
    prop::collection::vec(one, 1..6).prop_map(|candidates| {
        candidates.into_iter().enumerate().map(|(k, c)| keyed(c, k as u8 / 2, k as u32 % 2)).collect()
    })
}

/// A few cycles: speed, time step, people.
type Drive = Vec<(f64, f64, Vec<PredictedObject>)>;

fn drives() -> impl Strategy<Value = Drive> {
    prop::collection::vec((prop_oneof![Just(0.0), 0.0..8.0_f64], 0.05..0.9_f64, people()), 1..6)
}

/// Turning and shifting of the plane.
#[derive(Clone, Copy)]
struct Motion {
    yaw: f64,
    dx: f64,
    dy: f64,
}

impl Motion {
    const NONE: Self = Self { yaw: 0.0, dx: 0.0, dy: 0.0 };

    fn place(self, (x, y): (f64, f64)) -> (f64, f64) {
        let (sin, cos) = self.yaw.sin_cos();
        (cos * x - sin * y + self.dx, sin * x + cos * y + self.dy)
    }

    fn map(self) -> Map {
        let mut sketch = Sketch(MapBuilder::new());
        let moved = |places: &[(f64, f64)]| places.iter().map(|&p| self.place(p)).collect::<Vec<_>>();
        let road = [2.0, -2.0].map(|y| sketch.line(&moved(&[(-50.0, y), (200.0, y)])));
        sketch.0.lanelet(ROAD, road[0], road[1], &[]).unwrap();
        for (id, x) in [(10, 10.0), (20, 24.0)] {
            let bounds = [x - 2.0, x + 2.0].map(|x| sketch.line(&moved(&[(x, -6.0), (x, 6.0)])));
            sketch.0.lanelet(id + 1, bounds[0], bounds[1], &[]).unwrap();
            sketch.stop_line(id + 2, &moved(&[(x, -5.0), (x, 5.0)]));
            sketch.rule(id, &[id + 2]);
        }
        sketch.0.build().unwrap()
    }

    fn person(self, object: &PredictedObject) -> PredictedObject {
        let mut object = object.clone();
        let kinematics = &mut object.kinematics;
        self.pose(&mut kinematics.initial_pose_with_covariance.pose);
        kinematics.predicted_paths.iter_mut().flat_map(|path| &mut path.path).for_each(|p| self.pose(p));
        object
    }

    fn pose(self, pose: &mut PoseMessage) {
        (pose.position.x, pose.position.y) = self.place((pose.position.x, pose.position.y));
        let yaw = crate::candidate::pose_of(pose).yaw() + self.yaw;
        pose.orientation = Quaternion::from_yaw(yaw);
    }

    fn candidate(self, candidate: &Candidate) -> Candidate {
        let point = |point: &TrajectoryPoint| {
            let (x, y) = self.place((point.pose.position.x, point.pose.position.y));
            TrajectoryPoint { pose: Pose::from_xy_yaw(x, y, point.pose.yaw() + self.yaw), ..*point }
        };
        Candidate { points: Arc::new(candidate.points.iter().map(point).collect()), ..candidate.clone() }
    }
}

/// Feasible, number of metrics and person named, for each cycle and candidate.
type Outcome = Vec<Vec<(CandidateKey, bool, usize, Option<Uuid>)>>;

fn run(drive: &Drive, candidates: &[Candidate], motion: Motion, front_m: f64) -> Outcome {
    let mut filter = CrosswalkFilter::new(parameters(), front_m);
    let mut scene = scene(motion.map(), 0.0, &[]);
    let candidates: Vec<_> = candidates.iter().map(|candidate| motion.candidate(candidate)).collect();
    let mut now_s = 100.0;
    let mut outcome = Vec::new();
    for (speed_mps, step_s, people) in drive {
        now_s += step_s;
        set_odometry(&mut scene, now_s, *speed_mps);
        let people: Vec<_> = people.iter().map(|person| motion.person(person)).collect();
        set_people(&mut scene, &people);
        let judgements = cycle(&mut filter, &scene, &candidates);
        let one = |(candidate, judgement): (&Candidate, &Judgement)| {
            let person = judgement.evidence.and_then(|evidence| evidence.object_id);
            (candidate.key, judgement.feasible, judgement.metrics.len(), person)
        };
        outcome.push(candidates.iter().zip(&judgements).map(one).collect());
    }
    outcome
}

proptest! {
    #[test]
    fn moving_the_world_changes_nothing(
        drive in drives(), candidates in candidates(),
        yaw in -3.0..3.0_f64, dx in -3000.0..3000.0_f64, dy in -3000.0..3000.0_f64,
    ) {
        let moved = run(&drive, &candidates, Motion { yaw, dx, dy }, 3.789);
        prop_assert_eq!(moved, run(&drive, &candidates, Motion::NONE, 3.789));
    }

    #[test]
    fn order_and_company_change_nothing(drive in drives(), candidates in candidates(), turn in 0..9_usize) {
        let all = run(&drive, &candidates, Motion::NONE, 3.789);
        let mut turned = candidates.clone();
        let by = turn % turned.len();
        turned.rotate_left(by);
        let mut other = run(&drive, &turned, Motion::NONE, 3.789);
        other.iter_mut().for_each(|row| row.rotate_right(by));
        prop_assert_eq!(&other, &all);
        for (k, candidate) in candidates.iter().enumerate() {
            let alone = run(&drive, std::slice::from_ref(candidate), Motion::NONE, 3.789);
            for (alone, all) in alone.iter().zip(&all) {
                prop_assert_eq!(alone[0], all[k]);
            }
        }
    }

    #[test]
    fn the_order_of_people_changes_no_verdict(drive in drives(), candidates in candidates()) {
        let reversed = drive.iter().map(|(v, dt, people)| (*v, *dt, people.iter().rev().cloned().collect())).collect();
        let verdicts = |outcome: Outcome| -> Vec<Vec<bool>> {
            outcome.into_iter().map(|row| row.into_iter().map(|(_, feasible, _, _)| feasible).collect()).collect()
        };
        let a = verdicts(run(&drive, &candidates, Motion::NONE, 3.789));
        prop_assert_eq!(a, verdicts(run(&reversed, &candidates, Motion::NONE, 3.789)));
    }

    /// More people and a longer duration never let a candidate through that was held.
    #[test]
    fn people_never_clear_the_way(drive in drives(), candidates in candidates()) {
        let nobody = drive.iter().map(|(v, dt, _)| (*v, *dt, Vec::new())).collect();
        let alone = run(&nobody, &candidates, Motion::NONE, 3.789);
        prop_assert!(alone.iter().flatten().all(|(_, feasible, _, _)| *feasible));
        let crowd: Drive = drive.iter().map(|(v, dt, people)| {
            let mut crowd = people.clone();
            crowd.push(pedestrian(200, 10.0, -7.9));
            (*v, *dt, crowd)
        }).collect();
        let with = run(&crowd, &candidates, Motion::NONE, 3.789);
        for (with, without) in with.iter().flatten().zip(run(&drive, &candidates, Motion::NONE, 3.789).iter().flatten()) {
            prop_assert!(!with.1 || without.1);
        }
    }
}
