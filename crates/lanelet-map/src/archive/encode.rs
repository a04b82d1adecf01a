//! The encoder: a [`Store`] to archive bytes, with the same explicit stack as the decoder.

use super::SIGNATURE;
use super::class::Class;
use crate::error::Layer;
use crate::map::store::{Handle, Parameter, ParameterKind, Span, Store};

/// Library version written: Boost 1.74.
const LIBRARY_VERSION: u16 = 18;

/// Not yet written.
const UNWRITTEN: u32 = u32::MAX;

pub(super) fn encode(store: &Store) -> Vec<u8> {
    let mut encoder = Encoder::new(store);
    encoder.run();
    encoder.out
}

/// An element whose content is not yet complete.
#[derive(Debug, Clone, Copy)]
enum Frame {
    Lanelet { index: usize, next: u32, end: u32 },
    Area { next: u32, end: u32 },
    Rule { next: u32, end: u32 },
    Parameters { next: u32, end: u32 },
}

struct Encoder<'m> {
    store: &'m Store,
    out: Vec<u8>,
    /// Implicit class ids in the order of first meeting.
    classes: [Option<i16>; Class::COUNT],
    class_count: i16,
    object_count: u32,
    points: Vec<u32>,
    lines: Vec<u32>,
    areas: Vec<u32>,
    lanelets: Vec<u32>,
    rules: Vec<bool>,
    stack: Vec<Frame>,
}

impl<'m> Encoder<'m> {
    fn new(store: &'m Store) -> Self {
        Self {
            store,
            out: Vec::with_capacity(store.points.len() * 96 + 128),
            classes: [None; Class::COUNT],
            class_count: 0,
            object_count: 0,
            points: vec![UNWRITTEN; store.points.len()],
            lines: vec![UNWRITTEN; store.lines.len()],
            areas: vec![UNWRITTEN; store.areas.len()],
            lanelets: vec![UNWRITTEN; store.lanelets.len()],
            rules: vec![false; store.rules.len()],
            stack: Vec::new(),
        }
    }

    fn run(&mut self) {
        self.header();
        self.value(Class::LaneletMap);
        self.layer(Layer::Points, |e, handle| e.point(handle.index()));
        self.layer(Layer::LineStrings, |e, handle| e.line(Class::LineString, handle));
        self.layer(Layer::Polygons, |e, handle| e.line(Class::Polygon, handle));
        self.layer(Layer::Areas, |e, handle| e.area(handle.index()));
        self.layer(Layer::Lanelets, Self::lanelet);
        self.layer(Layer::RegulatoryElements, |e, handle| e.rule(handle.index()));
        self.i64(self.store.id_counter);
    }

    fn layer(&mut self, layer: Layer, mut write: impl FnMut(&mut Self, Handle)) {
        let store = self.store;
        let entries = store.layer(layer);
        self.u64(entries.len());
        for entry in entries {
            write(self, entry.handle);
            self.complete();
        }
    }

    fn header(&mut self) {
        self.u64(SIGNATURE.len());
        self.out.extend_from_slice(SIGNATURE);
        self.out.extend_from_slice(&LIBRARY_VERSION.to_le_bytes());
        self.out.extend_from_slice(&[4, 8, 4, 8]);
        self.out.extend_from_slice(&1_i32.to_le_bytes());
    }

    // Numbers and strings

    fn u64(&mut self, value: usize) {
        self.out.extend_from_slice(&(value as u64).to_le_bytes());
    }

    fn u32(&mut self, value: u32) {
        self.out.extend_from_slice(&value.to_le_bytes());
    }

    fn i64(&mut self, value: i64) {
        self.out.extend_from_slice(&value.to_le_bytes());
    }

    fn text(&mut self, span: Span) {
        let store = self.store;
        let text = store.str(span);
        self.u64(text.len());
        self.out.extend_from_slice(text.as_bytes());
    }

    // Boost's machinery

    /// Gives the class its id; true at the first meeting.
    fn meet(&mut self, class: Class) -> (i16, bool) {
        match self.classes[class as usize] {
            Some(id) => (id, false),
            None => {
                let id = self.class_count;
                self.classes[class as usize] = Some(id);
                self.class_count += 1;
                (id, true)
            }
        }
    }

    fn preamble(&mut self, class: Class) {
        self.out.push(u8::from(class.is_tracked()));
        self.u32(class.version());
    }

    fn value(&mut self, class: Class) {
        if self.meet(class).1 {
            self.preamble(class);
        }
        if class.is_tracked() {
            self.new_object();
        }
    }

    fn new_object(&mut self) -> u32 {
        let id = self.object_count;
        self.u32(id);
        self.object_count += 1;
        id
    }

    /// Writes a pointer to the object with this id, or to a new object, whose id is the answer.
    fn pointer(&mut self, shared: Class, data: Class, known: u32) -> Option<u32> {
        self.value(shared);
        let (class_id, first) = self.meet(data);
        self.out.extend_from_slice(&class_id.to_le_bytes());
        if first {
            self.preamble(data);
        }
        if known == UNWRITTEN {
            return Some(self.new_object());
        }
        self.u32(known);
        None
    }

    fn container(&mut self, class: Class, count: u32) {
        self.value(class);
        self.u64(count as usize);
        self.u32(0);
    }

    // Elements

    fn attributes(&mut self, span: Span) {
        self.container(Class::AttributeMap, span.len);
        let store = self.store;
        for attribute in &store.attributes[span.range()] {
            self.value(Class::AttributePair);
            self.text(attribute.key);
            self.value(Class::Attribute);
            self.text(attribute.value);
        }
    }

    fn point(&mut self, index: usize) {
        self.value(Class::Point);
        let known = self.points[index];
        if let Some(id) = self.pointer(Class::PointPointer, Class::PointData, known) {
            self.points[index] = id;
            let point = self.store.points[index];
            self.i64(point.id);
            self.attributes(point.attributes);
            for coordinate in point.position {
                self.out.extend_from_slice(&coordinate.to_le_bytes());
            }
        }
    }

    fn line(&mut self, class: Class, handle: Handle) {
        self.value(class);
        self.out.push(u8::from(handle.is_inverted()));
        let index = handle.index();
        let known = self.lines[index];
        if let Some(id) = self.pointer(Class::LineStringPointer, Class::LineStringData, known) {
            self.lines[index] = id;
            let store = self.store;
            let line = store.lines[index];
            self.i64(line.id);
            self.attributes(line.attributes);
            self.container(Class::Points, line.points.len);
            for point in &store.line_points[line.points.range()] {
                self.point(*point as usize);
            }
        }
    }

    fn ring(&mut self, ring: Span) {
        self.container(Class::LineStrings, ring.len);
        let store = self.store;
        for line in &store.ring_lines[ring.range()] {
            self.line(Class::LineString, *line);
        }
    }

    fn area(&mut self, index: usize) {
        self.value(Class::Area);
        let known = self.areas[index];
        if let Some(id) = self.pointer(Class::AreaPointer, Class::AreaData, known) {
            self.areas[index] = id;
            let store = self.store;
            let area = store.areas[index];
            self.i64(area.id);
            self.attributes(area.attributes);
            self.container(Class::Rings, area.inner.len);
            for ring in &store.rings[area.inner.range()] {
                self.ring(*ring);
            }
            self.ring(area.outer);
            self.u64(area.rules.len as usize);
            let (next, end) = (area.rules.start, area.rules.start + area.rules.len);
            self.stack.push(Frame::Area { next, end });
        }
    }

    fn lanelet(&mut self, handle: Handle) {
        self.value(Class::Lanelet);
        self.out.push(u8::from(handle.is_inverted()));
        let index = handle.index();
        let known = self.lanelets[index];
        if let Some(id) = self.pointer(Class::LaneletPointer, Class::LaneletData, known) {
            self.lanelets[index] = id;
            let lanelet = self.store.lanelets[index];
            self.i64(lanelet.id);
            self.attributes(lanelet.attributes);
            self.line(Class::LineString, lanelet.left);
            self.line(Class::LineString, lanelet.right);
            self.u64(lanelet.rules.len as usize);
            let (next, end) = (lanelet.rules.start, lanelet.rules.start + lanelet.rules.len);
            self.stack.push(Frame::Lanelet { index, next, end });
        }
    }

    fn rule(&mut self, index: usize) {
        let rule = self.store.rules[index];
        self.value(Class::RulePointer);
        self.i64(rule.id);
        if std::mem::replace(&mut self.rules[index], true) {
            return;
        }
        self.pointer(Class::RuleDataPointer, Class::RuleData, UNWRITTEN);
        self.i64(rule.id);
        self.attributes(rule.attributes);
        self.container(Class::RoleMap, rule.roles.len);
        self.stack.push(Frame::Rule { next: rule.roles.start, end: rule.roles.start + rule.roles.len });
    }

    fn parameter(&mut self, parameter: Parameter) {
        self.value(Class::Parameter);
        let kind = parameter.kind();
        self.u32(kind as u32);
        let handle = parameter.handle();
        match kind {
            ParameterKind::Point => self.point(handle.index()),
            ParameterKind::LineString => self.line(Class::LineString, handle),
            ParameterKind::Polygon => self.line(Class::Polygon, handle),
            ParameterKind::Lanelet => {
                self.value(Class::WeakLanelet);
                self.lanelet(handle);
            }
            ParameterKind::Area => {
                self.value(Class::WeakArea);
                self.area(handle.index());
            }
        }
    }

    /// Writes what is waiting on the stack, and what that brings along.
    fn complete(&mut self) {
        let store = self.store;
        while let Some(frame) = self.stack.last_mut() {
            match frame {
                Frame::Lanelet { next, end, .. } | Frame::Area { next, end } if *next < *end => {
                    let member = store.members[*next as usize];
                    *next += 1;
                    self.rule(member as usize);
                }
                Frame::Rule { next, end } if *next < *end => {
                    let role = store.roles[*next as usize];
                    *next += 1;
                    self.value(Class::RolePair);
                    self.text(role.name);
                    self.container(Class::Parameters, role.parameters.len);
                    let (next, end) = (role.parameters.start, role.parameters.start + role.parameters.len);
                    self.stack.push(Frame::Parameters { next, end });
                }
                Frame::Parameters { next, end } if *next < *end => {
                    let parameter = store.parameters[*next as usize];
                    *next += 1;
                    self.parameter(parameter);
                }
                Frame::Lanelet { index, .. } => {
                    let centerline = store.lanelets[*index].centerline;
                    self.out.push(u8::from(centerline != Handle::NONE));
                    if centerline != Handle::NONE {
                        self.line(Class::LineString, centerline);
                    }
                    self.stack.pop();
                }
                Frame::Area { .. } | Frame::Rule { .. } | Frame::Parameters { .. } => {
                    self.stack.pop();
                }
            }
        }
    }
}
