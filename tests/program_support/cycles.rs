//! What a recording holds, cycle by cycle, and generated drives with candidates of the test's choice.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::panic,
    reason = "each test uses some of these; tests fail by panicking"
)]

use crate::program::{Recorded, read};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory};
use messages::{Interface, Message};
use selector_actors::{Input, InputTopic};
use std::path::Path;
use std::sync::Arc;
use trajectory_selector::drive::{Event, TimedInput};
use trajectory_selector::report::summary;
use trajectory_selector::scenario::Scenario;
use trajectory_selector::session::{Rate, Session};
use trajectory_selector::settings::{DEFAULT_NODE_NAME, Settings, Source};

/// End of the topic that closes every cycle.
const LAST_TOPIC: &str = "/processing_time_detail_ms/trajectory_selector";

/// The messages of one cycle, in the order in which they were published.
pub(crate) struct Cycle(Vec<Recorded>);

impl Cycle {
    /// The cycles of a recording that published candidates; what is published beside cycles is left out.
    pub(crate) fn all(recorded: Vec<Recorded>) -> Vec<Self> {
        let mut cycles = vec![Vec::new()];
        for message in recorded {
            let is_last = message.0.ends_with(LAST_TOPIC);
            cycles.last_mut().unwrap().push(message);
            if is_last {
                cycles.push(Vec::new());
            }
        }
        let cycles = cycles.into_iter().map(Self);
        cycles.filter(|cycle| cycle.bytes("/output/concatenated_trajectories").is_some()).collect()
    }

    /// The payload on the topic whose name ends like this, if there is one. Panics if there are several.
    pub(crate) fn bytes(&self, topic: &str) -> Option<&[u8]> {
        let mut found = self.0.iter().filter(|(name, ..)| name.ends_with(topic));
        let first = found.next();
        assert!(found.next().is_none(), "{topic} more than once in a cycle");
        first.map(|(_, _, bytes)| &bytes[..])
    }

    /// The message on that topic, if there is one.
    pub(crate) fn message<M: Message>(&self, topic: &str) -> Option<M> {
        self.bytes(topic).map(|bytes| M::from_cdr(bytes, Interface::V0_53, topic).unwrap())
    }

    /// Names of the topics in order of publication.
    pub(crate) fn topics(&self) -> Vec<&str> {
        self.0.iter().map(|(topic, ..)| &topic[..]).collect()
    }
}

/// What a test makes of a candidate message before it is delivered.
pub(crate) type Change<'a> = dyn Fn(InputTopic, &mut CandidateTrajectory) + Send + 'a;

/// Runs a generated drive up to `until_s`, with its candidates changed, and records it.
pub(crate) fn drive(
    seed: u64,
    until_s: f64,
    interface: Interface,
    parameters: &[(&str, String)],
    change: &Change<'_>,
    output: &Path,
) {
    let sources: Vec<Source> = parameters
        .iter()
        .map(|(name, value)| Source::Override {
            name: (*name).to_owned(),
            value: value.clone(),
            origin: "test".to_owned(),
        })
        .collect();
    let settings = Settings::load(DEFAULT_NODE_NAME, &sources).unwrap();
    let scenario = Scenario::road(seed);
    let (start, end) = scenario.span();
    let last_ns = start.nanoseconds() + (until_s * 1e9) as i64;
    let events: Vec<Event> = scenario
        .drive()
        .take_while(|input| input.time.nanoseconds() <= last_ns)
        .map(|input| Event::Input(changed(input, change)))
        .collect();
    let session = Session {
        input: summary::Input { name: "generated".to_owned(), seed: Some(seed) },
        interface,
        span: (start, end),
        threads: 1,
        rate: Rate::Max,
        output: Some(output.to_owned()),
        map: None,
        watch: None,
        page: false,
        markers: false,
        progress: false,
    };
    let ended = session.run(&settings, events.into_iter()).unwrap();
    assert!(ended.errors.is_empty(), "{:?}", ended.errors);
}

fn changed(mut input: TimedInput, change: &Change<'_>) -> TimedInput {
    let topic = input.topic;
    let change_all = |message: &Arc<CandidateTrajectories>| {
        let mut message = CandidateTrajectories::clone(message);
        message
            .candidate_trajectories
            .iter_mut()
            .for_each(|candidate| change(topic, Arc::make_mut(candidate)));
        Arc::new(message)
    };
    input.input = match input.input {
        Input::Generative(message) => Input::Generative(change_all(&message)),
        Input::Backup(message) => Input::Backup(change_all(&message)),
        other => other,
    };
    input
}

/// The cycles of a generated drive, see [`drive`].
pub(crate) fn cycles_of_drive(
    seed: u64,
    until_s: f64,
    parameters: &[(&str, String)],
    change: &Change<'_>,
) -> Vec<Cycle> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.mcap");
    drive(seed, until_s, Interface::V0_53, parameters, change, &path);
    Cycle::all(read(&path))
}
