//! Attributes of an element: strings, with the typed readings that lanelet2 gives them.

use std::fmt;

use super::store::{AttributeRecord, Span, Store};

/// A key and its value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Attribute<'m> {
    /// The key.
    pub key: &'m str,
    /// The value.
    pub value: &'m str,
}

/// The attributes of one element, sorted by key bytes; keys are unique.
#[derive(Clone, Copy)]
pub struct Attributes<'m> {
    store: &'m Store,
    records: &'m [AttributeRecord],
}

impl<'m> Attributes<'m> {
    pub(crate) fn new(store: &'m Store, span: Span) -> Self {
        Self { store, records: &store.attributes[span.range()] }
    }

    /// Number of attributes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.records.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// All attributes in the order of keys.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Attribute<'m>> + Clone + use<'m> {
        let store = self.store;
        self.records
            .iter()
            .map(move |record| Attribute { key: store.str(record.key), value: store.str(record.value) })
    }

    /// The value of a key as text.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&'m str> {
        let record = self.records.iter().find(|record| self.store.str(record.key) == key)?;
        Some(self.store.str(record.value))
    }

    /// The value as a truth value: `1`, `true`, `yes` or `0`, `false`, `no`, nothing else.
    #[must_use]
    pub fn bool(&self, key: &str) -> Option<bool> {
        match self.get(key)? {
            "1" | "true" | "yes" => Some(true),
            "0" | "false" | "no" => Some(false),
            _ => None,
        }
    }

    /// The value as a finite number; the whole text must be the number.
    #[must_use]
    pub fn number(&self, key: &str) -> Option<f64> {
        self.get(key)?.parse().ok().filter(|number: &f64| number.is_finite())
    }

    /// The value as an id: the integer at its beginning, as in `12` or `12 (main road)`.
    #[must_use]
    pub fn id(&self, key: &str) -> Option<i64> {
        let text = self.get(key)?.trim_start();
        let sign = usize::from(text.starts_with(['-', '+']));
        let digits = text[sign..].bytes().take_while(u8::is_ascii_digit).count();
        text[..sign + digits].parse().ok()
    }

    /// The value as a speed in m/s. A bare number is km/h; the units m/s, mps, km/h, kmh and mph are known.
    #[must_use]
    pub fn speed_mps(&self, key: &str) -> Option<f64> {
        let text = self.get(key)?.trim();
        let unit_at = text.find(|c: char| c.is_ascii_alphabetic() && c != 'e' && c != 'E');
        let (number, unit) = text.split_at(unit_at.unwrap_or(text.len()));
        let per_unit = match unit {
            "" | "km/h" | "kmh" => 1.0 / 3.6,
            "m/s" | "mps" => 1.0,
            "mph" => 0.44704,
            _ => return None,
        };
        let number: f64 = number.trim_end().parse().ok()?;
        number.is_finite().then_some(number * per_unit)
    }
}

impl fmt::Debug for Attributes<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_map().entries(self.iter().map(|attribute| (attribute.key, attribute.value))).finish()
    }
}

#[cfg(test)]
mod tests {
    use crate::{Map, MapBuilder};

    fn map_with(value: &str) -> Map {
        let mut builder = MapBuilder::new();
        builder.point(1, [0.0; 3], &[("key", value)]).unwrap();
        builder.build().unwrap()
    }

    fn read<T>(value: &str, reading: impl Fn(super::Attributes<'_>) -> Option<T>) -> Option<T> {
        reading(map_with(value).point(1).unwrap().attributes())
    }

    #[test]
    fn truth_values_are_the_six_words() {
        for (text, expected) in [
            ("1", Some(true)),
            ("true", Some(true)),
            ("yes", Some(true)),
            ("0", Some(false)),
            ("false", Some(false)),
            ("no", Some(false)),
            ("True", None),
            ("", None),
            ("2", None),
        ] {
            assert_eq!(read(text, |a| a.bool("key")), expected, "{text:?}");
        }
    }

    #[test]
    fn numbers_are_whole_and_finite() {
        for (text, expected) in [
            ("1.5", Some(1.5)),
            ("-2e3", Some(-2000.0)),
            ("1.5m", None),
            ("", None),
            ("inf", None),
            ("nan", None),
        ] {
            assert_eq!(read(text, |a| a.number("key")), expected, "{text:?}");
        }
    }

    #[test]
    fn ids_are_leading_integers() {
        for (text, expected) in [
            ("12", Some(12)),
            ("-7", Some(-7)),
            (" 12 x", Some(12)),
            ("9007199254740993", Some(9_007_199_254_740_993)),
            ("x", None),
            ("", None),
            ("-", None),
            ("99999999999999999999", None),
        ] {
            assert_eq!(read(text, |a| a.id("key")), expected, "{text:?}");
        }
    }

    #[test]
    fn speeds_know_their_units() {
        for (text, expected) in [
            ("36", Some(10.0)),
            ("36 km/h", Some(10.0)),
            ("36kmh", Some(10.0)),
            ("10 m/s", Some(10.0)),
            ("10mps", Some(10.0)),
            ("100 mph", Some(44.704)),
            ("fast", None),
            ("10 knots", None),
            ("", None),
        ] {
            let found = read(text, |a| a.speed_mps("key"));
            match (found, expected) {
                (Some(found), Some(expected)) => {
                    assert!((found - expected).abs() < 1e-9, "{text:?}: {found}");
                }
                _ => assert_eq!(found, expected, "{text:?}"),
            }
        }
    }
}
