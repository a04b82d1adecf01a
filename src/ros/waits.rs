//! Waits for sockets that go on when they are interrupted.
//!
//! Linux ends a wait early when the process was stopped and goes on: suspended in a shell, looked at by a debugger,
//! paused with its container, asleep with its machine. RustDDS 0.15.1 takes that for a fault, ends its threads, and the
//! node would be deaf from then on. The poller below it (mio) asks the C library for the wait by name, so the name is
//! given to a function of this program that waits on; that is seen in the linked program, by
//! `tests/ros_peers_come_and_go.rs::a_node_that_was_suspended_hears_and_answers_again`. To be removed with the first
//! RustDDS that waits on by itself.
#![expect(unsafe_code, reason = "a function of the C library can only be stood in for by one of its kind")]

use libc::{c_int, epoll_event};
use std::io;
use std::ptr;
use std::time::{Duration, Instant};

/// `epoll_wait` of the C library, which never ends with `EINTR`: what is left of the time is waited for.
///
/// # Safety
/// As the original: `events` has room for `capacity` events.
#[unsafe(no_mangle)]
unsafe extern "C" fn epoll_wait(
    epoll: c_int,
    events: *mut epoll_event,
    capacity: c_int,
    timeout_ms: c_int,
) -> c_int {
    // Nothing is negative that has an end.
    let limit = u64::try_from(timeout_ms).ok().map(Duration::from_millis);
    let begun = Instant::now();
    let mut left_ms = timeout_ms;
    loop {
        // SAFETY: what the caller promises is what is promised here; without a set of signals both functions are one.
        let ready = unsafe { libc::epoll_pwait(epoll, events, capacity, left_ms, ptr::null()) };
        if ready >= 0 || io::Error::last_os_error().kind() != io::ErrorKind::Interrupted {
            return ready;
        }
        if let Some(limit) = limit {
            // Rounded up, so that the wait is not too short; at most what it was.
            let left = limit.saturating_sub(begun.elapsed()).as_micros().div_ceil(1_000);
            left_ms = c_int::try_from(left).unwrap_or(timeout_ms);
        }
    }
}
