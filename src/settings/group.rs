//! Parameters as the parameter structs are read from them: names with dots are nested maps, though no map is built.
//!
//! Relies on the order of the table, where all of a group stands together. Were it not so, a struct would be told of a
//! field twice and refuse.

use serde::de::value::BorrowedStrDeserializer;
use serde::de::{DeserializeSeed, Deserializer, MapAccess, Visitor};
use serde::forward_to_deserialize_any;
use serde_json::{Error, Value};

use super::table::{Component, ParameterDescriptor, parameter_table};
use super::value::ParameterValue;

/// Some parameters that stand together in the table, and their values.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group<'a> {
    pub(super) descriptors: &'a [ParameterDescriptor],
    pub(super) values: &'a [ParameterValue],
    /// Length of what all names begin with, in bytes.
    pub(super) prefix: usize,
}

impl<'a> Group<'a> {
    /// All parameters of a component, of values in the order of the table.
    pub(super) fn of(component: Component, values: &'a [ParameterValue]) -> Self {
        let table = parameter_table();
        let is_ours = |descriptor: &ParameterDescriptor| descriptor.component == component;
        let first = table.iter().position(is_ours).unwrap_or(table.len());
        let end = first + table[first..].iter().take_while(|descriptor| is_ours(descriptor)).count();
        Self { descriptors: &table[first..end], values: &values[first..end], prefix: 0 }
    }

    /// True where every value is the default.
    pub(super) fn is_as_shipped(&self) -> bool {
        self.descriptors.iter().zip(self.values).all(|(descriptor, value)| descriptor.default.is_same(value))
    }

    /// The first part of what the first name has behind the prefix.
    fn first_key(&self) -> Option<&'a str> {
        let name = self.descriptors.first()?.name.get(self.prefix..)?;
        Some(name.split_once('.').map_or(name, |(key, _)| key))
    }

    /// What follows on a key that is a parameter or a group: its members and the rest.
    fn split(self, key: &str) -> (Self, Self) {
        let is_member = |descriptor: &ParameterDescriptor| {
            let rest = descriptor.name.get(self.prefix..).and_then(|name| name.strip_prefix(key));
            rest.is_some_and(|rest| rest.starts_with('.'))
        };
        let is_group = self.descriptors.first().is_some_and(is_member);
        let members = if is_group { self.descriptors.partition_point(is_member) } else { 0 };
        let part = |from: usize, to: usize, prefix: usize| Self {
            descriptors: &self.descriptors[from..to],
            values: &self.values[from..to],
            prefix,
        };
        let end = members.max(1);
        (part(0, members, self.prefix + key.len() + 1), part(end, self.values.len(), self.prefix))
    }
}

impl<'de> Deserializer<'de> for Group<'de> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_map(Members { rest: self, value: None })
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
    }
}

/// What a group still has to tell.
struct Members<'a> {
    rest: Group<'a>,
    /// Of the key that was told.
    value: Option<Member<'a>>,
}

enum Member<'a> {
    Parameter(&'a ParameterValue),
    Group(Group<'a>),
}

impl<'a> MapAccess<'a> for Members<'a> {
    type Error = Error;

    fn next_key_seed<K: DeserializeSeed<'a>>(&mut self, seed: K) -> Result<Option<K::Value>, Error> {
        let (Some(key), Some(value)) = (self.rest.first_key(), self.rest.values.first()) else {
            return Ok(None);
        };
        let (members, rest) = self.rest.split(key);
        let is_parameter = members.values.is_empty();
        self.value = Some(if is_parameter { Member::Parameter(value) } else { Member::Group(members) });
        self.rest = rest;
        seed.deserialize(BorrowedStrDeserializer::new(key)).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'a>>(&mut self, seed: V) -> Result<V::Value, Error> {
        match self.value.take() {
            Some(Member::Group(group)) => seed.deserialize(group),
            Some(Member::Parameter(value)) => seed.deserialize(value.to_json()),
            None => seed.deserialize(Value::Null),
        }
    }
}

#[cfg(test)]
mod tests {
    use selection::parameters::{ConcatenatorParameters, RankerParameters, ValidatorParameters};
    use serde::Deserialize as _;
    use serde::de::DeserializeOwned;

    use super::*;
    use crate::settings::draft::default_values;
    use crate::settings::{
        NodeParameters, OpenSpaceSettings, SelectorParameters, Settings, VehicleInfoParameters,
    };

    /// The map that a group stands for, built the long way.
    fn nested(group: Group<'_>) -> Value {
        let mut root = Value::Object(serde_json::Map::new());
        for (descriptor, value) in group.descriptors.iter().zip(group.values) {
            let place = descriptor.name.split('.').fold(&mut root, |place, key| &mut place[key]);
            *place = value.to_json();
        }
        root
    }

    #[test]
    fn a_group_reads_as_the_nested_map() {
        let values = default_values();
        let group = Group { descriptors: parameter_table(), values: &values, prefix: 0 };
        let read = Value::deserialize(group).unwrap();
        assert_eq!(read, nested(group));
        assert!(read["collision_check"]["drac"]["ego_footprint_margin"]["lateral"]["pedestrian"].is_number());
    }

    /// Components of which nothing was said are not read at all, so this is what makes them right.
    #[test]
    fn what_is_as_shipped_reads_as_the_defaults() {
        fn read<T: DeserializeOwned>(component: Component, values: &[ParameterValue]) -> T {
            let group = Group::of(component, values);
            assert!(group.is_as_shipped() && !group.values.is_empty(), "{component:?}");
            T::deserialize(group).unwrap()
        }
        let (values, settings) = (default_values(), Settings::default());
        assert_eq!(read::<NodeParameters>(Component::Node, &values), settings.node);
        assert_eq!(read::<SelectorParameters>(Component::Selector, &values), settings.selector);
        assert_eq!(read::<ConcatenatorParameters>(Component::Concatenator, &values), settings.concatenator);
        assert_eq!(read::<ValidatorParameters>(Component::Validator, &values), settings.validator);
        assert_eq!(read::<RankerParameters>(Component::Ranker, &values), settings.ranker);
        assert_eq!(read::<OpenSpaceSettings>(Component::OpenSpace, &values).open_space, settings.open_space);
        assert_eq!(read::<VehicleInfoParameters>(Component::VehicleInfo, &values), settings.vehicle);
    }

    #[test]
    fn a_zero_with_a_sign_is_not_as_shipped() {
        let mut values = default_values();
        let is_zero = |value: &ParameterValue| matches!(value, ParameterValue::Double(0.0));
        let index = values.iter().position(is_zero).unwrap();
        values[index] = ParameterValue::Double(-0.0);
        assert!(!Group::of(parameter_table()[index].component, &values).is_as_shipped());
    }

    #[test]
    fn no_parameters_are_an_empty_map() {
        let nothing = Group { descriptors: &[], values: &[], prefix: 0 };
        assert_eq!(Value::deserialize(nothing).unwrap(), serde_json::json!({}));
    }
}
