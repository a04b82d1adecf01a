//! The threads on which the middleware works, and whether they still do.
//!
//! RustDDS 0.15.1 says nobody when one of its threads has ended: messages are still taken for sending, none is sent, and none
//! comes. A node without them would be deaf and dumb and go on with its cycles. So it looks, and ends with an error. Where
//! the system does not list threads (other than Linux), it cannot look.

use std::fs;
use std::path::{Path, PathBuf};

/// How the threads' names begin, as far as the system keeps them (15 bytes).
const NAMES: [&str; 2] = ["RustDDS Partici", "RustDDS discove"];
const THREADS: &str = "/proc/self/task";

/// Threads that were there once.
#[derive(Debug, Default)]
pub(super) struct MiddlewareThreads {
    /// Folder of the thread in the system's list, and its name.
    threads: Vec<(PathBuf, String)>,
}

impl MiddlewareThreads {
    /// All threads of the middleware in this process.
    pub(super) fn now() -> Self {
        let folders = fs::read_dir(THREADS).into_iter().flatten().flatten().map(|entry| entry.path());
        let named = folders.filter_map(|folder| Some((name_of(&folder)?, folder)));
        let threads = named
            .filter(|(name, _)| NAMES.iter().any(|begin| name.starts_with(begin)))
            .map(|(name, folder)| (folder, name))
            .collect();
        Self { threads }
    }

    /// Those that have come since then.
    pub(super) fn since(before: &Self) -> Self {
        let mut now = Self::now();
        now.threads.retain(|thread| !before.threads.contains(thread));
        now
    }

    /// The name of one that has ended.
    pub(super) fn ended(&self) -> Option<&str> {
        // The system may give the number of a thread that has ended to another.
        let ended = self.threads.iter().find(|(folder, name)| name_of(folder).as_ref() != Some(name));
        ended.map(|(_, name)| name.as_str())
    }
}

fn name_of(folder: &Path) -> Option<String> {
    let name = fs::read_to_string(folder.join("comm")).ok()?;
    Some(name.trim_end().to_owned())
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::super::graph::{Graph, GraphOptions};
    use super::*;
    use std::net::Ipv4Addr;
    use std::sync::mpsc::channel;

    #[test]
    fn a_thread_that_has_ended_is_named() {
        let before = MiddlewareThreads::now();
        let options = GraphOptions { domain_id: 231, interfaces: vec![Ipv4Addr::LOCALHOST.into()] };
        let graph = Graph::join(&options, "/", "known").unwrap();
        let of_graph = MiddlewareThreads::since(&before);
        assert_eq!(of_graph.threads.len(), 2, "the middleware's own are known by their names: {of_graph:?}");
        assert!(graph.check().is_ok());
        drop(graph);
        while of_graph.ended().is_none() {
            std::thread::yield_now();
        }

        let before = MiddlewareThreads::now();
        let (end, ends) = channel::<()>();
        let (begun, has_begun) = channel();
        let work = move || {
            begun.send(()).unwrap();
            ends.recv().unwrap_err();
        };
        let name = "RustDDS discovery thread of a test";
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(work).unwrap();
        has_begun.recv().unwrap();
        let threads = MiddlewareThreads::since(&before);
        assert_eq!(threads.threads.len(), 1);
        assert_eq!(threads.ended(), None);
        drop(end);
        thread.join().unwrap();
        // The list of the system may follow a moment later.
        while threads.ended().is_none() {
            std::thread::yield_now();
        }
        assert_eq!(threads.ended(), Some(NAMES[1]));
    }
}
