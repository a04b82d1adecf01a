//! How drivers choose their speed: the intelligent-driver model with a limited jerk, and stop points as things ahead.

/// Usual acceleration of a driver.
pub(crate) const USUAL_ACCELERATION_MPS2: f64 = 1.8;
/// Usual limit of the change of acceleration.
pub(crate) const USUAL_JERK_MPS3: f64 = 4.0;
const COMFORTABLE_DECELERATION_MPS2: f64 = 2.2;
/// Slowing down to a lower desired speed is done gently.
const GENTLE_DECELERATION_MPS2: f64 = 1.5;
/// Within the limits that vehicles have.
const STRONGEST_DECELERATION_MPS2: f64 = 4.5;
const VEHICLE_TIME_GAP_S: f64 = 1.2;
const VEHICLE_GAP_M: f64 = 2.0;
const STOP_TIME_GAP_S: f64 = 0.3;
const STOP_GAP_M: f64 = 0.5;
/// Slower than this near the place where one wants to stand, one stands.
const STANDING_MPS: f64 = 0.15;
const STANDING_GAP_M: f64 = 0.6;

/// Where on its track something is and how it moves along it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    /// Place along the road.
    pub(crate) s_m: f64,
    /// Speed in the direction of travel.
    pub(crate) speed_mps: f64,
    /// Its change.
    pub(crate) acceleration_mps2: f64,
}

/// What a driver wants.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Goal {
    /// To go on at this speed, m/s.
    Cruise(f64),
    /// To stop with this deceleration, m/s², positive.
    Stop(f64),
}

/// Something ahead that limits the speed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ahead {
    /// From the front bumper to it.
    pub(crate) gap_m: f64,
    /// Its speed in the direction of travel.
    pub(crate) speed_mps: f64,
    /// Whether it is a line to stop at rather than a vehicle.
    pub(crate) is_line: bool,
}

impl Ahead {
    fn standing_gap_m(&self) -> f64 {
        if self.is_line { STOP_GAP_M } else { VEHICLE_GAP_M }
    }

    fn time_gap_s(&self) -> f64 {
        if self.is_line { STOP_TIME_GAP_S } else { VEHICLE_TIME_GAP_S }
    }

    /// Whether a slow vehicle has come near enough to stand.
    fn holds(&self) -> bool {
        self.speed_mps < STANDING_MPS && self.gap_m < self.standing_gap_m() + STANDING_GAP_M
    }
}

/// A driver.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Driver {
    /// What the driver wants.
    pub(crate) goal: Goal,
    /// Strongest acceleration.
    pub(crate) acceleration_mps2: f64,
    /// Fastest change of acceleration.
    pub(crate) jerk_mps3: f64,
}

impl Driver {
    /// A driver of usual temper.
    pub(crate) fn cruising(speed_mps: f64) -> Self {
        Self {
            goal: Goal::Cruise(speed_mps),
            acceleration_mps2: USUAL_ACCELERATION_MPS2,
            jerk_mps3: USUAL_JERK_MPS3,
        }
    }

    fn wanted_acceleration(&self, speed_mps: f64, ahead: &[Ahead]) -> f64 {
        let free = match self.goal {
            Goal::Stop(deceleration_mps2) => -deceleration_mps2,
            Goal::Cruise(desired_mps) => {
                let excess = (speed_mps / desired_mps).powi(4);
                (self.acceleration_mps2 * (1.0 - excess)).max(-GENTLE_DECELERATION_MPS2)
            }
        };
        let held_back = ahead.iter().map(|thing| self.behind(speed_mps, thing)).fold(free, f64::min);
        held_back.max(-STRONGEST_DECELERATION_MPS2)
    }

    /// The interaction term of the model.
    fn behind(&self, speed_mps: f64, thing: &Ahead) -> f64 {
        let braking = 2.0 * (USUAL_ACCELERATION_MPS2 * COMFORTABLE_DECELERATION_MPS2).sqrt();
        let closing_m = speed_mps * (speed_mps - thing.speed_mps) / braking;
        let wanted_m = thing.standing_gap_m() + (speed_mps * thing.time_gap_s() + closing_m).max(0.0);
        // A gap that is used up asks for all that the brakes have.
        self.acceleration_mps2 * (1.0 - (wanted_m / thing.gap_m.max(0.05)).powi(2))
    }

    /// Drives for `dt_s`; returns the speed and acceleration at its end and the distance covered.
    pub(crate) fn step(&self, motion: &Motion, ahead: &[Ahead], dt_s: f64) -> (f64, f64, f64) {
        let wanted = self.wanted_acceleration(motion.speed_mps, ahead);
        let change = self.jerk_mps3 * dt_s;
        let acceleration_mps2 =
            motion.acceleration_mps2 + (wanted - motion.acceleration_mps2).clamp(-change, change);
        let speed_mps = motion.speed_mps + acceleration_mps2 * dt_s;
        let stands = speed_mps <= 0.0 || (speed_mps < STANDING_MPS && ahead.iter().any(Ahead::holds));
        if stands {
            return (0.0, 0.0, 0.0);
        }
        (speed_mps, acceleration_mps2, 0.5 * (motion.speed_mps + speed_mps) * dt_s)
    }
}
