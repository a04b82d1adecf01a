//! The form of a line on the console.

use std::fmt::Write as _;

use messages::rcl_interfaces::Log;

use super::Severity;

/// The form of ROS.
const DEFAULT: &str = "[{severity}] [{time}] [{name}]: {message}";

/// A form of lines, as `RCUTILS_CONSOLE_OUTPUT_FORMAT` describes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConsoleFormat {
    pieces: Vec<Piece>,
    coloured: bool,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Piece {
    Text(String),
    Severity,
    Name,
    Message,
    Function,
    File,
    Line,
    Time,
    Nanoseconds,
}

impl ConsoleFormat {
    /// Reads a format; without one it is the form of ROS. What is no known field in braces is plain text.
    #[must_use]
    pub fn new(format: Option<&str>, coloured: bool) -> Self {
        let mut pieces = Vec::new();
        let mut text = String::new();
        let mut rest = format.unwrap_or(DEFAULT);
        while let Some(open) = rest.find('{') {
            let (before, from) = rest.split_at(open);
            text.push_str(before);
            let field = from.find('}').and_then(|close| Some((Piece::of(&from[1..close])?, close)));
            let length = match field {
                Some((piece, close)) => {
                    pieces.extend((!text.is_empty()).then(|| Piece::Text(std::mem::take(&mut text))));
                    pieces.push(piece);
                    close + 1
                }
                None => {
                    text.push('{');
                    1
                }
            };
            rest = &from[length..];
        }
        text.push_str(rest);
        pieces.extend((!text.is_empty()).then_some(Piece::Text(text)));
        Self { pieces, coloured }
    }

    /// The whole line, with its end.
    pub(super) fn line(&self, severity: Severity, log: &Log) -> String {
        let mut line = String::with_capacity(64 + log.msg.len());
        let colour = self.coloured.then(|| colour(severity)).flatten();
        line.push_str(colour.unwrap_or_default());
        for piece in &self.pieces {
            // Writing to a string cannot fail.
            let _ = match piece {
                Piece::Text(text) => line.write_str(text),
                Piece::Severity => line.write_str(severity.name()),
                Piece::Name => line.write_str(&log.name),
                Piece::Message => write_safely(&mut line, &log.msg),
                Piece::Function => line.write_str(&log.function),
                Piece::File => line.write_str(&log.file),
                Piece::Line => write!(line, "{}", log.line),
                Piece::Time => write!(line, "{:010}.{:09}", log.stamp.sec, log.stamp.nanosec),
                Piece::Nanoseconds => write!(line, "{:019}", log.stamp.nanoseconds()),
            };
        }
        line.push_str(if colour.is_some() { "\x1b[0m\n" } else { "\n" });
        line
    }
}

impl Piece {
    fn of(field: &str) -> Option<Self> {
        Some(match field {
            "severity" => Self::Severity,
            "name" => Self::Name,
            "message" => Self::Message,
            "function_name" => Self::Function,
            "file_name" => Self::File,
            "line_number" => Self::Line,
            "time" => Self::Time,
            "time_as_nanoseconds" => Self::Nanoseconds,
            _ => return None,
        })
    }
}

fn colour(severity: Severity) -> Option<&'static str> {
    match severity {
        Severity::Debug => Some("\x1b[32m"),
        Severity::Info => None,
        Severity::Warn => Some("\x1b[33m"),
        Severity::Error | Severity::Fatal => Some("\x1b[31m"),
    }
}

/// Names that come from other nodes are part of messages: they must not steer the terminal.
fn write_safely(line: &mut String, text: &str) -> std::fmt::Result {
    for c in text.chars() {
        if c.is_control() && c != '\n' && c != '\t' {
            write!(line, "{}", c.escape_default())?;
        } else {
            line.push(c);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::builtin_interfaces::Time;

    fn log(msg: &str) -> Log {
        Log {
            stamp: Time { sec: 1_700_000_000, nanosec: 12_345 },
            level: 30,
            name: "planning.selector".to_owned(),
            msg: msg.to_owned(),
            file: "src/a.rs".to_owned(),
            function: "a::b".to_owned(),
            line: 42,
        }
    }

    #[test]
    fn forms_of_lines() {
        for (format, expected) in [
            (None, "[WARN] [1700000000.000012345] [planning.selector]: odd"),
            (Some("{message}"), "odd"),
            (
                Some(
                    "[{severity} {time}] [{name}]: {message} ({function_name}() at {file_name}:{line_number})",
                ),
                "[WARN 1700000000.000012345] [planning.selector]: odd (a::b() at src/a.rs:42)",
            ),
            (Some("{time_as_nanoseconds}"), "1700000000000012345"),
            (Some("{message}{message}"), "oddodd"),
            (Some("plain"), "plain"),
            (Some("{}{nothing} {message"), "{}{nothing} {message"),
            (Some("{{message}}"), "{odd}"),
            (Some("} {"), "} {"),
            (Some("größe {message}"), "größe odd"),
        ] {
            let line = ConsoleFormat::new(format, false).line(Severity::Warn, &log("odd"));
            assert_eq!(line, format!("{expected}\n"), "{format:?}");
        }
        let mut early = log("x");
        early.stamp = Time { sec: 7, nanosec: 8 };
        let line = |format| ConsoleFormat::new(Some(format), false).line(Severity::Info, &early);
        assert_eq!(line("{time} {time_as_nanoseconds}"), "0000000007.000000008 0000000007000000008\n");
    }

    #[test]
    fn colours() {
        let format = ConsoleFormat::new(Some("{message}"), true);
        for (severity, expected) in [
            (Severity::Debug, "\x1b[32mx\x1b[0m\n"),
            (Severity::Info, "x\n"),
            (Severity::Warn, "\x1b[33mx\x1b[0m\n"),
            (Severity::Error, "\x1b[31mx\x1b[0m\n"),
            (Severity::Fatal, "\x1b[31mx\x1b[0m\n"),
        ] {
            assert_eq!(format.line(severity, &log("x")), expected);
        }
    }

    #[test]
    fn messages_cannot_steer_the_terminal() {
        let format = ConsoleFormat::new(Some("{message}"), false);
        let line = format.line(Severity::Info, &log("a\x1b[2Jb\r\n\tc\u{9b}"));
        assert_eq!(line, "a\\u{1b}[2Jb\\r\n\tc\\u{9b}\n");
    }
}
