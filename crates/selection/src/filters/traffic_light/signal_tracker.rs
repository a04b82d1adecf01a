//! Steadies what traffic lights show: a state counts once it was seen for long enough, and then until another does.
//!
//! Owns, for every light of the messages, the state seen last (since when, until when), the stable state, and whether
//! the present amber came after green. It advances once per cycle, with the stamp of the odometry as the time, whatever
//! becomes of the candidates. What counts in the cycle:
//!
//! * a vehicle that stands sees the lights of the message as they are;
//! * a vehicle that moves sees their stable states; a light without one yet constrains nothing;
//! * a light missing from the message keeps its stable state until it was missing for longer than its last state needed
//!   to become stable; such lights come last, in ascending id.
//!
//! All durations are whole nanoseconds divided by 10⁹. The number of lights is bounded: beyond [`MAX_LIGHTS`] they are
//! passed on as they are.

use super::lamps::Lamps;
use crate::parameters::TrafficLightParameters;
use messages::autoware_perception_msgs::TrafficLightGroup;
use std::collections::BTreeMap;

/// Most lights remembered at once; a city has some thousands, a message some dozens.
pub(super) const MAX_LIGHTS: usize = 4096;

/// How a light became amber.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum AmberOrigin {
    /// It is not amber, or what it showed before is not known.
    #[default]
    NotAmber,
    /// From a green circle: the regular end of a green phase.
    FromGreen,
    /// From anything else.
    FromNonGreen,
}

/// Seconds between two instants in nanoseconds.
pub(super) fn seconds_between(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 / 1e9
}

/// What is known about one light.
#[derive(Debug)]
struct Tracked {
    current: Lamps,
    stable: Option<Lamps>,
    first_seen_ns: i64,
    last_seen_ns: i64,
    /// Number of the update that saw it last.
    seen_in: u64,
    origin: AmberOrigin,
}

/// What a light shows in this cycle, as far as it counts.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Signal {
    /// Id of the regulatory element.
    pub light_id: i64,
    /// The lamps.
    pub lamps: Lamps,
    /// How the present amber phase began.
    pub origin: AmberOrigin,
    /// How long the light was seen in its latest state, which may not be stable yet, s.
    pub duration_s: f64,
}

/// The lights seen so far.
#[derive(Debug, Default)]
pub(super) struct SignalTracker {
    lights: BTreeMap<i64, Tracked>,
    updates: u64,
    signals: Vec<Signal>,
}

/// How long these lamps must be seen before they count, s.
fn required_s(lamps: &Lamps, parameters: &TrafficLightParameters) -> f64 {
    if lamps.is_red() {
        parameters.stable_duration_threshold_red
    } else if lamps.is_amber() {
        parameters.stable_duration_threshold_amber
    } else if lamps.is_unknown() {
        parameters.stable_duration_threshold_unknown
    } else {
        0.0
    }
}

impl AmberOrigin {
    /// The origin after the stable state changed.
    fn after(self, old: &Lamps, new: &Lamps) -> Self {
        match self {
            _ if !new.is_amber() => Self::NotAmber,
            Self::FromGreen | Self::FromNonGreen => self,
            Self::NotAmber if old.is_dark() => Self::NotAmber,
            Self::NotAmber if old.is_green() => Self::FromGreen,
            Self::NotAmber => Self::FromNonGreen,
        }
    }
}

impl Tracked {
    fn new(group: &TrafficLightGroup, now_ns: i64) -> Self {
        Self {
            current: group.into(),
            stable: None,
            first_seen_ns: now_ns,
            last_seen_ns: now_ns,
            seen_in: 0,
            origin: AmberOrigin::NotAmber,
        }
    }

    fn see(&mut self, group: &TrafficLightGroup, now_ns: i64, parameters: &TrafficLightParameters) {
        if self.current.replace_if_changed(group) {
            self.first_seen_ns = now_ns;
        }
        self.last_seen_ns = now_ns;
        if seconds_between(self.first_seen_ns, now_ns) < required_s(&self.current, parameters) {
            return;
        }
        match &mut self.stable {
            Some(stable) if *stable == self.current => {}
            Some(stable) => {
                self.origin = self.origin.after(stable, &self.current);
                stable.clone_from(&self.current);
            }
            None => self.stable = Some(self.current.clone()),
        }
    }

    /// Never negative: after a step back in time the state may have been seen later than now.
    fn duration_s(&self) -> f64 {
        seconds_between(self.first_seen_ns, self.last_seen_ns).max(0.0)
    }

    fn signal(&self, light_id: i64, lamps: &Lamps) -> Signal {
        Signal { light_id, lamps: lamps.clone(), origin: self.origin, duration_s: self.duration_s() }
    }
}

impl SignalTracker {
    /// Takes in a message and answers what counts now. A group given twice is answered twice.
    pub(super) fn update(
        &mut self,
        groups: &[TrafficLightGroup],
        now_ns: i64,
        ego_stopped: bool,
        parameters: &TrafficLightParameters,
    ) -> &[Signal] {
        self.updates += 1;
        self.signals.clear();
        for group in groups {
            let light_id = group.traffic_light_group_id;
            if self.lights.len() >= MAX_LIGHTS && !self.lights.contains_key(&light_id) {
                let untracked = Tracked::new(group, now_ns);
                self.signals.push(untracked.signal(light_id, &untracked.current));
                continue;
            }
            let light = self.lights.entry(light_id).or_insert_with(|| Tracked::new(group, now_ns));
            light.seen_in = self.updates;
            light.see(group, now_ns, parameters);
            let counts = if ego_stopped { Some(&light.current) } else { light.stable.as_ref() };
            self.signals.extend(counts.map(|lamps| light.signal(light_id, lamps)));
        }
        self.lights.retain(|_, light| {
            let missing_s = seconds_between(light.last_seen_ns, now_ns);
            light.seen_in == self.updates || missing_s <= required_s(&light.current, parameters)
        });
        for (light_id, light) in self.lights.iter().filter(|(_, light)| light.seen_in != self.updates) {
            self.signals.extend(light.stable.as_ref().map(|lamps| light.signal(*light_id, lamps)));
        }
        &self.signals
    }

    /// What counted in the last update.
    pub(super) fn signals(&self) -> &[Signal] {
        &self.signals
    }

    /// The clock was set back: nothing was seen later than now.
    pub(super) fn restart_clock(&mut self, now_ns: i64) {
        for light in self.lights.values_mut() {
            light.first_seen_ns = light.first_seen_ns.min(now_ns);
            light.last_seen_ns = light.last_seen_ns.min(now_ns);
        }
    }

    /// The ids may name other lights now: no amber is known to have come after green any more. What was seen stays, so
    /// that a red light does not have to become stable anew.
    pub(super) fn doubt_origins(&mut self) {
        for light in self.lights.values_mut() {
            light.origin = AmberOrigin::NotAmber;
        }
    }

    #[cfg(test)]
    pub(super) fn origin(&self, light_id: i64) -> AmberOrigin {
        self.lights.get(&light_id).map_or(AmberOrigin::NotAmber, |light| light.origin)
    }

    /// Number of lights.
    pub(super) fn len(&self) -> usize {
        self.lights.len()
    }
}

#[cfg(test)]
mod tests;
