//! The way out closes, fails, panics or is slow: it costs the messages that could not be taken, they are counted and
//! reported, and the next cycle is normal.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "support/faulty.rs"]
mod faulty;
#[path = "support/inputs.rs"]
mod inputs;

use crossbeam_channel::{bounded, unbounded};
use faulty::{PATIENCE, START, Setup, THREADS, anchor, block_on, break_down};
use messages::builtin_interfaces::Time;
use messages::nav_msgs::Odometry;
use messages::std_msgs::Header;
use selector_actors::{Input, OutputTopic, Publication, SinkError, SystemError};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

const MANY: u32 = 32;
const PER_CYCLE: u64 = 14;

fn full() -> Result<(), SinkError> {
    Err(SinkError(Arc::new(io::Error::from(io::ErrorKind::StorageFull))))
}

#[test]
fn a_closed_channel_loses_messages_and_no_cycle() {
    for threads in THREADS {
        let (sender, receiver) = unbounded::<Publication>();
        let sink = move |publication: &Publication| {
            sender
                .send(publication.clone())
                .map_err(|_| SinkError(Arc::new(io::Error::from(io::ErrorKind::BrokenPipe))))
        };
        let node = Setup { sink: Box::new(sink), ..Setup::new(threads) }.start();
        node.assert_normal("before");
        drop(receiver);
        let before = node.system.inlets().tally().unpublished();
        for lost in 1..=3 {
            node.bring(&anchor(START, MANY));
            let seen = node.next();
            assert!(seen.published.is_empty(), "nothing was taken");
            let judged = seen.judged().unwrap();
            assert!(judged.verdicts.iter().all(|verdict| verdict.accepted), "and yet all were judged");
            assert_eq!(node.system.inlets().tally().unpublished() - before, lost * PER_CYCLE);
        }
        let told = node.system.settle();
        assert!(matches!(told, Err(SystemError::Sink(_))), "{told:?}");
        assert!(told.unwrap_err().to_string().starts_with("an output cannot be written"));
    }
}

#[test]
fn a_sink_that_fails_for_a_while_loses_what_it_was_given_then() {
    for threads in THREADS {
        let fails = Arc::new(AtomicBool::new(false));
        let failing = fails.clone();
        let sink = move |publication: &Publication| {
            let is_set = publication.topic == OutputTopic::ValidatedTrajectories;
            if is_set && failing.load(Ordering::Relaxed) { full() } else { Ok(()) }
        };
        let node = Setup { sink: Box::new(sink), ..Setup::new(threads) }.start();
        fails.store(true, Ordering::Relaxed);
        node.bring(&anchor(START, MANY));
        let seen = node.next();
        assert!(seen.on(OutputTopic::ValidatedTrajectories).is_none());
        assert_eq!(seen.published.len() as u64, PER_CYCLE - 1, "the other outputs are out");
        fails.store(false, Ordering::Relaxed);
        node.bring(&anchor(START, MANY));
        let seen = node.next();
        seen.assert_normal(MANY as usize, "the next cycle");
        assert_eq!(seen.value("outputs.not_sent"), Some("1"), "and it tells what was lost");
    }
}

#[test]
fn a_sink_that_panics_loses_the_message_and_ends_its_cycle() {
    for threads in THREADS {
        let panics = Arc::new(AtomicBool::new(false));
        let panicking = panics.clone();
        let sink = move |publication: &Publication| {
            if publication.topic == OutputTopic::Trajectory && panicking.load(Ordering::Relaxed) {
                break_down();
            }
            Ok(())
        };
        let node = Setup { sink: Box::new(sink), ..Setup::new(threads) }.start();
        panics.store(true, Ordering::Relaxed);
        node.bring(&anchor(START, MANY));
        let seen = node.next();
        assert!(seen.driven().is_none() && seen.validated().is_some());
        let told = node.system.settle().unwrap_err().to_string();
        assert_eq!(told, "an output cannot be written: the sink panicked: broken on purpose");
        panics.store(false, Ordering::Relaxed);
        node.bring(&anchor(START, MANY));
        let seen = node.next();
        seen.assert_normal(MANY as usize, "the next cycle");
        assert_eq!(seen.value("outputs.not_sent"), Some("1"));
    }
}

#[test]
fn a_sink_that_panics_over_a_report_ends_its_cycle() {
    for threads in THREADS {
        let node = Setup { observe: Box::new(|_| break_down()), ..Setup::new(threads) }.start();
        for _ in 0..3 {
            node.bring(&anchor(START, MANY));
            node.next().assert_normal(MANY as usize, "all is out before the report is looked at");
        }
        assert!(matches!(node.system.settle(), Err(SystemError::Sink(_))));
    }
}

#[test]
fn a_slow_sink_delays_cycles_and_loses_none() {
    for threads in THREADS {
        let (entered, enters) = unbounded();
        let (open, opens) = bounded::<()>(0);
        let slow = Arc::new(AtomicBool::new(false));
        let is_slow = slow.clone();
        let sink = move |publication: &Publication| {
            if publication.topic == OutputTopic::Trajectory && is_slow.swap(false, Ordering::Relaxed) {
                entered.send(()).unwrap();
                opens.recv_timeout(PATIENCE).unwrap();
            }
            Ok(())
        };
        let node = Setup { sink: Box::new(sink), ..Setup::new(threads) }.start();
        slow.store(true, Ordering::Relaxed);
        node.bring(&anchor(START, MANY));
        enters.recv_timeout(PATIENCE).unwrap();
        std::thread::scope(|scope| {
            for _ in 0..10 {
                scope.spawn(|| node.bring(&anchor(START, MANY)));
            }
            // Sensors wait for nobody.
            for sec in 1..=5 {
                let header = Header { stamp: Time { sec, nanosec: 0 }, ..Header::default() };
                let odometry = Input::Odometry(Arc::new(Odometry { header, ..Odometry::default() }));
                block_on(node.system.inlets().take(odometry, Instant::now())).unwrap();
            }
            open.send(()).unwrap();
        });
        let state = node.system.settle().unwrap();
        assert_eq!(state.cycles + state.coalesced, 11, "every anchor had a cycle or was merged into one");
        let seen = node.seen();
        assert_eq!(seen.len() as u64, state.cycles);
        for cycle in &seen {
            cycle.assert_normal(MANY as usize, "slow but whole");
        }
        let odometry = seen.last().unwrap().report.cycle.scene.odometry.clone();
        assert_eq!(odometry.unwrap().header.stamp.sec, 5, "the newest of the sensors");
        node.assert_normal("the next cycle");
    }
}
