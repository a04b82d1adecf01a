//! The flat memory of a map: one `Vec` for each kind of element, ranges instead of pointers, one text for all strings.
//!
//! Elements name each other by arena index, so cycles (lanelet, rule, lanelet) need no care and dropping a
//! map is a handful of frees. Owned by [`crate::Map`]; filled by the archive decoder, the OSM loader and
//! [`crate::MapBuilder`]. [`Store::finish`] sorts the layers and is the only way to a usable map.

use crate::error::{Layer, MapError};

/// Largest number of elements of one kind: an index must fit in a [`Parameter`].
const MAX_ELEMENTS: usize = 1 << 28;

/// A range of another arena.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Span {
    pub(crate) start: u32,
    pub(crate) len: u32,
}

impl Span {
    pub(crate) fn new(start: usize, end: usize) -> Self {
        Self { start: start as u32, len: (end - start) as u32 }
    }

    #[inline]
    pub(crate) fn range(self) -> std::ops::Range<usize> {
        let start = self.start as usize;
        start..start + self.len as usize
    }
}

/// Reference to an element and the direction in which it is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Handle(u32);

impl Handle {
    /// No element: a lanelet without a centerline.
    pub(crate) const NONE: Self = Self(u32::MAX);

    #[inline]
    pub(crate) fn new(index: u32, inverted: bool) -> Self {
        Self((index << 1) | u32::from(inverted))
    }

    #[inline]
    pub(crate) fn index(self) -> usize {
        (self.0 >> 1) as usize
    }

    #[inline]
    pub(crate) fn is_inverted(self) -> bool {
        self.0 & 1 == 1
    }

    #[inline]
    pub(crate) fn flipped(self) -> Self {
        if self == Self::NONE { self } else { Self(self.0 ^ 1) }
    }
}

/// What a parameter of a regulatory element is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ParameterKind {
    Point = 0,
    LineString = 1,
    Polygon = 2,
    Lanelet = 3,
    Area = 4,
}

/// Kind and handle in four bytes: an archive can hold one for each four bytes, and memory must stay
/// within a small multiple of the input.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parameter(u32);

impl Parameter {
    pub(crate) const EMPTY: Self = Self(0);

    pub(crate) fn new(kind: ParameterKind, handle: Handle) -> Self {
        Self(((kind as u32) << 29) | (handle.0 & 0x1fff_ffff))
    }

    pub(crate) fn handle(self) -> Handle {
        Handle(self.0 & 0x1fff_ffff)
    }

    pub(crate) fn kind(self) -> ParameterKind {
        match self.0 >> 29 {
            0 => ParameterKind::Point,
            1 => ParameterKind::LineString,
            2 => ParameterKind::Polygon,
            3 => ParameterKind::Lanelet,
            _ => ParameterKind::Area,
        }
    }
}

/// A key and its value.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AttributeRecord {
    pub(crate) key: Span,
    pub(crate) value: Span,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct PointRecord {
    pub(crate) id: i64,
    pub(crate) position: [f64; 3],
    pub(crate) attributes: Span,
}

/// Line strings and polygons share this record, as in lanelet2.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LineRecord {
    pub(crate) id: i64,
    pub(crate) attributes: Span,
    /// Range of [`Store::line_points`].
    pub(crate) points: Span,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct LaneletRecord {
    pub(crate) id: i64,
    pub(crate) attributes: Span,
    pub(crate) left: Handle,
    pub(crate) right: Handle,
    pub(crate) centerline: Handle,
    /// Range of [`Store::members`].
    pub(crate) rules: Span,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct AreaRecord {
    pub(crate) id: i64,
    pub(crate) attributes: Span,
    /// Range of [`Store::ring_lines`].
    pub(crate) outer: Span,
    /// Range of [`Store::rings`].
    pub(crate) inner: Span,
    /// Range of [`Store::members`].
    pub(crate) rules: Span,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct RuleRecord {
    pub(crate) id: i64,
    pub(crate) attributes: Span,
    /// Range of [`Store::roles`].
    pub(crate) roles: Span,
}

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RoleRecord {
    pub(crate) name: Span,
    /// Range of [`Store::parameters`].
    pub(crate) parameters: Span,
}

/// One element of a layer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) id: i64,
    pub(crate) handle: Handle,
}

/// The arenas and the layers; see the module documentation.
#[derive(Debug, Default)]
pub(crate) struct Store {
    pub(crate) text: String,
    pub(crate) attributes: Vec<AttributeRecord>,
    pub(crate) points: Vec<PointRecord>,
    pub(crate) lines: Vec<LineRecord>,
    pub(crate) line_points: Vec<u32>,
    pub(crate) areas: Vec<AreaRecord>,
    pub(crate) ring_lines: Vec<Handle>,
    pub(crate) rings: Vec<Span>,
    pub(crate) lanelets: Vec<LaneletRecord>,
    pub(crate) rules: Vec<RuleRecord>,
    pub(crate) roles: Vec<RoleRecord>,
    pub(crate) parameters: Vec<Parameter>,
    /// Regulatory elements of lanelets and areas.
    pub(crate) members: Vec<u32>,
    /// The six layers in the order of [`Layer`], each sorted by id once the store is finished.
    pub(crate) layers: [Vec<Entry>; 6],
    pub(crate) id_counter: i64,
    recent_keys: RecentKeys,
}

impl Store {
    #[inline]
    pub(crate) fn str(&self, span: Span) -> &str {
        &self.text[span.range()]
    }

    pub(crate) fn layer(&self, layer: Layer) -> &[Entry] {
        &self.layers[layer as usize]
    }

    pub(crate) fn layer_mut(&mut self, layer: Layer) -> &mut Vec<Entry> {
        &mut self.layers[layer as usize]
    }

    pub(crate) fn find(&self, layer: Layer, id: i64) -> Option<Handle> {
        let entries = self.layer(layer);
        let at = entries.binary_search_by_key(&id, |entry| entry.id).ok()?;
        Some(entries[at].handle)
    }

    /// Adds a string. Bytes that are not UTF-8 become one `?` for each broken sequence, so that the text never
    /// grows beyond its source.
    #[inline]
    pub(crate) fn push_text(&mut self, bytes: &[u8]) -> Span {
        let start = self.text.len();
        match std::str::from_utf8(bytes) {
            Ok(text) => self.text.push_str(text),
            Err(_) => {
                for chunk in bytes.utf8_chunks() {
                    self.text.push_str(chunk.valid());
                    if !chunk.invalid().is_empty() {
                        self.text.push('?');
                    }
                }
            }
        }
        Span::new(start, self.text.len())
    }

    /// Adds a key or role name, most of which were seen shortly before and are shared.
    #[inline]
    pub(crate) fn push_key(&mut self, bytes: &[u8]) -> Span {
        let slot = RecentKeys::slot(bytes);
        let known = self.recent_keys.0[slot];
        if self.text.as_bytes()[known.range()] == *bytes {
            return known;
        }
        let span = self.push_text(bytes);
        self.recent_keys.0[slot] = span;
        span
    }

    #[inline]
    pub(crate) fn push_attribute(&mut self, key: &[u8], value: &[u8]) {
        let key = self.push_key(key);
        let value = self.push_text(value);
        self.attributes.push(AttributeRecord { key, value });
    }

    /// Closes an attribute list that began at `start`: sorted by key bytes, of equal keys the first stays.
    #[inline]
    pub(crate) fn close_attributes(&mut self, start: usize) -> Span {
        let text = self.text.as_bytes();
        let list = &mut self.attributes[start..];
        let key = |attribute: &AttributeRecord| &text[attribute.key.range()];
        if !list.windows(2).all(|pair| key(&pair[0]) < key(&pair[1])) {
            list.sort_by(|a, b| key(a).cmp(key(b)));
            let mut kept = 1;
            for at in 1..list.len() {
                if key(&list[at]) != key(&list[kept - 1]) {
                    list[kept] = list[at];
                    kept += 1;
                }
            }
            self.attributes.truncate(start + kept);
        }
        Span::new(start, self.attributes.len())
    }

    /// Sorts the roles of a finished regulatory element by name bytes; of equal names the first stays.
    pub(crate) fn close_roles(&mut self, roles: Span) -> Span {
        let text = self.text.as_bytes();
        let list = &mut self.roles[roles.range()];
        let name = |role: &RoleRecord| &text[role.name.range()];
        if list.windows(2).all(|pair| name(&pair[0]) < name(&pair[1])) {
            return roles;
        }
        list.sort_by(|a, b| name(a).cmp(name(b)));
        let mut kept = 1;
        for at in 1..list.len() {
            if name(&list[at]) != name(&list[kept - 1]) {
                list[kept] = list[at];
                kept += 1;
            }
        }
        Span { start: roles.start, len: kept as u32 }
    }

    /// Sorts the layers and checks what every user relies on: unique ids, finite coordinates, indexes in range.
    pub(crate) fn finish(mut self) -> Result<Self, MapError> {
        let sizes = [
            self.points.len(),
            self.lines.len(),
            self.areas.len(),
            self.lanelets.len(),
            self.rules.len(),
            self.text.len() / 16,
            self.attributes.len() / 16,
            self.line_points.len() / 16,
            self.parameters.len() / 16,
        ];
        if sizes.iter().any(|size| *size >= MAX_ELEMENTS) {
            return Err(MapError::TooLarge { limit: MAX_ELEMENTS });
        }
        if let Some(bad) = self.points.iter().find(|point| !point.position.iter().all(|v| v.is_finite())) {
            return Err(MapError::NonFinitePoint { point: bad.id });
        }
        for layer in LAYERS {
            let entries = self.layer_mut(layer);
            if !entries.is_sorted_by_key(|entry| entry.id) {
                entries.sort_unstable_by_key(|entry| entry.id);
            }
            if let Some(pair) = entries.windows(2).find(|pair| pair[0].id == pair[1].id) {
                return Err(MapError::DuplicateId { layer, id: pair[0].id });
            }
        }
        Ok(self)
    }
}

/// All layers in archive order.
pub(crate) const LAYERS: [Layer; 6] = [
    Layer::Points,
    Layer::LineStrings,
    Layer::Polygons,
    Layer::Areas,
    Layer::Lanelets,
    Layer::RegulatoryElements,
];

/// Keys met lately, by a cheap hash. A fixed size keeps hostile keys from costing memory.
#[derive(Debug)]
struct RecentKeys([Span; 256]);

impl Default for RecentKeys {
    fn default() -> Self {
        Self([Span::default(); 256])
    }
}

impl RecentKeys {
    #[inline]
    fn slot(bytes: &[u8]) -> usize {
        let first = bytes.first().copied().unwrap_or(0);
        let last = bytes.last().copied().unwrap_or(0);
        let mixed = (bytes.len() as u32) ^ (u32::from(first) << 8) ^ (u32::from(last) << 16);
        (mixed.wrapping_mul(0x9e37_79b1) >> 24) as usize
    }
}
