//! XML to nodes, ways and relations. Tags go straight into the text and attributes of the map to be.

use std::borrow::Cow;

use quick_xml::events::attributes::Attribute;
use quick_xml::events::{BytesStart, Event};
use quick_xml::name::QName;
use quick_xml::{Reader, XmlVersion};

use crate::error::{MapError, XmlProblem};
use crate::map::store::{Span, Store};
use crate::projection::Projector;

#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    pub(super) id: i64,
    pub(super) latitude_deg: f64,
    pub(super) longitude_deg: f64,
    pub(super) elevation_m: f64,
    pub(super) attributes: Span,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    pub(super) id: i64,
    pub(super) attributes: Span,
    /// Range of [`Document::way_nodes`].
    pub(super) nodes: Span,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Relation {
    pub(super) id: i64,
    pub(super) attributes: Span,
    /// Range of [`Document::members`].
    pub(super) members: Span,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MemberType {
    Node,
    Way,
    Relation,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct RelationMember {
    pub(super) kind: MemberType,
    pub(super) id: i64,
    /// Range of the store's text.
    pub(super) role: Span,
}

/// What stands in the files, in their order.
#[derive(Debug, Default)]
pub(super) struct Document {
    pub(super) nodes: Vec<Node>,
    pub(super) ways: Vec<Way>,
    pub(super) way_nodes: Vec<i64>,
    pub(super) relations: Vec<Relation>,
    pub(super) members: Vec<RelationMember>,
    /// Text and attributes of all elements; nothing else yet.
    pub(super) store: Store,
    pub(super) format_version: String,
    pub(super) map_version: String,
}

/// The element under `<osm>` that is being read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Open {
    Nothing,
    Node,
    Way,
    Relation,
}

/// State between the events of one file.
struct Cursor {
    depth: usize,
    inside_osm: bool,
    seen_osm: bool,
    open: Open,
    /// Where the attributes of the open element begin.
    first_attribute: usize,
    has_elevation: bool,
}

impl Document {
    /// Adds the elements of one file.
    pub(super) fn read(&mut self, bytes: &[u8]) -> Result<(), MapError> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let text = match std::str::from_utf8(bytes) {
            Ok(text) => Cow::Borrowed(text),
            Err(_) => String::from_utf8_lossy(bytes),
        };
        let mut reader = Reader::from_str(&text);
        let mut cursor = Cursor {
            depth: 0,
            inside_osm: false,
            seen_osm: false,
            open: Open::Nothing,
            first_attribute: 0,
            has_elevation: false,
        };
        loop {
            let event = reader
                .read_event()
                .map_err(|error| malformed(&text, reader.error_position() as usize, error.to_string()))?;
            let mut begin = |cursor: &mut Cursor, element: &BytesStart<'_>| {
                let attributes = XmlAttributes(element.attributes_raw());
                self.begin(cursor, element.name().as_ref(), attributes).map_err(|NotAnAttribute| {
                    let reason = "an attribute is not of the form name=\"value\"".to_owned();
                    malformed(&text, reader.buffer_position() as usize, reason)
                })
            };
            match event {
                Event::Start(element) => {
                    begin(&mut cursor, &element)?;
                    cursor.depth += 1;
                }
                Event::Empty(element) => {
                    begin(&mut cursor, &element)?;
                    self.end(&mut cursor);
                }
                Event::End(_) => {
                    cursor.depth = cursor.depth.saturating_sub(1);
                    self.end(&mut cursor);
                }
                Event::Eof => break,
                _ => {}
            }
        }
        if cursor.depth > 0 {
            return Err(malformed(&text, text.len(), "the file ends inside an element".to_owned()));
        }
        if cursor.seen_osm {
            Ok(())
        } else {
            Err(MapError::Xml { line: 1, problem: XmlProblem::NoOsmElement })
        }
    }

    /// MGRS if the nodes have positions, else Local.
    pub(super) fn likely_projector(&self) -> Projector {
        let has_position = |node: &Node| node.latitude_deg != 0.0 || node.longitude_deg != 0.0;
        if self.nodes.iter().any(has_position) { Projector::Mgrs } else { Projector::Local }
    }

    fn begin(
        &mut self,
        cursor: &mut Cursor,
        name: &str,
        attributes: XmlAttributes<'_>,
    ) -> Result<(), NotAnAttribute> {
        match (cursor.depth, name) {
            (0, "osm") => {
                cursor.inside_osm = true;
                cursor.seen_osm = true;
            }
            (1, kind) if cursor.inside_osm => self.begin_element(cursor, kind, attributes)?,
            (2, "tag") if cursor.open != Open::Nothing => self.tag(cursor, attributes)?,
            (2, "nd") if cursor.open == Open::Way => {
                let mut node = 0;
                for attribute in attributes {
                    if let ("ref", value) = attribute? {
                        node = integer(value);
                    }
                }
                self.way_nodes.push(node);
                if let Some(way) = self.ways.last_mut() {
                    way.nodes.len += 1;
                }
            }
            (2, "member") if cursor.open == Open::Relation => self.member(attributes)?,
            _ => {}
        }
        Ok(())
    }

    fn begin_element(
        &mut self,
        cursor: &mut Cursor,
        kind: &str,
        xml: XmlAttributes<'_>,
    ) -> Result<(), NotAnAttribute> {
        let open = match kind {
            "node" => Open::Node,
            "way" => Open::Way,
            "relation" => Open::Relation,
            "MetaInfo" => return self.meta_info(xml),
            _ => return Ok(()),
        };
        let (mut id, mut latitude_deg, mut longitude_deg) = (0, 0.0, 0.0);
        for attribute in xml {
            match attribute? {
                ("id", value) => id = integer(value),
                ("lat", value) => latitude_deg = leading_number(value).unwrap_or(0.0),
                ("lon", value) => longitude_deg = leading_number(value).unwrap_or(0.0),
                ("action", "delete") => return Ok(()),
                _ => {}
            }
        }
        cursor.open = open;
        cursor.first_attribute = self.store.attributes.len();
        cursor.has_elevation = false;
        let attributes = Span::default();
        match open {
            Open::Nothing => {}
            Open::Node => {
                self.nodes.push(Node { id, latitude_deg, longitude_deg, elevation_m: 0.0, attributes });
            }
            Open::Way => {
                let nodes = Span::new(self.way_nodes.len(), self.way_nodes.len());
                self.ways.push(Way { id, attributes, nodes });
            }
            Open::Relation => {
                let members = Span::new(self.members.len(), self.members.len());
                self.relations.push(Relation { id, attributes, members });
            }
        }
        Ok(())
    }

    /// The first file speaks for all.
    fn meta_info(&mut self, attributes: XmlAttributes<'_>) -> Result<(), NotAnAttribute> {
        if self.format_version.is_empty() && self.map_version.is_empty() {
            for attribute in attributes {
                match attribute? {
                    ("format_version", value) => self.format_version = unescaped(value).into_owned(),
                    ("map_version", value) => self.map_version = unescaped(value).into_owned(),
                    _ => {}
                }
            }
        }
        Ok(())
    }

    fn tag(&mut self, cursor: &mut Cursor, attributes: XmlAttributes<'_>) -> Result<(), NotAnAttribute> {
        let (mut key, mut text) = (Cow::Borrowed(""), Cow::Borrowed(""));
        for attribute in attributes {
            match attribute? {
                ("k", value) => key = unescaped(value),
                ("v", value) => text = unescaped(value),
                _ => {}
            }
        }
        if cursor.open == Open::Node && key == "ele" {
            if let Some(node) = self.nodes.last_mut().filter(|_| !cursor.has_elevation) {
                node.elevation_m = leading_number(&text).unwrap_or(0.0);
                cursor.has_elevation = true;
            }
            return Ok(());
        }
        self.store.push_attribute(key.as_bytes(), text.as_bytes());
        Ok(())
    }

    fn member(&mut self, attributes: XmlAttributes<'_>) -> Result<(), NotAnAttribute> {
        let (mut kind, mut id, mut role) = (None, 0, Cow::Borrowed(""));
        for attribute in attributes {
            match attribute? {
                ("type", "node") => kind = Some(MemberType::Node),
                ("type", "way") => kind = Some(MemberType::Way),
                ("type", "relation") => kind = Some(MemberType::Relation),
                ("ref", value) => id = integer(value),
                ("role", value) => role = unescaped(value),
                _ => {}
            }
        }
        if let (Some(kind), Some(relation)) = (kind, self.relations.last_mut()) {
            let role = self.store.push_key(role.as_bytes());
            self.members.push(RelationMember { kind, id, role });
            relation.members.len += 1;
        }
        Ok(())
    }

    /// The end of an element; its depth is that of the cursor.
    fn end(&mut self, cursor: &mut Cursor) {
        match cursor.depth {
            0 => cursor.inside_osm = false,
            1 => {
                let start = cursor.first_attribute;
                match std::mem::replace(&mut cursor.open, Open::Nothing) {
                    Open::Nothing => {}
                    Open::Node => {
                        let attributes = self.close_attributes(start);
                        self.nodes.iter_mut().next_back().into_iter().for_each(|n| n.attributes = attributes);
                    }
                    Open::Way => {
                        let attributes = self.close_attributes(start);
                        self.ways.iter_mut().next_back().into_iter().for_each(|w| w.attributes = attributes);
                    }
                    Open::Relation => {
                        let attributes = self.close_attributes(start);
                        self.relations
                            .iter_mut()
                            .next_back()
                            .into_iter()
                            .for_each(|r| r.attributes = attributes);
                    }
                }
            }
            _ => {}
        }
    }

    /// Of equal keys the last tag of the file wins; the store keeps the first of its list.
    fn close_attributes(&mut self, start: usize) -> Span {
        self.store.attributes[start..].reverse();
        self.store.close_attributes(start)
    }
}

fn malformed(text: &str, at: usize, reason: String) -> MapError {
    let before = &text.as_bytes()[..at.min(text.len())];
    let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
    MapError::Xml { line, problem: XmlProblem::Malformed(reason) }
}

/// The text of a tag is not a list of `name="value"`.
#[derive(Debug)]
struct NotAnAttribute;

/// Names and raw values of the attributes of a tag. The general iterator of the XML reader costs a third of the time
/// of a whole map.
struct XmlAttributes<'e>(&'e str);

impl<'e> Iterator for XmlAttributes<'e> {
    type Item = Result<(&'e str, &'e str), NotAnAttribute>;

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        let text = self.0.trim_ascii_start();
        if text.is_empty() {
            return None;
        }
        let parts = text.split_once('=').and_then(|(name, rest)| {
            let rest = rest.trim_ascii_start();
            let quote = rest.chars().next().filter(|c| matches!(c, '"' | '\''))?;
            let (value, rest) = rest[1..].split_once(quote)?;
            Some((name.trim_ascii_end(), value, rest))
        });
        let Some((name, value, rest)) = parts else {
            self.0 = "";
            return Some(Err(NotAnAttribute));
        };
        self.0 = rest;
        Some(Ok((name, value)))
    }
}

/// The value with white space and entities replaced; entities that nobody knows stay as they are written.
fn unescaped(value: &str) -> Cow<'_, str> {
    if !value.bytes().any(|byte| matches!(byte, b'&' | b'\t' | b'\n' | b'\r')) {
        return Cow::Borrowed(value);
    }
    let attribute = Attribute { key: QName(""), value: Cow::Borrowed(value) };
    attribute.normalized_value(XmlVersion::Implicit1_0).unwrap_or(Cow::Borrowed(value))
}

/// An id; 0 if the text does not begin with an integer.
fn integer(text: &str) -> i64 {
    if let Ok(id) = text.parse() {
        return id;
    }
    let text = text.trim_start();
    let sign = usize::from(text.starts_with(['-', '+']));
    let digits = text[sign..].bytes().take_while(u8::is_ascii_digit).count();
    text[..sign + digits].parse().unwrap_or(0)
}

/// The number at the beginning of a text.
pub(super) fn leading_number(text: &str) -> Option<f64> {
    if let Ok(number) = text.parse() {
        return Some(number);
    }
    let text = text.trim_start();
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let mut end = usize::from(text.starts_with(['-', '+']));
    let whole = digits(end);
    end += whole;
    let mut fraction = 0;
    if bytes.get(end) == Some(&b'.') {
        fraction = digits(end + 1);
        end += 1 + fraction;
    }
    if whole + fraction == 0 {
        return None;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'-' | b'+')));
        let exponent = digits((end + 1 + sign).min(bytes.len()));
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    text[..end].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_at_the_beginning() {
        for (text, expected) in [
            ("35.5", Some(35.5)),
            ("-3", Some(-3.0)),
            (" 4.25 m", Some(4.25)),
            ("1e3x", Some(1000.0)),
            ("1e", Some(1.0)),
            ("7.", Some(7.0)),
            (".5a", Some(0.5)),
            ("1,5", Some(1.0)),
            ("", None),
            ("-", None),
            (".", None),
            ("north", None),
        ] {
            assert_eq!(leading_number(text), expected, "{text:?}");
        }
    }

    #[test]
    fn ids_are_integers_of_64_bits() {
        for (text, expected) in
            [("9007199254740993", 9_007_199_254_740_993), ("-12", -12), ("12abc", 12), ("", 0), ("x", 0)]
        {
            assert_eq!(integer(text), expected, "{text:?}");
        }
    }

    #[test]
    fn faults_of_the_file_name_their_line() {
        for (text, line) in [
            ("<osm>\n<node id='1'>\n</way>\n</osm>", 3),
            ("<osm>\n<node id='1'>\n", 3),
            ("<osm>\n<node id=5/></osm>", 2),
            ("<map></map>", 1),
            ("", 1),
        ] {
            match Document::default().read(text.as_bytes()) {
                Err(MapError::Xml { line: found, .. }) => assert_eq!(found, line, "{text:?}"),
                other => assert!(other.is_err(), "{text:?} gave {other:?}"),
            }
        }
    }

    #[test]
    fn odd_but_legal_files() {
        let text = "\u{feff}<?xml version='1.0'?><!-- a -- b --><osm><MetaInfo format_version='1' map_version='7'/>
            <node id='1' lat='' lon='2'><tag k='n' v='&lt;&#228;&unknown;'/><tag k='d' v='1'/><tag k='d' v='2'/></node>
            <node id='2' action='delete'><tag k='x' v='y'/></node>
            <other><node id='3'/></other></osm>";
        let mut document = Document::default();
        document.read(text.as_bytes()).unwrap();
        assert_eq!(document.nodes.len(), 1);
        assert_eq!((document.nodes[0].latitude_deg, document.nodes[0].longitude_deg), (0.0, 2.0));
        let attributes: Vec<_> = document.store.attributes[document.nodes[0].attributes.range()]
            .iter()
            .map(|a| (document.store.str(a.key), document.store.str(a.value)))
            .collect();
        assert_eq!(attributes, [("d", "2"), ("n", "&lt;&#228;&unknown;")]);
        assert_eq!(document.map_version, "7");
    }
}
