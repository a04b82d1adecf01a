//! Rejects candidates whose footprint leaves the road.
//!
//! The road is the union of the lanelets of some subtypes. Every footprint up to a horizon must lie on it, and so must
//! the hull of neighbouring footprints where one sticks out or where they are far apart. The metric is the largest
//! distance by which any point of an outline is off the road. No memory. Upstream once carried a filter of this name
//! that never worked; this one has no counterpart to be equal to.

mod road;

use self::road::{Excess, Road, RoadBuffers};
use super::{Filter, Scratch};
use crate::candidate::Candidate;
use crate::parameters::{OutOfLaneParameters, ValidatorParameters};
use crate::scene::Scene;
use crate::verdict::{Evidence, Judgement, Memo, Metric, RiskLevel};
use motion::geometry::convex_hull;
use motion::{Footprint, Point2, TrajectoryPoint, VehicleInfo};
use smallvec::smallvec;

/// Name of the filter.
pub const NAME: &str = "out_of_lane_filter";

const METRIC: &str = "check_out_of_lane";
/// An excess is one only beyond this \[m\]: rounding moves a footprint by less.
const EXCESS_TOLERANCE_M: f64 = 1e-6;

/// The filter with the road of the present map.
#[derive(Debug)]
pub struct OutOfLaneFilter {
    parameters: OutOfLaneParameters,
    outline: Footprint,
    half_length_m: f64,
    road: RoadState,
}

#[derive(Debug)]
enum RoadState {
    NoMap,
    NoLanelets { epoch: u64 },
    Ready { epoch: u64, road: Box<Road> },
}

impl RoadState {
    fn epoch(&self) -> Option<u64> {
        match self {
            Self::NoMap => None,
            Self::NoLanelets { epoch } | Self::Ready { epoch, .. } => Some(*epoch),
        }
    }
}

/// Buffers of the filter, reused from candidate to candidate.
#[derive(Debug, Default)]
pub struct Workspace {
    road: RoadBuffers,
    corners: Vec<Point2>,
    hull: Vec<Point2>,
}

/// What a candidate leaves behind so that its judgement can be explained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct OutOfLaneMemo {
    /// True if the first tested footprint is off the road already.
    pub starts_outside: bool,
}

impl OutOfLaneFilter {
    /// A filter for this vehicle.
    #[must_use]
    pub fn new(parameters: OutOfLaneParameters, vehicle: &VehicleInfo) -> Self {
        Self {
            parameters,
            outline: vehicle.footprint(0.0, 0.0),
            half_length_m: 0.5 * vehicle.vehicle_length_m(),
            road: RoadState::NoMap,
        }
    }

    fn is_excess(&self, excess: &Excess) -> bool {
        excess.distance_m > self.parameters.min_value + EXCESS_TOLERANCE_M
    }
}

/// The four corners of the vehicle at a point. The centre points of the sides add nothing to the outline.
fn corners_at(outline: &Footprint, point: &TrajectoryPoint) -> [Point2; 4] {
    let placed = outline.placed_at(&point.pose);
    [placed.front_left(), placed.front_right(), placed.rear_right(), placed.rear_left()]
}

/// The largest excess of a candidate, and where it first has too much.
#[derive(Debug, Default)]
struct Found {
    largest_m: f64,
    first: Option<(usize, Excess)>,
    is_at_start: bool,
}

impl Found {
    fn take(&mut self, index: usize, excess: &Excess, is_too_much: bool) {
        self.largest_m = self.largest_m.max(excess.distance_m);
        if is_too_much && self.first.is_none() {
            self.first = Some((index, *excess));
        }
    }
}

impl OutOfLaneFilter {
    fn find_excess(&self, road: &Road, candidate: &Candidate, work: &mut Workspace) -> Found {
        let mut found = Found::default();
        let mut previous: Option<([Point2; 4], Point2, bool)> = None;
        for (index, point) in candidate.points.iter().enumerate() {
            let time_s = point.time_from_start.seconds();
            if time_s > self.parameters.time {
                break;
            }
            if time_s < 0.0 {
                continue;
            }
            let corners = corners_at(&self.outline, point);
            let excess = road.excess(&corners, &mut work.road);
            if let Some((before, place, was_outside)) = previous {
                let is_far = (point.pose.point() - place).norm() > self.half_length_m;
                if (is_far || was_outside || excess.is_some())
                    && let Some(between) = hull_excess(road, &before, &corners, work)
                {
                    // What happens on the way happens after the earlier of the two points.
                    found.take(index - 1, &between, self.is_excess(&between));
                }
            }
            if let Some(excess) = &excess {
                found.take(index, excess, self.is_excess(excess));
                found.is_at_start |= previous.is_none() && self.is_excess(excess);
            }
            previous = Some((corners, point.pose.point(), excess.is_some()));
        }
        found
    }
}

fn hull_excess(road: &Road, a: &[Point2; 4], b: &[Point2; 4], work: &mut Workspace) -> Option<Excess> {
    work.corners.clear();
    work.corners.extend(a.iter().chain(b));
    convex_hull(&mut work.corners, &mut work.hull);
    road.excess(&work.hull, &mut work.road)
}

impl Filter for OutOfLaneFilter {
    fn name(&self) -> &'static str {
        NAME
    }

    fn configure(&mut self, parameters: &ValidatorParameters) {
        if parameters.out_of_lane.lanelet_subtypes != self.parameters.lanelet_subtypes {
            self.road = RoadState::NoMap;
        }
        self.parameters = parameters.out_of_lane.clone();
    }

    fn observe(&mut self, scene: &Scene) {
        let Some(map) = &scene.map else {
            self.road = RoadState::NoMap;
            return;
        };
        let epoch = map.number;
        if self.road.epoch() != Some(epoch) {
            let road = Road::new(&map.value.map, &self.parameters.lanelet_subtypes);
            self.road = road.map_or(RoadState::NoLanelets { epoch }, |road| RoadState::Ready {
                epoch,
                road: Box::new(road),
            });
        }
    }

    fn judge(&self, _scene: &Scene, candidate: &Candidate, scratch: &mut Scratch) -> Judgement {
        let road = match &self.road {
            RoadState::NoMap => return Judgement::not_assessed("lanelet map is not available"),
            RoadState::NoLanelets { .. } => {
                return Judgement::not_assessed("the lanelet map has no lanelet of the configured subtypes");
            }
            RoadState::Ready { road, .. } => road,
        };
        let found = self.find_excess(road, candidate, &mut scratch.out_of_lane);
        let risk = if found.first.is_some() { RiskLevel::Danger } else { RiskLevel::Safe };
        let threshold = self.parameters.min_value;
        Judgement {
            feasible: found.first.is_none(),
            failure: None,
            metrics: smallvec![Metric { name: METRIC, value: found.largest_m, threshold, risk }],
            evidence: found.first.map(|(index, excess)| Evidence {
                x_m: excess.point.x,
                y_m: excess.point.y,
                element_id: excess.lanelet,
                ..Evidence::at(candidate, index)
            }),
            memo: Memo::OutOfLane(OutOfLaneMemo { starts_outside: found.is_at_start }),
        }
    }

    fn explain(&self, judgement: &Judgement) -> Option<String> {
        let (Memo::OutOfLane(memo), Some(at), Some(metric), false) =
            (&judgement.memo, &judgement.evidence, judgement.metrics.first(), judgement.feasible)
        else {
            return crate::verdict::explain(judgement);
        };
        let start = if memo.starts_outside { "starts outside: " } else { "" };
        let lanelet = at.element_id.map_or_else(String::new, |id| format!(", beside lanelet {id}"));
        Some(format!(
            "{start}leaves the road by up to {:.2} m, first after {:.1} s at ({:.1}, {:.1}){lanelet}",
            metric.value, at.time_s, at.x_m, at.y_m
        ))
    }
}
