//! Writes SVG: shapes in pixels with a class of the style sheet, numbers as short as they can be.

use std::fmt::Write as _;

/// A place on the page, px: x to the right, y down.
pub(super) type Px = [f64; 2];

/// The elements of a picture in the order of drawing.
#[derive(Debug, Default)]
pub(super) struct Svg {
    body: String,
}

impl Svg {
    /// The elements so far.
    pub(super) fn into_body(self) -> String {
        self.body
    }

    /// Everything up to the matching [`Self::close`] belongs together.
    pub(super) fn open(&mut self, attributes: &str) {
        // Writing to a string cannot fail, here and below.
        let _ = writeln!(self.body, "<g {attributes}>");
    }

    pub(super) fn close(&mut self) {
        self.body.push_str("</g>\n");
    }

    /// Lines through places, one for each run.
    pub(super) fn lines<'p>(&mut self, class: &str, runs: impl IntoIterator<Item = &'p [Px]>) {
        let mut path = String::new();
        for run in runs.into_iter().filter(|run| run.len() > 1) {
            append_run(&mut path, run);
        }
        if !path.is_empty() {
            let _ = writeln!(self.body, "<path class=\"{class}\" d=\"{path}\"/>");
        }
    }

    /// One closed shape.
    pub(super) fn polygon(&mut self, class: &str, corners: &[Px]) {
        let mut path = String::new();
        append_run(&mut path, corners);
        let _ = writeln!(self.body, "<path class=\"{class}\" d=\"{path}z\"/>");
    }

    pub(super) fn circle(&mut self, class: &str, [x, y]: Px, radius: f64) {
        let (x, y, r) = (number(x), number(y), number(radius));
        let _ = writeln!(self.body, "<circle class=\"{class}\" cx=\"{x}\" cy=\"{y}\" r=\"{r}\"/>");
    }

    pub(super) fn rectangle(&mut self, class: &str, [x, y]: Px, [width, height]: Px, radius: f64) {
        let _ = writeln!(
            self.body,
            "<rect class=\"{class}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"{}\"/>",
            number(x),
            number(y),
            number(width),
            number(height),
            number(radius)
        );
    }

    /// Text that begins, ends or has its middle at a place, by the class.
    pub(super) fn text(&mut self, class: &str, [x, y]: Px, text: &str) {
        let _ = writeln!(
            self.body,
            "<text class=\"{class}\" x=\"{}\" y=\"{}\">{}</text>",
            number(x),
            number(y),
            escaped(text)
        );
    }
}

/// A run from its first place on in steps, which are shorter to write than places. Steps are between rounded places,
/// so that rounding does not add up.
fn append_run(path: &mut String, run: &[Px]) {
    let tenths = |value: f64| (value * 10.0).round();
    let mut before = [0.0, 0.0];
    for (index, [x, y]) in run.iter().enumerate() {
        let command = if index == 0 { 'M' } else { 'l' };
        let [x, y] = [tenths(*x), tenths(*y)];
        let step = [x - before[0], y - before[1]];
        let [x_step, y_step] = step.map(|tenths| number(tenths / 10.0));
        // A sign parts two numbers as well as a space does.
        let gap = if y_step.starts_with('-') { "" } else { " " };
        let _ = write!(path, "{command}{x_step}{gap}{y_step}");
        before = [x, y];
    }
}

/// A number to a tenth, which is finer than any screen.
pub(super) fn number(value: f64) -> String {
    let rounded = (value * 10.0).round() / 10.0;
    // Adding zero turns minus zero into zero; the zero before the point says nothing.
    let text = format!("{}", rounded + 0.0);
    match text.strip_prefix('-').unwrap_or(&text).strip_prefix("0.") {
        Some(tenth) if rounded < 0.0 => format!("-.{tenth}"),
        Some(tenth) => format!(".{tenth}"),
        None => text,
    }
}

/// Text that may stand between tags or in an attribute.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // Control characters are not allowed in XML at all.
            control if control.is_control() => out.push(' '),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (1.0, "1"),
            (1.25, "1.3"),
            (-0.04, "0"),
            (959.96, "960"),
            (-2.5, "-2.5"),
            (0.1, ".1"),
            (-0.3, "-.3"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn text_cannot_break_out() {
        assert_eq!(escaped("<a b=\"&\">\n"), "&lt;a b=&quot;&amp;&quot;&gt; ");
        let mut svg = Svg::default();
        svg.text("label", [1.0, 2.0], "</text><script/>");
        assert!(!svg.into_body().contains("<script"));
    }

    #[test]
    fn rounding_does_not_add_up() {
        let run: Vec<Px> = (0..=100).map(|step| [f64::from(step) * 0.26, 7.0]).collect();
        let mut path = String::new();
        append_run(&mut path, &run);
        let steps =
            path.split('l').skip(1).map(|step| step.split(' ').next().unwrap().parse::<f64>().unwrap());
        assert!((steps.sum::<f64>() - 26.0).abs() < 1e-6, "{path}");
    }

    #[test]
    fn runs_of_one_place_are_nothing() {
        let mut svg = Svg::default();
        svg.lines("x", [&[[0.0, 0.0]][..]]);
        assert_eq!(svg.into_body(), "");
    }
}
