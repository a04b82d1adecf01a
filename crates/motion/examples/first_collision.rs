//! Times `BoxTracks::first_collision` on 800 candidates of 50 points against 20 moving boxes.
//!
//! `first_collision write DIR` writes the three workloads (`sparse.bin`, `mixed.bin`, `near.bin`) to a folder;
//! `first_collision run FILE` judges a workload and prints the best times of many rounds in milliseconds: with all boxes
//! ready, from positions and yaws, and from serialised ROS messages; `FILE.first` gets the first colliding index of each
//! candidate (little-endian i32, -1 for none). The file is flat and little-endian: u32
//! candidates, steps, objects; f64 length and width of the vehicle; x, y, yaw of every candidate's poses; x, y, yaw of
//! every object's poses; length and width of every object.

use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory};
use messages::autoware_perception_msgs::{PredictedObject, PredictedObjects, PredictedPath};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::geometry_msgs;
use messages::{Interface, Message};
use motion::occupancy::BoxTracks;
use motion::{OrientedBox, Point2, Vector2};
use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

const CANDIDATES: usize = 800;
const STEPS: usize = 50;
const OBJECTS: usize = 20;
const STEP_S: f64 = 0.1;
const RADIUS_M: f64 = 200.0;
const LANE_M: f64 = 3.5;
/// Best of this many measurements, each over so many repetitions that starting threads does not count.
const ROUNDS: usize = 30;
const REPETITIONS: usize = 20;
const SIZE: [f64; 2] = [4.77, 1.83];

type Pose = [f64; 3];

struct Workload {
    size: [f64; 2],
    candidates: Vec<Vec<Pose>>,
    objects: Vec<Vec<Pose>>,
    sizes: Vec<[f64; 2]>,
}

/// A pose at a length along and a distance to the left of a circle.
fn on_road(along: f64, left: f64, slope: f64) -> Pose {
    let angle = along / RADIUS_M;
    let radius = RADIUS_M - left;
    [radius * angle.sin(), RADIUS_M - radius * angle.cos(), angle + (slope / (1.0 - left / RADIUS_M)).atan()]
}

/// Lateral place and slope of a quintic lane change that starts at `from` and ends at `to`.
fn quintic(from: f64, to: f64, ratio: f64, length: f64) -> (f64, f64) {
    let r = ratio.clamp(0.0, 1.0);
    let shape = r * r * r * (10.0 - 15.0 * r + 6.0 * r * r);
    let slope = 30.0 * r * r * (1.0 - r) * (1.0 - r) / length;
    (from + (to - from) * shape, (to - from) * slope)
}

/// Numbers in 0..1 that look random and are the same everywhere.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self, from: f64, to: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        from + (to - from) * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn workload(density: &str) -> Workload {
    let mut numbers = Numbers(7);
    let is_near = density == "near";
    let candidates = (0..CANDIDATES).map(|_| {
        let speed = if is_near { numbers.next(11.8, 12.2) } else { numbers.next(8.0, 16.0) };
        let target = if is_near { numbers.next(-0.05, 0.05) } else { numbers.next(-0.5, LANE_M + 0.5) };
        let duration = numbers.next(2.5, 5.0);
        let pose = |step: usize| {
            let t = STEP_S * step as f64;
            let (left, slope) = quintic(0.0, target, t / duration, duration * speed);
            on_road(speed * t, left, slope)
        };
        (0..STEPS).map(pose).collect()
    });
    let candidates = candidates.collect();
    let mut sizes = Vec::new();
    let objects = (0..OBJECTS).map(|object| {
        let size = [numbers.next(3.8, 5.2), numbers.next(1.6, 2.0)];
        sizes.push(size);
        let (start, left, speed) = match density {
            "sparse" => (numbers.next(180.0, 400.0), LANE_M * (object % 2) as f64, numbers.next(8.0, 16.0)),
            "near" => {
                let gap = numbers.next(0.3, 0.7);
                let side = if object % 2 == 0 { 1.0 } else { -1.0 };
                (6.0 * (object / 2) as f64 - 20.0, side * (0.5 * (SIZE[1] + size[1]) + gap), 12.0)
            }
            _ => (numbers.next(25.0, 140.0), LANE_M * (object % 2) as f64, numbers.next(4.0, 12.0)),
        };
        // The other lane of the mixed road comes the other way.
        let sign = if density == "mixed" && object % 2 == 1 { -1.0 } else { 1.0 };
        (0..STEPS).map(|step| on_road(start + sign * speed * STEP_S * step as f64, left, 0.0)).collect()
    });
    let objects = objects.collect();
    Workload { size: SIZE, candidates, objects, sizes }
}

fn write(workload: &Workload, path: &Path) -> std::io::Result<()> {
    let mut bytes = Vec::new();
    for count in [workload.candidates.len(), STEPS, workload.objects.len()] {
        bytes.extend((count as u32).to_le_bytes());
    }
    let poses = workload.candidates.iter().chain(&workload.objects).flatten().flatten();
    for number in workload.size.iter().chain(poses).chain(workload.sizes.iter().flatten()) {
        bytes.extend(number.to_le_bytes());
    }
    std::fs::write(path, bytes)
}

fn read(path: &Path) -> Result<Workload, Box<dyn Error>> {
    let bytes = std::fs::read(path)?;
    let mut counts = bytes.chunks_exact(4).take(3).map(|c| c.try_into().map(u32::from_le_bytes));
    let mut count = || Ok::<_, Box<dyn Error>>(counts.next().ok_or("the file is too short")?? as usize);
    let (n, steps, m) = (count()?, count()?, count()?);
    let mut numbers = bytes.get(12..).ok_or("the file is too short")?.chunks_exact(8);
    let mut number = || {
        let chunk: [u8; 8] = numbers.next().ok_or("the file is too short")?.try_into()?;
        Ok::<_, Box<dyn Error>>(f64::from_le_bytes(chunk))
    };
    let size = [number()?, number()?];
    let mut rows = |count: usize| {
        (0..count)
            .map(|_| (0..steps).map(|_| Ok([number()?, number()?, number()?])).collect())
            .collect::<Result<Vec<Vec<Pose>>, Box<dyn Error>>>()
    };
    let (candidates, objects) = (rows(n)?, rows(m)?);
    let sizes = (0..m).map(|_| Ok([number()?, number()?])).collect::<Result<_, Box<dyn Error>>>()?;
    Ok(Workload { size, candidates, objects, sizes })
}

fn oriented([x, y, yaw]: Pose, [length, width]: [f64; 2]) -> OrientedBox {
    let (sin, cos) = yaw.sin_cos();
    OrientedBox {
        center: Point2::new(x, y),
        axis: Vector2::new(cos, sin),
        half_length_m: 0.5 * length,
        half_width_m: 0.5 * width,
    }
}

fn fill_tracks(workload: &Workload, tracks: &mut BoxTracks) {
    tracks.reset(workload.objects.len(), STEPS);
    for (track, (poses, size)) in workload.objects.iter().zip(&workload.sizes).enumerate() {
        for (step, pose) in poses.iter().enumerate() {
            tracks.set(track, step, &oriented(*pose, *size));
        }
    }
}

/// The workload as planners and perception send it.
struct Serialised {
    candidates: Vec<u8>,
    objects: Vec<u8>,
}

const INTERFACE: Interface = Interface::V0_53;

impl Serialised {
    fn of(workload: &Workload) -> Self {
        let candidates = workload.candidates.iter().map(|poses| {
            let points =
                poses.iter().map(|&pose| TrajectoryPoint { pose: posed(pose), ..Default::default() });
            Arc::new(CandidateTrajectory { points: points.collect(), ..Default::default() })
        });
        let objects = workload.objects.iter().zip(&workload.sizes).map(|(poses, &[length, width])| {
            let mut object = PredictedObject::default();
            let path = poses.iter().map(|&pose| posed(pose)).collect();
            object.kinematics.predicted_paths = vec![PredictedPath { path, ..Default::default() }];
            (object.shape.dimensions.x, object.shape.dimensions.y) = (length, width);
            object
        });
        let candidates =
            CandidateTrajectories { candidate_trajectories: candidates.collect(), ..Default::default() };
        let objects = PredictedObjects { objects: objects.collect(), ..Default::default() };
        Self { candidates: candidates.to_cdr(INTERFACE), objects: objects.to_cdr(INTERFACE) }
    }

    /// Decodes both messages and judges every candidate.
    fn judge(
        &self,
        size: [f64; 2],
        tracks: &mut BoxTracks,
        answers: &mut [i32],
    ) -> Result<(), Box<dyn Error>> {
        let objects = PredictedObjects::from_cdr(&self.objects, INTERFACE, "objects")?.objects;
        let candidates = CandidateTrajectories::from_cdr(&self.candidates, INTERFACE, "candidates")?;
        tracks.reset(objects.len(), STEPS);
        for (track, object) in objects.iter().enumerate() {
            let size = [object.shape.dimensions.x, object.shape.dimensions.y];
            for (step, pose) in object.kinematics.predicted_paths[0].path.iter().enumerate() {
                tracks.set(track, step, &placed(pose, size));
            }
        }
        let mut boxes = Vec::with_capacity(STEPS);
        for (candidate, answer) in candidates.candidate_trajectories.iter().zip(answers) {
            boxes.clear();
            boxes.extend(candidate.points.iter().map(|point| placed(&point.pose, size)));
            *answer = first_step(tracks, &boxes);
        }
        Ok(())
    }
}

fn posed([x, y, yaw]: Pose) -> geometry_msgs::Pose {
    let (z, w) = (0.5 * yaw).sin_cos();
    geometry_msgs::Pose {
        position: geometry_msgs::Point { x, y, z: 0.0 },
        orientation: geometry_msgs::Quaternion { x: 0.0, y: 0.0, z, w },
    }
}

/// The heading of an orientation that turns about z alone needs no angle.
fn placed(pose: &geometry_msgs::Pose, [length, width]: [f64; 2]) -> OrientedBox {
    let (z, w) = (pose.orientation.z, pose.orientation.w);
    OrientedBox {
        center: Point2::new(pose.position.x, pose.position.y),
        axis: Vector2::new(w * w - z * z, 2.0 * w * z),
        half_length_m: 0.5 * length,
        half_width_m: 0.5 * width,
    }
}

fn first_step(tracks: &BoxTracks, boxes: &[OrientedBox]) -> i32 {
    tracks.first_collision(boxes).map_or(-1, |hit| hit.step as i32)
}

/// Splits candidates over threads; each has its own part of the answers.
fn on_threads<T: Sync>(
    threads: usize,
    items: &[T],
    answers: &mut [i32],
    judge: impl Fn(&[T], &mut [i32]) + Sync,
) {
    let part = items.len().div_ceil(threads).max(1);
    std::thread::scope(|scope| {
        let mut parts = items.chunks(part).zip(answers.chunks_mut(part));
        let own = parts.next();
        for (items, answers) in parts {
            let judge = &judge;
            scope.spawn(move || judge(items, answers));
        }
        if let Some((items, answers)) = own {
            judge(items, answers);
        }
    });
}

fn best_ms(mut round: impl FnMut()) -> f64 {
    (0..ROUNDS)
        .map(|_| {
            let start = Instant::now();
            round();
            start.elapsed().as_secs_f64() * 1e3 / REPETITIONS as f64
        })
        .fold(f64::INFINITY, f64::min)
}

fn run(path: &Path) -> Result<(), Box<dyn Error>> {
    let workload = read(path)?;
    let mut tracks = BoxTracks::default();
    fill_tracks(&workload, &mut tracks);
    let prebuilt: Vec<Vec<OrientedBox>> = workload
        .candidates
        .iter()
        .map(|poses| poses.iter().map(|&pose| oriented(pose, workload.size)).collect())
        .collect();
    let mut answers = vec![0; prebuilt.len()];
    for threads in [1, 2] {
        let ready_ms = best_ms(|| {
            on_threads(threads, &prebuilt, &mut answers, |candidates, answers| {
                for _ in 0..REPETITIONS {
                    for (boxes, answer) in candidates.iter().zip(&mut *answers) {
                        *answer = first_step(&tracks, black_box(boxes));
                    }
                }
            });
        });
        let whole_ms = best_ms(|| {
            // Every thread would wait for the objects, so each repetition counts them in full.
            for _ in 0..REPETITIONS {
                fill_tracks(black_box(&workload), &mut tracks);
            }
            on_threads(threads, &workload.candidates, &mut answers, |candidates, answers| {
                let mut boxes = Vec::with_capacity(STEPS);
                for _ in 0..REPETITIONS {
                    for (poses, answer) in candidates.iter().zip(&mut *answers) {
                        boxes.clear();
                        boxes.extend(poses.iter().map(|&pose| oriented(pose, workload.size)));
                        *answer = first_step(&tracks, black_box(&boxes));
                    }
                }
            });
        });
        println!("ours {threads} {ready_ms:.6} {whole_ms:.6}");
    }
    let serialised = Serialised::of(&workload);
    let mut of_messages = vec![0; answers.len()];
    let mut outcome = Ok(());
    let decoded_ms = best_ms(|| {
        for _ in 0..REPETITIONS {
            let judged = black_box(&serialised).judge(workload.size, &mut tracks, &mut of_messages);
            outcome = std::mem::replace(&mut outcome, Ok(())).and(judged);
        }
    });
    outcome?;
    println!("decoded {decoded_ms:.6}");
    let differ = answers.iter().zip(&of_messages).filter(|(a, b)| a != b).count();
    if differ > 0 {
        return Err(format!("{differ} candidates are judged otherwise when they come as messages").into());
    }
    let bytes: Vec<u8> = answers.iter().flat_map(|answer: &i32| answer.to_le_bytes()).collect();
    std::fs::write(path.with_extension("first"), bytes)?;
    eprintln!("{} of {} collide", answers.iter().filter(|&&step| step >= 0).count(), answers.len());
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["write", folder] => {
            for density in ["sparse", "mixed", "near"] {
                write(&workload(density), &Path::new(folder).join(density).with_extension("bin"))?;
            }
            Ok(())
        }
        ["run", file] => run(Path::new(file)),
        _ => Err("usage: first_collision write DIR | run FILE".into()),
    }
}
