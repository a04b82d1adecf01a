//! What every drawing wants to know about the road: which lines are what, and what the lights show.

use lanelet_map::{Lanelet, Map, Polyline};
use messages::autoware_perception_msgs::TrafficLightElement;
use selection::Scene;
use std::collections::BTreeSet;

/// Types of line strings that nobody drives over.
const BORDERS: [&str; 5] = ["road_border", "curb", "guard_rail", "wall", "fence"];

/// What a light shows to whoever draws it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lamp {
    /// Stop.
    Red,
    /// Stop if possible.
    Amber,
    /// Go.
    Green,
    /// Nothing, or nobody knows.
    Dark,
}

/// Whether nobody drives over the line.
pub(super) fn is_border(line: &Polyline<'_>) -> bool {
    line.attribute("type").is_some_and(|kind| BORDERS.contains(&kind))
}

/// Whether the lanelet is for pedestrians.
pub(super) fn is_for_walking(lanelet: &Lanelet<'_>) -> bool {
    matches!(lanelet.subtype(), Some("crosswalk" | "walkway"))
}

/// Every stop line once: those of that type, and those that a rule refers to.
pub(super) fn stop_lines(map: &Map) -> Vec<Polyline<'_>> {
    let of_rules =
        map.regulatory_elements().flat_map(|rule| rule.line_strings("ref_line").collect::<Vec<_>>());
    let typed = map.line_strings().filter(|line| line.attribute("type") == Some("stop_line"));
    let mut seen = BTreeSet::new();
    typed.chain(of_rules).filter(|line| seen.insert(line.id())).collect()
}

/// What the light with this id shows; the most restrictive colour if it shows several.
pub(super) fn lamp(scene: &Scene, id: i64) -> Lamp {
    let groups = scene.traffic_signals.iter().flat_map(|signals| &signals.traffic_light_groups);
    let group = groups.into_iter().find(|group| group.traffic_light_group_id == id);
    let shows =
        |color: u8| group.is_some_and(|group| group.elements.iter().any(|element| element.color == color));
    match () {
        () if shows(TrafficLightElement::RED) => Lamp::Red,
        () if shows(TrafficLightElement::AMBER) => Lamp::Amber,
        () if shows(TrafficLightElement::GREEN) => Lamp::Green,
        () => Lamp::Dark,
    }
}
