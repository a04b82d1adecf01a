//! YAML with the place of every key and value.
//!
//! Built on parser events, because only they tell quoted from plain scalars and give all places. Anchors and
//! aliases work (upstream parameter files use them); merge keys do not. Size, depth and the nodes that aliases may
//! create are limited.

use std::collections::HashMap;

use granit_parser::{Event, Parser, ScalarStyle, ScanError, Span};

use super::problem::{Position, ProblemKind};
use super::value::ParameterValue;

/// Nodes of one document, copies for anchors and aliases included, beyond which it is refused.
const MAX_NODES: usize = 100_000;
/// Text that costs as much as a node where it is copied, in bytes.
const TEXT_PER_NODE: usize = 32;

/// A YAML value and where it begins.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) at: Position,
    pub(crate) content: Content,
}

#[derive(Clone, Debug)]
pub(crate) enum Content {
    /// Scalar, with its type decided.
    Scalar(ParameterValue),
    /// List.
    Sequence(Vec<Node>),
    /// Map in the order of the document; keys may repeat.
    Mapping(Vec<(Key, Node)>),
}

#[derive(Clone, Debug)]
pub(crate) struct Key {
    pub(crate) at: Position,
    pub(crate) text: String,
}

/// Why and where a text could not be read.
pub(crate) type Fault = (Position, ProblemKind);

/// Reads one document. `None` when there is none.
pub(crate) fn parse(text: &str) -> Result<Option<Node>, Fault> {
    let mut reader =
        Reader { parser: Parser::new_from_str(text), anchors: HashMap::new(), nodes: 0, at: Position::START };
    let mut root = None;
    loop {
        let (event, span) = reader.next()?;
        match event {
            Event::StreamStart | Event::DocumentStart(..) | Event::DocumentEnd => {}
            Event::StreamEnd => return Ok(root),
            _ if root.is_some() => return Err((position(&span), ProblemKind::SeveralDocuments)),
            event => root = Some(reader.node(event, &span)?),
        }
    }
}

/// The value of a plain (unquoted) scalar, by the rules of ROS 2 parameter files.
pub(super) fn plain_scalar(text: &str) -> ParameterValue {
    match text {
        "" | "~" | "null" | "Null" | "NULL" => ParameterValue::NotSet,
        "y" | "Y" | "yes" | "Yes" | "YES" | "true" | "True" | "TRUE" | "on" | "On" | "ON" => {
            ParameterValue::Bool(true)
        }
        "n" | "N" | "no" | "No" | "NO" | "false" | "False" | "FALSE" | "off" | "Off" | "OFF" => {
            ParameterValue::Bool(false)
        }
        _ => number(text).unwrap_or_else(|| ParameterValue::String(text.to_owned())),
    }
}

/// A number, unless the text is none. A leading zero is ambiguous (octal or not) and makes it text.
fn number(text: &str) -> Option<ParameterValue> {
    let (sign, digits) = match text.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    match digits {
        ".inf" | ".Inf" | ".INF" => return Some(ParameterValue::Double(sign * f64::INFINITY)),
        ".nan" | ".NaN" | ".NAN" if digits.len() == text.len() => {
            return Some(ParameterValue::Double(f64::NAN));
        }
        _ => {}
    }
    if let Some(hex) = digits.strip_prefix("0x") {
        let magnitude = i64::from_str_radix(hex, 16).ok().filter(|_| !hex.starts_with(['+', '-']))?;
        return Some(ParameterValue::Integer(if sign < 0.0 { -magnitude } else { magnitude }));
    }
    let all_digits = digits.bytes().all(|b| b.is_ascii_digit());
    if all_digits && digits.len() > 1 && digits.starts_with('0') {
        return None;
    }
    if all_digits {
        // Too large for 64 bits: as a double it is refused wherever an integer is declared.
        return text
            .parse()
            .map(ParameterValue::Integer)
            .or_else(|_| text.parse().map(ParameterValue::Double))
            .ok();
    }
    let starts_like_a_number = digits.starts_with(|c: char| c.is_ascii_digit() || c == '.');
    let looks_like_a_number = digits.bytes().all(|b| b.is_ascii_digit() || b".eE+-".contains(&b));
    (starts_like_a_number && looks_like_a_number)
        .then(|| text.parse().ok().map(ParameterValue::Double))
        .flatten()
}

struct Reader<'text> {
    parser: Parser<'text, granit_parser::StrInput<'text>>,
    anchors: HashMap<usize, Node>,
    nodes: usize,
    /// Place of the last event, for faults that have none of their own.
    at: Position,
}

impl<'text> Reader<'text> {
    /// The next event that is not a comment.
    fn next(&mut self) -> Result<(Event<'text>, Span), Fault> {
        loop {
            match self.parser.next_event() {
                Some(Ok((Event::Comment(..), _))) => {}
                Some(Ok((event, span))) => {
                    self.at = position(&span);
                    return Ok((event, span));
                }
                Some(Err(error)) => return Err(syntax(&error)),
                None => return Ok((Event::StreamEnd, Span::default())),
            }
        }
    }

    fn node(&mut self, event: Event<'text>, span: &Span) -> Result<Node, Fault> {
        let at = position(span);
        self.count(1, at)?;
        let (content, anchor) = match event {
            Event::Scalar(text, style, anchor, tag) => {
                let tag = tag.as_deref().map(|tag| tag.core_suffix().unwrap_or("").to_owned());
                (Content::Scalar(scalar(&text, style, tag.as_deref()).map_err(|kind| (at, kind))?), anchor)
            }
            Event::SequenceStart(_, anchor, _) => (Content::Sequence(self.sequence()?), anchor),
            Event::MappingStart(_, anchor, _) => (Content::Mapping(self.mapping()?), anchor),
            Event::Alias(anchor) => return self.alias(anchor, at),
            other => return Err((at, ProblemKind::Syntax { reason: format!("unexpected {other:?}") })),
        };
        let node = Node { at, content };
        if anchor != 0 {
            self.count(size(&node), at)?;
            self.anchors.insert(anchor, node.clone());
        }
        Ok(node)
    }

    fn sequence(&mut self) -> Result<Vec<Node>, Fault> {
        let mut items = Vec::new();
        loop {
            match self.next()? {
                (Event::SequenceEnd, _) => return Ok(items),
                (event, span) => items.push(self.node(event, &span)?),
            }
        }
    }

    fn mapping(&mut self) -> Result<Vec<(Key, Node)>, Fault> {
        let mut entries = Vec::new();
        loop {
            let key = match self.next()? {
                (Event::MappingEnd, _) => return Ok(entries),
                (Event::Scalar(text, ..), span) => {
                    self.count(1, position(&span))?;
                    Key { at: position(&span), text: text.into_owned() }
                }
                (_, span) => return Err((position(&span), ProblemKind::KeyNotText)),
            };
            let (event, span) = self.next()?;
            entries.push((key, self.node(event, &span)?));
        }
    }

    /// A copy of the anchored node, placed at the alias.
    fn alias(&mut self, anchor: usize, at: Position) -> Result<Node, Fault> {
        let Some(node) = self.anchors.get(&anchor) else {
            return Err((at, ProblemKind::Syntax { reason: "an alias inside its own anchor".to_owned() }));
        };
        let (size, node) = (size(node), Node { at, ..node.clone() });
        self.count(size, at)?;
        Ok(node)
    }

    fn count(&mut self, nodes: usize, at: Position) -> Result<(), Fault> {
        self.nodes += nodes;
        if self.nodes > MAX_NODES {
            Err((at, ProblemKind::TooManyValues { limit: MAX_NODES }))
        } else {
            Ok(())
        }
    }
}

fn scalar(text: &str, style: ScalarStyle, tag: Option<&str>) -> Result<ParameterValue, ProblemKind> {
    let wrong = |tag: &str| ProblemKind::TagMismatch { tag: tag.to_owned(), text: text.to_owned() };
    match tag {
        None if style == ScalarStyle::Plain => Ok(plain_scalar(text)),
        None | Some("str") => Ok(ParameterValue::String(text.to_owned())),
        Some("float") => match plain_scalar(text) {
            #[expect(clippy::cast_precision_loss, reason = "the file asks for a double")]
            ParameterValue::Integer(value) => Ok(ParameterValue::Double(value as f64)),
            value @ ParameterValue::Double(_) => Ok(value),
            _ => Err(wrong("float")),
        },
        Some("int") => match plain_scalar(text) {
            value @ ParameterValue::Integer(_) => Ok(value),
            _ => Err(wrong("int")),
        },
        Some("bool") => match plain_scalar(text) {
            value @ ParameterValue::Bool(_) => Ok(value),
            _ => Err(wrong("bool")),
        },
        Some(tag) => Err(wrong(tag)),
    }
}

/// What a copy costs, in nodes.
fn size(node: &Node) -> usize {
    let of_text = |text: &str| 1 + text.len() / TEXT_PER_NODE;
    match &node.content {
        Content::Scalar(ParameterValue::String(text)) => of_text(text),
        Content::Scalar(_) => 1,
        Content::Sequence(items) => 1 + items.iter().map(size).sum::<usize>(),
        Content::Mapping(entries) => {
            1 + entries.iter().map(|(key, node)| of_text(&key.text) + size(node)).sum::<usize>()
        }
    }
}

fn position(span: &Span) -> Position {
    Position { line: span.start.line(), column: span.start.col() + 1 }
}

fn syntax(error: &ScanError) -> Fault {
    let mark = error.marker();
    (Position { line: mark.line(), column: mark.col() + 1 }, ProblemKind::Syntax { reason: error.info() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_scalars_have_the_types_of_ros() {
        use ParameterValue::{Bool, Double, Integer, NotSet, String};
        let text = |t: &str| String(t.to_owned());
        let cases = [
            ("1", Integer(1)),
            ("-7", Integer(-7)),
            ("+7", Integer(7)),
            ("0", Integer(0)),
            ("0x1F", Integer(31)),
            ("-0x10", Integer(-16)),
            ("1.0", Double(1.0)),
            ("1.", Double(1.0)),
            (".5", Double(0.5)),
            ("-.5", Double(-0.5)),
            ("1e3", Double(1000.0)),
            ("-2.5E-3", Double(-0.0025)),
            (".inf", Double(f64::INFINITY)),
            ("-.inf", Double(f64::NEG_INFINITY)),
            ("1e999", Double(f64::INFINITY)),
            ("9223372036854775807", Integer(i64::MAX)),
            ("9223372036854775808", Double(9_223_372_036_854_775_808.0)),
            ("true", Bool(true)),
            ("No", Bool(false)),
            ("on", Bool(true)),
            ("", NotSet),
            ("~", NotSet),
            ("null", NotSet),
            ("010", text("010")),
            ("inf", text("inf")),
            ("nan", text("nan")),
            ("1.2.3", text("1.2.3")),
            ("e5", text("e5")),
            ("-", text("-")),
            ("0x", text("0x")),
            ("0x-1", text("0x-1")),
            ("road_border", text("road_border")),
        ];
        for (input, expected) in cases {
            assert_eq!(plain_scalar(input), expected, "{input:?}");
        }
        assert!(matches!(plain_scalar(".nan"), Double(v) if v.is_nan()));
    }

    #[test]
    fn aliases_cannot_multiply_without_bound() {
        let mut text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n".to_owned();
        for level in 1..9 {
            let previous = level - 1;
            let alias = format!("*a{previous}");
            text += &format!("a{level}: &a{level} [{}]\n", [alias.as_str(); 10].join(", "));
        }
        assert!(matches!(parse(&text), Err((_, ProblemKind::TooManyValues { .. }))));
    }

    #[test]
    fn long_texts_and_nested_anchors_cannot_be_copied_without_bound() {
        let refused = |text: &str| matches!(parse(text), Err((_, ProblemKind::TooManyValues { .. })));
        let long = "x".repeat(1 << 16);
        assert!(!refused(&format!("[&a {long}, *a, *a]")));
        assert!(refused(&format!("[&a {long}{}]", ", *a".repeat(1_000))));
        assert!(refused(&format!("[&a {{{}: 1}}{}]", &long[..1_000], ", *a".repeat(10_000))));
        let nested = |anchor: fn(usize) -> String| {
            let open: String = (0..100).map(|level| format!("{}[", anchor(level))).collect();
            format!("{open}{}{}", "x, ".repeat(10_000), "]".repeat(100))
        };
        assert!(!refused(&nested(|_| String::new())));
        assert!(refused(&nested(|level| format!("&a{level} "))));
    }

    #[test]
    fn an_alias_within_its_anchor_is_an_error() {
        assert!(parse("a: &a [*a]").is_err());
    }

    #[test]
    fn places_are_counted_from_one() {
        let node = parse("a:\n  b: 1\n").unwrap().unwrap();
        let Content::Mapping(entries) = node.content else { panic!("a map") };
        assert_eq!(entries[0].0.at, Position { line: 1, column: 1 });
        let Content::Mapping(inner) = &entries[0].1.content else { panic!("a map") };
        assert_eq!(inner[0].0.at, Position { line: 2, column: 3 });
        assert_eq!(inner[0].1.at, Position { line: 2, column: 6 });
    }
}
