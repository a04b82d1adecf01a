//! Parameter files in the form of ROS 2: node patterns, `ros__parameters`, nested names.

use std::collections::HashMap;

use super::problem::{Location, Position, Problem, ProblemKind};
use super::value::ParameterValue;
use super::yaml::{self, Content, Node};

/// Key that separates node names from parameter names.
const BLOCK_KEY: &str = "ros__parameters";

/// Which node's blocks are read.
#[derive(Clone, Copy, Debug)]
pub(super) enum Target<'a> {
    /// The node with this fully qualified name.
    Node(&'a str),
    /// A node with this name in whatever namespace.
    AnyNamespace(&'a str),
}

impl Target<'_> {
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Node(name) | Self::AnyNamespace(name) => name,
        }
    }

    /// True when the pattern stands for this node: `*` is one name, `**` any number of names.
    pub(super) fn matches(&self, pattern: &str) -> bool {
        let pattern: Vec<&str> = tokens(pattern).collect();
        match self {
            Self::Node(name) => matches_tokens(&pattern, &tokens(name).collect::<Vec<_>>()),
            Self::AnyNamespace(name) => match pattern.last() {
                Some(&"*" | &"**") => true,
                Some(last) => Some(*last) == tokens(name).last(),
                None => false,
            },
        }
    }
}

fn tokens(name: &str) -> impl Iterator<Item = &str> {
    name.split('/').filter(|token| !token.is_empty())
}

fn matches_tokens(pattern: &[&str], name: &[&str]) -> bool {
    match (pattern.split_first(), name.split_first()) {
        (None, None) => true,
        (Some((&"**", rest)), _) => (0..=name.len()).any(|skip| matches_tokens(rest, &name[skip..])),
        (Some((&"*", rest)), Some((_, names))) => matches_tokens(rest, names),
        (Some((token, rest)), Some((first, names))) => token == first && matches_tokens(rest, names),
        _ => false,
    }
}

/// A value for a name.
#[derive(Clone, Debug)]
pub(super) struct Assignment {
    pub(super) name: String,
    pub(super) value: ParameterValue,
    pub(super) location: Location,
}

/// What a file says to a node.
#[derive(Debug, Default)]
pub(super) struct FileContent {
    /// In document order.
    pub(super) assignments: Vec<Assignment>,
    /// The patterns of all blocks, also of other nodes.
    pub(super) patterns: Vec<String>,
    /// True when at least one block is for the node.
    pub(super) matched: bool,
    pub(super) problems: Vec<Problem>,
}

/// Reads the text of a parameter file. Reports everything that is wrong in blocks for the target, and in the
/// structure above the blocks; says nothing about the blocks of other nodes.
pub(super) fn read(text: &str, source: usize, origin: &str, target: Target<'_>) -> FileContent {
    let mut reader = Reader { source, origin, target, content: FileContent::default() };
    match yaml::parse(text) {
        Err((at, kind)) => reader.problem(at, None, kind),
        Ok(None) => reader.problem(Position::START, None, ProblemKind::NoContent),
        Ok(Some(Node { content: Content::Scalar(ParameterValue::NotSet), at })) => {
            reader.problem(at, None, ProblemKind::NoContent);
        }
        Ok(Some(root)) => reader.names(&root, "", None),
    }
    reader.content
}

/// Reads one value in YAML, as on the command line.
pub(super) fn read_value(text: &str) -> Result<ParameterValue, ProblemKind> {
    match yaml::parse(text) {
        Ok(Some(node)) => value(&node).map_err(|(_, kind)| kind),
        Ok(None) => Err(ProblemKind::NoValue),
        Err((_, kind)) => Err(kind),
    }
}

/// The value of a scalar or list.
fn value(node: &Node) -> Result<ParameterValue, (Position, ProblemKind)> {
    match &node.content {
        Content::Scalar(ParameterValue::NotSet) => Err((node.at, ProblemKind::NoValue)),
        Content::Scalar(value) => Ok(value.clone()),
        Content::Sequence(items) => list(items).map_err(|kind| (node.at, kind)),
        Content::Mapping(_) => Err((node.at, ProblemKind::NestedList)),
    }
}

/// A list whose items all have the type of the first.
fn list(items: &[Node]) -> Result<ParameterValue, ProblemKind> {
    let mut scalars = Vec::with_capacity(items.len());
    for item in items {
        match &item.content {
            Content::Scalar(ParameterValue::NotSet) => return Err(ProblemKind::MixedList),
            Content::Scalar(value) => scalars.push(value.clone()),
            Content::Sequence(_) | Content::Mapping(_) => return Err(ProblemKind::NestedList),
        }
    }
    macro_rules! gather {
        ($($single:ident => $array:ident),*) => {
            match scalars.first() {
                None => return Ok(ParameterValue::StringArray(Vec::new())),
                $(Some(ParameterValue::$single(_)) => scalars
                    .into_iter()
                    .map(|value| match value {
                        ParameterValue::$single(value) => Some(value),
                        _ => None,
                    })
                    .collect::<Option<Vec<_>>>()
                    .map(ParameterValue::$array),)*
                Some(_) => None,
            }
        };
    }
    let typed = gather!(
        Bool => BoolArray, Integer => IntegerArray, Double => DoubleArray, String => StringArray
    );
    typed.ok_or(ProblemKind::MixedList)
}

struct Reader<'a> {
    source: usize,
    origin: &'a str,
    target: Target<'a>,
    content: FileContent,
}

impl Reader<'_> {
    fn location(&self, at: Position) -> Location {
        Location { source: self.source, origin: self.origin.to_owned(), position: Some(at) }
    }

    fn problem(&mut self, at: Position, key: Option<&str>, kind: ProblemKind) {
        let location = self.location(at);
        self.content.problems.push(Problem { key: key.map(str::to_owned), ..Problem::at(location, kind) });
    }

    fn duplicate(&mut self, key: &str, first: Position, again: Position) {
        let kind = ProblemKind::Duplicate { first_line: first.line, line: again.line };
        self.problem(again, Some(key), kind);
    }

    /// The part of the file above `ros__parameters`.
    fn names(&mut self, node: &Node, path: &str, key: Option<(&str, Position)>) {
        let Content::Mapping(entries) = &node.content else {
            let at = key.map_or(node.at, |(_, at)| at);
            return self.problem(at, key.map(|(key, _)| key), ProblemKind::NoParameterBlock);
        };
        let mut seen = HashMap::new();
        for (key, value) in entries {
            if let Some(first) = seen.insert(key.text.as_str(), key.at) {
                self.duplicate(&key.text, first, key.at);
            }
            if key.text == BLOCK_KEY {
                if path.is_empty() {
                    self.problem(key.at, Some(BLOCK_KEY), ProblemKind::NoParameterBlock);
                } else {
                    self.block(path, key.at, value);
                }
            } else if tokens(&key.text).any(|t| t.contains('*') && t != "*" && t != "**") {
                self.problem(key.at, Some(&key.text), ProblemKind::BadPattern);
            } else {
                let path = format!("{path}/{}", key.text.trim_matches('/'));
                self.names(value, &path, Some((&key.text, key.at)));
            }
        }
    }

    fn block(&mut self, pattern: &str, at: Position, node: &Node) {
        self.content.patterns.push(pattern.to_owned());
        if !self.target.matches(pattern) {
            return;
        }
        self.content.matched = true;
        match &node.content {
            Content::Mapping(_) => self.parameters(node, "", &mut HashMap::new()),
            _ => self.problem(at, Some(BLOCK_KEY), ProblemKind::NotAMap),
        }
    }

    fn parameters(&mut self, node: &Node, prefix: &str, seen: &mut HashMap<String, Position>) {
        let Content::Mapping(entries) = &node.content else { return };
        for (key, node) in entries {
            let name = if prefix.is_empty() { key.text.clone() } else { format!("{prefix}.{}", key.text) };
            if matches!(node.content, Content::Mapping(_)) {
                self.parameters(node, &name, seen);
                continue;
            }
            if let Some(first) = seen.insert(name.clone(), key.at) {
                self.duplicate(&name, first, key.at);
            }
            match value(node) {
                Ok(value) => {
                    let location = self.location(key.at);
                    self.content.assignments.push(Assignment { name, value, location });
                }
                Err((_, kind)) => self.problem(key.at, Some(&name), kind),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn node_patterns() {
        let cases = [
            ("/**", "/selector", true),
            ("/**", "/planning/selector", true),
            ("**", "/planning/selector", true),
            ("/*", "/selector", true),
            ("*", "/selector", true),
            ("/*", "/planning/selector", false),
            ("/selector", "/selector", true),
            ("selector", "/selector", true),
            ("/selector", "/planning/selector", false),
            ("/**/selector", "/selector", true),
            ("/**/selector", "/a/b/selector", true),
            ("/**/selector", "/a/b/other", false),
            ("/*/selector", "/a/selector", true),
            ("/*/selector", "/selector", false),
            ("/*/selector", "/a/b/selector", false),
            ("/planning/**", "/planning/selector", true),
            ("/planning/**", "/planning/a/b", true),
            ("/planning/**", "/planning", true),
            ("/planning/**", "/control/selector", false),
            ("/planning/*", "/planning/selector", true),
            ("/planning/selector", "/planning/selector2", false),
        ];
        for (pattern, name, expected) in cases {
            assert_eq!(Target::Node(name).matches(pattern), expected, "{pattern} {name}");
        }
    }

    #[test]
    fn any_namespace_asks_for_the_last_name_only() {
        let target = Target::AnyNamespace("selector");
        for (pattern, expected) in
            [("/a/selector", true), ("/selector", true), ("/a/**", true), ("/*", true), ("/a/other", false)]
        {
            assert_eq!(target.matches(pattern), expected, "{pattern}");
        }
    }
}
