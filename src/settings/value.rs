//! Values of parameters as ROS 2 knows them: a closed set of types, never converted into each other.

use std::fmt;

use serde_json::Value;

/// Type of a parameter, with the names that ROS 2 prints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterKind {
    /// `bool`
    Bool,
    /// `integer`, 64 bits
    Integer,
    /// `double`
    Double,
    /// `string`
    String,
    /// `bool_array`
    BoolArray,
    /// `integer_array`
    IntegerArray,
    /// `double_array`
    DoubleArray,
    /// `string_array`
    StringArray,
}

impl ParameterKind {
    /// Name in messages and documentation.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::Integer => "integer",
            Self::Double => "double",
            Self::String => "string",
            Self::BoolArray => "bool_array",
            Self::IntegerArray => "integer_array",
            Self::DoubleArray => "double_array",
            Self::StringArray => "string_array",
        }
    }

    /// Number in `rcl_interfaces/msg/ParameterType`.
    #[must_use]
    pub const fn ros_type(self) -> u8 {
        match self {
            Self::Bool => 1,
            Self::Integer => 2,
            Self::Double => 3,
            Self::String => 4,
            Self::BoolArray => 6,
            Self::IntegerArray => 7,
            Self::DoubleArray => 8,
            Self::StringArray => 9,
        }
    }

    /// True for the four list types.
    #[must_use]
    pub const fn is_array(self) -> bool {
        matches!(self, Self::BoolArray | Self::IntegerArray | Self::DoubleArray | Self::StringArray)
    }
}

impl fmt::Display for ParameterKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterValue {
    /// No value; of a class of objects: the base value holds.
    NotSet,
    /// Truth value.
    Bool(bool),
    /// Whole number.
    Integer(i64),
    /// Real number.
    Double(f64),
    /// Text.
    String(String),
    /// List of truth values.
    BoolArray(Vec<bool>),
    /// List of whole numbers.
    IntegerArray(Vec<i64>),
    /// List of real numbers.
    DoubleArray(Vec<f64>),
    /// List of texts. An empty list of unknown type is written like this.
    StringArray(Vec<String>),
}

impl ParameterValue {
    /// The type, none when not set.
    #[must_use]
    pub const fn kind(&self) -> Option<ParameterKind> {
        Some(match self {
            Self::NotSet => return None,
            Self::Bool(_) => ParameterKind::Bool,
            Self::Integer(_) => ParameterKind::Integer,
            Self::Double(_) => ParameterKind::Double,
            Self::String(_) => ParameterKind::String,
            Self::BoolArray(_) => ParameterKind::BoolArray,
            Self::IntegerArray(_) => ParameterKind::IntegerArray,
            Self::DoubleArray(_) => ParameterKind::DoubleArray,
            Self::StringArray(_) => ParameterKind::StringArray,
        })
    }

    /// True for a list without entries, which has no type of its own and fits every list.
    #[must_use]
    pub fn is_empty_array(&self) -> bool {
        match self {
            Self::BoolArray(list) => list.is_empty(),
            Self::IntegerArray(list) => list.is_empty(),
            Self::DoubleArray(list) => list.is_empty(),
            Self::StringArray(list) => list.is_empty(),
            _ => false,
        }
    }

    /// True for the same value to the last bit: zeros of different signs are not.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Double(a), Self::Double(b)) => a.to_bits() == b.to_bits(),
            (Self::DoubleArray(a), Self::DoubleArray(b)) => {
                a.iter().map(|a| a.to_bits()).eq(b.iter().map(|b| b.to_bits()))
            }
            _ => self == other,
        }
    }

    /// The JSON form the parameter structs are read from. Numbers must be finite: JSON holds no others.
    pub(super) fn to_json(&self) -> Value {
        match self {
            Self::NotSet => Value::Null,
            Self::Bool(value) => (*value).into(),
            Self::Integer(value) => (*value).into(),
            Self::Double(value) => (*value).into(),
            Self::String(value) => value.as_str().into(),
            Self::BoolArray(list) => list.as_slice().into(),
            Self::IntegerArray(list) => list.as_slice().into(),
            Self::DoubleArray(list) => list.as_slice().into(),
            Self::StringArray(list) => list.as_slice().into(),
        }
    }

    /// The value of a parameter of this type from the JSON form of the parameter structs.
    pub(super) fn from_json(kind: ParameterKind, json: &Value) -> Option<Self> {
        fn list<T>(json: &Value, item: impl Fn(&Value) -> Option<T>) -> Option<Vec<T>> {
            json.as_array()?.iter().map(item).collect()
        }
        let text = |json: &Value| json.as_str().map(str::to_owned);
        if json.is_null() {
            return Some(Self::NotSet);
        }
        match kind {
            ParameterKind::Bool => json.as_bool().map(Self::Bool),
            ParameterKind::Integer => json.as_i64().map(Self::Integer),
            ParameterKind::Double => json.as_f64().map(Self::Double),
            ParameterKind::String => text(json).map(Self::String),
            ParameterKind::BoolArray => list(json, Value::as_bool).map(Self::BoolArray),
            ParameterKind::IntegerArray => list(json, Value::as_i64).map(Self::IntegerArray),
            ParameterKind::DoubleArray => list(json, Value::as_f64).map(Self::DoubleArray),
            ParameterKind::StringArray => list(json, text).map(Self::StringArray),
        }
    }
}

/// YAML of the value on one line: reads back as the same value and type, numbers in their shortest form.
impl fmt::Display for ParameterValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fn list<T>(
            f: &mut fmt::Formatter<'_>,
            items: &[T],
            show: impl Fn(&mut fmt::Formatter<'_>, &T) -> fmt::Result,
        ) -> fmt::Result {
            f.write_str("[")?;
            for (at, item) in items.iter().enumerate() {
                if at > 0 {
                    f.write_str(", ")?;
                }
                show(f, item)?;
            }
            f.write_str("]")
        }
        match self {
            Self::NotSet => f.write_str("(not set)"),
            Self::Bool(value) => write!(f, "{value}"),
            Self::Integer(value) => write!(f, "{value}"),
            Self::Double(value) => write_double(f, *value),
            Self::String(value) => write_text(f, value),
            Self::BoolArray(items) => list(f, items, |f, item| write!(f, "{item}")),
            Self::IntegerArray(items) => list(f, items, |f, item| write!(f, "{item}")),
            Self::DoubleArray(items) => list(f, items, |f, item| write_double(f, *item)),
            Self::StringArray(items) => list(f, items, |f, item| write_text(f, item)),
        }
    }
}

fn write_double(f: &mut fmt::Formatter<'_>, value: f64) -> fmt::Result {
    if value.is_nan() {
        f.write_str(".nan")
    } else if value.is_infinite() {
        f.write_str(if value > 0.0 { ".inf" } else { "-.inf" })
    } else {
        write!(f, "{value:?}")
    }
}

/// Plain where nothing else could be read from it, else quoted.
fn write_text(f: &mut fmt::Formatter<'_>, text: &str) -> fmt::Result {
    // A colon is plain text in YAML 1.2, but not inside a list for every reader that is in use.
    let plain = text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        && matches!(super::yaml::plain_scalar(text), ParameterValue::String(_));
    if plain {
        return f.write_str(text);
    }
    f.write_str("\"")?;
    for c in text.chars() {
        match c {
            '"' => f.write_str("\\\"")?,
            '\\' => f.write_str("\\\\")?,
            '\n' => f.write_str("\\n")?,
            c if c.is_control() => write!(f, "\\U{:08x}", u32::from(c))?,
            c => write!(f, "{c}")?,
        }
    }
    f.write_str("\"")
}
