//! Making maps in code: for demonstrations, generated scenes and tests.
//!
//! Elements are added bottom up (points, lines, lanelets and areas, rules) under ids of the caller's choice;
//! a name of something that was not added yet is an error at once. Rules are attached afterwards, since rules and
//! lanelets name each other.

use std::collections::HashMap;

use super::Map;
use super::store::{
    AreaRecord, Entry, Handle, LAYERS, LaneletRecord, LineRecord, Parameter, ParameterKind, PointRecord,
    RoleRecord, RuleRecord, Span, Store,
};
use crate::error::{Layer, MapError};

/// First id that [`MapBuilder::next_id`] hands out, as lanelet2 does.
const FIRST_FREE_ID: i64 = 1000;

/// Builds a [`Map`].
#[derive(Debug, Default)]
pub struct MapBuilder {
    store: Store,
    handles: [HashMap<i64, Handle>; 6],
    lanelet_rules: Vec<Vec<u32>>,
    area_rules: Vec<Vec<u32>>,
    largest_id: i64,
}

/// An element in a role of a regulatory element, by id.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Member {
    /// A point.
    Point(i64),
    /// A line string.
    LineString(i64),
    /// A polygon.
    Polygon(i64),
    /// A lanelet.
    Lanelet(i64),
    /// An area.
    Area(i64),
}

/// A line string and the direction in which it is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bound {
    /// Id of the line string.
    pub line_string: i64,
    /// Whether it is read backwards.
    pub inverted: bool,
}

impl From<i64> for Bound {
    fn from(line_string: i64) -> Self {
        Self { line_string, inverted: false }
    }
}

impl Bound {
    /// The line string read backwards.
    #[must_use]
    pub fn inverted(line_string: i64) -> Self {
        Self { line_string, inverted: true }
    }
}

impl MapBuilder {
    /// An empty map.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// An id that is larger than all ids used so far, and at least 1000.
    #[must_use]
    pub fn next_id(&self) -> i64 {
        self.largest_id.saturating_add(1).max(FIRST_FREE_ID)
    }

    /// Adds a point at x, y, z in metres.
    ///
    /// # Errors
    /// [`MapError::DuplicateId`]. Coordinates are checked by [`Self::build`].
    pub fn point(
        &mut self,
        id: i64,
        position: [f64; 3],
        attributes: &[(&str, &str)],
    ) -> Result<(), MapError> {
        let handle = Handle::new(self.store.points.len() as u32, false);
        self.register(Layer::Points, id, handle)?;
        let attributes = self.attributes(attributes);
        self.store.points.push(PointRecord { id, position, attributes });
        Ok(())
    }

    /// Adds a line string through points.
    ///
    /// # Errors
    /// [`MapError::DuplicateId`], [`MapError::UnknownId`].
    pub fn line_string(
        &mut self,
        id: i64,
        points: &[i64],
        attributes: &[(&str, &str)],
    ) -> Result<(), MapError> {
        self.line(Layer::LineStrings, id, points, attributes)
    }

    /// Adds a line string through new points at these places, in metres. The points get ids from [`Self::next_id`].
    ///
    /// # Errors
    /// [`MapError::DuplicateId`]. Coordinates are checked by [`Self::build`].
    pub fn line_string_at(
        &mut self,
        id: i64,
        places: &[[f64; 3]],
        attributes: &[(&str, &str)],
    ) -> Result<(), MapError> {
        let mut points = Vec::with_capacity(places.len());
        for place in places {
            let point = self.next_id();
            self.point(point, *place, &[])?;
            points.push(point);
        }
        self.line_string(id, &points, attributes)
    }

    /// Adds a polygon; its last point is joined to its first.
    ///
    /// # Errors
    /// [`MapError::DuplicateId`], [`MapError::UnknownId`].
    pub fn polygon(&mut self, id: i64, points: &[i64], attributes: &[(&str, &str)]) -> Result<(), MapError> {
        self.line(Layer::Polygons, id, points, attributes)
    }

    fn line(
        &mut self,
        layer: Layer,
        id: i64,
        points: &[i64],
        attributes: &[(&str, &str)],
    ) -> Result<(), MapError> {
        let indices = points
            .iter()
            .map(|point| self.find(id, Layer::Points, *point).map(|handle| handle.index() as u32))
            .collect::<Result<Vec<_>, _>>()?;
        let handle = Handle::new(self.store.lines.len() as u32, false);
        self.register(layer, id, handle)?;
        let attributes = self.attributes(attributes);
        let start = self.store.line_points.len();
        self.store.line_points.extend(indices);
        let points = Span::new(start, self.store.line_points.len());
        self.store.lines.push(LineRecord { id, attributes, points });
        Ok(())
    }

    /// Adds a lanelet between two line strings, each read in driving direction.
    ///
    /// # Errors
    /// [`MapError::DuplicateId`], [`MapError::UnknownId`].
    pub fn lanelet(
        &mut self,
        id: i64,
        left: impl Into<Bound>,
        right: impl Into<Bound>,
        attributes: &[(&str, &str)],
    ) -> Result<(), MapError> {
        let left = self.bound(id, left.into())?;
        let right = self.bound(id, right.into())?;
        let handle = Handle::new(self.store.lanelets.len() as u32, false);
        self.register(Layer::Lanelets, id, handle)?;
        let attributes = self.attributes(attributes);
        let centerline = Handle::NONE;
        let rules = Span::default();
        self.store.lanelets.push(LaneletRecord { id, attributes, left, right, centerline, rules });
        self.lanelet_rules.push(Vec::new());
        Ok(())
    }

    /// Gives a lanelet a line string as its centerline.
    ///
    /// # Errors
    /// [`MapError::UnknownId`].
    pub fn centerline(&mut self, lanelet: i64, line: impl Into<Bound>) -> Result<(), MapError> {
        let line = self.bound(lanelet, line.into())?;
        let handle = self.find(lanelet, Layer::Lanelets, lanelet)?;
        self.store.lanelets[handle.index()].centerline = line;
        Ok(())
    }

    /// Adds an area with an outer ring and holes, each a list of line strings.
    ///
    /// # Errors
    /// [`MapError::DuplicateId`], [`MapError::UnknownId`].
    pub fn area(
        &mut self,
        id: i64,
        outer: &[Bound],
        inner: &[&[Bound]],
        attributes: &[(&str, &str)],
    ) -> Result<(), MapError> {
        let outer = self.ring(id, outer)?;
        let rings = inner.iter().map(|ring| self.ring(id, ring)).collect::<Result<Vec<_>, _>>()?;
        let handle = Handle::new(self.store.areas.len() as u32, false);
        self.register(Layer::Areas, id, handle)?;
        let attributes = self.attributes(attributes);
        let start = self.store.rings.len();
        self.store.rings.extend(rings);
        let inner = Span::new(start, self.store.rings.len());
        self.store.areas.push(AreaRecord { id, attributes, outer, inner, rules: Span::default() });
        self.area_rules.push(Vec::new());
        Ok(())
    }

    fn ring(&mut self, user: i64, lines: &[Bound]) -> Result<Span, MapError> {
        let handles = lines.iter().map(|line| self.bound(user, *line)).collect::<Result<Vec<_>, _>>()?;
        let start = self.store.ring_lines.len();
        self.store.ring_lines.extend(handles);
        Ok(Span::new(start, self.store.ring_lines.len()))
    }

    /// Adds a regulatory element. Members of one role keep their order. The caller puts `subtype` among the
    /// attributes and attaches the element to the lanelets it rules.
    ///
    /// # Errors
    /// [`MapError::DuplicateId`], [`MapError::UnknownId`].
    pub fn regulatory_element(
        &mut self,
        id: i64,
        members: &[(&str, Member)],
        attributes: &[(&str, &str)],
    ) -> Result<(), MapError> {
        let mut parameters = members
            .iter()
            .map(|(role, member)| Ok((*role, self.parameter(id, *member)?)))
            .collect::<Result<Vec<_>, MapError>>()?;
        parameters.sort_by_key(|(role, _)| *role);
        let handle = Handle::new(self.store.rules.len() as u32, false);
        self.register(Layer::RegulatoryElements, id, handle)?;
        let attributes = self.attributes(attributes);
        let first_role = self.store.roles.len();
        for group in parameters.chunk_by(|a, b| a.0 == b.0) {
            let name = self.store.push_key(group[0].0.as_bytes());
            let start = self.store.parameters.len();
            self.store.parameters.extend(group.iter().map(|(_, parameter)| *parameter));
            let parameters = Span::new(start, self.store.parameters.len());
            self.store.roles.push(RoleRecord { name, parameters });
        }
        let roles = Span::new(first_role, self.store.roles.len());
        self.store.rules.push(RuleRecord { id, attributes, roles });
        Ok(())
    }

    /// Attaches a regulatory element to a lanelet.
    ///
    /// # Errors
    /// [`MapError::UnknownId`].
    pub fn attach(&mut self, lanelet: i64, regulatory_element: i64) -> Result<(), MapError> {
        let rule = self.find(lanelet, Layer::RegulatoryElements, regulatory_element)?;
        let handle = self.find(regulatory_element, Layer::Lanelets, lanelet)?;
        self.lanelet_rules[handle.index()].push(rule.index() as u32);
        Ok(())
    }

    /// Attaches a regulatory element to an area.
    ///
    /// # Errors
    /// [`MapError::UnknownId`].
    pub fn attach_to_area(&mut self, area: i64, regulatory_element: i64) -> Result<(), MapError> {
        let rule = self.find(area, Layer::RegulatoryElements, regulatory_element)?;
        let handle = self.find(regulatory_element, Layer::Areas, area)?;
        self.area_rules[handle.index()].push(rule.index() as u32);
        Ok(())
    }

    /// The finished map.
    ///
    /// # Errors
    /// [`MapError::NonFinitePoint`], [`MapError::TooLarge`].
    pub fn build(mut self) -> Result<Map, MapError> {
        self.store.id_counter = self.next_id();
        for (lanelet, rules) in self.store.lanelets.iter_mut().zip(&self.lanelet_rules) {
            let start = self.store.members.len();
            self.store.members.extend(rules);
            lanelet.rules = Span::new(start, self.store.members.len());
        }
        for (area, rules) in self.store.areas.iter_mut().zip(&self.area_rules) {
            let start = self.store.members.len();
            self.store.members.extend(rules);
            area.rules = Span::new(start, self.store.members.len());
        }
        for layer in LAYERS {
            let handles = std::mem::take(&mut self.handles[layer as usize]);
            let entries = handles.into_iter().map(|(id, handle)| Entry { id, handle });
            self.store.layer_mut(layer).extend(entries);
        }
        Ok(Map::from_store(self.store.finish()?))
    }

    fn register(&mut self, layer: Layer, id: i64, handle: Handle) -> Result<(), MapError> {
        let handles = &mut self.handles[layer as usize];
        if handles.contains_key(&id) {
            return Err(MapError::DuplicateId { layer, id });
        }
        handles.insert(id, handle);
        self.largest_id = self.largest_id.max(id);
        Ok(())
    }

    fn find(&self, user: i64, layer: Layer, id: i64) -> Result<Handle, MapError> {
        self.handles[layer as usize].get(&id).copied().ok_or(MapError::UnknownId { user, layer, id })
    }

    fn bound(&self, user: i64, bound: Bound) -> Result<Handle, MapError> {
        let handle = self.find(user, Layer::LineStrings, bound.line_string)?;
        Ok(if bound.inverted { handle.flipped() } else { handle })
    }

    fn parameter(&self, user: i64, member: Member) -> Result<Parameter, MapError> {
        let (kind, layer, id) = match member {
            Member::Point(id) => (ParameterKind::Point, Layer::Points, id),
            Member::LineString(id) => (ParameterKind::LineString, Layer::LineStrings, id),
            Member::Polygon(id) => (ParameterKind::Polygon, Layer::Polygons, id),
            Member::Lanelet(id) => (ParameterKind::Lanelet, Layer::Lanelets, id),
            Member::Area(id) => (ParameterKind::Area, Layer::Areas, id),
        };
        Ok(Parameter::new(kind, self.find(user, layer, id)?))
    }

    fn attributes(&mut self, attributes: &[(&str, &str)]) -> Span {
        let start = self.store.attributes.len();
        for (key, value) in attributes {
            self.store.push_attribute(key.as_bytes(), value.as_bytes());
        }
        self.store.close_attributes(start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_points() -> MapBuilder {
        let mut builder = MapBuilder::new();
        builder.point(1, [0.0, 0.0, 0.0], &[]).unwrap();
        builder.point(2, [10.0, 0.0, 1.0], &[("b", "2"), ("a", "1"), ("b", "3")]).unwrap();
        builder
    }

    #[test]
    fn an_id_is_used_once_in_a_layer_and_may_be_used_again_in_another() {
        let mut builder = two_points();
        let error = builder.point(1, [0.0; 3], &[]).unwrap_err();
        assert!(matches!(error, MapError::DuplicateId { layer: Layer::Points, id: 1 }), "{error}");
        builder.line_string(1, &[1, 2], &[]).unwrap();
        assert_eq!(builder.build().unwrap().line_string(1).unwrap().len(), 2);
    }

    #[test]
    fn names_of_missing_elements_are_refused_and_change_nothing() {
        let mut builder = two_points();
        let error = builder.line_string(5, &[1, 9], &[]).unwrap_err();
        assert!(matches!(error, MapError::UnknownId { user: 5, layer: Layer::Points, id: 9 }), "{error}");
        assert!(builder.build().unwrap().line_string(5).is_none());
    }

    #[test]
    fn attributes_are_sorted_and_the_first_of_equal_keys_stays() {
        let map = two_points().build().unwrap();
        let pairs: Vec<_> = map
            .point(2)
            .unwrap()
            .attributes()
            .iter()
            .map(|a| (a.key.to_owned(), a.value.to_owned()))
            .collect();
        assert_eq!(pairs, [("a".to_owned(), "1".to_owned()), ("b".to_owned(), "2".to_owned())]);
    }

    #[test]
    fn points_of_a_line_get_free_ids() {
        let mut builder = two_points();
        builder.line_string_at(7, &[[0.0, 1.0, 0.0], [2.0, 1.0, 3.0]], &[("type", "stop_line")]).unwrap();
        let map = builder.build().unwrap();
        let line = map.line_string(7).unwrap();
        let points: Vec<_> = line.points().map(|point| (point.id(), point.position())).collect();
        assert_eq!(points, [(1000, [0.0, 1.0, 0.0]), (1001, [2.0, 1.0, 3.0])]);
        assert_eq!(line.attribute("type"), Some("stop_line"));
    }

    #[test]
    fn coordinates_that_are_not_finite_make_no_map() {
        let mut builder = two_points();
        builder.point(3, [0.0, f64::NAN, 0.0], &[]).unwrap();
        let error = builder.build().unwrap_err();
        assert!(matches!(error, MapError::NonFinitePoint { point: 3 }), "{error}");
    }

    #[test]
    fn roles_keep_the_order_of_their_members() {
        let mut builder = two_points();
        builder.line_string(5, &[1, 2], &[]).unwrap();
        builder.line_string(6, &[2, 1], &[]).unwrap();
        let members = [
            ("ref_line", Member::LineString(6)),
            ("pole", Member::Point(1)),
            ("ref_line", Member::LineString(5)),
        ];
        builder.regulatory_element(7, &members, &[("subtype", "crosswalk")]).unwrap();
        let map = builder.build().unwrap();
        let rule = map.regulatory_element(7).unwrap();
        assert_eq!(rule.subtype(), "crosswalk");
        assert_eq!(rule.roles().map(|role| role.name()).collect::<Vec<_>>(), ["pole", "ref_line"]);
        assert_eq!(rule.line_strings("ref_line").map(|line| line.id()).collect::<Vec<_>>(), [6, 5]);
        assert_eq!(rule.role("refers").len(), 0);
    }
}
