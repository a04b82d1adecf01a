//! Where the vehicle is over time when it follows a candidate, as planned or braking.
//!
//! Times are seconds after the stamp of the objects. As planned the vehicle is where the candidate says; before the
//! first point it is at the first pose. When it brakes it keeps to the path and comes to a standstill on it.

use crate::candidate::Candidate;
use motion::occupancy::{Deviation, Outline, PlanarPose, Sweep};

/// Slower than this \[m/s\] at its last point a candidate ends standing.
const STANDSTILL_MPS: f64 = 0.01;
/// Points of a candidate closer in time or distance than this are not interpolated between (s or m).
const INTERPOLATION_GAP: f64 = 1e-6;

/// The points of a candidate, column by column.
#[derive(Debug, Default)]
pub(super) struct EgoPath {
    times_s: Vec<f64>,
    distances_m: Vec<f64>,
    speeds_mps: Vec<f64>,
    poses: Vec<PlanarPose>,
}

/// A place on a path.
#[derive(Debug, Clone, Copy)]
struct Place {
    pose: PlanarPose,
    distance_m: f64,
    speed_mps: f64,
    /// Index of the first path point that is not before the place.
    next: usize,
}

impl EgoPath {
    /// Takes the points of a candidate, whose times are shifted by `offset_s`.
    pub(super) fn fill(&mut self, candidate: &Candidate, offset_s: f64) {
        self.times_s.clear();
        self.distances_m.clear();
        self.speeds_mps.clear();
        self.poses.clear();
        let mut distance_m = 0.0;
        for point in candidate.points.iter() {
            let pose = PlanarPose::from(&point.pose);
            if let Some(previous) = self.poses.last() {
                distance_m += (pose.position - previous.position).norm();
            }
            self.times_s.push(point.time_from_start.seconds() + offset_s);
            self.distances_m.push(distance_m);
            self.speeds_mps.push(f64::from(point.longitudinal_velocity_mps));
            self.poses.push(pose);
        }
    }

    pub(super) fn end_time_s(&self) -> f64 {
        self.times_s[self.last()]
    }

    /// Index of the last point not after a time; past the end if that is all of them.
    pub(super) fn last_point_at(&self, time_s: f64) -> usize {
        let after = self.times_s.partition_point(|&at| at <= time_s);
        if after == self.times_s.len() { after } else { after.saturating_sub(1) }
    }

    pub(super) fn distance_and_time(&self, point: usize) -> (f64, f64) {
        (self.distances_m[point], self.times_s[point])
    }

    pub(super) fn poses(&self) -> &[PlanarPose] {
        &self.poses
    }

    fn last(&self) -> usize {
        self.poses.len() - 1
    }

    fn point(&self, at: usize, next: usize) -> Place {
        Place { pose: self.poses[at], distance_m: self.distances_m[at], speed_mps: self.speeds_mps[at], next }
    }

    /// Between the points `next - 1` and `next`.
    fn between(&self, next: usize, ratio: f64) -> Place {
        let lerp = |column: &[f64]| column[next - 1] + (column[next] - column[next - 1]) * ratio;
        Place {
            pose: self.poses[next - 1].between(&self.poses[next], ratio),
            distance_m: lerp(&self.distances_m),
            speed_mps: lerp(&self.speeds_mps),
            next,
        }
    }

    /// Where the candidate is at a time. `cursor` speeds up rising times; start it at 0. Beyond the end it goes
    /// on along the last heading for at most `tail_s`, unless it ends standing.
    fn at_time(&self, time_s: f64, tail_s: f64, cursor: &mut usize) -> Place {
        let last = self.last();
        if time_s <= self.times_s[0] {
            return self.point(0, 0);
        }
        if time_s > self.times_s[last] {
            let end = self.point(last, last + 1);
            if end.speed_mps.abs() <= STANDSTILL_MPS {
                return end;
            }
            let beyond_s = (time_s - self.times_s[last]).min(tail_s);
            return Place {
                pose: end.pose.ahead(end.speed_mps * beyond_s),
                distance_m: end.distance_m + end.speed_mps.abs() * beyond_s,
                ..end
            };
        }
        while self.times_s[*cursor] < time_s {
            *cursor += 1;
        }
        self.between(*cursor, ratio(&self.times_s, *cursor, time_s))
    }

    /// Where the path is at a distance, clamped to its ends. `cursor` speeds up distances that hardly change; start it
    /// anywhere.
    fn at_distance(&self, distance_m: f64, cursor: &mut usize) -> Place {
        let last = self.last();
        if distance_m <= 0.0 {
            return self.point(0, 0);
        }
        if distance_m >= self.distances_m[last] {
            return self.point(last, last + 1);
        }
        // The number of points before the place. A braking motion goes on, but for what is rounded in its last moment.
        let is_before = |at: usize| self.distances_m[at] < distance_m;
        let mut next = (*cursor).min(last);
        while next < last && is_before(next) {
            next += 1;
        }
        while next > 0 && !is_before(next - 1) {
            next -= 1;
        }
        *cursor = next;
        // The first piece for a distance that is not a number.
        let next = next.max(1);
        self.between(next, ratio(&self.distances_m, next, distance_m))
    }
}

fn ratio(column: &[f64], next: usize, value: f64) -> f64 {
    let gap = column[next] - column[next - 1];
    if gap > INTERPOLATION_GAP { (value - column[next - 1]) / gap } else { 0.0 }
}

/// Braking from some time on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Braking {
    /// When it sets in \[s\].
    pub(super) start_s: f64,
    /// Acceleration \[m/s²\], negative.
    pub(super) acceleration_mps2: f64,
}

/// Samples of the vehicle's motion at the multiples of the resolution.
#[derive(Debug, Default)]
pub(super) struct EgoMotion {
    pub(super) poses: Vec<PlanarPose>,
    /// Distance along the path from its first point \[m\].
    pub(super) distances_m: Vec<f64>,
    /// How the motion strays from the straight line to the next sample; none for the last sample.
    deviations: Vec<Deviation>,
    /// How many of the last samples are the one before them again: the vehicle has come to a standstill.
    standing: usize,
    sampling: Sampling,
}

/// How far the sampling of a motion has come, and how it goes on.
#[derive(Debug, Clone, Copy, Default)]
struct Sampling {
    /// Braking, and where and how fast the vehicle is when it sets in: distance, speed, time to a standstill.
    plan: Option<(Braking, f64, f64, f64)>,
    resolution_s: f64,
    /// After this no sample is followed by another one \[s\].
    end_s: f64,
    by_time: usize,
    by_distance: usize,
    previous: Option<Place>,
    is_complete: bool,
}

impl Sampling {
    fn is_over(&self, tick: usize) -> bool {
        tick as f64 * self.resolution_s > self.end_s
    }
}

impl EgoMotion {
    /// Samples the motion from time 0 until it ended, and one sample more; not beyond `horizon_s`.
    pub(super) fn sample(
        &mut self,
        path: &EgoPath,
        braking: Option<Braking>,
        resolution_s: f64,
        horizon_s: f64,
    ) {
        self.begin(path, braking, resolution_s, horizon_s);
        self.extend(path, usize::MAX);
    }

    /// Begins to sample a motion in the same way; [`Self::extend`] goes on with it.
    pub(super) fn begin(
        &mut self,
        path: &EgoPath,
        braking: Option<Braking>,
        resolution_s: f64,
        horizon_s: f64,
    ) {
        self.poses.clear();
        self.distances_m.clear();
        self.deviations.clear();
        self.standing = 0;
        let plan = braking.map(|braking| {
            let start = path.at_time(braking.start_s, resolution_s, &mut 0);
            // In reverse gear the speed is negative, and the vehicle brakes all the same.
            let speed_mps = start.speed_mps.abs();
            (braking, start.distance_m, speed_mps, speed_mps / -braking.acceleration_mps2)
        });
        let stop_s = plan.map_or(f64::NEG_INFINITY, |(braking, _, _, stop_s)| braking.start_s + stop_s);
        let end_s = stop_s.max(path.end_time_s()).min(horizon_s);
        self.sampling = Sampling { plan, resolution_s, end_s, ..Sampling::default() };
    }

    /// Goes on until there are so many samples, or the motion has ended.
    pub(super) fn extend(&mut self, path: &EgoPath, samples: usize) {
        let mut sampling = self.sampling;
        while !sampling.is_complete && self.poses.len() < samples {
            let tick = self.poses.len();
            let time_s = tick as f64 * sampling.resolution_s;
            let mut is_standing = false;
            let place = match sampling.plan {
                Some((braking, start_m, speed_mps, stop_s)) if time_s > braking.start_s => {
                    let since_s = (time_s - braking.start_s).min(stop_s);
                    let braked_m = (speed_mps + 0.5 * braking.acceleration_mps2 * since_s) * since_s;
                    is_standing = since_s == stop_s;
                    path.at_distance(start_m + braked_m, &mut sampling.by_distance)
                }
                _ => path.at_time(time_s, sampling.resolution_s, &mut sampling.by_time),
            };
            if let Some(previous) = &sampling.previous {
                self.deviations.push(deviation(path, previous, &place));
            }
            self.poses.push(place.pose);
            self.distances_m.push(place.distance_m);
            if sampling.is_over(tick) {
                sampling.is_complete = true;
            } else if is_standing {
                self.stand((tick..).take_while(|&tick| !sampling.is_over(tick)).count());
                sampling.is_complete = true;
            }
            sampling.previous = Some(place);
        }
        self.sampling = sampling;
    }

    /// True if the motion is sampled to its end.
    pub(super) fn is_complete(&self) -> bool {
        self.sampling.is_complete
    }

    /// Adds the last sample `count` times more.
    fn stand(&mut self, count: usize) {
        let (Some(&pose), Some(&distance_m)) = (self.poses.last(), self.distances_m.last()) else { return };
        self.standing = count;
        self.poses.resize(self.poses.len() + count, pose);
        self.distances_m.resize(self.distances_m.len() + count, distance_m);
        self.deviations.resize(self.deviations.len() + count, Deviation::default());
    }

    /// Number of samples that another one follows.
    pub(super) fn steps(&self) -> usize {
        self.deviations.len()
    }

    /// Writes what the vehicle covers from one sample to the next.
    pub(super) fn sweep_step(&self, step: usize, outline: &Outline, sweep: &mut Sweep) {
        sweep.clear();
        sweep.push(outline, self.poses[step], self.poses[step + 1], &self.deviations[step]);
    }

    /// Writes what the vehicle covers from each sample to the next; the last slice is the last sample alone.
    pub(super) fn sweep(&self, outline: &Outline, sweep: &mut Sweep) {
        sweep.clear();
        self.extend_sweep(outline, sweep);
    }

    /// Appends the slices that a sweep lacks of this motion, as far as that is sampled.
    pub(super) fn extend_sweep(&self, outline: &Outline, sweep: &mut Sweep) {
        let moving = self.deviations.len() - self.standing;
        let known = sweep.len();
        if known < moving {
            let mut row = sweep.row(outline, &self.poses[known]);
            for (end, deviation) in self.poses[known + 1..].iter().zip(&self.deviations[known..moving]) {
                row.go(end, deviation);
            }
        }
        if self.is_complete()
            && sweep.len() == moving
            && let Some(&last) = self.poses.last()
        {
            if self.standing > 0 {
                sweep.push(outline, last, last, &Deviation::default());
                sweep.repeat_last(self.standing - 1);
            }
            sweep.push(outline, last, last, &Deviation::default());
        }
    }
}

/// How the path between two places strays from the straight line.
fn deviation(path: &EgoPath, from: &Place, to: &Place) -> Deviation {
    let mut deviation = Deviation::default();
    // A braking motion may fall back behind points that it passed at the same distance.
    let passed = path.poses.get(from.next..to.next.min(path.poses.len())).unwrap_or_default();
    for via in passed {
        deviation.pass(&from.pose, &to.pose, via);
    }
    deviation
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::{candidate_of, straight};
    use motion::occupancy::slices_meet;
    use motion::{Pose, TimeFromStart};
    use proptest::prelude::*;

    fn path(points: usize, speed_mps: f32, offset_s: f64) -> EgoPath {
        let mut path = EgoPath::default();
        path.fill(&candidate_of(straight(points, speed_mps)), offset_s);
        path
    }

    fn sampled(path: &EgoPath, braking: Option<Braking>) -> EgoMotion {
        let mut motion = EgoMotion::default();
        motion.sample(path, braking, 0.1, 30.0);
        motion
    }

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-9, "{a} instead of {b}");
    }

    #[test]
    fn as_planned_the_first_pose_holds_before_and_one_sample_goes_beyond() {
        // Points at 0.25 .. 1.25 s, speed 10: one sample after the end, extrapolated by 0.05 s.
        let motion = sampled(&path(11, 10.0, 0.25), None);
        let xs: Vec<f64> = motion.poses.iter().map(|pose| pose.position.x).collect();
        assert_eq!(xs.len(), 14);
        assert_eq!(xs[..3], [0.0, 0.0, 0.0]);
        close(xs[3], 0.5);
        close(xs[13], 10.5);
        close(motion.distances_m[13], 10.5);
    }

    #[test]
    fn a_candidate_that_ends_standing_stays() {
        let mut points = straight(11, 10.0);
        points[10].longitudinal_velocity_mps = 0.01;
        let mut path = EgoPath::default();
        path.fill(&candidate_of(points), 0.05);
        let motion = sampled(&path, None);
        close(motion.poses.last().unwrap().position.x, 10.0);
    }

    #[test]
    fn braking_stops_and_stays() {
        let path = path(101, 10.0, 0.0);
        let braking = Braking { start_s: 0.5, acceleration_mps2: -4.0 };
        let motion = sampled(&path, Some(braking));
        for (tick, distance_m) in motion.distances_m.iter().enumerate() {
            let since = (0.1 * tick as f64 - 0.5).clamp(0.0, 2.5);
            let planned = 10.0 * (0.1 * tick as f64).min(0.5);
            close(*distance_m, planned + 10.0 * since - 2.0 * since * since);
        }
        close(*motion.distances_m.last().unwrap(), 17.5);
        assert!(motion.distances_m.is_sorted(), "never runs back along the path");
        // Exactly at the start of braking the vehicle is where it is, not at the start of the path.
        close(motion.distances_m[5], 5.0);
    }

    #[test]
    fn braking_in_reverse_takes_its_time_too() {
        let mut points = straight(51, 5.0);
        for point in &mut points {
            point.longitudinal_velocity_mps = -5.0;
        }
        let mut path = EgoPath::default();
        path.fill(&candidate_of(points), 0.0);
        let motion = sampled(&path, Some(Braking { start_s: 0.0, acceleration_mps2: -2.5 }));
        close(*motion.distances_m.last().unwrap(), 5.0);
    }

    #[test]
    fn braking_distances_keep_to_the_path() {
        let path = path(6, 10.0, 0.0);
        let motion = sampled(&path, Some(Braking { start_s: 0.0, acceleration_mps2: -1.0 }));
        close(motion.poses.last().unwrap().position.x, 5.0);
        assert!(motion.distances_m.iter().all(|&distance| distance <= 5.0));
    }

    #[test]
    fn a_bend_between_two_samples_is_covered() {
        // A detour of 3 m to the left and back within one sample.
        let at = |ms: i64, x: f64, y: f64| motion::TrajectoryPoint {
            time_from_start: TimeFromStart::from_nanos(ms * 1_000_000),
            pose: Pose::from_xy_yaw(x, y, 0.0),
            longitudinal_velocity_mps: 10.0,
            ..motion::TrajectoryPoint::default()
        };
        let points =
            vec![at(0, 0.0, 0.0), at(20, 1.0, 0.0), at(50, 2.0, 3.0), at(80, 3.0, 0.0), at(300, 9.0, 0.0)];
        let mut path = EgoPath::default();
        path.fill(&candidate_of(points), 0.0);
        let motion = sampled(&path, None);
        let (car, post) = (Outline::rectangle(1.0, 1.0, 0.5, 0.5), Outline::rectangle(0.1, 0.1, 0.1, 0.1));
        let (mut sweep, mut standing) = (Sweep::default(), Sweep::default());
        motion.sweep(&car, &mut sweep);
        let place = PlanarPose::new(2.0, 3.2, 0.0);
        standing.push(&post, place, place, &Deviation::default());
        assert!(slices_meet(
            (&car, &sweep, 0),
            (&post, &standing, 0),
            &mut motion::occupancy::HullBuffers::default()
        ));
    }

    #[test]
    fn the_horizon_bounds_the_number_of_samples() {
        let mut points = straight(2, 1.0);
        points[1].time_from_start = TimeFromStart::from_parts(i32::MAX, 0);
        let mut path = EgoPath::default();
        path.fill(&candidate_of(points), 0.0);
        assert!(sampled(&path, None).poses.len() < 310);
    }

    proptest! {
        /// A motion that is sampled bit by bit is the one that is sampled at once, and so is what it covers.
        #[test]
        fn bit_by_bit_is_at_once(
            (points, speed_mps, offset_s) in (2..60_usize, 0.0..12.0_f32, -0.5..0.5_f64),
            (start_s, acceleration_mps2, brakes) in (-0.5..2.0_f64, -6.0..-0.5_f64, any::<bool>()),
            parts in proptest::collection::vec(1..20_usize, 0..8),
        ) {
            let path = path(points, speed_mps, offset_s);
            let braking = brakes.then_some(Braking { start_s, acceleration_mps2 });
            let outline = Outline::rectangle(3.8, 1.1, 0.9, 0.9);
            let at_once = sampled(&path, braking);
            let (mut motion, mut sweep, mut whole) = (EgoMotion::default(), Sweep::default(), Sweep::default());
            at_once.sweep(&outline, &mut whole);
            motion.begin(&path, braking, 0.1, 30.0);
            let mut samples = 0;
            for part in parts.into_iter().chain([usize::MAX]) {
                samples = part.saturating_add(samples);
                motion.extend(&path, samples);
                motion.extend_sweep(&outline, &mut sweep);
                prop_assert!(motion.is_complete() || sweep.len() + 1 == motion.poses.len());
            }
            prop_assert_eq!((&motion.poses, &motion.distances_m), (&at_once.poses, &at_once.distances_m));
            prop_assert_eq!(&motion.deviations, &at_once.deviations);
            prop_assert_eq!((sweep.bounds(), sweep.groups()), (whole.bounds(), whole.groups()));
            for at in 0..whole.len() {
                prop_assert_eq!((sweep.slice(at), sweep.bounding_box(at)), (whole.slice(at), whole.bounding_box(at)));
            }
        }

        /// A cursor, wherever it is, changes no place.
        #[test]
        fn a_place_does_not_depend_on_the_cursor(
            steps in proptest::collection::vec(prop_oneof![Just(0.0), 0.0..3.0_f64], 1..30),
            (ratio, cursor) in (-0.1..1.1_f64, 0..40_usize),
        ) {
            let mut path = EgoPath::default();
            let mut x = 0.0;
            for (k, step) in (0_u32..).zip(std::iter::once(&0.0).chain(&steps)) {
                x += step;
                path.times_s.push(f64::from(k));
                path.distances_m.push(x);
                path.speeds_mps.push(1.0);
                path.poses.push(PlanarPose::new(x, 0.0, 0.0));
            }
            let distance_m = ratio * x;
            let place = path.at_distance(distance_m, &mut { cursor });
            prop_assert_eq!(place.distance_m, path.at_distance(distance_m, &mut 0).distance_m);
            if distance_m > 0.0 && distance_m < x {
                let before = path.distances_m.partition_point(|&at| at < distance_m).max(1);
                prop_assert_eq!(place.next, before);
            }
        }
    }
}
