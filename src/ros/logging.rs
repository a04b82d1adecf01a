//! Log lines in the forms of ROS: on the console, and as messages for `/rosout`.
//!
//! Takes what the program logs with `tracing` and what its libraries log with `log`. Our own crates speak with the
//! node's logger, every other crate with a logger of its own name. Levels are per logger. Lines of other crates are
//! thinned out where one place repeats itself; the middleware's own lines never go to `/rosout`, where they would
//! cause more of themselves. A full queue to `/rosout` drops lines and counts them; it never makes a caller wait.

mod format;
mod levels;
mod throttle;

pub use format::ConsoleFormat;
pub use levels::Levels;

use std::fmt::{self, Write as _};
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crossbeam_channel::{Receiver, Sender, TrySendError, bounded};
use messages::builtin_interfaces::Time;
use messages::rcl_interfaces::Log;
use tracing::field::{Field, Visit};
use tracing::subscriber::Interest;
use tracing::{Event, Level, Metadata, Subscriber};
use tracing_subscriber::layer::{Context, Layer, SubscriberExt};
use tracing_subscriber::registry::Registry;

use super::environment::Console;
use super::estranged::Estranged;
use throttle::{Throttle, Verdict};

/// Lines that wait for `/rosout`.
pub const ROSOUT_QUEUE: usize = 1000;

/// Time between two lines of one place in another crate.
const THROTTLE_PERIOD: Duration = Duration::from_secs(5);

/// Our own crates: they log with the node's logger.
const OWN_CRATES: [&str; 7] = [
    "trajectory_selector",
    "selector_actors",
    "selection",
    "open_space",
    "lanelet_map",
    "motion",
    "messages",
];

/// The middleware: its lines never go to `/rosout`, and only errors are shown unless its logger is asked for more.
const MIDDLEWARE: [&str; 2] = ["rustdds", "ros2_client"];

/// A field of an event that makes an error fatal: `error!(fatal = true, "..")`.
const FATAL_FIELD: &str = "fatal";

/// Severity of a log line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// For developers.
    Debug,
    /// Worth knowing.
    Info,
    /// Odd.
    Warn,
    /// Something failed.
    Error,
    /// The end.
    Fatal,
}

impl Severity {
    /// Name as ROS prints it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Debug => "DEBUG",
            Self::Info => "INFO",
            Self::Warn => "WARN",
            Self::Error => "ERROR",
            Self::Fatal => "FATAL",
        }
    }

    /// Number in `rcl_interfaces/msg/Log`.
    #[must_use]
    pub const fn number(self) -> u8 {
        match self {
            Self::Debug => Log::DEBUG,
            Self::Info => Log::INFO,
            Self::Warn => Log::WARN,
            Self::Error => Log::ERROR,
            Self::Fatal => Log::FATAL,
        }
    }

    /// The severity of a level; traces have none and are never shown.
    fn of(level: Level) -> Option<Self> {
        match level {
            Level::ERROR => Some(Self::Error),
            Level::WARN => Some(Self::Warn),
            Level::INFO => Some(Self::Info),
            Level::DEBUG => Some(Self::Debug),
            _ => None,
        }
    }
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A queue for [`RosLog::new`] and whoever publishes on `/rosout`.
#[must_use]
pub fn rosout_queue() -> (Sender<Log>, Receiver<Log>) {
    bounded(ROSOUT_QUEUE)
}

/// Where log lines of the process go. Clones share everything.
#[derive(Clone)]
pub struct RosLog(Arc<Shared>);

struct Shared {
    /// Name of the node's logger.
    node: String,
    levels: Levels,
    console: Option<(ConsoleFormat, Mutex<Box<dyn Write + Send>>)>,
    rosout: Option<Sender<Log>>,
    lost: AtomicU64,
    throttle: Mutex<Throttle>,
    /// Time zero of the throttle.
    start: Instant,
    wall_clock: fn() -> Time,
}

/// A line on its way, not yet shown to anybody.
struct Line<'a> {
    severity: Severity,
    target: &'a str,
    file: &'a str,
    function: &'a str,
    line: u32,
}

impl RosLog {
    /// Lines of the node whose logger is `node` (see [`super::names::Names::logger`]), on the console unless it is
    /// `None`, and to `/rosout` unless that is `None`.
    #[must_use]
    pub fn new(node: &str, levels: Levels, console: Option<&Console>, rosout: Option<Sender<Log>>) -> Self {
        let console = console.map(|console| {
            let (terminal, writer): (bool, Box<dyn Write + Send>) = if console.to_stdout {
                (std::io::stdout().is_terminal(), Box::new(std::io::stdout()))
            } else {
                (std::io::stderr().is_terminal(), Box::new(std::io::stderr()))
            };
            let coloured = console.coloured.unwrap_or(terminal);
            (ConsoleFormat::new(console.format.as_deref(), coloured), writer)
        });
        Self::with(node, levels, console, rosout, now)
    }

    fn with(
        node: &str,
        levels: Levels,
        console: Option<(ConsoleFormat, Box<dyn Write + Send>)>,
        rosout: Option<Sender<Log>>,
        wall_clock: fn() -> Time,
    ) -> Self {
        Self(Arc::new(Shared {
            node: node.to_owned(),
            levels,
            console: console.map(|(format, writer)| (format, Mutex::new(writer))),
            rosout,
            lost: AtomicU64::new(0),
            throttle: Mutex::new(Throttle::new(THROTTLE_PERIOD)),
            start: Instant::now(),
            wall_clock,
        }))
    }

    /// Takes in all log lines of the process from now on. What the middleware says of lost peers is overheard, whether it
    /// is shown or not.
    ///
    /// # Errors
    /// The process has a place for its log lines already.
    pub fn install(&self, estranged: &Estranged) -> Result<(), AlreadyInstalled> {
        tracing::subscriber::set_global_default(Registry::default().with(self.clone()))
            .map_err(|_| AlreadyInstalled)?;
        let ear = Ear { log: self.clone(), estranged: estranged.clone() };
        log::set_boxed_logger(Box::new(ear)).map_err(|_| AlreadyInstalled)?;
        log::set_max_level(self.0.levels.most_verbose().max(log::LevelFilter::Info));
        Ok(())
    }

    /// Lines that found the queue to `/rosout` full and were lost there.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.0.lost.load(Ordering::Relaxed)
    }

    fn passes(&self, target: &str, severity: Severity) -> bool {
        severity >= self.0.levels.lowest(&self.0.logger(target))
    }

    /// Shows a line whose level has been checked. The text is made only if it will be seen.
    fn show(&self, line: &Line<'_>, elapsed: Duration, text: impl FnOnce() -> String) {
        let shared = &*self.0;
        let krate = krate(line.target);
        let mut suppressed = 0;
        if !OWN_CRATES.contains(&krate) {
            let mut throttle = shared.throttle.lock().unwrap_or_else(PoisonError::into_inner);
            match throttle.ask((line.target, line.file, line.line), elapsed) {
                Verdict::Hide => return,
                Verdict::Show { suppressed: hidden } => suppressed = hidden,
            }
        }
        let mut msg = text();
        if suppressed > 0 {
            // Writing to a string cannot fail.
            let _ = write!(msg, " ({suppressed} suppressed)");
        }
        let log = Log {
            stamp: (shared.wall_clock)(),
            level: line.severity.number(),
            name: shared.logger(line.target),
            msg,
            file: line.file.to_owned(),
            function: line.function.to_owned(),
            line: line.line,
        };
        if let Some((format, writer)) = &shared.console {
            let text = format.line(line.severity, &log);
            let mut writer = writer.lock().unwrap_or_else(PoisonError::into_inner);
            // Nobody can be told that the console is gone.
            let _ = writer.write_all(text.as_bytes()).and_then(|()| writer.flush());
        }
        if let Some(rosout) = shared.rosout.as_ref().filter(|_| !MIDDLEWARE.contains(&krate))
            && let Err(TrySendError::Full(_)) = rosout.try_send(log)
        {
            shared.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn elapsed(&self) -> Duration {
        self.0.start.elapsed()
    }
}

impl fmt::Debug for RosLog {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RosLog")
            .field("node", &self.0.node)
            .field("lost", &self.lost())
            .finish_non_exhaustive()
    }
}

impl Shared {
    /// The logger that a module speaks with.
    fn logger(&self, target: &str) -> String {
        if OWN_CRATES.contains(&krate(target)) { self.node.clone() } else { target.replace("::", ".") }
    }
}

/// The process has a place for its log lines already.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("log lines of this process go somewhere else already")]
pub struct AlreadyInstalled;

fn krate(target: &str) -> &str {
    target.split_once("::").map_or(target, |(krate, _)| krate)
}

fn now() -> Time {
    // A clock before 1970 is a broken one; lines then have the stamp 0.
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Time::from_nanoseconds(i64::try_from(since.as_nanos()).unwrap_or(i64::MAX))
}

impl<S: Subscriber> Layer<S> for RosLog {
    /// Levels do not change, so each place in the code is decided once.
    fn register_callsite(&self, metadata: &'static Metadata<'static>) -> Interest {
        let passes = metadata.is_event()
            && Severity::of(*metadata.level()).is_some_and(|severity| {
                let loudest = if severity == Severity::Error { Severity::Fatal } else { severity };
                self.passes(metadata.target(), loudest)
            });
        if passes { Interest::always() } else { Interest::never() }
    }

    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let metadata = event.metadata();
        let Some(mut severity) = Severity::of(*metadata.level()) else { return };
        let mut fields = Fields::default();
        event.record(&mut fields);
        if fields.fatal && severity == Severity::Error {
            severity = Severity::Fatal;
        }
        if !self.passes(metadata.target(), severity) {
            return;
        }
        let line = Line {
            severity,
            target: metadata.target(),
            file: metadata.file().unwrap_or_default(),
            function: metadata.module_path().unwrap_or_default(),
            line: metadata.line().unwrap_or_default(),
        };
        self.show(&line, self.elapsed(), || fields.message + &fields.others);
    }
}

/// What an event says: its message, then the other fields as ` name=value`.
#[derive(Default)]
struct Fields {
    message: String,
    others: String,
    fatal: bool,
}

impl Visit for Fields {
    fn record_bool(&mut self, field: &Field, value: bool) {
        if field.name() == FATAL_FIELD {
            self.fatal = value;
        } else {
            self.record_debug(field, &value);
        }
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        self.record_debug(field, &format_args!("{value}"));
    }

    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        // Writing to a string cannot fail.
        let _ = if field.name() == "message" {
            write!(self.message, "{value:?}")
        } else {
            write!(self.others, " {}={value:?}", field.name())
        };
    }
}

impl log::Log for RosLog {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        severity_of(metadata.level()).is_some_and(|severity| self.passes(metadata.target(), severity))
    }

    fn log(&self, record: &log::Record<'_>) {
        let Some(severity) = severity_of(record.level()) else { return };
        if !self.passes(record.target(), severity) {
            return;
        }
        let line = Line {
            severity,
            target: record.target(),
            file: record.file().unwrap_or_default(),
            function: record.module_path().unwrap_or_default(),
            line: record.line().unwrap_or_default(),
        };
        self.show(&line, self.elapsed(), || record.args().to_string());
    }

    fn flush(&self) {}
}

/// Overhears what the middleware says.
struct Ear {
    log: RosLog,
    estranged: Estranged,
}

impl log::Log for Ear {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        log::Log::enabled(&self.log, metadata)
    }

    fn log(&self, record: &log::Record<'_>) {
        self.estranged.overhear(record, Instant::now());
        log::Log::log(&self.log, record);
    }

    fn flush(&self) {}
}

fn severity_of(level: log::Level) -> Option<Severity> {
    match level {
        log::Level::Error => Some(Severity::Error),
        log::Level::Warn => Some(Severity::Warn),
        log::Level::Info => Some(Severity::Info),
        log::Level::Debug => Some(Severity::Debug),
        log::Level::Trace => None,
    }
}

#[cfg(test)]
mod tests;
