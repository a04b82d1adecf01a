//! Whom the planner has to wait for, as the message that tells it.

use super::{CrosswalkMemo, NAME};
use crate::scene::Scene;
use crate::verdict::{Judgement, Memo};
use messages::autoware_internal_planning_msgs as wire;
use messages::geometry_msgs::Point;
use messages::unique_identifier_msgs::Uuid;

/// Somebody for whom a candidate would have to wait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SafetyFactor {
    /// The person.
    pub object_id: Uuid,
    /// Where the person was last seen, map frame \[m\].
    pub position: Point,
}

/// Those for whom an infeasible candidate would have to wait, in the order of the drive: one at each crosswalk up to
/// the one that makes it infeasible. With `use_trajectory_time` that includes crosswalks which the candidate reaches
/// late enough. Empty for feasible candidates and for judgements of other filters.
#[must_use]
pub fn safety_factors(judgement: &Judgement) -> &[SafetyFactor] {
    match &judgement.memo {
        Memo::Crosswalk(CrosswalkMemo { factors, .. }) if !judgement.feasible => factors,
        _ => &[],
    }
}

/// The message for an infeasible candidate: stop here and now for these people. `None` if there are none, or no
/// odometry.
#[must_use]
pub fn planning_factor(scene: &Scene, judgement: &Judgement) -> Option<wire::PlanningFactor> {
    let factors = safety_factors(judgement);
    let odometry = scene.odometry.as_ref().filter(|_| !factors.is_empty())?;
    let factor = |factor: &SafetyFactor| wire::SafetyFactor {
        r#type: wire::SafetyFactor::OBJECT,
        object_id: factor.object_id,
        points: vec![factor.position],
        is_safe: false,
        ..wire::SafetyFactor::default()
    };
    Some(wire::PlanningFactor {
        module: NAME.to_owned(),
        is_driving_forward: true,
        control_points: vec![wire::ControlPoint {
            pose: odometry.pose.pose,
            ..wire::ControlPoint::default()
        }],
        behavior: wire::PlanningFactor::STOP,
        detail: "crosswalk_obstruction".to_owned(),
        safety_factors: wire::SafetyFactorArray {
            header: odometry.header.clone(),
            factors: factors.iter().map(factor).collect(),
            is_safe: false,
            detail: String::new(),
        },
    })
}
