//! What filters derive from a map alone: borders, road, intersections.
//!
//! For the map of a city that takes longer than several cycles last, so it is made where maps are decoded
//! ([`prepare_map`](crate::filters::prepare_map)) and travels with the map. A filter that finds nothing prepared, or something
//! prepared for other parameters, makes its own in the cycle that needs it: later, not otherwise.

use crate::filters::boundary_departure::Borders;
use crate::filters::collision_check::PriorityMap;
use crate::filters::out_of_lane::Road;
use std::sync::{Arc, OnceLock};

/// The tables of one map. Each is made once, by whoever asks first, for the parameters of then.
#[derive(Debug, Default)]
pub(crate) struct Survey {
    /// Borders of the configured types; `None` inside if one lies beyond the range of coordinates.
    pub(crate) borders: Table<Option<Arc<Borders>>>,
    /// Lanelets of the configured subtypes; `None` inside if there are none.
    pub(crate) road: Table<Option<Arc<Road>>>,
    /// Intersections and crossings; no parameters.
    pub(crate) priority: OnceLock<Arc<PriorityMap>>,
}

/// A table with the names of the map elements that it was made of.
#[derive(Debug)]
pub(crate) struct Table<T>(OnceLock<(Vec<String>, T)>);

impl<T> Default for Table<T> {
    fn default() -> Self {
        Self(OnceLock::new())
    }
}

impl<T: Clone> Table<T> {
    /// The table of these elements, made now if it is not there.
    pub(crate) fn of(&self, elements: &[String], make: impl Fn() -> T) -> T {
        let (made_of, table) = self.0.get_or_init(|| (elements.to_vec(), make()));
        if made_of == elements { table.clone() } else { make() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn a_table_is_made_once_and_never_given_for_other_elements() {
        let (table, made) = (Table::default(), Cell::new(0));
        let ask = |elements: &[&str]| {
            let elements: Vec<String> = elements.iter().map(|&element| element.to_owned()).collect();
            table.of(&elements, || {
                made.set(made.get() + 1);
                elements.join("+")
            })
        };
        assert_eq!((ask(&["curb"]), ask(&["curb"]), made.get()), ("curb".to_owned(), "curb".to_owned(), 1));
        assert_eq!((ask(&["wall"]), made.get()), ("wall".to_owned(), 2));
        assert_eq!((ask(&["curb"]), made.get()), ("curb".to_owned(), 2));
    }
}
