//! Rejects candidates whose footprint leaves the road.
//!
//! The road is the union of the lanelets of some subtypes. Every footprint up to a horizon must lie on it, and so must
//! the hull of neighbouring footprints where one sticks out or where they are far apart. The metric is the largest
//! distance by which any point of an outline is off the road. No memory. Upstream once carried a filter of this name
//! that never worked; this one has no counterpart to be equal to.

mod borders;
mod box_tree;
mod cell_grid;
mod excess;
mod lanes;
mod quad;
mod road;
mod walk;

pub(crate) use self::road::Road;
use self::walk::Walk;
use super::{Filter, Scratch};
use crate::candidate::Candidate;
use crate::parameters::{OutOfLaneParameters, ValidatorParameters};
use crate::scene::{HdMap, Scene};
use crate::verdict::{Evidence, Judgement, Memo, Metric, RiskLevel};
use motion::{Footprint, VehicleInfo};
use smallvec::smallvec;
use std::sync::Arc;

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
    Ready { epoch: u64, road: Arc<Road> },
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
pub struct Workspace(Walk);

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
}

/// The lanelets of some subtypes, `None` if there are none; made unless the map has them already.
pub(super) fn road_of(map: &HdMap, subtypes: &[String]) -> Option<Arc<Road>> {
    map.survey.road.of(subtypes, || Road::new(&map.map, subtypes).map(Arc::new))
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
            let road = road_of(&map.value, &self.parameters.lanelet_subtypes);
            self.road = road.map_or(RoadState::NoLanelets { epoch }, |road| RoadState::Ready { epoch, road });
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
        let threshold = self.parameters.min_value;
        let walk = &mut scratch.out_of_lane.0;
        walk.restart();
        walk.take_stances(road, &self.outline, &candidate.points, self.parameters.time);
        let found = walk.find(road, self.half_length_m, threshold + EXCESS_TOLERANCE_M);
        let risk = if found.first.is_some() { RiskLevel::Danger } else { RiskLevel::Safe };
        Judgement {
            feasible: found.first.is_none(),
            failure: None,
            metrics: smallvec![Metric { name: METRIC, value: found.largest_m, threshold, risk }],
            evidence: found.first.map(|(index, excess)| Evidence {
                x_m: excess.point.x,
                y_m: excess.point.y,
                element_id: walk.nearest_lanelet(road, &excess),
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
