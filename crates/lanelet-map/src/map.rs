//! The decoded map: six layers of elements, found by id or walked in the order of ids.
//!
//! Owns the [`Map`] and its views, the builder and the loading of files. Elements that only others name (the
//! centerlines Autoware's loader makes, dummies of broken maps) are reached through those others, never
//! through a layer.

pub(crate) mod attributes;
pub(crate) mod builder;
pub(crate) mod elements;
pub(crate) mod load;
pub(crate) mod store;

use std::fmt;

use self::elements::{Area, Lanelet, Point, Polyline, RegulatoryElement};
use self::store::Store;
use crate::error::Layer;

/// An HD map in metres of the map frame. Immutable; share it as `Arc<Map>`.
///
/// Two maps are equal when their archives are, that is when everything that can be reached from their
/// layers is equal, to the last bit of the coordinates.
pub struct Map {
    store: Store,
}

impl Map {
    pub(crate) fn from_store(store: Store) -> Self {
        Self { store }
    }

    pub(crate) fn store(&self) -> &Store {
        &self.store
    }

    #[cfg(test)]
    pub(crate) fn into_store(self) -> Store {
        self.store
    }

    /// The writer's next free id; larger than every id the writer handed out itself.
    #[must_use]
    pub fn id_counter(&self) -> i64 {
        self.store.id_counter
    }
}

/// Access to one layer by id and as a whole.
macro_rules! layer_access {
    ($(#[$one_doc:meta])* $one:ident, $(#[$all_doc:meta])* $all:ident, $view:ident, $layer:ident) => {
        impl Map {
            $(#[$one_doc])*
            #[must_use]
            pub fn $one(&self, id: i64) -> Option<$view<'_>> {
                self.store.find(Layer::$layer, id).map(|handle| $view::new(&self.store, handle))
            }

            $(#[$all_doc])*
            pub fn $all(&self) -> impl ExactSizeIterator<Item = $view<'_>> + DoubleEndedIterator + Clone {
                self.store.layer(Layer::$layer).iter().map(|entry| $view::new(&self.store, entry.handle))
            }
        }
    };
}

layer_access!(
    /// The point with this id.
    point,
    /// All points, in the order of ids.
    points, Point, Points
);
layer_access!(
    /// The line string with this id.
    line_string,
    /// All line strings, in the order of ids.
    line_strings, Polyline, LineStrings
);
layer_access!(
    /// The polygon with this id; its last point is joined to its first.
    polygon,
    /// All polygons, in the order of ids.
    polygons, Polyline, Polygons
);
layer_access!(
    /// The area with this id.
    area,
    /// All areas, in the order of ids.
    areas, Area, Areas
);
layer_access!(
    /// The lanelet with this id.
    lanelet,
    /// All lanelets, in the order of ids.
    lanelets, Lanelet, Lanelets
);
layer_access!(
    /// The regulatory element with this id.
    regulatory_element,
    /// All regulatory elements, in the order of ids.
    regulatory_elements, RegulatoryElement, RegulatoryElements
);

impl fmt::Debug for Map {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Map")
            .field("points", &self.points().len())
            .field("line_strings", &self.line_strings().len())
            .field("polygons", &self.polygons().len())
            .field("areas", &self.areas().len())
            .field("lanelets", &self.lanelets().len())
            .field("regulatory_elements", &self.regulatory_elements().len())
            .finish_non_exhaustive()
    }
}

impl PartialEq for Map {
    fn eq(&self, other: &Self) -> bool {
        crate::archive::encode(self) == crate::archive::encode(other)
    }
}

#[cfg(test)]
mod tests {
    use super::Map;

    #[test]
    fn a_map_can_be_shared_between_threads() {
        fn check<T: Send + Sync>() {}
        check::<Map>();
    }
}
