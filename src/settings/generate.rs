//! Writes what is derived from the parameter structs: configuration files, their JSON schemas, documentation.
//!
//! `cargo run --example generate_config` writes the files; a test fails when one of them differs.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::{Component, ParameterDescriptor, ParameterKind, ParameterValue, parameter_table};
use selection::parameters::FilterClass;

/// Width of comment lines in configuration files.
const COMMENT_WIDTH: usize = 100;

/// A file of the repository that is made by this program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GeneratedFile {
    /// Path from the root of the repository.
    pub path: String,
    /// Content.
    pub text: String,
}

/// All generated files.
#[must_use]
pub fn generated_files() -> Vec<GeneratedFile> {
    let mut files = vec![
        GeneratedFile {
            path: "config/validator.upstream.param.yaml".to_owned(),
            text: upstream_validator_file(),
        },
        GeneratedFile { path: "docs/parameters.md".to_owned(), text: documentation() },
    ];
    for component in Component::ALL.into_iter().filter(|c| has_file(*c)) {
        let name = component.name();
        files.push(GeneratedFile {
            path: format!("config/{name}.param.yaml"),
            text: parameter_file(component),
        });
        files.push(GeneratedFile {
            path: format!("config/schema/{name}.schema.json"),
            text: schema_file(component),
        });
    }
    files
}

/// `use_sim_time` belongs to whoever starts the node: a file that names it would override the launch file.
fn has_file(component: Component) -> bool {
    component != Component::Node
}

fn descriptors(component: Component) -> impl Iterator<Item = &'static ParameterDescriptor> {
    parameter_table().iter().filter(move |d| d.component == component)
}

/// Values of classes that say nothing are left out.
fn is_written(descriptor: &ParameterDescriptor) -> bool {
    descriptor.default != ParameterValue::NotSet
}

fn parameter_file(component: Component) -> String {
    let mut text = format!(
        "# Parameters of the {}: the shipped configuration.\n\
         # Generated from the program; change a copy, or the program and this file with it.\n\
         /**:\n  ros__parameters:\n",
        component.name().replace('_', " ")
    );
    let mut open: Vec<&str> = Vec::new();
    for descriptor in descriptors(component).filter(|d| is_written(d)) {
        let mut path: Vec<&str> = descriptor.name.split('.').collect();
        let Some(leaf) = path.pop() else { continue };
        let common = open.iter().zip(&path).take_while(|(a, b)| a == b).count();
        // The base value stands for its group: the comment goes above the group.
        let group_begins = leaf == "base" && common < path.len();
        let comment_depth = if group_begins { path.len() - 1 } else { path.len() };
        for (depth, group) in path.iter().enumerate().skip(common) {
            if group_begins && depth == comment_depth {
                comment(&mut text, depth, descriptor);
            }
            let _ = writeln!(text, "{}{group}:", indent(depth));
        }
        if !group_begins && descriptor.class_of.is_none() {
            comment(&mut text, path.len(), descriptor);
        }
        let _ = writeln!(text, "{}{leaf}: {}", indent(path.len()), descriptor.default);
        open = path;
    }
    text
}

fn indent(depth: usize) -> String {
    " ".repeat(4 + 2 * depth)
}

fn comment(text: &mut String, depth: usize, descriptor: &ParameterDescriptor) {
    let allowed = descriptor.allowed();
    let read_only = if descriptor.read_only { "; fixed at start" } else { "" };
    let full = format!("{} [{allowed}{read_only}]", descriptor.description);
    let start = format!("{}#", indent(depth));
    let mut line = start.clone();
    for word in full.split_whitespace() {
        if line.len() + 1 + word.len() > COMMENT_WIDTH && line.len() > start.len() {
            let _ = writeln!(text, "{line}");
            line.clone_from(&start);
        }
        line.push(' ');
        line.push_str(word);
    }
    let _ = writeln!(text, "{line}");
}

fn upstream_validator_file() -> String {
    let names = FilterClass::ALL.into_iter().map(|class| class.class_name().to_owned()).collect();
    format!(
        "# Enforces nothing, as the configuration that upstream ships: every filter judges and reports, none rejects.\n\
         # Use it instead of validator.param.yaml, or after it. Never in a vehicle that drives on the output.\n\
         /**:\n  ros__parameters:\n    filter_names: {}\n    shadow_mode_filter_names: {}\n",
        ParameterValue::StringArray(vec![String::new()]),
        ParameterValue::StringArray(names),
    )
}

fn schema_file(component: Component) -> String {
    let name = component.name();
    let mut parameters = component.schema();
    if let Some(object) = parameters.as_object_mut() {
        object.shift_remove("$schema");
        object.shift_remove("title");
    }
    compact(&mut parameters);
    let schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": format!("Parameters of the {}", name.replace('_', " ")),
        "type": "object",
        "properties": { "/**": {
            "type": "object",
            "properties": { "ros__parameters": parameters },
            "required": ["ros__parameters"],
            "additionalProperties": false,
        } },
        "required": ["/**"],
        "additionalProperties": false,
    });
    // A tree of strings, numbers and maps always serialises.
    let mut text = serde_json::to_string_pretty::<Value>(&schema).unwrap_or_default();
    text.push('\n');
    text
}

/// Leaves out the defaults of groups, which their members repeat, and says a group of values per class once.
fn compact(schema: &mut Value) {
    let Some(object) = schema.as_object_mut() else { return };
    let per_class = object.get("x-per-class").is_some();
    let Some(properties) = object.get_mut("properties").and_then(Value::as_object_mut) else { return };
    properties.values_mut().for_each(compact);
    if per_class {
        let names: Vec<&String> = properties.keys().collect();
        let names = json!(names);
        let base = properties.get("base").cloned().unwrap_or_default();
        let default = object.shift_remove("default");
        *schema = json!({
            "description": base["description"],
            "anyOf": [
                base,
                { "type": "object", "propertyNames": { "enum": names }, "additionalProperties": base },
            ],
            "default": default.as_ref().and_then(Value::as_object).map(|values| {
                let given = values.iter().filter(|(_, value)| !value.is_null());
                given.map(|(name, value)| (name.clone(), value.clone())).collect::<serde_json::Map<_, _>>()
            }),
        });
    } else {
        object.shift_remove("default");
    }
}

fn documentation() -> String {
    let mut text = "# Parameters\n\n\
        Generated from the program by `cargo run --example generate_config`.\n\n\
        All parameters of the node form one flat set; the tables follow the files in `config/`. \
        Files and `-p name:=value` are applied in the order of the command line, the last value of a name wins. \
        A name that does not exist, a value of another type (`1` is an integer, `1.0` a double) and a value outside \
        its range are errors: the node does not start, and a change at run time is refused as a whole. \
        `qos_overrides.*` is accepted and left alone.\n\n\
        A parameter *per class* is a group: `base` holds for every class of objects without a value of its own \
        (`car`, `truck`, `bus`, `trailer`, `motorcycle`, `bicycle`, `pedestrian`, `unknown`, `animal`, `hazard`, \
        `over_drivable`, `under_drivable`). A plain value in place of the group is the base value. \
        `.nan` (numbers) and `[]` (lists) take the value of a class back to the base.\n"
        .to_owned();
    for component in Component::ALL {
        let title = component.name().replace('_', " ");
        let _ = writeln!(text, "\n## {}{}\n", title[..1].to_uppercase(), &title[1..]);
        if has_file(component) {
            let _ = writeln!(text, "`config/{}.param.yaml`\n", component.name());
        }
        text.push_str(
            "| name | type | default | allowed | at run time | meaning |\n|---|---|---|---|---|---|\n",
        );
        for descriptor in descriptors(component).filter(|d| d.class_of.is_none()) {
            row(&mut text, descriptor);
        }
    }
    text
}

fn row(text: &mut String, descriptor: &ParameterDescriptor) {
    let group = descriptor.name.strip_suffix(".base");
    let name = group.unwrap_or(&descriptor.name);
    let per_class = if group.is_some() { " per class" } else { "" };
    let mut default = descriptor.default.to_string();
    let own = parameter_table().iter().filter(|d| group.is_some() && d.class_of.as_deref() == group);
    for class in own.filter(|d| is_written(d)) {
        let class_name = class.name.rsplit('.').next().unwrap_or_default();
        let _ = write!(default, "; {class_name} {}", class.default);
    }
    let unbounded = descriptor.allowed() == descriptor.kind.name();
    let allowed = if unbounded && descriptor.kind != ParameterKind::Double {
        String::new()
    } else if unbounded {
        "any number".to_owned()
    } else {
        descriptor.allowed()
    };
    let change = if descriptor.read_only { "fixed" } else { "changeable" };
    let _ = writeln!(
        text,
        "| `{name}` | {}{per_class} | `{default}` | {allowed} | {change} | {} |",
        descriptor.kind, descriptor.description
    );
}
