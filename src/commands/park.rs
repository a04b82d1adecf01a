//! `park`: plans a parking scene and tells what came out.

use super::Failure;
use crate::parking_scene::ParkingScene;
use crate::report::parking::{ParkingReport, StepTimes};
use crate::report::parking_page;
use crate::report::summary::Common;
use crate::session::vehicle_of;
use crate::settings::{Settings, Source};
use clap::Args;
use open_space::planner::Step;
use open_space::{Interruption, Limits, Planner, Supervisor};
use selector_actors::topics::NODE_NAME;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Arguments of `park`.
#[derive(Debug, Args)]
pub struct ParkArguments {
    /// The scene: a vehicle, bounds, obstacles, start and goal. See `config/scenes`.
    #[arg(value_name = "SCENE.yaml")]
    pub scene: PathBuf,
    /// Draw the plan as one HTML page to this file.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// Time for the plan; what is best by then is taken [default: as long as it takes].
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u64).range(1..))]
    pub deadline: Option<u64>,
    /// Parameter file in ROS form; later files win.
    #[arg(long, value_name = "FILE")]
    pub params: Vec<PathBuf>,
}

/// What `park` answers.
#[derive(Debug)]
pub struct Answer {
    /// What every command says.
    pub common: Common,
    /// The plan, or why there is none.
    pub report: ParkingReport,
}

/// Plans the scene.
///
/// # Errors
/// Settings or scene cannot be used, or the page cannot be written. A scene without a plan is an answer.
pub fn run(arguments: &ParkArguments) -> Result<Answer, Failure> {
    let sources: Vec<_> = arguments.params.iter().cloned().map(Source::File).collect();
    let settings = Settings::load(&format!("/{NODE_NAME}"), &sources)?;
    let parameters = &settings.open_space.planner;
    let limits = Limits::from(parameters.limits);
    let ParkingScene { name, problem } =
        ParkingScene::load(&arguments.scene, &vehicle_of(&settings)?, &limits)?;

    let mut watch = Stopwatch::new(arguments.deadline.map(Duration::from_millis));
    let planned = Planner::new(parameters.clone()).plan(&problem, &mut watch);
    let report = ParkingReport::new(name, planned, watch.finish());

    let errors = report.failure().map(|reason| Failure::no_plan(reason).at(arguments.scene.display()));
    let warnings = settings.warnings().iter().map(|warning| Failure::note("settings", warning.to_string()));
    // A scene has a vehicle of its own; whose dimensions the settings give is told where they are used.
    let mut common = Common::new("park", errors.into_iter().collect(), warnings.collect());
    common.settings_hash = Some(settings.settings_hash());
    if let Some(file) = &arguments.report {
        let failed = |error: &dyn std::fmt::Display| {
            Failure::output(format!("{} cannot be written: {error}; choose another --report", file.display()))
        };
        let page = parking_page::write(&problem, &report).map_err(|error| failed(&error))?;
        std::fs::write(file, page).map_err(|error| failed(&error))?;
    }
    Ok(Answer { common, report })
}

/// Measures the steps of a plan, and ends it at its deadline.
struct Stopwatch {
    started: Instant,
    deadline: Option<Instant>,
    step: Option<(Step, Instant)>,
    times: StepTimes,
}

impl Stopwatch {
    fn new(budget: Option<Duration>) -> Self {
        let started = Instant::now();
        // A deadline too far for the clock is none.
        let deadline = budget.and_then(|budget| started.checked_add(budget));
        Self { started, deadline, step: None, times: StepTimes::default() }
    }

    fn end_step(&mut self, now: Instant) {
        if let Some((step, began)) = self.step.take() {
            self.times.add(step, now - began);
        }
    }

    fn finish(mut self) -> StepTimes {
        let now = Instant::now();
        self.end_step(now);
        self.times.total = now - self.started;
        self.times
    }
}

impl Supervisor for Stopwatch {
    fn interruption(&mut self) -> Option<Interruption> {
        self.deadline.filter(|deadline| Instant::now() >= *deadline).map(|_| Interruption::OutOfTime)
    }

    fn begin(&mut self, step: Step) {
        let now = Instant::now();
        self.end_step(now);
        self.step = Some((step, now));
    }
}
