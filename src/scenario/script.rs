//! What happens when on the generated road: the traffic light and the pedestrian at the crosswalk.

use messages::autoware_perception_msgs::TrafficLightElement;

/// From then on drivers yield to the pedestrian.
const SEEN_AT_S: f64 = 0.8;
const STEPS_ON_ROAD_AT_S: f64 = 4.2;
const PEDESTRIAN_START_M: f64 = -7.0;
/// Within the area beside the crosswalk where a pedestrian counts as one who wants to cross.
const PEDESTRIAN_WAITS_M: f64 = -4.8;
/// Walking speed.
pub(crate) const WALKING_MPS: f64 = 1.4;
const AMBER_AT_S: f64 = 10.5;
const RED_AT_S: f64 = 13.5;
const GREEN_AT_S: f64 = 17.0;

/// When things happen, in seconds from the start.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Script {
    /// When the pedestrian steps on the road.
    pub(crate) crossing_at_s: f64,
}

impl Script {
    /// The script; the pedestrian is early or late by `hesitation_s`.
    pub(crate) fn new(hesitation_s: f64) -> Self {
        Self { crossing_at_s: STEPS_ON_ROAD_AT_S + hesitation_s }
    }

    /// Nobody crosses, and the light is green: the first seconds of the script for ever.
    pub(crate) fn without_pedestrian() -> Self {
        Self { crossing_at_s: f64::INFINITY }
    }

    /// Colour of the light, one of the constants of `TrafficLightElement`.
    pub(crate) fn light(self, t_ns: i64) -> u8 {
        match t_ns as f64 * 1e-9 {
            t if t < AMBER_AT_S => TrafficLightElement::GREEN,
            t if t < RED_AT_S => TrafficLightElement::AMBER,
            t if t < GREEN_AT_S => TrafficLightElement::RED,
            _ => TrafficLightElement::GREEN,
        }
    }

    /// Offset and speed of the pedestrian, who walks across from the right to the left.
    pub(crate) fn pedestrian(self, t_ns: i64) -> (f64, f64) {
        let t_s = t_ns as f64 * 1e-9;
        let walked_m = PEDESTRIAN_START_M + WALKING_MPS * t_s;
        if t_s >= self.crossing_at_s {
            (PEDESTRIAN_WAITS_M + WALKING_MPS * (t_s - self.crossing_at_s), WALKING_MPS)
        } else if walked_m < PEDESTRIAN_WAITS_M {
            (walked_m, WALKING_MPS)
        } else {
            (PEDESTRIAN_WAITS_M, 0.0)
        }
    }

    /// Whether a vehicle must yield at the crosswalk, until the pedestrian has passed `clear_offset_m`.
    pub(crate) fn must_yield(self, t_ns: i64, clear_offset_m: f64) -> bool {
        t_ns as f64 * 1e-9 >= SEEN_AT_S && self.pedestrian(t_ns).0 < clear_offset_m
    }
}
