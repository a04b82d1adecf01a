//! Where a candidate drives over the stop lines of crosswalks.

use super::route::{Crosswalk, StopLine};
use motion::trajectory::{Posed, TrajectoryPoint};
use motion::{AxisAlignedBox, Point2, Segment};

/// Up to this speed a point is the end of the drive \[m/s\].
const STOPPED_MPS: f64 = 1e-6;
/// Segments of a path that share a box.
const BLOCK: usize = 8;

/// The stretch of candidates that is looked at, the same for all candidates of a cycle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Outlook {
    /// Path length after which no further points are taken \[m\]; infinite if the vehicle cannot stop.
    pub(super) length_m: f64,
    /// From base_link to the front bumper, less the tolerated overshoot \[m\].
    pub(super) front_m: f64,
    /// Distance from a stop line within which the vehicle has arrived at it \[m\].
    pub(super) arrived_m: f64,
}

/// A stop line under a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Crossing {
    /// Place of the crosswalk in the route's list.
    pub(super) crosswalk: usize,
    /// Id of the stop line.
    pub(super) stop_line: i64,
    /// Segment of the path that meets the line.
    segment: usize,
    /// Path length of base_link up to the line \[m\].
    pub(super) arc_m: f64,
    /// Where.
    pub(super) place: Point2,
}

/// The places of a candidate that are looked at, with their path lengths.
#[derive(Debug, Default)]
pub(crate) struct Path {
    /// base_link at the points of the candidate from time 0 on, then its front at the end.
    places: Vec<Point2>,
    /// Path length up to each point; the front at the end has none.
    lengths_m: Vec<f64>,
    /// A box around each [`BLOCK`] segments.
    blocks: Vec<AxisAlignedBox>,
    /// Index of the first point in the candidate.
    first: usize,
    /// How far the front bumper gets, as path length of base_link plus the distance between both \[m\].
    reach_m: f64,
}

impl Path {
    fn trace(&mut self, points: &[TrajectoryPoint], outlook: &Outlook) {
        self.places.clear();
        self.lengths_m.clear();
        let is_past = |point: &TrajectoryPoint| point.time_from_start.nanos() < 0;
        self.first = points.iter().position(|point| !is_past(point)).unwrap_or(points.len());
        let mut length_m = 0.0;
        for point in points[self.first..].iter().filter(|point| !is_past(point)) {
            let place = point.point();
            length_m += self.places.last().map_or(0.0, |last| (place - last).norm());
            self.places.push(place);
            self.lengths_m.push(length_m);
            if f64::from(point.longitudinal_velocity_mps) <= STOPPED_MPS || length_m > outlook.length_m {
                break;
            }
        }
        let short_m = if length_m < outlook.arrived_m { outlook.arrived_m - length_m } else { 0.0 };
        let extension_m = outlook.front_m + short_m;
        self.reach_m = length_m + outlook.front_m;
        // The end of the whole candidate, not of the stretch: upstream's way, and it can only add crosswalks.
        if let Some(last) = points.last().filter(|_| extension_m > 0.0) {
            self.places.push(last.pose.planar_transform().apply(Point2::new(extension_m, 0.0)));
        }
        self.blocks.clear();
        let ends = self.places.len().saturating_sub(1);
        let block = |start: usize| &self.places[start..=ends.min(start + BLOCK)];
        let starts = (0..ends).step_by(BLOCK);
        self.blocks.extend(starts.map(|start| AxisAlignedBox::around(block(start).iter().copied())));
    }

    /// The first meeting with a stop line.
    fn meet(&self, crosswalk: usize, line: &StopLine) -> Option<Crossing> {
        let segments = self.places.len().saturating_sub(1);
        let near = self.blocks.iter().enumerate().filter(|(_, block)| block.overlaps(&line.extent));
        let mut candidates = near.flat_map(|(block, _)| block * BLOCK..segments.min((block + 1) * BLOCK));
        candidates.find_map(|segment| {
            let step = Segment::new(self.places[segment], self.places[segment + 1]);
            let (place, distance_m) = first_contact(&step, line)?;
            let arc_m = self.lengths_m[segment] + distance_m;
            Some(Crossing { crosswalk, stop_line: line.id, segment, arc_m, place })
        })
    }

    /// True if the front bumper gets as far as the stop line.
    pub(super) fn crosses(&self, crossing: &Crossing) -> bool {
        self.reach_m >= crossing.arc_m
    }

    /// Index of the first point of the candidate at which base_link has come this far; the last one of the path if it
    /// does not come so far.
    pub(super) fn index_at(&self, length_m: f64) -> usize {
        let reached = self.lengths_m.partition_point(|&at| at < length_m);
        self.first + reached.min(self.lengths_m.len().saturating_sub(1))
    }
}

/// Where a segment meets a stop line, and how far from the segment's start; the nearest place of several.
fn first_contact(step: &Segment, line: &StopLine) -> Option<(Point2, f64)> {
    let contacts = line.points.windows(2).filter_map(|l| step.first_contact(&Segment::new(l[0], l[1])));
    contacts.map(|place| (place, (place - step.start).norm())).min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Finds the stop lines that a candidate meets, one for each crosswalk, in the order in which it meets them.
///
/// Of several stop lines of one crosswalk the first one counts. `path` is traced only if some stop line is near.
pub(super) fn find_crossings(
    points: &[TrajectoryPoint],
    crosswalks: &[Crosswalk],
    outlook: &Outlook,
    path: &mut Path,
    crossings: &mut Vec<Crossing>,
) {
    crossings.clear();
    let Some(last) = points.last() else { return };
    if points.len() < 2 || crosswalks.is_empty() {
        return;
    }
    let overhang_m = outlook.front_m.abs() + outlook.arrived_m;
    // A quaternion is a rotation but for rounding, so the extension is at most this much longer than asked.
    let end = AxisAlignedBox::around([last.point()]).widened(2.0 * overhang_m);
    let extent = points.iter().fold(end, |extent, point| extent.with(point.point()));
    let mut traced = false;
    for (index, crosswalk) in crosswalks.iter().enumerate() {
        let near = crosswalk.stop_lines.iter().filter(|line| line.extent.overlaps(&extent));
        let mut first: Option<Crossing> = None;
        for line in near {
            if !traced {
                path.trace(points, outlook);
                traced = true;
            }
            let met = path.meet(index, line);
            let order = |crossing: &Crossing| (crossing.segment, crossing.arc_m);
            if let Some(met) = met
                && first.is_none_or(|first| order(&met) < order(&first))
            {
                first = Some(met);
            }
        }
        crossings.extend(first);
    }
    crossings.sort_unstable_by_key(|crossing| (crossing.segment, crossing.crosswalk));
}
