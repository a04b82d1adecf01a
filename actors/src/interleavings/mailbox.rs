//! How owners send each other messages here.

use shuttle::sync::{Arc, Condvar, Mutex};
use std::collections::VecDeque;

pub(super) struct Mailbox<M> {
    queue: Mutex<VecDeque<M>>,
    moved: Condvar,
}

impl<M> Mailbox<M> {
    pub(super) fn new() -> Arc<Self> {
        Arc::new(Self { queue: Mutex::new(VecDeque::new()), moved: Condvar::new() })
    }

    /// From one owner to another.
    pub(super) fn post(&self, message: M) {
        self.queue.lock().unwrap().push_back(message);
        self.moved.notify_all();
    }

    /// From outside: waits for room.
    pub(super) fn send(&self, message: M) {
        let mut queue = self.queue.lock().unwrap();
        while !queue.is_empty() {
            queue = self.moved.wait(queue).unwrap();
        }
        queue.push_back(message);
        self.moved.notify_all();
    }

    pub(super) fn next(&self) -> M {
        let mut queue = self.queue.lock().unwrap();
        loop {
            if let Some(message) = queue.pop_front() {
                self.moved.notify_all();
                return message;
            }
            queue = self.moved.wait(queue).unwrap();
        }
    }
}
