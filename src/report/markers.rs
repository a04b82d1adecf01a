//! The scene of a cycle as markers for RViz and Foxglove: road, everybody on it, candidates by verdict, and for each
//! filter where and why it objects.
//!
//! One topic for the road, one for what moves, one for each filter, one for a text. Every array begins by removing what
//! the topic drew before, so that nothing of a cycle outlives it; where no cycle follows, what moves vanishes on its own.
//! Nothing here is worked out unless somebody asks for it.

mod canvas;
mod moving;
mod objections;
mod road;
pub mod scene_updates;

use messages::Message;
use messages::std_msgs::Header;
use messages::visualization_msgs::MarkerArray;
use selection::{Scene, Validator};
use selector_actors::cycle::{CycleReport, Outcome};
use selector_actors::topics::NODE_NAME;

use road::Road;

/// A topic with markers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum MarkerTopic {
    /// The road about the vehicle.
    Road,
    /// The vehicle, other road users, lights and all candidates by verdict.
    Scene,
    /// Where one filter objects, by its name.
    Filter(&'static str),
    /// How many candidates each filter objects to, as a text above the vehicle.
    Text,
}

impl MarkerTopic {
    /// Every topic with these filters in order of evaluation.
    #[must_use]
    pub fn all(filters: &[&'static str]) -> Vec<Self> {
        let mut topics = vec![Self::Road, Self::Scene];
        topics.extend(filters.iter().map(|filter| Self::Filter(filter)));
        topics.push(Self::Text);
        topics
    }

    /// ROS type.
    #[must_use]
    pub fn type_name() -> &'static str {
        MarkerArray::TYPE_NAME
    }

    /// Name as the node itself says it, before remapping.
    #[must_use]
    pub fn ros_name(self) -> String {
        match self {
            Self::Road => "~/debug/markers/road".to_owned(),
            Self::Scene => "~/debug/markers/scene".to_owned(),
            Self::Filter(filter) => format!("~/debug/markers/{filter}"),
            Self::Text => "~/debug/plugin_report_text".to_owned(),
        }
    }

    /// Full name for the node in the root namespace.
    #[must_use]
    pub fn full_name(self) -> String {
        self.ros_name().replacen('~', &format!("/{NODE_NAME}"), 1)
    }
}

/// Draws cycles.
#[derive(Debug)]
pub struct Markers {
    validator: Validator,
    road: Road,
}

impl Markers {
    /// `validator` names the filters and words their judgements, it judges nothing.
    #[must_use]
    pub fn new(validator: Validator) -> Self {
        Self { validator, road: Road::default() }
    }

    /// Every topic, in the order in which a cycle is drawn.
    #[must_use]
    pub fn topics(&self) -> Vec<MarkerTopic> {
        let names: Vec<_> =
            self.validator.filters().iter().map(selection::validator::LoadedFilter::name).collect();
        MarkerTopic::all(&names)
    }

    /// What a cycle shows on one topic; `None` where it shows nothing new: the road stays for a while, and without
    /// verdicts there is nothing to say about them.
    pub fn draw(&mut self, topic: MarkerTopic, report: &CycleReport) -> Option<MarkerArray> {
        let scene = &*report.cycle.scene;
        let judged = match &report.outcome {
            Outcome::Judged(judged) => Some(&**judged),
            _ => None,
        };
        match topic {
            MarkerTopic::Road => self.road.draw(scene),
            MarkerTopic::Scene => Some(moving::draw(report)),
            MarkerTopic::Filter(name) => {
                let at = self.validator.filters().iter().position(|filter| filter.name() == name)?;
                Some(objections::of_filter(&report.cycle, judged?, &self.validator.filters()[at], at))
            }
            MarkerTopic::Text => Some(objections::text(&report.cycle, judged?)),
        }
    }
}

/// Of everything drawn for a scene.
fn header(scene: &Scene) -> Header {
    Header { stamp: scene.now, frame_id: scene.frame_id().unwrap_or("map").to_owned() }
}
