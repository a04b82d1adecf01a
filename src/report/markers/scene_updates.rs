//! The same scene for Foxglove, where a click on a candidate or a road user tells about it.
//!
//! One topic for the road, one for the cycle: each update takes away what its topic showed before. A candidate is an
//! entity of its own whose details say what was found about it, and why.

use super::canvas::{Canvas, FOREVER, SHORT_LIVED};
use super::road::Road;
use super::{header, moving};
use crate::report::road_users::{name, objects, speed_mps};
use messages::builtin_interfaces::Duration;
use messages::foxglove_msgs::{
    Color, KeyValuePair, LinePrimitive, SceneEntity, SceneEntityDeletion, SceneUpdate, TextPrimitive,
};
use messages::std_msgs::{ColorRgba, Header};
use messages::visualization_msgs::{Marker, MarkerArray};
use selection::{Candidate, Validator, Verdict, data_validity};
use selector_actors::cycle::{CycleReport, Outcome};
use selector_actors::topics::NODE_NAME;

/// A topic with scene updates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum UpdateTopic {
    /// The road about the vehicle.
    Road,
    /// The vehicle, other road users, lights and all candidates by verdict.
    Cycle,
}

impl UpdateTopic {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Road, Self::Cycle];

    /// Full name for the node in the root namespace.
    #[must_use]
    pub fn full_name(self) -> String {
        let name = match self {
            Self::Road => "road",
            Self::Cycle => "cycle",
        };
        format!("/{NODE_NAME}/debug/scene_updates/{name}")
    }
}

/// Makes scene updates of cycles.
#[derive(Debug)]
pub struct SceneUpdates {
    validator: Validator,
    road: Road,
}

impl SceneUpdates {
    /// `validator` names the filters and words their judgements, it judges nothing.
    #[must_use]
    pub fn new(validator: Validator) -> Self {
        Self { validator, road: Road::default() }
    }

    /// What a cycle changes on one topic; `None` where it changes nothing: the road stays for a while.
    pub fn update(&mut self, topic: UpdateTopic, report: &CycleReport) -> Option<SceneUpdate> {
        let header = header(&report.cycle.scene);
        let entities = match topic {
            UpdateTopic::Road => vec![entity(&header, FOREVER, "road", self.road.draw(&report.cycle.scene)?)],
            UpdateTopic::Cycle => self.cycle(report, &header),
        };
        let everything = SceneEntityDeletion {
            timestamp: header.stamp,
            r#type: SceneEntityDeletion::ALL,
            id: String::new(),
        };
        Some(SceneUpdate { deletions: vec![everything], entities })
    }

    fn cycle(&self, report: &CycleReport, header: &Header) -> Vec<SceneEntity> {
        let scene = &*report.cycle.scene;
        let drawn = |id: &str, draw: &dyn Fn(&mut Canvas)| {
            let mut canvas = Canvas::new(header.clone(), SHORT_LIVED);
            draw(&mut canvas);
            entity(header, SHORT_LIVED, id, canvas.finish())
        };
        let mut entities = vec![
            drawn("lights", &|canvas| moving::draw_lights(canvas, scene)),
            drawn("vehicle", &|canvas| moving::draw_vehicle(canvas, scene)),
        ];
        for object in objects(scene) {
            let id = object.object_id.to_string();
            let entity = drawn(&format!("road_user {id}"), &|canvas| moving::draw_road_user(canvas, object));
            let metadata = details([
                ("class", name(object).to_owned()),
                ("speed_mps", format!("{:.2}", speed_mps(object))),
                ("object_id", id),
            ]);
            entities.push(SceneEntity { metadata, ..entity });
        }
        let judged = match &report.outcome {
            Outcome::Judged(judged) => Some(&**judged),
            _ => None,
        };
        let best = judged.filter(|judged| judged.selected.is_some()).and_then(|judged| judged.ranking.best());
        for (at, candidate) in report.cycle.concatenated.candidates.iter().enumerate() {
            let verdict = judged.and_then(|judged| judged.verdicts.get(at));
            let is_selected = best.is_some_and(|best| best.index == at);
            let entity = drawn(&format!("candidate {}", candidate.key), &|canvas| {
                moving::draw_candidate(canvas, candidate, verdict);
                if is_selected {
                    moving::draw_selected(canvas, candidate);
                }
            });
            let mut metadata = self.found(candidate, verdict);
            if let Some(score) = best.filter(|_| is_selected).map(|best| best.score) {
                metadata.extend(details([("selected", format!("with score {score}"))]));
            }
            entities.push(SceneEntity { metadata, ..entity });
        }
        entities
    }

    /// What was found about a candidate: the verdict, then every objection in words under the filter's name.
    fn found(&self, candidate: &Candidate, verdict: Option<&Verdict>) -> Vec<KeyValuePair> {
        let word = verdict.map_or("not_judged", |verdict| moving::look(verdict).0);
        let mut found = details([
            ("generator", candidate.generator_name.to_string()),
            ("sample", candidate.key.sample.to_string()),
            ("verdict", word.to_owned()),
        ]);
        let Some(verdict) = verdict else { return found };
        if let Some(defect) = data_validity::explain(&verdict.data_validity) {
            found.extend(details([(data_validity::NAME, defect)]));
        }
        for (filter, said) in self.validator.filters().iter().zip(&verdict.judgements) {
            if let Some(why) = filter.explain(said).filter(|_| !said.feasible) {
                found.extend(details([(filter.name(), why)]));
            }
        }
        found
    }
}

fn details<const N: usize>(pairs: [(&str, String); N]) -> Vec<KeyValuePair> {
    pairs.map(|(key, value)| KeyValuePair { key: key.to_owned(), value }).into()
}

/// All markers of an array as one entity.
fn entity(header: &Header, lifetime: Duration, id: &str, drawn: MarkerArray) -> SceneEntity {
    let (mut lines, mut texts) = (Vec::new(), Vec::new());
    for marker in drawn.markers.into_iter().filter(|marker| marker.action == Marker::ADD) {
        let color = colour(marker.color);
        match marker.r#type {
            Marker::TEXT_VIEW_FACING => texts.push(TextPrimitive {
                pose: marker.pose,
                billboard: true,
                font_size: marker.scale.z,
                scale_invariant: false,
                color,
                text: marker.text,
            }),
            kind => lines.push(LinePrimitive {
                r#type: if kind == Marker::LINE_LIST {
                    LinePrimitive::LINE_LIST
                } else {
                    LinePrimitive::LINE_STRIP
                },
                pose: marker.pose,
                thickness: marker.scale.x,
                points: marker.points,
                color,
                ..LinePrimitive::default()
            }),
        }
    }
    SceneEntity {
        timestamp: header.stamp,
        frame_id: header.frame_id.clone(),
        id: id.to_owned(),
        lifetime,
        lines,
        texts,
        ..SceneEntity::default()
    }
}

fn colour(colour: ColorRgba) -> Color {
    let ColorRgba { r, g, b, a } = colour;
    Color { r: r.into(), g: g.into(), b: b.into(), a: a.into() }
}
