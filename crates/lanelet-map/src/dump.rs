//! A map as canonical text: equal texts mean equal maps, whatever the order of the archive.
//!
//! One line for each element of a layer, sections in the order points, line strings, polygons, areas,
//! lanelets, regulatory elements, lines of a section sorted as bytes. Coordinates are printed as bit patterns.

use std::fmt::Write;

use crate::map::Map;
use crate::map::attributes::Attributes;
use crate::map::elements::{Area, Lanelet, Parameter, Point, Polyline, RegulatoryElement};

/// The text of a map.
#[must_use]
pub fn dump(map: &Map) -> String {
    let mut out = String::new();
    section(&mut out, map.points(), point);
    section(&mut out, map.line_strings(), |out, line| full_line(out, "L ", line));
    section(&mut out, map.polygons(), |out, line| full_line(out, "G ", line));
    section(&mut out, map.areas(), area);
    section(&mut out, map.lanelets(), lanelet);
    section(&mut out, map.regulatory_elements(), rule);
    out
}

fn section<T>(out: &mut String, elements: impl Iterator<Item = T>, mut write: impl FnMut(&mut String, T)) {
    let mut lines: Vec<String> = elements
        .map(|element| {
            let mut line = String::new();
            write(&mut line, element);
            line
        })
        .collect();
    lines.sort_unstable();
    for line in lines {
        out.push_str(&line);
        out.push('\n');
    }
}

/// `write!` into a `String`, which cannot fail.
macro_rules! put {
    ($out:expr, $($arguments:tt)*) => {{
        let _ = write!($out, $($arguments)*);
    }};
}

fn escaped(out: &mut String, text: &str) {
    for c in text.chars() {
        match c {
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            '|' => out.push_str("\\p"),
            '=' => out.push_str("\\e"),
            other => out.push(other),
        }
    }
}

fn attributes(out: &mut String, attributes: Attributes<'_>) {
    out.push_str(" {");
    for (at, attribute) in attributes.iter().enumerate() {
        if at > 0 {
            out.push('|');
        }
        escaped(out, attribute.key);
        out.push('=');
        escaped(out, attribute.value);
    }
    out.push('}');
}

fn reference(out: &mut String, id: i64, inverted: bool) {
    put!(out, "{id}{}", if inverted { '-' } else { '+' });
}

fn full_line(out: &mut String, prefix: &str, line: Polyline<'_>) {
    out.push_str(prefix);
    reference(out, line.id(), line.is_inverted());
    attributes(out, line.attributes());
    out.push_str(" [");
    for point in line.points() {
        put!(out, "{},", point.id());
    }
    out.push(']');
}

fn point(out: &mut String, point: Point<'_>) {
    let [x, y, z] = point.position().map(f64::to_bits);
    put!(out, "P {} {x:016x} {y:016x} {z:016x}", point.id());
    attributes(out, point.attributes());
}

fn references<'m>(out: &mut String, lines: impl Iterator<Item = Polyline<'m>>) {
    for line in lines {
        reference(out, line.id(), line.is_inverted());
        out.push(',');
    }
}

fn rules<'m>(out: &mut String, rules: impl Iterator<Item = RegulatoryElement<'m>>) {
    out.push_str(" re=");
    for rule in rules {
        put!(out, "{},", rule.id());
    }
}

fn area(out: &mut String, area: Area<'_>) {
    put!(out, "A {}", area.id());
    attributes(out, area.attributes());
    out.push_str(" outer=");
    references(out, area.outer());
    out.push_str(" inner=");
    for ring in area.inner() {
        references(out, ring);
        out.push(';');
    }
    rules(out, area.regulatory_elements());
}

fn lanelet(out: &mut String, lanelet: Lanelet<'_>) {
    out.push_str("W ");
    reference(out, lanelet.id(), lanelet.is_inverted());
    attributes(out, lanelet.attributes());
    full_line(out, " left=", lanelet.left());
    full_line(out, " right=", lanelet.right());
    rules(out, lanelet.regulatory_elements());
    out.push_str(" center=");
    match lanelet.centerline() {
        None => out.push_str("none"),
        Some(line) => {
            full_line(out, "", line);
            out.push_str("xyz");
            for coordinate in line.positions().flatten() {
                put!(out, "{:016x}", coordinate.to_bits());
            }
        }
    }
}

fn rule(out: &mut String, rule: RegulatoryElement<'_>) {
    put!(out, "R {}", rule.id());
    attributes(out, rule.attributes());
    for role in rule.roles() {
        out.push(' ');
        escaped(out, role.name());
        out.push(':');
        for parameter in role.parameters() {
            match parameter {
                Parameter::Point(point) => put!(out, "P{}", point.id()),
                Parameter::Area(area) => put!(out, "A{}", area.id()),
                Parameter::LineString(line) => {
                    out.push('L');
                    reference(out, line.id(), line.is_inverted());
                }
                Parameter::Polygon(line) => {
                    out.push('G');
                    reference(out, line.id(), line.is_inverted());
                }
                Parameter::Lanelet(lanelet) => {
                    out.push('W');
                    reference(out, lanelet.id(), lanelet.is_inverted());
                }
            }
            out.push(',');
        }
    }
}
