//! Which severities pass, by logger.

use std::collections::HashMap;

use super::{MIDDLEWARE, Severity};
use crate::ros::arguments::LogLevel;

/// Lowest severities by logger. Loggers are a tree: the level of `a` holds for `a.b` unless that has its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Levels {
    default: Severity,
    named: HashMap<String, Severity>,
}

impl Levels {
    /// The levels of ROS (everything but debug lines; of the middleware only errors), changed by the arguments in
    /// their order.
    #[must_use]
    pub fn new(arguments: &[LogLevel]) -> Self {
        let middleware = || MIDDLEWARE.map(|name| (name.to_owned(), Severity::Error));
        let mut levels = Self { default: Severity::Info, named: middleware().into() };
        for LogLevel { logger, level } in arguments {
            match (logger, level) {
                (None, level) => levels.default = level.unwrap_or(Severity::Info),
                (Some(logger), Some(level)) => {
                    levels.named.insert(logger.clone(), *level);
                }
                (Some(logger), None) => {
                    levels.named.remove(logger);
                    levels.named.extend(middleware().into_iter().filter(|(name, _)| name == logger));
                }
            }
        }
        levels
    }

    /// The lowest severity that passes for a logger.
    #[must_use]
    pub fn lowest(&self, logger: &str) -> Severity {
        let mut name = logger;
        loop {
            if let Some(level) = self.named.get(name) {
                return *level;
            }
            match name.rsplit_once('.') {
                Some((parent, _)) => name = parent,
                None => return self.default,
            }
        }
    }

    /// Lines below this level pass for no logger.
    pub(super) fn most_verbose(&self) -> log::LevelFilter {
        match self.named.values().fold(self.default, |lowest, level| lowest.min(*level)) {
            Severity::Debug => log::LevelFilter::Debug,
            Severity::Info => log::LevelFilter::Info,
            Severity::Warn => log::LevelFilter::Warn,
            Severity::Error | Severity::Fatal => log::LevelFilter::Error,
        }
    }
}

impl Default for Levels {
    fn default() -> Self {
        Self::new(&[])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Severity::{Debug, Error, Fatal, Info, Warn};

    #[test]
    fn the_nearest_logger_above_decides() {
        let set = |logger: &str, level| LogLevel { logger: Some(logger.to_owned()), level };
        let all = |level| LogLevel { logger: None, level };
        for (arguments, logger, expected) in [
            (vec![], "planning.selector", Info),
            (vec![], "rustdds.rtps.reader", Error),
            (vec![], "ros2_client", Error),
            (vec![], "rustdds_like", Info),
            (vec![all(Some(Debug))], "planning.selector", Debug),
            (vec![all(Some(Debug))], "rustdds.rtps", Error),
            (vec![all(Some(Debug)), all(Some(Warn))], "a", Warn),
            (vec![all(Some(Debug)), all(None)], "a", Info),
            (vec![set("a", Some(Warn))], "a", Warn),
            (vec![set("a", Some(Warn))], "a.b.c", Warn),
            (vec![set("a", Some(Warn))], "ab", Info),
            (vec![set("a.b", Some(Warn))], "a", Info),
            (vec![set("a", Some(Fatal)), set("a.b", Some(Debug))], "a.b.c", Debug),
            (vec![set("a.b", Some(Debug)), set("a", Some(Fatal))], "a.b.c", Debug),
            (vec![set("a", Some(Debug)), set("a", Some(Error))], "a", Error),
            (vec![set("a", Some(Debug)), set("a", None)], "a", Info),
            (vec![set("rustdds", Some(Debug))], "rustdds.rtps", Debug),
            (vec![set("rustdds", Some(Debug)), set("rustdds", None)], "rustdds.rtps", Error),
        ] {
            assert_eq!(Levels::new(&arguments).lowest(logger), expected, "{arguments:?} {logger}");
        }
        let verbose = |level| Levels::new(&[set("a", Some(level))]).most_verbose();
        assert_eq!((verbose(Debug), verbose(Error)), (log::LevelFilter::Debug, log::LevelFilter::Info));
    }
}
