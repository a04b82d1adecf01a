//! Log lines onto `/rosout`, from a thread of their own: whoever logs never waits for the network.

use super::graph::Writer;
use crossbeam_channel::{Receiver, Sender, bounded, select};
use messages::rcl_interfaces::Log;
use messages::{Interface, Message};
use std::io;
use std::thread::JoinHandle;

/// The thread that publishes log lines until it is ended.
#[derive(Debug)]
pub struct Rosout {
    ending: Sender<()>,
    thread: JoinHandle<()>,
}

impl Rosout {
    /// Starts publishing.
    ///
    /// # Errors
    /// The operating system gives no thread.
    pub fn start(writer: Writer, lines: Receiver<Log>) -> io::Result<Self> {
        let (ending, ended) = bounded::<()>(0);
        let thread = std::thread::Builder::new().name("rosout".to_owned()).spawn(move || {
            loop {
                select! {
                    recv(lines) -> line => match line {
                        Ok(line) => publish(&writer, &line),
                        Err(_) => return,
                    },
                    // The last words are said, too.
                    recv(ended) -> _ => return lines.try_iter().for_each(|line| publish(&writer, &line)),
                }
            }
        })?;
        Ok(Self { ending, thread })
    }

    /// Publishes what waits and ends the thread.
    pub fn end(self) {
        drop(self.ending);
        // A thread that has panicked has said so on the console.
        let _ = self.thread.join();
    }
}

/// A line that cannot be sent is lost: to log that would only make more lines.
fn publish(writer: &Writer, line: &Log) {
    let _ = writer.send(line.to_cdr(Interface::default()));
}
