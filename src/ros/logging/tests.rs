use super::*;
use crate::ros::arguments::LogLevel;
use log::Log as _;
use tracing::{debug, error, info, trace, warn};

const NODE: &str = "planning.selector";

/// A console that can be read.
#[derive(Clone, Default)]
struct Screen(Arc<Mutex<Vec<u8>>>);

impl Write for Screen {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Screen {
    fn lines(&self) -> Vec<String> {
        let bytes = std::mem::take(&mut *self.0.lock().unwrap());
        String::from_utf8(bytes).unwrap().lines().map(str::to_owned).collect()
    }
}

struct Fixture {
    log: RosLog,
    screen: Screen,
    rosout: Receiver<Log>,
}

fn fixture(levels: &[(&str, Severity)], queue: usize) -> Fixture {
    let levels: Vec<LogLevel> = levels
        .iter()
        .map(|(logger, level)| LogLevel { logger: Some((*logger).to_owned()), level: Some(*level) })
        .collect();
    let (sender, rosout) = bounded(queue);
    let screen = Screen::default();
    let format = ConsoleFormat::new(Some("[{severity}] [{time}] [{name}]: {message}"), false);
    let clock = || Time { sec: 7, nanosec: 8 };
    let console = (format, Box::new(screen.clone()) as Box<dyn Write + Send>);
    let log = RosLog::with(NODE, Levels::new(&levels), Some(console), Some(sender), clock);
    Fixture { log, screen, rosout }
}

impl Fixture {
    /// Runs code whose events come here.
    fn run(&self, code: impl FnOnce()) {
        tracing::subscriber::with_default(Registry::default().with(self.log.clone()), code);
    }

    fn library_line(&self, level: log::Level, target: &str, line: u32, text: &str) {
        self.log.log(
            &log::Record::builder()
                .level(level)
                .target(target)
                .file(Some("file.rs"))
                .module_path(Some(target))
                .line(Some(line))
                .args(format_args!("{text}"))
                .build(),
        );
    }
}

#[test]
fn own_lines_have_the_logger_of_the_node_on_both_ways_out() {
    let fixture = fixture(&[], 10);
    fixture.run(|| {
        trace!("never");
        debug!("not at this level");
        info!("started");
        warn!(age_s = 1.5, name = "a b", "old {}", "map");
        error!("failed");
        error!(fatal = true, "the end");
    });
    assert_eq!(
        fixture.screen.lines(),
        [
            "[INFO] [0000000007.000000008] [planning.selector]: started",
            "[WARN] [0000000007.000000008] [planning.selector]: old map age_s=1.5 name=a b",
            "[ERROR] [0000000007.000000008] [planning.selector]: failed",
            "[FATAL] [0000000007.000000008] [planning.selector]: the end",
        ]
    );
    let sent: Vec<Log> = fixture.rosout.try_iter().collect();
    assert_eq!(sent.iter().map(|log| log.level).collect::<Vec<_>>(), [20, 30, 40, 50]);
    let first = &sent[0];
    assert_eq!(
        (first.stamp, first.name.as_str(), first.msg.as_str()),
        ((fixture.log.0.wall_clock)(), NODE, "started")
    );
    assert!(first.file.ends_with("logging/tests.rs") && first.line > 0, "{first:?}");
    assert!(first.function.ends_with("ros::logging::tests"), "{first:?}");
}

#[test]
fn levels_are_per_logger() {
    let shown = |levels: &[(&str, Severity)]| {
        let fixture = fixture(levels, 10);
        fixture.run(|| {
            debug!("debug");
            info!("info");
            error!("error");
            error!(fatal = true, "fatal");
            debug!(target: "mio::poll", "foreign debug");
            info!(target: "mio::poll", "foreign info");
        });
        fixture.screen.lines().len()
    };
    assert_eq!(shown(&[]), 4);
    assert_eq!(shown(&[(NODE, Severity::Debug)]), 5);
    assert_eq!(shown(&[("planning", Severity::Debug), ("mio", Severity::Debug)]), 6);
    assert_eq!(shown(&[(NODE, Severity::Error), ("mio", Severity::Fatal)]), 2);
    assert_eq!(shown(&[(NODE, Severity::Fatal), ("mio.poll", Severity::Warn)]), 1);
}

#[test]
fn the_middleware_is_heard_only_when_it_fails_and_never_on_rosout() {
    let fixture = fixture(&[], 10);
    fixture.library_line(log::Level::Warn, "rustdds::rtps::writer", 1, "no locators");
    fixture.library_line(log::Level::Error, "rustdds::rtps::writer", 2, "gone");
    fixture.library_line(log::Level::Error, "ros2_client::context", 3, "gone, too");
    fixture.library_line(log::Level::Warn, "mio", 4, "odd");
    fixture.library_line(log::Level::Trace, "mio", 5, "never");
    assert_eq!(
        fixture.screen.lines(),
        [
            "[ERROR] [0000000007.000000008] [rustdds.rtps.writer]: gone",
            "[ERROR] [0000000007.000000008] [ros2_client.context]: gone, too",
            "[WARN] [0000000007.000000008] [mio]: odd",
        ]
    );
    let sent: Vec<String> = fixture.rosout.try_iter().map(|log| log.name).collect();
    assert_eq!(sent, ["mio"]);
    let enabled = |level, target| {
        log::Log::enabled(&fixture.log, &log::Metadata::builder().level(level).target(target).build())
    };
    assert!(enabled(log::Level::Error, "rustdds") && !enabled(log::Level::Warn, "rustdds"));
    assert!(enabled(log::Level::Info, "mio") && !enabled(log::Level::Trace, "mio"));
}

#[test]
fn a_place_in_another_crate_that_repeats_itself_is_thinned_out() {
    let fixture = fixture(&[], 10);
    for _ in 0..1000 {
        fixture.library_line(log::Level::Error, "rustdds::rtps", 1, "flood");
        fixture.library_line(log::Level::Error, "rustdds::rtps", 2, "other flood");
    }
    assert_eq!(fixture.screen.lines().len(), 2);
    let later =
        Line { severity: Severity::Error, target: "rustdds::rtps", file: "file.rs", function: "", line: 1 };
    fixture.log.show(&later, fixture.log.elapsed() + THROTTLE_PERIOD, || "flood".to_owned());
    assert_eq!(
        fixture.screen.lines(),
        ["[ERROR] [0000000007.000000008] [rustdds.rtps]: flood (999 suppressed)"]
    );
    // our own lines have throttles of their own
    fixture.run(|| (0..20).for_each(|_| warn!("ours")));
    assert_eq!(fixture.screen.lines().len(), 20);
}

#[test]
fn a_full_queue_loses_lines_and_counts_them() {
    let fixture = fixture(&[], 3);
    fixture.run(|| (0..10).for_each(|index| info!("{index}")));
    assert_eq!(fixture.log.lost(), 7);
    let sent: Vec<String> = fixture.rosout.try_iter().map(|log| log.msg).collect();
    assert_eq!(sent, ["0", "1", "2"]);
    assert_eq!(fixture.screen.lines().len(), 10, "the console shows them all");
    drop(fixture.rosout);
}

#[test]
fn nobody_listening_is_no_loss() {
    let Fixture { log, screen, rosout } = fixture(&[], 1);
    drop(rosout);
    tracing::subscriber::with_default(Registry::default().with(log.clone()), || {
        info!("one");
        info!("two");
    });
    assert_eq!((log.lost(), screen.lines().len()), (0, 2));
    let silent = RosLog::new(NODE, Levels::default(), None, None);
    tracing::subscriber::with_default(Registry::default().with(silent), || error!("to nobody"));
}
