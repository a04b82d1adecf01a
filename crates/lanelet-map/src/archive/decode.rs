//! The decoder: archive bytes to a [`Store`].
//!
//! Points and lines cannot contain other elements and are read by plain functions. Lanelets, areas and rules
//! contain one another to any depth and in cycles: each is registered before its content, and what remains
//! to be read of it waits on an explicit stack. Lists that wait reserve their place in the arenas; the bytes
//! they still need are added up in `promised`, so that nested hostile counts cannot reserve more than the
//! input could ever fill.

mod boost;

use std::collections::HashMap;

use self::boost::{ClassState, Object, Target};
use super::class::{Class, Kind};
use super::reader::{Fault, Reader};
use super::{ArchiveInfo, MAX_ARCHIVE_BYTES, SIGNATURE};
use crate::error::{ArchiveProblem, Layer, MapError};
use crate::map::Map;
use crate::map::store::{
    AreaRecord, Entry, Handle, LaneletRecord, LineRecord, Parameter, ParameterKind, PointRecord, RoleRecord,
    RuleRecord, Span, Store,
};

/// Smallest encodings in bytes, for the guards of the counts. All but the first are those of references to
/// known objects.
mod smallest {
    pub(super) const NEW_POINT: usize = 2 + 8 + 12 + 24;
    pub(super) const POINT: usize = 6;
    pub(super) const ATTRIBUTE: usize = 16;
    pub(super) const LINE: usize = 7;
    pub(super) const AREA: usize = 6;
    pub(super) const RING: usize = 12;
    pub(super) const LANELET: usize = 7;
    pub(super) const RULE: usize = 8;
    pub(super) const ROLE: usize = 20;
    pub(super) const PARAMETER: usize = 4;
}

pub(super) fn decode(bytes: &[u8]) -> Result<(Map, ArchiveInfo), MapError> {
    if bytes.len() > MAX_ARCHIVE_BYTES {
        return Err(MapError::TooLarge { limit: MAX_ARCHIVE_BYTES });
    }
    let mut decoder = Decoder::new(bytes);
    let library_version =
        decoder.run().map_err(|Fault { offset, problem }| MapError::Archive { offset, problem })?;
    let info = ArchiveInfo {
        library_version,
        objects: decoder.objects.len(),
        max_depth: decoder.max_depth,
        unfamiliar_types: decoder.unfamiliar_types,
    };
    Ok((Map::from_store(decoder.store.finish()?), info))
}

/// An element whose content is not yet complete.
#[derive(Debug, Clone, Copy)]
enum Frame {
    /// Rules of a lanelet, then its centerline.
    Lanelet { index: u32, next: u32, end: u32 },
    /// Rules of an area.
    Area { next: u32, end: u32 },
    /// Roles of a rule.
    Rule { index: u32, next: u32, end: u32 },
    /// Parameters of a role.
    Parameters { next: u32, end: u32 },
}

struct Decoder<'a> {
    reader: Reader<'a>,
    store: Store,
    classes: [ClassState; Class::COUNT],
    objects: Vec<Object>,
    rules_by_id: HashMap<i64, u32>,
    stack: Vec<Frame>,
    promised: usize,
    depth: usize,
    max_depth: usize,
    unfamiliar_types: usize,
}

impl<'a> Decoder<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self {
            reader: Reader::new(bytes),
            store: Store::default(),
            classes: [ClassState::Unseen; Class::COUNT],
            objects: Vec::new(),
            rules_by_id: HashMap::new(),
            stack: Vec::new(),
            promised: 0,
            depth: 0,
            max_depth: 0,
            unfamiliar_types: 0,
        }
    }

    fn run(&mut self) -> Result<u16, Fault> {
        let library_version = self.header()?;
        self.value(Class::LaneletMap)?;
        self.point_layer()?;
        self.layer(Layer::LineStrings, smallest::LINE, |d| d.line(Class::LineString))?;
        self.layer(Layer::Polygons, smallest::LINE, |d| d.line(Class::Polygon))?;
        self.layer(Layer::Areas, smallest::AREA, |d| d.area().map(|index| Handle::new(index, false)))?;
        self.layer(Layer::Lanelets, smallest::LANELET, Self::lanelet)?;
        self.layer(Layer::RegulatoryElements, smallest::RULE, |d| {
            d.rule().map(|index| Handle::new(index, false))
        })?;
        self.store.id_counter = self.reader.i64()?;
        match self.reader.left() {
            0 => Ok(library_version),
            count => Err(self.reader.fault(0, ArchiveProblem::TrailingBytes { count })),
        }
    }

    fn header(&mut self) -> Result<u16, Fault> {
        if self.reader.u64()? != SIGNATURE.len() as u64 || self.reader.array()? != *SIGNATURE {
            return Err(Fault { offset: 0, problem: ArchiveProblem::NotAnArchive });
        }
        let found = self.reader.u16()?;
        if found < 8 {
            return Err(self.reader.fault(2, ArchiveProblem::UnsupportedVersion { found }));
        }
        let sizes: [u8; 4] = self.reader.array()?;
        if sizes != [4, 8, 4, 8] || self.reader.i32()? != 1 {
            return Err(self.reader.fault(4, ArchiveProblem::ForeignLayout));
        }
        Ok(found)
    }

    #[inline]
    fn note_depth(&mut self, below: usize) {
        self.max_depth = self.max_depth.max(self.depth + below);
    }

    // Elements without nesting

    #[inline]
    fn attributes(&mut self) -> Result<Span, Fault> {
        let count = self.container(Class::AttributeMap, smallest::ATTRIBUTE)?;
        let start = self.store.attributes.len();
        for _ in 0..count {
            self.value(Class::AttributePair)?;
            let key = self.reader.bytes()?;
            self.value(Class::Attribute)?;
            let value = self.reader.bytes()?;
            self.store.push_attribute(key, value);
        }
        Ok(self.store.close_attributes(start))
    }

    /// A point; `below` is the nesting of its place.
    #[inline]
    fn point(&mut self, below: usize) -> Result<u32, Fault> {
        self.value(Class::Point)?;
        let index = self.store.points.len();
        match self.pointer(Class::PointPointer, Class::PointData, Kind::Point, index)? {
            Target::Known(known) => Ok(known),
            Target::New => {
                let id = self.reader.i64()?;
                let attributes = self.attributes()?;
                let position = [self.reader.f64()?, self.reader.f64()?, self.reader.f64()?];
                self.store.points.push(PointRecord { id, position, attributes });
                self.note_depth(below + 1);
                Ok(index as u32)
            }
        }
    }

    /// A line string or polygon.
    fn line(&mut self, class: Class) -> Result<Handle, Fault> {
        self.value(class)?;
        let inverted = self.reader.flag()?;
        let index = self.store.lines.len();
        match self.pointer(Class::LineStringPointer, Class::LineStringData, Kind::Line, index)? {
            Target::Known(known) => Ok(Handle::new(known, inverted)),
            Target::New => {
                self.note_depth(1);
                let id = self.reader.i64()?;
                let attributes = self.attributes()?;
                let count = self.container(Class::Points, smallest::POINT)?;
                let start = self.store.line_points.len();
                for _ in 0..count {
                    let point = self.point(1)?;
                    self.store.line_points.push(point);
                }
                let points = Span::new(start, self.store.line_points.len());
                self.store.lines.push(LineRecord { id, attributes, points });
                Ok(Handle::new(index as u32, inverted))
            }
        }
    }

    fn ring(&mut self) -> Result<Span, Fault> {
        let count = self.container(Class::LineStrings, smallest::LINE)?;
        let start = self.store.ring_lines.len();
        for _ in 0..count {
            let line = self.line(Class::LineString)?;
            self.store.ring_lines.push(line);
        }
        Ok(Span::new(start, self.store.ring_lines.len()))
    }

    // Elements that nest

    fn area(&mut self) -> Result<u32, Fault> {
        self.value(Class::Area)?;
        let index = self.store.areas.len();
        if let Target::Known(known) = self.pointer(Class::AreaPointer, Class::AreaData, Kind::Area, index)? {
            return Ok(known);
        }
        self.enter();
        let id = self.reader.i64()?;
        let attributes = self.attributes()?;
        let inner_count = self.container(Class::Rings, smallest::RING)?;
        let inner_start = self.store.rings.len();
        for _ in 0..inner_count {
            let ring = self.ring()?;
            self.store.rings.push(ring);
        }
        let inner = Span::new(inner_start, self.store.rings.len());
        let outer = self.ring()?;
        let rules = self.promise_rules()?;
        self.store.areas.push(AreaRecord { id, attributes, outer, inner, rules });
        self.stack.push(Frame::Area { next: rules.start, end: rules.start + rules.len });
        Ok(index as u32)
    }

    fn lanelet(&mut self) -> Result<Handle, Fault> {
        self.value(Class::Lanelet)?;
        let inverted = self.reader.flag()?;
        let index = self.store.lanelets.len();
        let target = self.pointer(Class::LaneletPointer, Class::LaneletData, Kind::Lanelet, index)?;
        if let Target::Known(known) = target {
            return Ok(Handle::new(known, inverted));
        }
        self.enter();
        let id = self.reader.i64()?;
        let attributes = self.attributes()?;
        let left = self.line(Class::LineString)?;
        let right = self.line(Class::LineString)?;
        let rules = self.promise_rules()?;
        let centerline = Handle::NONE;
        self.store.lanelets.push(LaneletRecord { id, attributes, left, right, centerline, rules });
        let (index, next, end) = (index as u32, rules.start, rules.start + rules.len);
        self.stack.push(Frame::Lanelet { index, next, end });
        Ok(Handle::new(index, inverted))
    }

    /// A regulatory element: known by its id, or its data follow.
    fn rule(&mut self) -> Result<u32, Fault> {
        self.value(Class::RulePointer)?;
        let outer = self.reader.i64()?;
        if let Some(known) = self.rules_by_id.get(&outer) {
            return Ok(*known);
        }
        let index = self.store.rules.len();
        let target = self.pointer(Class::RuleDataPointer, Class::RuleData, Kind::Rule, index)?;
        let inner = match target {
            Target::Known(known) => self.store.rules[known as usize].id,
            Target::New => self.reader.i64()?,
        };
        if inner != outer {
            return Err(self.reader.fault(8, ArchiveProblem::RegulatoryId { outer, inner }));
        }
        if let Target::Known(known) = target {
            return Ok(known);
        }
        self.enter();
        self.rules_by_id.insert(outer, index as u32);
        let attributes = self.attributes()?;
        let count = self.container(Class::RoleMap, smallest::ROLE)?;
        self.promised += count * smallest::ROLE;
        let start = self.store.roles.len();
        self.store.roles.resize(start + count, RoleRecord::default());
        let roles = Span::new(start, start + count);
        self.store.rules.push(RuleRecord { id: outer, attributes, roles });
        let (index, next, end) = (index as u32, roles.start, roles.start + roles.len);
        self.stack.push(Frame::Rule { index, next, end });
        Ok(index)
    }

    fn enter(&mut self) {
        self.depth += 1;
        self.note_depth(0);
    }

    fn leave(&mut self) {
        self.stack.pop();
        self.depth -= 1;
    }

    /// Reserves the list of regulatory elements of a lanelet or area.
    fn promise_rules(&mut self) -> Result<Span, Fault> {
        let count = self.reader.count(smallest::RULE, self.promised)?;
        self.promised += count * smallest::RULE;
        let start = self.store.members.len();
        self.store.members.resize(start + count, 0);
        Ok(Span::new(start, start + count))
    }

    /// Reads what is waiting on the stack, and what that brings along, until all is complete.
    fn complete(&mut self) -> Result<(), Fault> {
        while let Some(frame) = self.stack.last().copied() {
            match frame {
                Frame::Lanelet { next, end, .. } | Frame::Area { next, end } if next < end => {
                    self.advance();
                    self.promised -= smallest::RULE;
                    let rule = self.rule()?;
                    self.store.members[next as usize] = rule;
                }
                Frame::Lanelet { index, .. } => {
                    if self.reader.flag()? {
                        let centerline = self.line(Class::LineString)?;
                        self.store.lanelets[index as usize].centerline = centerline;
                    }
                    self.leave();
                }
                Frame::Area { .. } => self.leave(),
                Frame::Rule { next, end, .. } if next < end => {
                    self.advance();
                    self.promised -= smallest::ROLE;
                    let role = self.role()?;
                    self.store.roles[next as usize] = role;
                }
                Frame::Rule { index, .. } => {
                    let roles = self.store.rules[index as usize].roles;
                    self.store.rules[index as usize].roles = self.store.close_roles(roles);
                    self.leave();
                }
                Frame::Parameters { next, end } if next < end => {
                    self.advance();
                    self.promised -= smallest::PARAMETER;
                    self.parameter(next)?;
                }
                Frame::Parameters { .. } => {
                    self.stack.pop();
                }
            }
        }
        Ok(())
    }

    /// Moves the topmost frame on to its next item.
    fn advance(&mut self) {
        if let Some(
            Frame::Lanelet { next, .. }
            | Frame::Area { next, .. }
            | Frame::Rule { next, .. }
            | Frame::Parameters { next, .. },
        ) = self.stack.last_mut()
        {
            *next += 1;
        }
    }

    fn role(&mut self) -> Result<RoleRecord, Fault> {
        self.value(Class::RolePair)?;
        let name = self.reader.bytes()?;
        let name = self.store.push_key(name);
        let count = self.container(Class::Parameters, smallest::PARAMETER)?;
        self.promised += count * smallest::PARAMETER;
        let start = self.store.parameters.len();
        self.store.parameters.resize(start + count, Parameter::EMPTY);
        let parameters = Span::new(start, start + count);
        self.stack.push(Frame::Parameters { next: parameters.start, end: parameters.start + parameters.len });
        Ok(RoleRecord { name, parameters })
    }

    /// The one tracked value of the format: a variant with an object id of its own.
    fn parameter(&mut self, slot: u32) -> Result<(), Fault> {
        if self.is_tracked(Class::Parameter)? {
            if let Some(known) = self.object(Kind::Parameter)? {
                self.store.parameters[slot as usize] = self.store.parameters[known as usize];
                return Ok(());
            }
            self.objects.push(Object::new(Kind::Parameter, slot as usize));
        }
        let parameter = match self.reader.i32()? {
            0 => Parameter::new(ParameterKind::Point, Handle::new(self.point(0)?, false)),
            1 => Parameter::new(ParameterKind::LineString, self.line(Class::LineString)?),
            2 => Parameter::new(ParameterKind::Polygon, self.line(Class::Polygon)?),
            3 => {
                self.value(Class::WeakLanelet)?;
                Parameter::new(ParameterKind::Lanelet, self.lanelet()?)
            }
            4 => {
                self.value(Class::WeakArea)?;
                Parameter::new(ParameterKind::Area, Handle::new(self.area()?, false))
            }
            found => return Err(self.reader.fault(4, ArchiveProblem::ParameterKind { found })),
        };
        self.store.parameters[slot as usize] = parameter;
        Ok(())
    }

    // Layers

    /// The first layer: all its points are new, which gives a tight bound for their number.
    fn point_layer(&mut self) -> Result<(), Fault> {
        let count = self.reader.count(smallest::NEW_POINT, 0)?;
        self.store.points.reserve_exact(count);
        self.objects.reserve_exact(count);
        self.fill_layer(Layer::Points, count, |d| d.point(0).map(|index| Handle::new(index, false)))
    }

    fn layer(
        &mut self,
        layer: Layer,
        smallest: usize,
        read: impl FnMut(&mut Self) -> Result<Handle, Fault>,
    ) -> Result<(), Fault> {
        let count = self.reader.count(smallest, 0)?;
        self.fill_layer(layer, count, read)
    }

    fn fill_layer(
        &mut self,
        layer: Layer,
        count: usize,
        mut read: impl FnMut(&mut Self) -> Result<Handle, Fault>,
    ) -> Result<(), Fault> {
        // Exact, because growing by doubling could take eight times the bytes of a layer of references.
        self.store.layer_mut(layer).reserve_exact(count);
        for _ in 0..count {
            let handle = read(self)?;
            self.complete()?;
            let id = self.id_of(layer, handle);
            self.store.layer_mut(layer).push(Entry { id, handle });
        }
        Ok(())
    }

    fn id_of(&self, layer: Layer, handle: Handle) -> i64 {
        let index = handle.index();
        match layer {
            Layer::Points => self.store.points[index].id,
            Layer::LineStrings | Layer::Polygons => self.store.lines[index].id,
            Layer::Areas => self.store.areas[index].id,
            Layer::Lanelets => self.store.lanelets[index].id,
            Layer::RegulatoryElements => self.store.rules[index].id,
        }
    }
}
