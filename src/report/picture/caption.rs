//! The words around the drawing: a title, what was said about the candidate in focus, a legend, a scale.

use super::camera::{Camera, WIDTH_PX};
use super::candidates::verdict;
use super::svg::Svg;
use crate::report::explanation::ExplainedCandidate;

/// Height of the title above the drawing, px.
pub(super) const TITLE_PX: f64 = 46.0;
const MARGIN_PX: f64 = 20.0;
const LINE_PX: f64 = 23.0;
const LEGEND_PX: f64 = 34.0;
/// As many characters of the text size as surely fit a line.
const LINE_CHARACTERS: usize = 112;
/// No more lines than these are written about one candidate.
const MOST_LINES: usize = 7;

/// A line of the caption with its class.
type Line = (&'static str, String);

/// What is said below the drawing.
#[derive(Debug)]
pub(super) struct Caption {
    lines: Vec<Line>,
    legend: Vec<(&'static str, &'static str)>,
}

impl Caption {
    /// What was said about the candidate in focus; the legend explains only what is drawn.
    /// Road users have a name by id.
    pub(super) fn new(
        all: &[&ExplainedCandidate],
        focus: Option<&ExplainedCandidate>,
        has_ways: bool,
        name_of: impl Fn(&str) -> Option<&'static str>,
    ) -> Self {
        let mut lines: Vec<Line> = focus.map(|focus| said(focus, &name_of)).unwrap_or_default();
        if lines.len() > MOST_LINES {
            lines.truncate(MOST_LINES);
            lines.push(("note", "...".to_owned()));
        }
        let is_there = |wanted: &str| all.iter().any(|candidate| verdict(candidate) == wanted);
        let entries = [
            ("ego", "vehicle", true),
            ("path accepted", "accepted", is_there("accepted")),
            ("path doubted", "shadow objection", is_there("doubted")),
            ("path rejected", "rejected", is_there("rejected")),
            ("mark", "first violation", focus.is_some_and(|candidate| !candidate.accepted)),
            ("way vehicle", "predicted path", has_ways),
        ];
        let legend = entries.into_iter().filter(|(.., drawn)| *drawn);
        Self { lines, legend: legend.map(|(class, text, _)| (class, text)).collect() }
    }

    /// Height below the drawing, px.
    pub(super) fn height_px(&self) -> f64 {
        16.0 + LINE_PX * self.lines.len() as f64 + LEGEND_PX
    }

    /// Draws everything below the drawing, which ends at `top`.
    pub(super) fn draw(&self, svg: &mut Svg, top: f64) {
        let mut y = top + 29.0;
        for (class, text) in &self.lines {
            svg.text(class, [MARGIN_PX, y], text);
            y += LINE_PX;
        }
        let mut x = MARGIN_PX;
        let middle = y;
        for (class, text) in &self.legend {
            let ends = [[x, middle], [x + 30.0, middle]];
            match *class {
                "ego" => svg.rectangle("ego", [x + 2.0, middle - 6.0], [26.0, 12.0], 2.0),
                "mark" => svg.circle("mark", [x + 15.0, middle], 8.0),
                class => svg.lines(class, [&ends[..]]),
            }
            svg.text("legend", [x + 38.0, middle + 5.0], text);
            x += 38.0 + 7.6 * text.len() as f64 + 26.0;
        }
    }
}

/// Verdict, objections in the order of the filters, enforced ones first, and what was left open.
fn said(candidate: &ExplainedCandidate, name_of: &dyn Fn(&str) -> Option<&'static str>) -> Vec<Line> {
    let mut lines = Vec::new();
    let sample = candidate.key.rsplit('#').next().filter(|sample| *sample != "0");
    let sample = sample.map(|sample| format!(" #{sample}")).unwrap_or_default();
    let verdict = if candidate.accepted { "accepted" } else { "rejected" };
    lines.push(("said", format!("“{}”{sample} is {verdict}", candidate.generator)));
    let objects = |enforced: bool| {
        candidate
            .judgements
            .iter()
            .filter(move |judgement| !judgement.feasible && judgement.enforced == enforced)
    };
    for judgement in objects(true).chain(objects(false)) {
        let shadow = if judgement.enforced { "" } else { " (shadow)" };
        let why = judgement.evidence.as_ref().and_then(|evidence| evidence.text.as_deref());
        let why = with_names(why.unwrap_or("no reason given"), name_of);
        let class = if judgement.enforced { "why" } else { "doubt" };
        wrap(&mut lines, class, &format!("{}{shadow}: {why}", judgement.filter));
    }
    for judgement in &candidate.judgements {
        if let Some(what) = &judgement.not_assessed {
            wrap(&mut lines, "note", &format!("{}, not assessed: {what}", judgement.filter));
        }
    }
    lines
}

/// Ids of 32 digits say nothing to a reader of a picture: the road user is named, or the id shortened.
fn with_names(text: &str, name_of: &dyn Fn(&str) -> Option<&'static str>) -> String {
    let is_id = |word: &str| word.len() == 32 && word.bytes().all(|byte| byte.is_ascii_hexdigit());
    let mut words: Vec<String> = Vec::new();
    for word in text.split(' ') {
        if !is_id(word) {
            words.push(word.to_owned());
        } else if let Some(name) = name_of(word) {
            // "object <id>" reads better as "the car" than as "object the car".
            words.pop_if(|last| last == "object");
            words.push(format!("the {name}"));
        } else {
            words.push(format!("{}…", &word[..8]));
        }
    }
    words.join(" ")
}

fn wrap(lines: &mut Vec<Line>, class: &'static str, text: &str) {
    let mut line = String::new();
    for word in text.split(' ') {
        if line.chars().count() + 1 + word.chars().count() > LINE_CHARACTERS && !line.is_empty() {
            lines.push((class, std::mem::take(&mut line)));
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line.push_str(word);
    }
    lines.push((class, line));
}

/// Writes the title above the drawing.
pub(super) fn write_title(svg: &mut Svg, title: &str) {
    svg.text("title", [MARGIN_PX, 30.0], title);
}

/// Draws a bar of a round length in the lower right corner of the drawing.
pub(super) fn scale(svg: &mut Svg, camera: &Camera) {
    let length_m = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0].into_iter().find(|m| camera.length(*m) >= 70.0);
    let length_m = length_m.unwrap_or(100.0);
    let (right, y) = (WIDTH_PX - MARGIN_PX, camera.height_px() - 14.0);
    let left = right - camera.length(length_m);
    svg.lines("scale", [&[[left, y - 5.0], [left, y], [right, y], [right, y - 5.0]][..]]);
    svg.text("label", [0.5 * (left + right), y - 8.0], &format!("{length_m} m"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_texts_are_wrapped_and_ids_named() {
        let mut lines = Vec::new();
        wrap(&mut lines, "why", &"word ".repeat(60));
        assert!(lines.len() == 3 && lines.iter().all(|(_, line)| line.chars().count() <= LINE_CHARACTERS));
        let id = "00112233445566778899aabbccddeeff";
        let known = |_: &str| Some("car");
        assert_eq!(with_names(&format!("object {id} at"), &known), "the car at");
        assert_eq!(with_names(&format!("waits for {id}"), &known), "waits for the car");
        assert_eq!(with_names(&format!("object {id} at"), &|_| None), "object 00112233… at");
    }
}
