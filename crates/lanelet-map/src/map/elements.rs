//! Views of the map's elements: `Copy`, borrowed from the map, oriented the way they are read.

use std::fmt;

use super::attributes::Attributes;
use super::store::{Handle, ParameterKind, RoleRecord, Span, Store};

/// The parts that all views have.
macro_rules! view {
    ($(#[$doc:meta])* $view:ident, $arena:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy)]
        pub struct $view<'m> {
            store: &'m Store,
            handle: Handle,
        }

        impl<'m> $view<'m> {
            pub(crate) fn new(store: &'m Store, handle: Handle) -> Self {
                Self { store, handle }
            }

            /// The id, unique inside the layer.
            #[must_use]
            pub fn id(&self) -> i64 {
                self.store.$arena[self.handle.index()].id
            }

            /// All attributes.
            #[must_use]
            pub fn attributes(&self) -> Attributes<'m> {
                Attributes::new(self.store, self.store.$arena[self.handle.index()].attributes)
            }

            /// The value of one attribute.
            #[must_use]
            pub fn attribute(&self, key: &str) -> Option<&'m str> {
                self.attributes().get(key)
            }
        }

        impl fmt::Debug for $view<'_> {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.debug_struct(stringify!($view))
                    .field("id", &self.id())
                    .field("inverted", &self.handle.is_inverted())
                    .field("attributes", &self.attributes())
                    .finish_non_exhaustive()
            }
        }
    };
}

view!(
    /// A point.
    Point, points
);
view!(
    /// A line string or polygon, read in one of its two directions.
    Polyline, lines
);
view!(
    /// An area: outer rings of line strings, and holes.
    Area, areas
);
view!(
    /// A lanelet: the strip between a left and a right bound, in driving direction.
    Lanelet, lanelets
);
view!(
    /// A traffic rule and the elements that play a role in it.
    RegulatoryElement, rules
);

impl Point<'_> {
    /// x, y, z in metres of the map frame; always finite.
    #[must_use]
    pub fn position(&self) -> [f64; 3] {
        self.store.points[self.handle.index()].position
    }
}

impl<'m> Polyline<'m> {
    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.store.lines[self.handle.index()].points.len as usize
    }

    /// Whether there are no points, as in the dummy borders of broken maps.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether the points are read backwards.
    #[must_use]
    pub fn is_inverted(&self) -> bool {
        self.handle.is_inverted()
    }

    /// The same points in the other direction.
    #[must_use]
    pub fn inverted(&self) -> Self {
        Self { store: self.store, handle: self.handle.flipped() }
    }

    /// The `at`-th point in reading order.
    #[must_use]
    pub fn point(&self, at: usize) -> Option<Point<'m>> {
        let indices = self.indices();
        let at = if self.is_inverted() { indices.len().checked_sub(at + 1)? } else { at };
        indices.get(at).map(|index| Point::new(self.store, Handle::new(*index, false)))
    }

    /// The points in reading order.
    pub fn points(&self) -> impl ExactSizeIterator<Item = Point<'m>> + DoubleEndedIterator + Clone + use<'m> {
        let line = *self;
        (0..self.len()).map(move |at| {
            let indices = line.indices();
            let at = if line.is_inverted() { indices.len() - 1 - at } else { at };
            Point::new(line.store, Handle::new(indices[at], false))
        })
    }

    /// x, y, z of the points in reading order.
    pub fn positions(
        &self,
    ) -> impl ExactSizeIterator<Item = [f64; 3]> + DoubleEndedIterator + Clone + use<'m> {
        self.points().map(|point| point.position())
    }

    fn indices(&self) -> &'m [u32] {
        &self.store.line_points[self.store.lines[self.handle.index()].points.range()]
    }
}

impl<'m> Lanelet<'m> {
    /// Whether the lanelet is read against its stored direction; the bounds below follow.
    #[must_use]
    pub fn is_inverted(&self) -> bool {
        self.handle.is_inverted()
    }

    /// The left bound in driving direction.
    #[must_use]
    pub fn left(&self) -> Polyline<'m> {
        let lanelet = self.store.lanelets[self.handle.index()];
        Polyline::new(self.store, if self.is_inverted() { lanelet.right.flipped() } else { lanelet.left })
    }

    /// The right bound in driving direction.
    #[must_use]
    pub fn right(&self) -> Polyline<'m> {
        let lanelet = self.store.lanelets[self.handle.index()];
        Polyline::new(self.store, if self.is_inverted() { lanelet.left.flipped() } else { lanelet.right })
    }

    /// The centerline that is stored with the lanelet, in driving direction.
    #[must_use]
    pub fn centerline(&self) -> Option<Polyline<'m>> {
        let stored = self.store.lanelets[self.handle.index()].centerline;
        let handle = if self.is_inverted() { stored.flipped() } else { stored };
        (stored != Handle::NONE).then(|| Polyline::new(self.store, handle))
    }

    /// The closed outline: left bound forwards, right bound backwards; clockwise for a lanelet that does not
    /// cross itself.
    pub fn outline(&self) -> impl DoubleEndedIterator<Item = [f64; 3]> + Clone + use<'m> {
        self.left().positions().chain(self.right().inverted().positions())
    }

    /// The value of `subtype`, such as `road` or `crosswalk`.
    #[must_use]
    pub fn subtype(&self) -> Option<&'m str> {
        self.attribute("subtype")
    }

    /// The traffic rules of the lanelet, in stored order.
    pub fn regulatory_elements(
        &self,
    ) -> impl ExactSizeIterator<Item = RegulatoryElement<'m>> + Clone + use<'m> {
        rules(self.store, self.store.lanelets[self.handle.index()].rules)
    }
}

impl<'m> Area<'m> {
    /// The line strings of the outer ring, in order.
    pub fn outer(&self) -> impl ExactSizeIterator<Item = Polyline<'m>> + Clone + use<'m> {
        ring(self.store, self.store.areas[self.handle.index()].outer)
    }

    /// The holes, each as its line strings in order.
    pub fn inner(
        &self,
    ) -> impl ExactSizeIterator<Item = impl ExactSizeIterator<Item = Polyline<'m>> + Clone + use<'m>> + use<'m>
    {
        let store = self.store;
        let area = store.areas[self.handle.index()];
        store.rings[area.inner.range()].iter().map(move |span| ring(store, *span))
    }

    /// The traffic rules of the area, in stored order.
    pub fn regulatory_elements(
        &self,
    ) -> impl ExactSizeIterator<Item = RegulatoryElement<'m>> + Clone + use<'m> {
        rules(self.store, self.store.areas[self.handle.index()].rules)
    }
}

/// An element that plays a role in a traffic rule.
#[derive(Debug, Clone, Copy)]
pub enum Parameter<'m> {
    /// A point.
    Point(Point<'m>),
    /// A line string.
    LineString(Polyline<'m>),
    /// A polygon.
    Polygon(Polyline<'m>),
    /// A lanelet.
    Lanelet(Lanelet<'m>),
    /// An area.
    Area(Area<'m>),
}

/// A role of a traffic rule and the elements that play it.
#[derive(Debug, Clone, Copy)]
pub struct Role<'m> {
    store: &'m Store,
    record: RoleRecord,
}

impl<'m> Role<'m> {
    /// The name, such as `refers` or `ref_line`; free text, may be empty.
    #[must_use]
    pub fn name(&self) -> &'m str {
        self.store.str(self.record.name)
    }

    /// The elements, in stored order.
    pub fn parameters(&self) -> impl ExactSizeIterator<Item = Parameter<'m>> + Clone + use<'m> {
        parameters(self.store, self.record.parameters)
    }
}

impl<'m> RegulatoryElement<'m> {
    /// The value of `subtype`, such as `traffic_light`; empty if there is none.
    #[must_use]
    pub fn subtype(&self) -> &'m str {
        self.attribute("subtype").unwrap_or("")
    }

    /// All roles, in the order of names.
    pub fn roles(&self) -> impl ExactSizeIterator<Item = Role<'m>> + Clone + use<'m> {
        let store = self.store;
        let roles = store.rules[self.handle.index()].roles;
        store.roles[roles.range()].iter().map(move |record| Role { store, record: *record })
    }

    /// The elements in one role, in stored order; none if the rule has no such role.
    pub fn role(&self, name: &str) -> impl ExactSizeIterator<Item = Parameter<'m>> + Clone + use<'m> {
        let span = self.roles().find(|role| role.name() == name).map(|role| role.record.parameters);
        parameters(self.store, span.unwrap_or_default())
    }

    /// The line strings in one role, in stored order; elements of other kinds are passed over.
    pub fn line_strings(&self, role: &str) -> impl Iterator<Item = Polyline<'m>> + Clone + use<'m> {
        self.role(role).filter_map(|parameter| match parameter {
            Parameter::LineString(line) => Some(line),
            _ => None,
        })
    }

    /// The polygons in one role, in stored order; elements of other kinds are passed over.
    pub fn polygons(&self, role: &str) -> impl Iterator<Item = Polyline<'m>> + Clone + use<'m> {
        self.role(role).filter_map(|parameter| match parameter {
            Parameter::Polygon(polygon) => Some(polygon),
            _ => None,
        })
    }

    /// The lanelets in one role, in stored order; elements of other kinds are passed over.
    pub fn lanelets(&self, role: &str) -> impl Iterator<Item = Lanelet<'m>> + Clone + use<'m> {
        self.role(role).filter_map(|parameter| match parameter {
            Parameter::Lanelet(lanelet) => Some(lanelet),
            _ => None,
        })
    }
}

fn rules(store: &Store, span: Span) -> impl ExactSizeIterator<Item = RegulatoryElement<'_>> + Clone {
    store.members[span.range()].iter().map(|index| RegulatoryElement::new(store, Handle::new(*index, false)))
}

fn ring(store: &Store, span: Span) -> impl ExactSizeIterator<Item = Polyline<'_>> + Clone {
    store.ring_lines[span.range()].iter().map(|handle| Polyline::new(store, *handle))
}

fn parameters(store: &Store, span: Span) -> impl ExactSizeIterator<Item = Parameter<'_>> + Clone {
    store.parameters[span.range()].iter().map(|parameter| {
        let handle = parameter.handle();
        match parameter.kind() {
            ParameterKind::Point => Parameter::Point(Point::new(store, handle)),
            ParameterKind::LineString => Parameter::LineString(Polyline::new(store, handle)),
            ParameterKind::Polygon => Parameter::Polygon(Polyline::new(store, handle)),
            ParameterKind::Lanelet => Parameter::Lanelet(Lanelet::new(store, handle)),
            ParameterKind::Area => Parameter::Area(Area::new(store, handle)),
        }
    })
}

#[cfg(test)]
mod tests {
    use crate::error::Layer;
    use crate::map::store::Handle;
    use crate::{Map, MapBuilder, archive};

    /// One lanelet with a centerline, in the layer against its stored direction.
    fn inverted_lanelet() -> Map {
        let mut b = MapBuilder::new();
        for (id, y) in (1..).zip([2.0, 1.0, 0.0]) {
            b.point(id, [0.0, y, 0.0], &[]).unwrap();
            b.point(id + 10, [5.0, y, 0.0], &[]).unwrap();
            b.line_string(id, &[id, id + 10], &[]).unwrap();
        }
        b.lanelet(9, 1, 3, &[]).unwrap();
        b.centerline(9, 2).unwrap();
        let mut store = b.build().unwrap().into_store();
        store.layer_mut(Layer::Lanelets)[0].handle = Handle::new(0, true);
        Map::from_store(store)
    }

    #[test]
    fn an_inverted_lanelet_swaps_and_turns_its_bounds() {
        let made = inverted_lanelet();
        let decoded = archive::decode(&archive::encode(&made)).unwrap();
        for map in [&made, &decoded] {
            let lanelet = map.lanelet(9).unwrap();
            assert!(lanelet.is_inverted());
            let ids = |line: super::Polyline<'_>| line.points().map(|p| p.id()).collect::<Vec<_>>();
            assert_eq!((lanelet.left().id(), ids(lanelet.left())), (3, vec![13, 3]));
            assert_eq!((lanelet.right().id(), ids(lanelet.right())), (1, vec![11, 1]));
            assert_eq!(ids(lanelet.centerline().unwrap()), [12, 2]);
            let outline: Vec<[f64; 3]> = lanelet.outline().collect();
            assert_eq!(outline, [[5.0, 0.0, 0.0], [0.0; 3], [0.0, 2.0, 0.0], [5.0, 2.0, 0.0]]);
        }
    }

    #[test]
    fn points_are_counted_in_reading_order() {
        let map = inverted_lanelet();
        let line = map.lanelet(9).unwrap().left();
        assert_eq!(line.point(0).map(|p| p.id()), Some(13));
        assert_eq!(line.point(1).map(|p| p.id()), Some(3));
        assert!(line.point(2).is_none());
        assert_eq!(line.inverted().point(0).map(|p| p.id()), Some(3));
        assert!(line.inverted().point(2).is_none());
    }
}
