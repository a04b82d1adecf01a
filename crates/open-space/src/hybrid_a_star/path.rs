//! What the search hands on: a path of arcs, cut where the gear changes.

use crate::arc::Arc;
use crate::pose::{Gear, PlanarPose};

/// A path that a vehicle can drive when it may stop to steer: arcs and straight lines within its curvature limit,
/// free of collisions everywhere, not only at the poses.
#[derive(Clone, Debug, PartialEq)]
pub struct CoarsePath {
    /// Parts in the order they are driven; neighbours have opposite gears. Empty when the start is the goal.
    pub parts: Vec<GearPart>,
    /// Length plus penalties, m.
    pub cost_m: f64,
    /// Distance that the footprint keeps to every obstacle all along, m (the inflation of the search that found it).
    pub inflation_m: f64,
    /// Nodes that were expanded to find it, over all attempts.
    pub expansions: usize,
}

impl CoarsePath {
    /// Sum of the lengths of the parts, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.parts.iter().map(GearPart::length_m).sum()
    }

    /// How often the gear changes on the way.
    #[must_use]
    pub fn gear_changes(&self) -> usize {
        self.parts.len().saturating_sub(1)
    }
}

impl CoarsePath {
    /// The path that drives `arc` from `start` first, to where this one begins, with poses at most `spacing_m` apart.
    pub(crate) fn led_in_by(mut self, start: &PlanarPose, arc: Arc, spacing_m: f64) -> Self {
        let begin = arc.end(start);
        for mut lead in parts(start, &begin, &[arc], spacing_m) {
            self.cost_m += lead.length_m();
            match self.parts.first_mut() {
                Some(first) if first.gear == lead.gear => {
                    lead.poses.pop();
                    lead.poses.append(&mut first.poses);
                    lead.arcs.append(&mut first.arcs);
                    *first = lead;
                }
                _ => self.parts.insert(0, lead),
            }
        }
        self
    }
}

/// The longest piece of a path in one gear.
#[derive(Clone, Debug, PartialEq)]
pub struct GearPart {
    /// Gear of the whole part.
    pub gear: Gear,
    /// At least two poses, no further apart than the search was asked for. The first is the start or the cusp that
    /// ends the part before, bit for bit; the last is a cusp or the goal. Headings are continuous along the whole
    /// path, beginning with the start's; the last equals the goal's up to full turns.
    pub poses: Vec<PlanarPose>,
    /// The arcs between neighbouring poses, one fewer than poses; lengths are negative in reverse.
    pub arcs: Vec<Arc>,
}

impl GearPart {
    /// Length, positive in both gears, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.arcs.iter().map(|arc| arc.length_m.abs()).sum()
    }
}

/// The path that drives `arcs` from `start` to `goal`, with poses at most `spacing_m` apart.
///
/// The arcs must lead to the goal but for rounding: the last pose is set to it.
pub(super) fn parts(start: &PlanarPose, goal: &PlanarPose, arcs: &[Arc], spacing_m: f64) -> Vec<GearPart> {
    let mut parts: Vec<GearPart> = Vec::new();
    let mut from = *start;
    for &arc in arcs {
        let gear = arc.gear();
        if parts.last().is_none_or(|part| part.gear != gear) {
            parts.push(GearPart { gear, poses: vec![from], arcs: Vec::new() });
        }
        let pieces = (arc.length_m.abs() / spacing_m).ceil().max(1.0);
        let piece = Arc::new(arc.curvature, arc.length_m / pieces);
        if let Some(part) = parts.last_mut() {
            for k in 1..pieces as u32 {
                part.poses.push(arc.at(&from, arc.length_m * f64::from(k) / pieces));
            }
            part.arcs.extend(std::iter::repeat_n(piece, pieces as usize));
            from = arc.end(&from);
            part.poses.push(from);
        }
    }
    if let Some(last) = parts.last_mut().and_then(|part| part.poses.last_mut()) {
        *last = PlanarPose::new(goal.x, goal.y, last.yaw + last.yaw_to(goal));
    }
    parts
}

/// Joins neighbouring arcs of one curvature and gear.
pub(super) fn merged(arcs: &[Arc]) -> Vec<Arc> {
    let mut merged: Vec<Arc> = Vec::with_capacity(arcs.len());
    for &arc in arcs {
        match merged.last_mut() {
            Some(last) if last.curvature == arc.curvature && last.gear() == arc.gear() => {
                last.length_m += arc.length_m;
            }
            _ => merged.push(arc),
        }
    }
    merged
}
