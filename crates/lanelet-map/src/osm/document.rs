//! XML to nodes, ways and relations. Tags go straight into the text and attributes of the map to be.

use std::borrow::Cow;

use super::xml::{Event, Scanner, unescaped};
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Open {
    #[default]
    Nothing,
    Node,
    Way,
    Relation,
}

/// Names and raw values of the attributes of a tag.
type XmlAttributes<'e> = &'e [(&'e str, &'e str)];

/// State between the events of one file.
#[derive(Default)]
struct Cursor {
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
        let mut scanner = Scanner::new(&text);
        let mut cursor = Cursor::default();
        loop {
            let event = scanner.next().map_err(|problem| MapError::Xml { line: scanner.line(), problem })?;
            match event {
                Event::Open { name, is_empty } => {
                    let depth = scanner.depth() - usize::from(!is_empty);
                    self.begin(&mut cursor, depth, name, scanner.attributes());
                    if is_empty {
                        self.end(&mut cursor, depth);
                    }
                }
                Event::Close => self.end(&mut cursor, scanner.depth()),
                Event::End => break,
            }
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

    /// An opening tag; `depth` elements are around it.
    fn begin(&mut self, cursor: &mut Cursor, depth: usize, name: &str, attributes: XmlAttributes<'_>) {
        match (depth, name) {
            (0, "osm") => {
                cursor.inside_osm = true;
                cursor.seen_osm = true;
            }
            (1, kind) if cursor.inside_osm => self.begin_element(cursor, kind, attributes),
            (2, "tag") if cursor.open != Open::Nothing => self.tag(cursor, attributes),
            (2, "nd") if cursor.open == Open::Way => {
                let node = attributes.iter().find(|(name, _)| *name == "ref");
                self.way_nodes.push(node.map_or(0, |(_, value)| integer(value)));
                if let Some(way) = self.ways.last_mut() {
                    way.nodes.len += 1;
                }
            }
            (2, "member") if cursor.open == Open::Relation => self.member(attributes),
            _ => {}
        }
    }

    fn begin_element(&mut self, cursor: &mut Cursor, kind: &str, xml: XmlAttributes<'_>) {
        let open = match kind {
            "node" => Open::Node,
            "way" => Open::Way,
            "relation" => Open::Relation,
            "MetaInfo" => return self.meta_info(xml),
            _ => return,
        };
        let (mut id, mut latitude_deg, mut longitude_deg) = (0, 0.0, 0.0);
        for attribute in xml {
            match *attribute {
                ("id", value) => id = integer(value),
                ("lat", value) => latitude_deg = leading_number(value).unwrap_or(0.0),
                ("lon", value) => longitude_deg = leading_number(value).unwrap_or(0.0),
                ("action", "delete") => return,
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
    }

    /// The first file speaks for all.
    fn meta_info(&mut self, attributes: XmlAttributes<'_>) {
        if self.format_version.is_empty() && self.map_version.is_empty() {
            for attribute in attributes {
                match *attribute {
                    ("format_version", value) => self.format_version = unescaped(value).into_owned(),
                    ("map_version", value) => self.map_version = unescaped(value).into_owned(),
                    _ => {}
                }
            }
        }
    }

    fn tag(&mut self, cursor: &mut Cursor, attributes: XmlAttributes<'_>) {
        let (mut key, mut text) = (Cow::Borrowed(""), Cow::Borrowed(""));
        for attribute in attributes {
            match *attribute {
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
            return;
        }
        self.store.push_attribute(key.as_bytes(), text.as_bytes());
    }

    fn member(&mut self, attributes: XmlAttributes<'_>) {
        let (mut kind, mut id, mut role) = (None, 0, Cow::Borrowed(""));
        for attribute in attributes {
            match *attribute {
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
    }

    /// The end of an element; `depth` elements are around it.
    fn end(&mut self, cursor: &mut Cursor, depth: usize) {
        match depth {
            0 => cursor.inside_osm = false,
            1 => {
                let start = cursor.first_attribute;
                let open = std::mem::take(&mut cursor.open);
                if open == Open::Nothing {
                    return;
                }
                let attributes = self.close_attributes(start);
                let slot = match open {
                    Open::Nothing => None,
                    Open::Node => self.nodes.last_mut().map(|node| &mut node.attributes),
                    Open::Way => self.ways.last_mut().map(|way| &mut way.attributes),
                    Open::Relation => self.relations.last_mut().map(|relation| &mut relation.attributes),
                };
                if let Some(slot) = slot {
                    *slot = attributes;
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
        assert_eq!(attributes, [("d", "2"), ("n", "<ä&unknown;")]);
        assert_eq!(document.map_version, "7");
    }
}
