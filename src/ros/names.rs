//! Names of the node, its topics and its services: checked, expanded, remapped.
//!
//! Node name and namespace are remapped first; every other name is expanded with the result, then the first rule
//! that matches replaces it, once. Both sides of a rule are expanded like any name. A name that breaks the rules of
//! ROS is refused with the remap rule that caused it.

use super::arguments::{NameScope, RemapKind, RemapRule};

/// What is wrong with a name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NameFault {
    /// No character at all.
    #[error("is empty")]
    Empty,
    /// Two dots in a row, or one at an end.
    #[error("has an empty part beside a dot")]
    EmptyPart,
    /// A character that no name has.
    #[error("has the character `{0}`; letters, digits and `_` between slashes are allowed")]
    BadCharacter(char),
    /// A part that begins with a digit.
    #[error("has the part `{0}`, which begins with a digit")]
    LeadingDigit(String),
    /// Two slashes in a row.
    #[error("has two slashes in a row")]
    DoubleSlash,
    /// A slash at the end.
    #[error("ends with a slash")]
    TrailingSlash,
    /// A slash in the name of a node.
    #[error("has a slash; a node's name is a single word, its namespace is set with `__ns:=`")]
    Slash,
    /// A namespace that does not say where it is.
    #[error("does not begin with a slash, as a namespace must")]
    NotAbsolute,
    /// A tilde elsewhere than at the start.
    #[error("has a `~` that is not the first character with a slash behind it")]
    Tilde,
    /// Braces around something unknown, or without partner.
    #[error("has the substitution `{0}`; `{{node}}`, `{{ns}}` and `{{namespace}}` exist")]
    Substitution(String),
    /// More characters than a topic may have.
    #[error("is longer than {MAX_NAME_BYTES} characters")]
    TooLong,
}

/// A name that is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the name `{name}` {fault}{}", .rule.as_ref().map(|rule| format!(" (remap rule `{rule}`)")).unwrap_or_default())]
pub struct NameError {
    /// The name.
    pub name: String,
    /// What is wrong with it.
    pub fault: NameFault,
    /// The remap rule that it comes from.
    pub rule: Option<String>,
}

/// Most characters of an expanded name: what the middleware can put on the wire with its prefix.
pub const MAX_NAME_BYTES: usize = 247;

/// The names of one node after remapping.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Names {
    name: String,
    namespace: String,
    fully_qualified: String,
    rules: Vec<ExpandedRule>,
}

/// A rule with both sides fully qualified.
#[derive(Clone, Debug, PartialEq, Eq)]
struct ExpandedRule {
    scope: NameScope,
    from: String,
    to: String,
}

impl Names {
    /// For a node with this name and namespace (an empty one is `/`) before remapping. Of rules for a certain node,
    /// those that rename it are for its name before, all others for its name after.
    ///
    /// # Errors
    /// A name that ROS does not allow, with the rule that caused it.
    pub fn new(name: &str, namespace: &str, rules: &[RemapRule]) -> Result<Self, NameError> {
        let renamed = rules.iter().filter(|rule| rule.is_for(name)).find_map(|rule| match &rule.kind {
            RemapKind::NodeName(name) => Some((name, rule)),
            _ => None,
        });
        let name = match renamed {
            Some((name, rule)) => checked(name, check_node_name, Some(rule))?,
            None => checked(name, check_node_name, None)?,
        };
        let moved = rules.iter().filter(|rule| rule.is_for(&name)).find_map(|rule| match &rule.kind {
            RemapKind::Namespace(namespace) => Some((namespace, rule)),
            _ => None,
        });
        let namespace = match moved {
            Some((namespace, rule)) => checked(namespace, check_namespace, Some(rule))?,
            None if namespace.is_empty() => "/".to_owned(),
            None => checked(namespace, check_namespace, None)?,
        };
        let fully_qualified = join(&namespace, &name);
        let mut names = Self { name, namespace, fully_qualified, rules: Vec::new() };
        for rule in rules.iter().filter(|rule| rule.is_for(&names.name)) {
            if let RemapKind::Name { scope, from, to } = &rule.kind {
                let expand = |name: &str| names.expand(name).map_err(|fault| error(name, fault, Some(rule)));
                let expanded = ExpandedRule { scope: *scope, from: expand(from)?, to: expand(to)? };
                names.rules.push(expanded);
            }
        }
        Ok(names)
    }

    /// Name of the node.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Namespace, beginning with `/`.
    #[must_use]
    pub fn namespace(&self) -> &str {
        &self.namespace
    }

    /// Namespace and name.
    #[must_use]
    pub fn fully_qualified(&self) -> &str {
        &self.fully_qualified
    }

    /// Name of the node's logger: the fully qualified name with dots between its parts.
    #[must_use]
    pub fn logger(&self) -> String {
        self.fully_qualified.trim_start_matches('/').replace('/', ".")
    }

    /// The topic that is meant by an absolute, relative or private (`~/..`) name.
    ///
    /// # Errors
    /// A name that ROS does not allow.
    pub fn topic(&self, name: &str) -> Result<String, NameError> {
        self.resolve(name, NameScope::Topics)
    }

    /// The service that is meant by an absolute, relative or private (`~/..`) name.
    ///
    /// # Errors
    /// A name that ROS does not allow.
    pub fn service(&self, name: &str) -> Result<String, NameError> {
        self.resolve(name, NameScope::Services)
    }

    fn resolve(&self, name: &str, scope: NameScope) -> Result<String, NameError> {
        let expanded = self.expand(name).map_err(|fault| error(name, fault, None))?;
        let rule = self
            .rules
            .iter()
            .find(|rule| (rule.scope == scope || rule.scope == NameScope::All) && rule.from == expanded);
        Ok(rule.map_or(expanded, |rule| rule.to.clone()))
    }

    /// The fully qualified name.
    fn expand(&self, name: &str) -> Result<String, NameFault> {
        let private = name.strip_prefix('~').filter(|rest| rest.is_empty() || rest.starts_with('/'));
        let name = match private {
            Some(rest) => format!("{}{rest}", self.fully_qualified),
            None => name.to_owned(),
        };
        let name = self.substitute(&name)?;
        check_name(&name)?;
        let expanded = if name.starts_with('/') { name } else { join(&self.namespace, &name) };
        if expanded.len() > MAX_NAME_BYTES { Err(NameFault::TooLong) } else { Ok(expanded) }
    }

    fn substitute(&self, name: &str) -> Result<String, NameFault> {
        let mut result = String::with_capacity(name.len());
        let mut rest = name;
        while let Some(open) = rest.find('{') {
            let inside = &rest[open..];
            let Some(close) = inside.find('}') else {
                return Err(NameFault::Substitution(inside.to_owned()));
            };
            result.push_str(&rest[..open]);
            result.push_str(match &inside[..=close] {
                "{node}" => &self.name,
                "{ns}" | "{namespace}" => &self.namespace,
                unknown => return Err(NameFault::Substitution(unknown.to_owned())),
            });
            rest = &inside[close + 1..];
        }
        result.push_str(rest);
        Ok(result)
    }
}

fn join(namespace: &str, name: &str) -> String {
    if namespace == "/" { format!("/{name}") } else { format!("{namespace}/{name}") }
}

fn error(name: &str, fault: NameFault, rule: Option<&RemapRule>) -> NameError {
    NameError { name: name.to_owned(), fault, rule: rule.map(|rule| rule.text.clone()) }
}

fn checked(
    name: &str,
    check: impl Fn(&str) -> Result<(), NameFault>,
    rule: Option<&RemapRule>,
) -> Result<String, NameError> {
    check(name).map(|()| name.to_owned()).map_err(|fault| error(name, fault, rule))
}

/// Accepts one word: letters, digits and `_`, not beginning with a digit.
pub(super) fn check_token(token: &str) -> Result<(), NameFault> {
    match token.chars().find(|c| !c.is_ascii_alphanumeric() && *c != '_') {
        Some('~') => Err(NameFault::Tilde),
        Some(wrong) => Err(NameFault::BadCharacter(wrong)),
        None if token.is_empty() => Err(NameFault::Empty),
        None if token.starts_with(|c: char| c.is_ascii_digit()) => {
            Err(NameFault::LeadingDigit(token.to_owned()))
        }
        None => Ok(()),
    }
}

/// Accepts the name of a node: one word.
pub(super) fn check_node_name(name: &str) -> Result<(), NameFault> {
    if name.contains('/') { Err(NameFault::Slash) } else { check_token(name) }
}

/// Accepts `/` and absolute names.
pub(super) fn check_namespace(name: &str) -> Result<(), NameFault> {
    match name {
        "" => Err(NameFault::Empty),
        "/" => Ok(()),
        _ if !name.starts_with('/') => Err(NameFault::NotAbsolute),
        _ => check_name(name),
    }
}

/// Accepts words between slashes, absolute or relative.
fn check_name(name: &str) -> Result<(), NameFault> {
    if name.is_empty() {
        return Err(NameFault::Empty);
    }
    if name.contains("//") {
        return Err(NameFault::DoubleSlash);
    }
    if name.ends_with('/') {
        return Err(NameFault::TrailingSlash);
    }
    name.strip_prefix('/').unwrap_or(name).split('/').try_for_each(check_token)
}

/// Accepts one side of a remap rule: words between slashes, absolute, relative or private (`~/..`).
pub(super) fn check_rule_side(name: &str) -> Result<(), NameFault> {
    match name.strip_prefix("~/") {
        Some("") => Err(NameFault::TrailingSlash),
        Some(rest) if rest.starts_with('/') => Err(NameFault::DoubleSlash),
        Some(rest) => check_name(rest),
        None => check_name(name),
    }
}

#[cfg(test)]
mod tests;
