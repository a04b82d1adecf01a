//! Nodes, ways and relations to the elements of a map.

use super::align;
use super::area;
use super::document::{Document, MemberType, Node, Relation, RelationMember, leading_number};
use super::rule::{self, Members};
use crate::error::{IssueKind, Layer, LoadIssue, MapError};
use crate::map::attributes::Attributes;
use crate::map::elements::Polyline;
use crate::map::store::{
    AreaRecord, Entry, Handle, LaneletRecord, LineRecord, Parameter, ParameterKind, PointRecord, RoleRecord,
    RuleRecord, Span, Store,
};
use crate::projection::{GeoPoint, Projection, Projector, utm};

/// Smallest first free id, as lanelet2 has it.
const FIRST_FREE_ID: i64 = 1000;

/// A map that is not yet finished, and its defects.
pub(super) struct Assembled {
    pub(super) store: Store,
    pub(super) issues: Vec<LoadIssue>,
}

/// Ids and where they stand in a table, sorted by id; of equal ids the last one in the file counts.
struct Lookup(Vec<(i64, usize)>);

impl Lookup {
    fn new(ids: impl Iterator<Item = i64>) -> Self {
        let mut table: Vec<(i64, usize)> = ids.enumerate().map(|(at, id)| (id, at)).collect();
        table.sort_unstable_by_key(|(id, at)| (*id, usize::MAX - at));
        table.dedup_by_key(|(id, _)| *id);
        Self(table)
    }

    fn get(&self, id: i64) -> Option<usize> {
        self.0.binary_search_by_key(&id, |(id, _)| *id).ok().map(|at| self.0[at].1)
    }

    /// Whether the entry at this place of the table was not replaced by a later one.
    fn places(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().map(|(_, at)| *at)
    }
}

pub(super) fn assemble(
    mut document: Document,
    projector: Projector,
    projection: &Projection,
) -> Result<Assembled, MapError> {
    let store = std::mem::take(&mut document.store);
    let mut assembler = Assembler {
        nodes: Lookup::new(document.nodes.iter().map(|node| node.id)),
        ways: Lookup::new(document.ways.iter().map(|way| way.id)),
        relations: Lookup::new(document.relations.iter().map(|relation| relation.id)),
        document: &document,
        store,
        issues: Vec::new(),
    };
    assembler.points(projector, projection)?;
    assembler.lines();
    assembler.lanelets();
    assembler.align_bounds(matches!(projector, Projector::Local));
    assembler.areas();
    assembler.rules();
    assembler.attach_rules();
    assembler.count_ids();
    Ok(Assembled { store: assembler.store, issues: assembler.issues })
}

struct Assembler<'d> {
    document: &'d Document,
    nodes: Lookup,
    ways: Lookup,
    relations: Lookup,
    store: Store,
    issues: Vec<LoadIssue>,
}

impl<'d> Assembler<'d> {
    fn report(&mut self, id: i64, kind: IssueKind) {
        self.issues.push(LoadIssue { id, kind });
    }

    fn enter(&mut self, layer: Layer, id: i64, index: usize) {
        self.store.layer_mut(layer).push(Entry { id, handle: Handle::new(index as u32, false) });
    }

    fn relation_type(&self, relation: &Relation) -> &str {
        Attributes::new(&self.store, relation.attributes).get("type").unwrap_or("")
    }

    /// The relations of a type, in the order of ids.
    fn relations_of(&self, kind: &str) -> Vec<Relation> {
        self.relations
            .places()
            .map(|at| self.document.relations[at])
            .filter(|relation| self.relation_type(relation) == kind)
            .collect()
    }

    /// The members of a relation that exist in the file.
    fn members(&self, relation: Relation) -> impl Iterator<Item = RelationMember> + use<'_, 'd> {
        self.document.members[relation.members.range()]
            .iter()
            .copied()
            .filter(|member| self.member_exists(*member))
    }

    fn member_exists(&self, member: RelationMember) -> bool {
        match member.kind {
            MemberType::Node => self.nodes.get(member.id).is_some(),
            MemberType::Way => self.ways.get(member.id).is_some(),
            MemberType::Relation => self.relations.get(member.id).is_some(),
        }
    }

    fn report_missing_members(&mut self, relation: Relation) {
        let document = self.document;
        for member in &document.members[relation.members.range()] {
            if !self.member_exists(*member) {
                self.report(relation.id, IssueKind::MissingMember { member: member.id });
            }
        }
    }

    // Points and lines

    fn points(&mut self, projector: Projector, projection: &Projection) -> Result<(), MapError> {
        let places: Vec<usize> = self.nodes.places().collect();
        self.store.points.reserve(places.len());
        for at in places {
            let node = self.document.nodes[at];
            let position = self.position(&node, projector, projection)?;
            self.enter(Layer::Points, node.id, self.store.points.len());
            self.store.points.push(PointRecord { id: node.id, position, attributes: node.attributes });
        }
        if matches!(projector, Projector::Mgrs) {
            self.report_grid_change();
        }
        Ok(())
    }

    fn position(
        &self,
        node: &Node,
        projector: Projector,
        projection: &Projection,
    ) -> Result<[f64; 3], MapError> {
        if matches!(projector, Projector::Local) {
            let attributes = Attributes::new(&self.store, node.attributes);
            let local = |key: &'static str| match attributes.get(key).map(leading_number) {
                None => Ok(0.0),
                Some(Some(number)) => Ok(number),
                Some(None) => Err(MapError::LocalCoordinate { node: node.id, key }),
            };
            return Ok([local("local_x")?, local("local_y")?, node.elevation_m]);
        }
        projection
            .forward(geo(node), node.elevation_m)
            .map_err(|problem| MapError::Projection { node: node.id, problem })
    }

    /// One report is enough: a map that spans two squares is unusable with MGRS as a whole.
    fn report_grid_change(&mut self) {
        let square = |node: &Node| utm(geo(node)).ok().map(|utm| utm.square());
        let Some(others) = self.document.nodes.first().and_then(square) else { return };
        let change = self
            .document
            .nodes
            .iter()
            .find_map(|node| square(node).filter(|found| *found != others).map(|found| (node.id, found)));
        if let Some((id, found)) = change {
            self.report(id, IssueKind::GridChange { found, others });
        }
    }

    fn lines(&mut self) {
        let places: Vec<usize> = self.ways.places().collect();
        for at in places {
            let way = self.document.ways[at];
            let nodes = &self.document.way_nodes[way.nodes.range()];
            let start = self.store.line_points.len();
            for node in nodes {
                match self.store.find(Layer::Points, *node) {
                    Some(point) => self.store.line_points.push(point.index() as u32),
                    None => {
                        self.store.line_points.truncate(start);
                        self.report(way.id, IssueKind::MissingNode { node: *node });
                        break;
                    }
                }
            }
            let points = Span::new(start, self.store.line_points.len());
            if points.len == 0 {
                self.report(way.id, IssueKind::EmptyWay);
                continue;
            }
            let area = Attributes::new(&self.store, way.attributes).bool("area");
            let layer = if area == Some(true) { Layer::Polygons } else { Layer::LineStrings };
            self.enter(layer, way.id, self.store.lines.len());
            self.store.lines.push(LineRecord { id: way.id, attributes: way.attributes, points });
        }
    }

    // Lanelets

    fn lanelets(&mut self) {
        for relation in self.relations_of("lanelet") {
            self.report_missing_members(relation);
            let left = self.border(relation, "left");
            let right = self.border(relation, "right");
            let centerline = self.centerline(relation);
            self.enter(Layer::Lanelets, relation.id, self.store.lanelets.len());
            let (id, attributes, rules) = (relation.id, relation.attributes, Span::default());
            self.store.lanelets.push(LaneletRecord { id, attributes, left, right, centerline, rules });
        }
    }

    fn ways_in_role(&self, relation: Relation, role: &str) -> Vec<i64> {
        self.members(relation)
            .filter(|member| member.kind == MemberType::Way && self.store.str(member.role) == role)
            .map(|member| member.id)
            .collect()
    }

    fn border(&mut self, relation: Relation, role: &'static str) -> Handle {
        let ways = self.ways_in_role(relation, role);
        let &[way] = ways.as_slice() else {
            self.report(relation.id, IssueKind::BorderCount { role, found: ways.len() });
            return self.empty_line(relation.id);
        };
        self.store.find(Layer::LineStrings, way).unwrap_or_else(|| {
            self.report(relation.id, IssueKind::UnusableMember { member: way });
            self.empty_line(way)
        })
    }

    fn centerline(&mut self, relation: Relation) -> Handle {
        let ways = self.ways_in_role(relation, "centerline");
        let &[way] = ways.as_slice() else {
            if let Some(second) = ways.get(1) {
                self.report(relation.id, IssueKind::UnusableMember { member: *second });
            }
            return Handle::NONE;
        };
        self.store.find(Layer::LineStrings, way).unwrap_or_else(|| {
            self.report(relation.id, IssueKind::UnusableMember { member: way });
            Handle::NONE
        })
    }

    /// Takes the place of a border that is not there; in no layer.
    fn empty_line(&mut self, id: i64) -> Handle {
        let index = self.store.lines.len() as u32;
        self.store.lines.push(LineRecord { id, attributes: Span::default(), points: Span::default() });
        Handle::new(index, false)
    }

    /// Twice, since Autoware does it twice and bounds that touch are turned each time. In Local mode Autoware does
    /// that while x and y are still 0, and once more afterwards.
    fn align_bounds(&mut self, local: bool) {
        for at in 0..self.store.lanelets.len() {
            let lanelet = self.store.lanelets[at];
            let (mut left, mut right) = (lanelet.left, lanelet.right);
            let passes: &[bool] = if local { &[true, true, false] } else { &[false, false] };
            for flat in passes {
                let positions = |line: Handle| -> Vec<[f64; 3]> {
                    let line = Polyline::new(&self.store, line);
                    line.positions().map(|[x, y, z]| if *flat { [0.0, 0.0, z] } else { [x, y, z] }).collect()
                };
                let (turn_left, turn_right) = align::turns(&positions(left), &positions(right));
                left = if turn_left { left.flipped() } else { left };
                right = if turn_right { right.flipped() } else { right };
            }
            self.store.lanelets[at] = LaneletRecord { left, right, ..lanelet };
        }
    }

    // Areas

    fn areas(&mut self) {
        for relation in self.relations_of("multipolygon") {
            self.report_missing_members(relation);
            let mut outer = self.area_rings(relation, "outer");
            let inner = self.area_rings(relation, "inner");
            if outer.len() != 1 {
                self.report(relation.id, IssueKind::OuterRingCount { found: outer.len() });
                continue;
            }
            let outer = self.push_ring(&outer.remove(0));
            let spans: Vec<Span> = inner.iter().map(|ring| self.push_ring(ring)).collect();
            let start = self.store.rings.len();
            self.store.rings.extend(spans);
            let inner = Span::new(start, self.store.rings.len());
            self.enter(Layer::Areas, relation.id, self.store.areas.len());
            let (id, attributes, rules) = (relation.id, relation.attributes, Span::default());
            self.store.areas.push(AreaRecord { id, attributes, outer, inner, rules });
        }
    }

    fn area_rings(&mut self, relation: Relation, role: &'static str) -> Vec<Vec<Handle>> {
        let mut lines = Vec::new();
        for way in self.ways_in_role(relation, role) {
            match self.store.find(Layer::LineStrings, way) {
                Some(line) => lines.push(line),
                None => self.report(relation.id, IssueKind::UnusableMember { member: way }),
            }
        }
        let (rings, broken) = area::rings(&self.store, &lines);
        for _ in 0..broken {
            self.report(relation.id, IssueKind::BrokenRing { role });
        }
        rings
    }

    fn push_ring(&mut self, ring: &[Handle]) -> Span {
        let start = self.store.ring_lines.len();
        self.store.ring_lines.extend(ring);
        Span::new(start, self.store.ring_lines.len())
    }

    // Rules

    fn rules(&mut self) {
        for relation in self.relations_of("regulatory_element") {
            self.report_missing_members(relation);
            let attributes = Attributes::new(&self.store, relation.attributes);
            let (subtype, has_sign_type) =
                (attributes.get("subtype").map(str::to_owned), attributes.get("sign_type").is_some());
            let Some(subtype) = subtype else {
                self.report(relation.id, IssueKind::NoSubtype);
                continue;
            };
            let members = self.parameters(relation);
            let mut named: Vec<(&str, Parameter)> =
                members.iter().map(|(role, parameter)| (self.store.str(*role), *parameter)).collect();
            let first_refers_has_subtype =
                named.iter().find(|(role, _)| *role == "refers").is_some_and(|(_, parameter)| {
                    matches!(parameter.kind(), ParameterKind::LineString | ParameterKind::Polygon) && {
                        let sign = Polyline::new(&self.store, parameter.handle());
                        sign.attribute("subtype").is_some()
                    }
                });
            let check = Members { roles: &named, first_refers_has_subtype, has_sign_type };
            if let Err(problem) = rule::check(&subtype, &check) {
                self.report(relation.id, problem);
                continue;
            }
            named.sort_by_key(|(role, _)| *role);
            let groups: Vec<(String, Vec<Parameter>)> = named
                .chunk_by(|a, b| a.0 == b.0)
                .map(|group| (group[0].0.to_owned(), group.iter().map(|(_, p)| *p).collect()))
                .collect();
            self.push_rule(relation, &groups);
        }
    }

    fn push_rule(&mut self, relation: Relation, groups: &[(String, Vec<Parameter>)]) {
        let first_role = self.store.roles.len();
        for (role, parameters) in groups {
            let name = self.store.push_key(role.as_bytes());
            let start = self.store.parameters.len();
            self.store.parameters.extend(parameters);
            let parameters = Span::new(start, self.store.parameters.len());
            self.store.roles.push(RoleRecord { name, parameters });
        }
        let roles = Span::new(first_role, self.store.roles.len());
        self.enter(Layer::RegulatoryElements, relation.id, self.store.rules.len());
        self.store.rules.push(RuleRecord { id: relation.id, attributes: relation.attributes, roles });
    }

    /// The usable members of a rule with their roles, in file order.
    fn parameters(&mut self, relation: Relation) -> Vec<(Span, Parameter)> {
        let members: Vec<RelationMember> = self.members(relation).collect();
        let mut parameters = Vec::with_capacity(members.len());
        for member in members {
            match self.parameter(member) {
                Some(parameter) => parameters.push((member.role, parameter)),
                None => self.report(relation.id, IssueKind::UnusableMember { member: member.id }),
            }
        }
        parameters
    }

    fn parameter(&self, member: RelationMember) -> Option<Parameter> {
        let find = |kind, layer| Some(Parameter::new(kind, self.store.find(layer, member.id)?));
        match member.kind {
            MemberType::Node => find(ParameterKind::Point, Layer::Points),
            MemberType::Way => find(ParameterKind::LineString, Layer::LineStrings)
                .or_else(|| find(ParameterKind::Polygon, Layer::Polygons)),
            MemberType::Relation => find(ParameterKind::Lanelet, Layer::Lanelets)
                .or_else(|| find(ParameterKind::Area, Layer::Areas)),
        }
    }

    fn attach_rules(&mut self) {
        for at in 0..self.store.lanelets.len() {
            let rules = self.rules_of(self.store.lanelets[at].id);
            self.store.lanelets[at].rules = rules;
        }
        for at in 0..self.store.areas.len() {
            let rules = self.rules_of(self.store.areas[at].id);
            self.store.areas[at].rules = rules;
        }
    }

    fn rules_of(&mut self, id: i64) -> Span {
        let start = self.store.members.len();
        let Some(at) = self.relations.get(id) else { return Span::default() };
        let rules: Vec<i64> = self
            .members(self.document.relations[at])
            .filter(|member| {
                member.kind == MemberType::Relation && self.store.str(member.role) == "regulatory_element"
            })
            .map(|member| member.id)
            .collect();
        for rule in rules {
            let index = match self.store.find(Layer::RegulatoryElements, rule) {
                Some(handle) => handle.index(),
                None => {
                    self.report(id, IssueKind::MissingRule { rule });
                    self.empty_rule(rule)
                }
            };
            self.store.members.push(index as u32);
        }
        Span::new(start, self.store.members.len())
    }

    /// Takes the place of a rule that was not built; in no layer.
    fn empty_rule(&mut self, id: i64) -> usize {
        if let Some(known) = self.store.rules.iter().rposition(|rule| rule.id == id) {
            return known;
        }
        let (attributes, roles) = (Span::default(), Span::default());
        self.store.rules.push(RuleRecord { id, attributes, roles });
        self.store.rules.len() - 1
    }

    fn count_ids(&mut self) {
        let document = self.document;
        let ids = document.nodes.iter().map(|node| node.id);
        let ids = ids.chain(document.ways.iter().map(|way| way.id));
        let largest = ids.chain(document.relations.iter().map(|relation| relation.id)).max().unwrap_or(0);
        self.store.id_counter = largest.saturating_add(1).max(FIRST_FREE_ID);
    }
}

fn geo(node: &Node) -> GeoPoint {
    GeoPoint { latitude_deg: node.latitude_deg, longitude_deg: node.longitude_deg }
}
