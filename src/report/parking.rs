//! A plan of the open-space planner for people and scripts. The keys are a contract with scripts; see `docs/json.md`.

use crate::json::Number;
use open_space::planner::{Stage, Step};
use open_space::{Gear, Measures, Plan, PlanError, TrajectoryPoint};
use serde::Serialize;
use std::fmt::{self, Display, Formatter};
use std::time::Duration;

/// Time spent in each step.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepTimes {
    /// The way round the obstacles.
    pub heuristic: Duration,
    /// The coarse path.
    pub search: Duration,
    /// The smooth path.
    pub smooth: Duration,
    /// The speed, and the last check.
    pub speed: Duration,
    /// All of it.
    pub total: Duration,
}

impl StepTimes {
    /// Adds to one step.
    pub fn add(&mut self, step: Step, took: Duration) {
        let sum = match step {
            Step::Heuristic => &mut self.heuristic,
            Step::Search => &mut self.search,
            Step::Smoothing => &mut self.smooth,
            Step::Speed | Step::Check => &mut self.speed,
        };
        *sum += took;
    }
}

/// How planning ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Status {
    /// All the way.
    Planned,
    /// A valid trajectory of an earlier stage.
    BestEffort,
    /// Nothing to drive.
    Failed,
}

/// What planning gave.
#[derive(Clone, Debug, Serialize)]
pub struct ParkingReport {
    scene: String,
    status: Status,
    stage: Option<&'static str>,
    reason: Option<String>,
    length_m: Option<Number>,
    gear_changes: Option<usize>,
    duration_s: Option<Number>,
    min_clearance_m: Option<Number>,
    max_kappa: Option<Number>,
    end_error_m: Option<Number>,
    end_error_rad: Option<Number>,
    times_ms: TimesMs,
    expansions: Option<usize>,
    passes: Option<usize>,
    /// Stops to turn the front wheels, beside those where the gear changes.
    stops: Option<usize>,
    trajectory: Vec<PointOfPlan>,
}

#[derive(Clone, Debug, Serialize)]
struct TimesMs {
    heuristic: f64,
    search: f64,
    smooth: f64,
    speed: f64,
    total: f64,
}

#[derive(Clone, Debug, Serialize)]
struct PointOfPlan {
    t: f64,
    x: f64,
    y: f64,
    yaw: f64,
    kappa: f64,
    v: f64,
    a: f64,
    steer: f64,
    gear: &'static str,
}

impl ParkingReport {
    /// Of a scene with this name.
    #[must_use]
    pub fn new(scene: String, planned: Result<Plan, PlanError>, times: StepTimes) -> Self {
        let ms = |time: Duration| time.as_secs_f64() * 1e3;
        let times_ms = TimesMs {
            heuristic: ms(times.heuristic),
            search: ms(times.search),
            smooth: ms(times.smooth),
            speed: ms(times.speed),
            total: ms(times.total),
        };
        let (plan, error) = match planned {
            Ok(plan) => (Some(plan), None),
            Err(error) => (None, Some(error)),
        };
        let plan = plan.as_ref();
        let measures = plan.map(|plan| plan.measures);
        let number = |of: fn(&Measures) -> f64| measures.as_ref().map(|measures| Number(of(measures)));
        Self {
            scene,
            status: match plan.map(|plan| plan.stage) {
                Some(Stage::Timed) => Status::Planned,
                Some(Stage::Search | Stage::Smoothed) => Status::BestEffort,
                None => Status::Failed,
            },
            stage: plan.map(|plan| stage_name(plan.stage)),
            reason: error.map(|error| error.to_string()).or_else(|| plan.and_then(why_earlier)),
            length_m: number(|measures| measures.length_m),
            gear_changes: measures.map(|measures| measures.gear_changes),
            duration_s: number(|measures| measures.duration_s),
            min_clearance_m: number(|measures| measures.min_clearance_m),
            max_kappa: number(|measures| measures.max_curvature),
            end_error_m: number(|measures| measures.end_error_m),
            end_error_rad: number(|measures| measures.end_error_rad),
            times_ms,
            expansions: plan.map(|plan| plan.expansions),
            passes: plan.map(|plan| plan.passes),
            stops: plan.map(Plan::stops),
            trajectory: plan
                .map(|plan| plan.trajectory.points.iter().map(point).collect())
                .unwrap_or_default(),
        }
    }

    /// Why there is nothing to drive; `None` if there is something.
    #[must_use]
    pub fn failure(&self) -> Option<&str> {
        self.reason.as_deref().filter(|_| self.status == Status::Failed)
    }

    /// Name of the scene.
    #[must_use]
    pub fn scene(&self) -> &str {
        &self.scene
    }
}

/// Why a plan is of an earlier stage.
fn why_earlier(plan: &Plan) -> Option<String> {
    match (plan.stage, plan.held_back) {
        (Stage::Timed, _) => None,
        (_, Some(violation)) => Some(format!("a later stage was held back: {violation}")),
        (_, None) => Some("the time was used up".to_owned()),
    }
}

fn stage_name(stage: Stage) -> &'static str {
    match stage {
        Stage::Search => "search",
        Stage::Smoothed => "smoothed",
        Stage::Timed => "timed",
    }
}

fn point(point: &TrajectoryPoint) -> PointOfPlan {
    PointOfPlan {
        t: point.time_s,
        x: point.pose.x,
        y: point.pose.y,
        yaw: point.pose.yaw,
        kappa: point.curvature,
        v: point.speed_mps,
        a: point.acceleration_mps2,
        steer: point.steer_rad,
        gear: match point.gear {
            Gear::Forward => "forward",
            Gear::Reverse => "reverse",
        },
    }
}

impl Display for ParkingReport {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let TimesMs { heuristic, search, smooth, speed, total } = self.times_ms;
        let status = match self.status {
            Status::Planned => "planned",
            Status::BestEffort => "best effort",
            Status::Failed => "no plan",
        };
        writeln!(f, "{}: {status}", self.scene)?;
        if let Some(reason) = &self.reason {
            writeln!(f, "  {reason}")?;
        }
        let show = |value: Option<Number>| value.map_or(f64::NAN, |Number(value)| value);
        if let (Some(gear_changes), Some(stops)) = (self.gear_changes, self.stops) {
            writeln!(f, "  length     {:>8.2} m in {:.1} s", show(self.length_m), show(self.duration_s))?;
            writeln!(f, "  gears      {gear_changes:>8} changes, {stops} other stops to steer")?;
            writeln!(f, "  clearance  {:>8.3} m", show(self.min_clearance_m))?;
            writeln!(f, "  curvature  {:>8.3} 1/m at most", show(self.max_kappa))?;
            let degrees = show(self.end_error_rad).to_degrees();
            writeln!(f, "  at the end {:>8.3} m and {degrees:.2} degrees off", show(self.end_error_m))?;
        }
        writeln!(
            f,
            "  took       {total:>8.1} ms: heuristic {heuristic:.1}, search {search:.1}, smoothing {smooth:.1}, speed {speed:.1}"
        )?;
        if let (Some(expansions), Some(passes)) = (self.expansions, self.passes) {
            writeln!(f, "  effort     {expansions:>8} nodes expanded, {passes} smoothing passes")?;
        }
        Ok(())
    }
}
