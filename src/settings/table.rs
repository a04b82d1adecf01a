//! The table of all parameters, made from the schemas of the parameter structs.

use std::collections::HashMap;
use std::fmt;
use std::sync::LazyLock;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use selection::parameters::{ConcatenatorParameters, RankerParameters, ValidatorParameters};
use serde::Serialize;
use serde_json::{Map, Value};

use super::nearest::{Known, nearest, nearest_known};
use super::problem::ProblemKind;
use super::value::{ParameterKind, ParameterValue};
use super::{NodeParameters, OpenSpaceSettings, SelectorParameters, VehicleInfoParameters};

/// Keys of a group of values per class that hold for each of its values.
const SHARED_KEYS: [&str; 6] =
    ["minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum", "x-unit", "x-read-only"];

/// A part of the program with parameters of its own. All parts share one flat set of names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Component {
    /// What every ROS 2 node has.
    Node,
    /// The selector.
    Selector,
    /// The concatenator.
    Concatenator,
    /// The validator and its filters.
    Validator,
    /// The ranker.
    Ranker,
    /// The open-space trajectory provider.
    OpenSpace,
    /// The vehicle.
    VehicleInfo,
}

impl Component {
    /// All components, in the order of documentation.
    pub const ALL: [Self; 7] = [
        Self::Node,
        Self::Selector,
        Self::Concatenator,
        Self::Validator,
        Self::Ranker,
        Self::OpenSpace,
        Self::VehicleInfo,
    ];

    /// Name of its files in `config/`, without endings.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Node => "node",
            Self::Selector => "selector",
            Self::Concatenator => "concatenator",
            Self::Validator => "validator",
            Self::Ranker => "ranker",
            Self::OpenSpace => "open_space",
            Self::VehicleInfo => "vehicle_info",
        }
    }

    /// JSON schema of the parameters below `ros__parameters`, everything inlined.
    pub(super) fn schema(self) -> Value {
        match self {
            Self::Node => schema::<NodeParameters>(),
            Self::Selector => schema::<SelectorParameters>(),
            Self::Concatenator => schema::<ConcatenatorParameters>(),
            Self::Validator => schema::<ValidatorParameters>(),
            Self::Ranker => schema::<RankerParameters>(),
            Self::OpenSpace => schema::<OpenSpaceSettings>(),
            Self::VehicleInfo => schema::<VehicleInfoParameters>(),
        }
    }

    /// The defaults as JSON of the parameter structs.
    fn defaults(self) -> Value {
        match self {
            Self::Node => json::<NodeParameters>(),
            Self::Selector => json::<SelectorParameters>(),
            Self::Concatenator => json::<ConcatenatorParameters>(),
            Self::Validator => json::<ValidatorParameters>(),
            Self::Ranker => json::<RankerParameters>(),
            Self::OpenSpace => json::<OpenSpaceSettings>(),
            Self::VehicleInfo => json::<VehicleInfoParameters>(),
        }
    }
}

/// End of a range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// The number.
    pub value: f64,
    /// Whether the number itself is inside the range.
    pub inclusive: bool,
}

/// Everything that is known about a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterDescriptor {
    /// Name on the ROS side, groups joined with dots.
    pub name: String,
    /// Where it belongs.
    pub component: Component,
    /// Type.
    pub kind: ParameterKind,
    /// Value when nothing else is said; not set for a class of objects for which the base value holds.
    pub default: ParameterValue,
    /// What it means.
    pub description: String,
    /// Unit, none for numbers without one and for what is no number.
    pub unit: Option<String>,
    /// Lower end of the range of the number or of each number of a list.
    pub minimum: Option<Bound>,
    /// Upper end of that range.
    pub maximum: Option<Bound>,
    /// The only texts allowed, empty when all are.
    pub choices: Vec<String>,
    /// The only length allowed of a list.
    pub length: Option<usize>,
    /// True when fixed at start.
    pub read_only: bool,
    /// Name of the group whose base value holds while this value of a class of objects is not set.
    pub class_of: Option<String>,
}

impl ParameterDescriptor {
    /// Range or choices in words, with the unit; the type where there are none.
    #[must_use]
    pub fn allowed(&self) -> String {
        let unit = self.unit.as_ref().map(|unit| format!(" {unit}")).unwrap_or_default();
        let bound = |bound: Bound| self.bound_text(bound);
        let mut text = if self.choices.is_empty() {
            match (self.minimum, self.maximum) {
                (None, None) => format!("{}{unit}", self.kind),
                (Some(low), None) => format!("{} {}{unit}", low.above(), bound(low)),
                (None, Some(high)) => format!("{} {}{unit}", high.below(), bound(high)),
                (Some(low), Some(high)) if low.inclusive && high.inclusive => {
                    format!("{} to {}{unit}", bound(low), bound(high))
                }
                (Some(low), Some(high)) => {
                    format!("{} {} and {} {}{unit}", low.above(), bound(low), high.below(), bound(high))
                }
            }
        } else {
            let quoted: Vec<_> = self.choices.iter().map(|choice| format!("\"{choice}\"")).collect();
            let one_or_any = if self.kind.is_array() { "any of" } else { "one of" };
            format!("{one_or_any} {}", quoted.join(", "))
        };
        if let Some(length) = self.length {
            text = format!("{length} entries, each {text}");
        }
        text
    }

    fn bound_text(&self, bound: Bound) -> String {
        match self.kind {
            ParameterKind::Integer | ParameterKind::IntegerArray => format!("{}", bound.value),
            _ => format!("{:?}", bound.value),
        }
    }

    /// The value as it is stored, or what is wrong with it and the choice that was probably meant.
    pub(super) fn accept(
        &self,
        value: ParameterValue,
    ) -> Result<ParameterValue, (ProblemKind, Option<String>)> {
        let wrong = |kind| Err((kind, None));
        let Some(given) = value.kind() else {
            return if self.class_of.is_some() { Ok(value) } else { wrong(ProblemKind::NoValue) };
        };
        let value = match value {
            empty if empty.is_empty_array() && self.kind.is_array() => self.empty_array(),
            ParameterValue::Double(v) if v.is_nan() && self.kind == given && self.class_of.is_some() => {
                return Ok(ParameterValue::NotSet);
            }
            value if given == self.kind => value,
            _ => {
                return wrong(ProblemKind::WrongType { name: self.name.clone(), declared: self.kind, given });
            }
        };
        if self.class_of.is_some() && value.is_empty_array() {
            return Ok(ParameterValue::NotSet);
        }
        match &value {
            ParameterValue::Integer(number) => self.accept_integer(*number),
            ParameterValue::IntegerArray(list) => list.iter().try_for_each(|n| self.accept_integer(*n)),
            ParameterValue::Double(number) => self.accept_double(*number),
            ParameterValue::DoubleArray(list) => list.iter().try_for_each(|n| self.accept_double(*n)),
            ParameterValue::String(text) => self.accept_text(text),
            ParameterValue::StringArray(list) => list.iter().try_for_each(|text| self.accept_text(text)),
            ParameterValue::Bool(_) | ParameterValue::BoolArray(_) | ParameterValue::NotSet => Ok(()),
        }?;
        match (self.length, array_length(&value)) {
            (Some(expected), Some(length)) if length != expected => {
                wrong(ProblemKind::WrongLength { length })
            }
            _ => Ok(value),
        }
    }

    fn empty_array(&self) -> ParameterValue {
        match self.kind {
            ParameterKind::BoolArray => ParameterValue::BoolArray(Vec::new()),
            ParameterKind::IntegerArray => ParameterValue::IntegerArray(Vec::new()),
            ParameterKind::DoubleArray => ParameterValue::DoubleArray(Vec::new()),
            _ => ParameterValue::StringArray(Vec::new()),
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "bounds are small whole numbers")]
    fn accept_integer(&self, number: i64) -> Result<(), (ProblemKind, Option<String>)> {
        self.accept_range(number as f64, &number)
    }

    fn accept_double(&self, number: f64) -> Result<(), (ProblemKind, Option<String>)> {
        let shown = ParameterValue::Double(number);
        if !number.is_finite() {
            return Err((ProblemKind::NotFinite { value: shown.to_string() }, None));
        }
        self.accept_range(number, &shown)
    }

    fn accept_range(
        &self,
        number: f64,
        shown: &impl fmt::Display,
    ) -> Result<(), (ProblemKind, Option<String>)> {
        let high_enough =
            self.minimum.is_none_or(|low| number > low.value || (low.inclusive && number >= low.value));
        let low_enough =
            self.maximum.is_none_or(|high| number < high.value || (high.inclusive && number <= high.value));
        if high_enough && low_enough {
            Ok(())
        } else {
            Err((ProblemKind::OutOfRange { value: shown.to_string() }, None))
        }
    }

    fn accept_text(&self, text: &str) -> Result<(), (ProblemKind, Option<String>)> {
        if self.choices.is_empty() || self.choices.iter().any(|choice| choice == text) {
            return Ok(());
        }
        let meant = nearest(text, self.choices.iter().map(String::as_str)).map(str::to_owned);
        Err((ProblemKind::NotAChoice { value: text.to_owned() }, meant))
    }
}

impl Bound {
    const fn above(self) -> &'static str {
        if self.inclusive { "at least" } else { "greater than" }
    }

    const fn below(self) -> &'static str {
        if self.inclusive { "at most" } else { "less than" }
    }
}

fn array_length(value: &ParameterValue) -> Option<usize> {
    match value {
        ParameterValue::BoolArray(list) => Some(list.len()),
        ParameterValue::IntegerArray(list) => Some(list.len()),
        ParameterValue::DoubleArray(list) => Some(list.len()),
        ParameterValue::StringArray(list) => Some(list.len()),
        _ => None,
    }
}

/// All parameters in the order of documentation: components, then declaration.
#[must_use]
pub fn parameter_table() -> &'static [ParameterDescriptor] {
    &TABLE
}

static TABLE: LazyLock<Vec<ParameterDescriptor>> = LazyLock::new(|| {
    let mut out = Vec::new();
    for component in Component::ALL {
        flatten(component, "", None, &component.schema(), &component.defaults(), &mut out);
    }
    out
});

static BY_NAME: LazyLock<HashMap<&'static str, usize>> =
    LazyLock::new(|| TABLE.iter().enumerate().map(|(index, d)| (d.name.as_str(), index)).collect());

static SPELLINGS: LazyLock<Vec<Known<'static>>> =
    LazyLock::new(|| TABLE.iter().map(|descriptor| Known::new(&descriptor.name)).collect());

/// Index of a parameter in the table. A group of values per class stands for its base value.
pub(super) fn find(name: &str) -> Option<usize> {
    BY_NAME.get(name).or_else(|| BY_NAME.get(format!("{name}.base").as_str())).copied()
}

/// The declared name spelled most alike.
pub(super) fn nearest_name(wrong: &str) -> Option<String> {
    nearest_known(wrong, &SPELLINGS).map(str::to_owned)
}

/// Names of the parameters directly or deeper in a group; empty when there is no such group.
pub(super) fn group_members(name: &str) -> Vec<&'static str> {
    let prefix = format!("{name}.");
    parameter_table().iter().map(|d| d.name.as_str()).filter(|n| n.starts_with(&prefix)).collect()
}

fn schema<T: JsonSchema>() -> Value {
    let generator = SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true).into_generator();
    let mut schema = generator.into_root_schema_for::<T>().to_value();
    push_down(&mut schema);
    schema
}

fn json<T: Serialize + Default>() -> Value {
    // Structs of numbers, texts and lists always serialise; the drift test would show the empty result.
    serde_json::to_value(T::default()).unwrap_or_default()
}

/// Gives every value of a class group the range, unit and description of its group, and drops `null`, which no
/// parameter file can say, from the types of values that may be left out.
fn push_down(schema: &mut Value) {
    let Some(object) = schema.as_object_mut() else { return };
    let per_class = object.get("x-per-class").is_some();
    let mut shared = Map::new();
    if per_class {
        for key in SHARED_KEYS {
            if let Some(value) = object.remove(key) {
                shared.insert(key.to_owned(), value);
            }
        }
    }
    let description = object.get("description").and_then(Value::as_str).map(str::to_owned);
    let properties = object.get_mut("properties").and_then(Value::as_object_mut);
    for (name, property) in properties.into_iter().flatten() {
        if let (true, Some(property)) = (per_class, property.as_object_mut()) {
            let nullable = property.get("type").is_some_and(Value::is_array);
            if let Some(first) = property.get("type").and_then(|t| t.get(0)).cloned() {
                property.insert("type".to_owned(), first);
            }
            property.remove("default");
            property.extend(shared.clone());
            let own = if nullable { format!(" Own value of the class {name}.") } else { String::new() };
            let text = format!("{}{own}", description.as_deref().unwrap_or_default());
            property.insert("description".to_owned(), text.into());
        }
        push_down(property);
    }
}

fn flatten(
    component: Component,
    name: &str,
    group: Option<&str>,
    schema: &Value,
    default: &Value,
    out: &mut Vec<ParameterDescriptor>,
) {
    if let Some(properties) = schema.get("properties").and_then(Value::as_object) {
        let per_class = schema.get("x-per-class").is_some();
        for (key, property) in properties {
            let full = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
            let group = (per_class && key != "base").then_some(name);
            flatten(component, &full, group, property, &default[key.as_str()], out);
        }
        return;
    }
    let Some(kind) = kind(schema) else { return };
    let items = schema.get("items").unwrap_or(schema);
    let text = |key: &str| schema.get(key).and_then(Value::as_str).map(str::to_owned);
    out.push(ParameterDescriptor {
        name: name.to_owned(),
        component,
        kind,
        default: ParameterValue::from_json(kind, default).unwrap_or(ParameterValue::NotSet),
        description: text("description").unwrap_or_default().replace('\n', " "),
        unit: text("x-unit"),
        minimum: bound(items, "minimum", "exclusiveMinimum"),
        maximum: bound(items, "maximum", "exclusiveMaximum"),
        choices: choices(items),
        length: schema
            .get("minItems")
            .filter(|least| schema.get("maxItems") == Some(least))
            .and_then(Value::as_u64)
            .and_then(|length| usize::try_from(length).ok()),
        // The planner takes its parameters when it starts.
        read_only: component == Component::OpenSpace
            || schema.get("x-read-only").and_then(Value::as_bool).unwrap_or(false),
        class_of: group.map(str::to_owned),
    });
}

fn kind(schema: &Value) -> Option<ParameterKind> {
    let single = |schema: &Value| {
        Some(match schema.get("type").and_then(Value::as_str) {
            Some("boolean") => ParameterKind::Bool,
            Some("integer") => ParameterKind::Integer,
            Some("number") => ParameterKind::Double,
            Some("string") => ParameterKind::String,
            _ if schema.get("oneOf").is_some() => ParameterKind::String,
            _ => return None,
        })
    };
    match schema.get("type").and_then(Value::as_str) {
        Some("array") => Some(match single(schema.get("items")?)? {
            ParameterKind::Bool => ParameterKind::BoolArray,
            ParameterKind::Integer => ParameterKind::IntegerArray,
            ParameterKind::Double => ParameterKind::DoubleArray,
            _ => ParameterKind::StringArray,
        }),
        _ => single(schema),
    }
}

fn bound(schema: &Value, inclusive: &str, exclusive: &str) -> Option<Bound> {
    let number = |key: &str| schema.get(key).and_then(Value::as_f64);
    number(exclusive)
        .map(|value| Bound { value, inclusive: false })
        .or_else(|| number(inclusive).map(|value| Bound { value, inclusive: true }))
}

fn choices(schema: &Value) -> Vec<String> {
    let listed = schema.get("enum").and_then(Value::as_array).into_iter().flatten();
    let described = schema.get("oneOf").and_then(Value::as_array).into_iter().flatten();
    listed
        .chain(described.filter_map(|choice| choice.get("const")))
        .filter_map(Value::as_str)
        .map(str::to_owned)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A leaf that the schema walk does not recognise would silently lose its checks.
    #[test]
    fn every_leaf_of_every_struct_is_in_the_table() {
        fn leaves(json: &Value) -> usize {
            json.as_object().map_or(1, |map| map.values().map(leaves).sum())
        }
        for component in Component::ALL {
            let declared = parameter_table().iter().filter(|d| d.component == component).count();
            assert_eq!(declared, leaves(&component.defaults()), "{component:?}");
        }
    }

    #[test]
    fn names_are_unique_and_defaults_have_their_type() {
        let mut seen = HashMap::new();
        for descriptor in parameter_table() {
            assert_eq!(seen.insert(&descriptor.name, ()), None, "{}", descriptor.name);
            assert!(!descriptor.description.is_empty(), "{}", descriptor.name);
            match descriptor.default.kind() {
                Some(kind) => {
                    assert_eq!(kind, descriptor.kind, "{}", descriptor.name);
                    let accepted = descriptor.accept(descriptor.default.clone());
                    assert_eq!(accepted.as_ref(), Ok(&descriptor.default), "{}", descriptor.name);
                }
                None => assert!(descriptor.class_of.is_some(), "{}", descriptor.name),
            }
        }
    }

    #[test]
    fn ranges_reach_the_values_of_classes() {
        let name = "collision_check.drac.ego_footprint_margin.lateral.pedestrian";
        let descriptor = &parameter_table()[find(name).unwrap()];
        assert_eq!(descriptor.minimum, Some(Bound { value: 0.0, inclusive: true }));
        assert_eq!(descriptor.unit.as_deref(), Some("m"));
        assert_eq!(descriptor.class_of.as_deref(), Some("collision_check.drac.ego_footprint_margin.lateral"));
        assert_eq!(descriptor.default, ParameterValue::Double(0.5));
    }

    #[test]
    fn a_class_group_stands_for_its_base() {
        let group = "collision_check.rss.stop_distance_margin";
        assert_eq!(find(group), find(&format!("{group}.base")));
        assert_eq!(find("safety"), None);
    }
}
