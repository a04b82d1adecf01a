//! The little XML that maps are written in: tags with attributes, and everything else passed over.
//!
//! Lenient where real files are (`--` inside comments, unknown entities), strict where a silent guess could lose a
//! piece of the map: unfinished tags, attributes without quotes, tags that do not close what they opened. General
//! XML readers spend more time on a map than all the rest of loading it.

use std::borrow::Cow;

use crate::error::XmlProblem;

/// A piece of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Event<'t> {
    /// `<name ...>` or `<name .../>`; the attributes are in [`Scanner::attributes`].
    Open { name: &'t str, is_empty: bool },
    /// `</name>`.
    Close,
    /// The end of the file.
    End,
}

/// Walks through the tags of a file.
pub(super) struct Scanner<'t> {
    text: &'t str,
    at: usize,
    open: Vec<&'t str>,
    attributes: Vec<(&'t str, &'t str)>,
}

impl<'t> Scanner<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        Self { text, at: 0, open: Vec::new(), attributes: Vec::new() }
    }

    /// Names and raw values of the attributes of the tag that was opened last, in file order.
    pub(super) fn attributes(&self) -> &[(&'t str, &'t str)] {
        &self.attributes
    }

    /// Line of the present place, counted from 1.
    pub(super) fn line(&self) -> usize {
        1 + self.text.as_bytes()[..self.at].iter().filter(|byte| **byte == b'\n').count()
    }

    /// Number of elements around the present place.
    pub(super) fn depth(&self) -> usize {
        self.open.len()
    }

    pub(super) fn next(&mut self) -> Result<Event<'t>, XmlProblem> {
        loop {
            let Some(start) = self.find(b'<') else {
                self.at = self.text.len();
                return match self.open.last() {
                    None => Ok(Event::End),
                    Some(name) => Err(XmlProblem::UnfinishedElement { name: (*name).to_owned() }),
                };
            };
            self.at = start;
            match self.text.as_bytes().get(start + 1) {
                Some(b'!' | b'?') => self.pass_over()?,
                Some(b'/') => return self.close(),
                _ => return self.open(),
            }
        }
    }

    /// The next place of an ASCII byte.
    #[inline]
    fn find(&self, wanted: u8) -> Option<usize> {
        let offset = self.text.as_bytes()[self.at..].iter().position(|byte| *byte == wanted)?;
        Some(self.at + offset)
    }

    /// A comment, character data, a declaration or an instruction.
    fn pass_over(&mut self) -> Result<(), XmlProblem> {
        let rest = &self.text[self.at..];
        let end = if let Some(comment) = rest.strip_prefix("<!--") {
            comment.find("-->").map(|end| end + 4 + 3)
        } else if rest.starts_with("<![CDATA[") {
            rest.find("]]>").map(|end| end + 3)
        } else if rest.starts_with("<?") {
            rest.find("?>").map(|end| end + 2)
        } else {
            declaration_length(rest)
        };
        self.at += end.ok_or(XmlProblem::UnfinishedTag)?;
        Ok(())
    }

    fn close(&mut self) -> Result<Event<'t>, XmlProblem> {
        let end = self.find(b'>').ok_or(XmlProblem::UnfinishedTag)?;
        let name = self.text[self.at + 2..end].trim_ascii_end();
        if self.open.last() != Some(&name) {
            let expected = self.open.last().copied().unwrap_or("").to_owned();
            return Err(XmlProblem::MismatchedEnd { expected, found: name.to_owned() });
        }
        self.open.pop();
        self.at = end + 1;
        Ok(Event::Close)
    }

    fn open(&mut self) -> Result<Event<'t>, XmlProblem> {
        self.attributes.clear();
        self.at += 1;
        let name = self.word();
        if name.is_empty() {
            return Err(XmlProblem::UnfinishedTag);
        }
        loop {
            self.pass_space();
            match self.peek() {
                None => return Err(XmlProblem::UnfinishedTag),
                Some(b'>') => {
                    self.at += 1;
                    self.open.push(name);
                    return Ok(Event::Open { name, is_empty: false });
                }
                Some(b'/') => {
                    self.at += 1;
                    if self.peek() != Some(b'>') {
                        return Err(XmlProblem::UnfinishedTag);
                    }
                    self.at += 1;
                    return Ok(Event::Open { name, is_empty: true });
                }
                Some(_) => self.attribute()?,
            }
        }
    }

    fn attribute(&mut self) -> Result<(), XmlProblem> {
        let name = self.word();
        self.pass_space();
        if name.is_empty() || self.peek() != Some(b'=') {
            return Err(XmlProblem::BadAttribute);
        }
        self.at += 1;
        self.pass_space();
        let Some(quote @ (b'"' | b'\'')) = self.peek() else {
            return Err(XmlProblem::BadAttribute);
        };
        self.at += 1;
        let end = self.find(quote).ok_or(XmlProblem::UnfinishedTag)?;
        self.attributes.push((name, &self.text[self.at..end]));
        self.at = end + 1;
        Ok(())
    }

    #[inline]
    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    #[inline]
    fn pass_space(&mut self) {
        while self.peek().is_some_and(|byte| byte.is_ascii_whitespace()) {
            self.at += 1;
        }
    }

    /// Up to white space or a character that ends names.
    #[inline]
    fn word(&mut self) -> &'t str {
        let start = self.at;
        while self.peek().is_some_and(|byte| {
            !byte.is_ascii_whitespace() && !matches!(byte, b'=' | b'>' | b'/' | b'<' | b'"' | b'\'')
        }) {
            self.at += 1;
        }
        &self.text[start..self.at]
    }
}

/// Length of `<!DOCTYPE ...>` with what it may have in brackets.
fn declaration_length(rest: &str) -> Option<usize> {
    let mut brackets = 0_usize;
    for (at, byte) in rest.bytes().enumerate() {
        match byte {
            b'[' => brackets += 1,
            b']' => brackets = brackets.saturating_sub(1),
            b'>' if brackets == 0 => return Some(at + 1),
            _ => {}
        }
    }
    None
}

/// A raw value with white space made spaces and entities replaced; entities that nobody knows stay as they are
/// written.
pub(super) fn unescaped(raw: &str) -> Cow<'_, str> {
    if !raw.bytes().any(|byte| matches!(byte, b'&' | b'\t' | b'\n' | b'\r')) {
        return Cow::Borrowed(raw);
    }
    let mut out = String::with_capacity(raw.len());
    let mut rest = raw;
    while let Some(at) = rest.find(['&', '\t', '\n', '\r']) {
        out.push_str(&rest[..at]);
        rest = &rest[at..];
        if let Some(after) = rest.strip_prefix("\r\n") {
            out.push(' ');
            rest = after;
            continue;
        }
        let entity = rest.strip_prefix('&').and_then(|inside| {
            let end = inside.bytes().take(12).position(|byte| byte == b';')?;
            Some((character(&inside[..end])?, &inside[end + 1..]))
        });
        match entity {
            Some((c, after)) => {
                out.push(c);
                rest = after;
            }
            None => {
                out.push(if rest.starts_with('&') { '&' } else { ' ' });
                rest = &rest[1..];
            }
        }
    }
    out.push_str(rest);
    Cow::Owned(out)
}

fn character(entity: &str) -> Option<char> {
    match entity {
        "lt" => Some('<'),
        "gt" => Some('>'),
        "amp" => Some('&'),
        "apos" => Some('\''),
        "quot" => Some('"'),
        _ => {
            let number = entity.strip_prefix('#')?;
            let code = match number.strip_prefix(['x', 'X']) {
                Some(digits) => u32::from_str_radix(digits, 16).ok()?,
                None => number.parse().ok()?,
            };
            char::from_u32(code).filter(|c| *c != '\0')
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `name` for an opening tag, `name/` for an empty one, `/` for a closing one, with attributes.
    fn events(text: &str) -> Result<Vec<String>, XmlProblem> {
        let mut scanner = Scanner::new(text);
        let mut found = Vec::new();
        loop {
            match scanner.next()? {
                Event::End => return Ok(found),
                Event::Close => found.push("/".to_owned()),
                Event::Open { name, is_empty } => {
                    let attributes: String =
                        scanner.attributes().iter().map(|(k, v)| format!(" {k}={v}")).collect();
                    found.push(format!("{name}{}{attributes}", if is_empty { "/" } else { "" }));
                }
            }
        }
    }

    #[test]
    fn tags_and_what_is_passed_over() {
        let text = "<?xml version='1.0'?><!DOCTYPE a [<!ELEMENT b ANY>]><!-- x -- <y> -->\n<a p = '1>2' q=\"it's\">text
            <b/><c r=''></c ><![CDATA[<no>]]></a>";
        let expected = ["a p=1>2 q=it's", "b/", "c r=", "/", "/"];
        assert_eq!(events(text).unwrap(), expected);
        assert_eq!(events("").unwrap(), Vec::<String>::new());
        assert_eq!(events("<é ö='ü'/>").unwrap(), ["é/ ö=ü"]);
    }

    #[test]
    fn what_is_not_well_formed() {
        for text in [
            "<a", "<a ", "<a b", "<a b=", "<a b=1>", "<a b='1>", "<a/", "<a/ >", "< a/>", "<", "<a b>",
            "<a 'b'/>",
        ] {
            assert!(
                matches!(events(text), Err(XmlProblem::UnfinishedTag | XmlProblem::BadAttribute)),
                "{text:?} gave {:?}",
                events(text)
            );
        }
        for text in ["<!-- a", "<!-->", "<![CDATA[ ]]", "<?xml", "<!DOCTYPE [ >"] {
            assert_eq!(events(text), Err(XmlProblem::UnfinishedTag), "{text:?}");
        }
        let mismatch = |expected: &str, found: &str| {
            Err(XmlProblem::MismatchedEnd { expected: expected.to_owned(), found: found.to_owned() })
        };
        assert_eq!(events("<a></b>"), mismatch("a", "b"));
        assert_eq!(events("</a>"), mismatch("", "a"));
        assert_eq!(events("<a><b></a>"), mismatch("b", "a"));
        assert_eq!(events("<a><b/>"), Err(XmlProblem::UnfinishedElement { name: "a".to_owned() }));
    }

    #[test]
    fn entities_and_white_space() {
        for (raw, expected) in [
            ("plain", "plain"),
            ("&lt;&gt;&amp;&apos;&quot;", "<>&'\""),
            ("&#228;&#xE4;&#x1F697;", "ää🚗"),
            ("a\tb\nc\r\nd\re", "a b c d e"),
            ("&unknown; & &#0; &#xD800; &;", "&unknown; & &#0; &#xD800; &;"),
            ("&amp;lt;", "&lt;"),
            ("&éééééééééééé;", "&éééééééééééé;"),
        ] {
            assert_eq!(unescaped(raw), expected);
        }
    }
}
