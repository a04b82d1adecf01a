//! Values that may differ by the class of the object.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

macro_rules! object_classes {
    ($(#[doc = $doc:literal] $variant:ident $name:ident;)*) => {
        /// Class of a perceived object, named as in parameter files.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum ObjectClass {
            $(#[doc = $doc] $variant,)*
        }

        impl ObjectClass {
            /// All classes, in the order of parameter files.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// Name in parameter files.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => stringify!($name),)*
                }
            }
        }

        /// One value for all classes of objects, and another one for those classes that have their own.
        ///
        /// In parameter files a group `name: {base: .., pedestrian: ..}`, or just `name: ..` for the base. A class
        /// is given the base value again by `.nan` (numbers) or `[]` (lists).
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        #[schemars(extend("x-per-class" = true))]
        pub struct PerClass<T> {
            /// Value of every class without its own.
            pub base: T,
            $(#[doc = $doc] pub $name: Option<T>,)*
        }

        impl<T> PerClass<T> {
            /// The same value for every class.
            #[must_use]
            pub fn all(base: T) -> Self {
                Self { base, $($name: None,)* }
            }

            /// This, with an own value for one class.
            #[must_use]
            pub fn with(mut self, class: ObjectClass, value: T) -> Self {
                match class {
                    $(ObjectClass::$variant => self.$name = Some(value),)*
                }
                self
            }

            /// The value that holds for a class.
            #[must_use]
            pub fn get(&self, class: ObjectClass) -> &T {
                match class {
                    $(ObjectClass::$variant => self.$name.as_ref().unwrap_or(&self.base),)*
                }
            }

            /// The value that was given for a class itself, if any.
            #[must_use]
            pub fn own(&self, class: ObjectClass) -> Option<&T> {
                match class {
                    $(ObjectClass::$variant => self.$name.as_ref(),)*
                }
            }
        }
    };
}

object_classes! {
    /// Value of cars.
    Car car;
    /// Value of trucks.
    Truck truck;
    /// Value of buses.
    Bus bus;
    /// Value of trailers.
    Trailer trailer;
    /// Value of motorcycles.
    Motorcycle motorcycle;
    /// Value of bicycles.
    Bicycle bicycle;
    /// Value of pedestrians.
    Pedestrian pedestrian;
    /// Value of objects of unknown class.
    Unknown unknown;
    /// Value of animals.
    Animal animal;
    /// Value of hazards.
    Hazard hazard;
    /// Value of objects that can be driven over.
    OverDrivable over_drivable;
    /// Value of objects that can be driven under.
    UnderDrivable under_drivable;
}

impl<T> PerClass<T> {
    /// Every value with the name it has in parameter files, base first.
    pub(super) fn named(&self) -> impl Iterator<Item = (&'static str, &T)> {
        std::iter::once(("base", &self.base)).chain(
            ObjectClass::ALL.iter().filter_map(|class| self.own(*class).map(|value| (class.name(), value))),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_class_without_its_own_value_has_the_base() {
        let values = PerClass::all(1.0).with(ObjectClass::Bicycle, 2.0);
        for class in ObjectClass::ALL {
            let expected = if *class == ObjectClass::Bicycle { 2.0 } else { 1.0 };
            assert_eq!(*values.get(*class), expected, "{class:?}");
        }
        assert_eq!(values.named().collect::<Vec<_>>(), [("base", &1.0), ("bicycle", &2.0)]);
    }

    #[test]
    fn names_are_those_of_serialisation() {
        for class in ObjectClass::ALL {
            assert_eq!(serde_json::to_value(class).unwrap(), class.name());
        }
    }
}
