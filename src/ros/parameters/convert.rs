//! Parameters between the settings and the wire.

use messages::rcl_interfaces::{self as wire, FloatingPointRange, IntegerRange, ParameterType};

use crate::settings::{Bound, ParameterDescriptor, ParameterKind, ParameterValue};

/// The value on the wire. A class of objects for which the base value holds has the value that takes it back to the
/// base: `.nan`, an empty list, or where there is no such value none at all.
pub(super) fn to_wire(descriptor: &ParameterDescriptor, value: &ParameterValue) -> wire::ParameterValue {
    let r#type = descriptor.kind.ros_type();
    let empty = || wire::ParameterValue { r#type, ..wire::ParameterValue::default() };
    match value.clone() {
        ParameterValue::NotSet if descriptor.kind == ParameterKind::Double => {
            wire::ParameterValue { double_value: f64::NAN, ..empty() }
        }
        ParameterValue::NotSet if descriptor.kind.is_array() => empty(),
        ParameterValue::NotSet => wire::ParameterValue::default(),
        ParameterValue::Bool(bool_value) => wire::ParameterValue { bool_value, ..empty() },
        ParameterValue::Integer(integer_value) => wire::ParameterValue { integer_value, ..empty() },
        ParameterValue::Double(double_value) => wire::ParameterValue { double_value, ..empty() },
        ParameterValue::String(string_value) => wire::ParameterValue { string_value, ..empty() },
        ParameterValue::BoolArray(bool_array_value) => wire::ParameterValue { bool_array_value, ..empty() },
        ParameterValue::IntegerArray(integer_array_value) => {
            wire::ParameterValue { integer_array_value, ..empty() }
        }
        ParameterValue::DoubleArray(double_array_value) => {
            wire::ParameterValue { double_array_value, ..empty() }
        }
        ParameterValue::StringArray(string_array_value) => {
            wire::ParameterValue { string_array_value, ..empty() }
        }
    }
}

/// The value in the settings, or why there is none.
pub(super) fn from_wire(name: &str, value: &wire::ParameterValue) -> Result<ParameterValue, String> {
    Ok(match value.r#type {
        ParameterType::NOT_SET => ParameterValue::NotSet,
        ParameterType::BOOL => ParameterValue::Bool(value.bool_value),
        ParameterType::INTEGER => ParameterValue::Integer(value.integer_value),
        ParameterType::DOUBLE => ParameterValue::Double(value.double_value),
        ParameterType::STRING => ParameterValue::String(value.string_value.clone()),
        ParameterType::BOOL_ARRAY => ParameterValue::BoolArray(value.bool_array_value.clone()),
        ParameterType::INTEGER_ARRAY => ParameterValue::IntegerArray(value.integer_array_value.clone()),
        ParameterType::DOUBLE_ARRAY => ParameterValue::DoubleArray(value.double_array_value.clone()),
        ParameterType::STRING_ARRAY => ParameterValue::StringArray(value.string_array_value.clone()),
        ParameterType::BYTE_ARRAY => {
            return Err(format!("`{name}`: no parameter of this node is a byte_array"));
        }
        unknown => return Err(format!("`{name}`: {unknown} is no type of a parameter")),
    })
}

/// The description on the wire. Ranges there include their ends, so an end that is excluded becomes the next number
/// inside; an open end becomes the largest number. Ranges say nothing about lists; the words do.
pub(super) fn describe(descriptor: &ParameterDescriptor) -> wire::ParameterDescriptor {
    let allowed = descriptor.allowed();
    let bounded = descriptor.minimum.is_some() || descriptor.maximum.is_some();
    wire::ParameterDescriptor {
        name: descriptor.name.clone(),
        r#type: descriptor.kind.ros_type(),
        description: descriptor.description.clone(),
        additional_constraints: if allowed == descriptor.kind.name() { String::new() } else { allowed },
        read_only: descriptor.read_only,
        dynamic_typing: false,
        floating_point_range: (bounded && descriptor.kind == ParameterKind::Double)
            .then(|| floating_point_range(descriptor.minimum, descriptor.maximum)),
        integer_range: (bounded && descriptor.kind == ParameterKind::Integer)
            .then(|| integer_range(descriptor.minimum, descriptor.maximum)),
    }
}

fn floating_point_range(minimum: Option<Bound>, maximum: Option<Bound>) -> FloatingPointRange {
    let above = |bound: Bound| if bound.inclusive { bound.value } else { bound.value.next_up() };
    let below = |bound: Bound| if bound.inclusive { bound.value } else { bound.value.next_down() };
    FloatingPointRange {
        from_value: minimum.map_or(f64::MIN, above),
        to_value: maximum.map_or(f64::MAX, below),
        step: 0.0,
    }
}

/// Bounds are small whole numbers; the cast saturates all the same.
#[expect(clippy::cast_possible_truncation, reason = "saturates")]
fn integer_range(minimum: Option<Bound>, maximum: Option<Bound>) -> IntegerRange {
    let above = |bound: Bound| {
        let smallest = bound.value.ceil() as i64;
        if bound.inclusive || (smallest as f64) > bound.value { smallest } else { smallest.saturating_add(1) }
    };
    let below = |bound: Bound| {
        let largest = bound.value.floor() as i64;
        if bound.inclusive || (largest as f64) < bound.value { largest } else { largest.saturating_sub(1) }
    };
    IntegerRange {
        from_value: minimum.map_or(i64::MIN, above),
        to_value: maximum.map_or(i64::MAX, below),
        step: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_of_ranges() {
        let bound = |value, inclusive| Some(Bound { value, inclusive });
        for (minimum, maximum, from, to) in [
            (bound(1.0, true), bound(9.0, true), 1, 9),
            (bound(1.0, false), bound(9.0, false), 2, 8),
            (bound(0.5, true), bound(2.5, true), 1, 2),
            (bound(0.5, false), bound(2.5, false), 1, 2),
            (None, bound(3.0, true), i64::MIN, 3),
            (bound(-3.0, true), None, -3, i64::MAX),
        ] {
            let range = integer_range(minimum, maximum);
            assert_eq!((range.from_value, range.to_value), (from, to), "{minimum:?} {maximum:?}");
        }
        for (minimum, maximum, from, to) in [
            (bound(1.0, true), bound(9.0, true), 1.0, 9.0),
            (bound(0.0, false), None, f64::from_bits(1), f64::MAX),
            (None, bound(1.0, false), f64::MIN, 1.0 - f64::EPSILON / 2.0),
        ] {
            let range = floating_point_range(minimum, maximum);
            assert_eq!((range.from_value, range.to_value, range.step), (from, to, 0.0));
        }
    }
}
