//! Appends values to a message being serialised; owns alignment.

use super::ENCAPSULATION_BYTES;
use crate::Interface;

/// Bytes that a message has room for before it grows for the first time.
const FIRST_ROOM_BYTES: usize = 256;

/// A message being written, little endian, header first.
#[derive(Debug)]
pub struct Writer {
    /// The message so far, and zeros behind it: padding is made by stepping over them.
    bytes: Vec<u8>,
    /// Where the message ends.
    end: usize,
    interface: Interface,
}

impl Writer {
    /// Starts a message with its encapsulation header (`CDR_LE`, no options).
    #[must_use]
    pub fn new(interface: Interface) -> Self {
        let mut bytes = vec![0; FIRST_ROOM_BYTES];
        bytes[1] = 1;
        Self { bytes, end: ENCAPSULATION_BYTES, interface }
    }

    /// The interface to write for.
    #[must_use]
    pub fn interface(&self) -> Interface {
        self.interface
    }

    /// The bytes of the whole message.
    #[must_use]
    pub fn finish(mut self) -> Vec<u8> {
        self.bytes.truncate(self.end);
        self.bytes
    }

    /// One primitive, aligned to its size.
    #[inline(always)]
    pub(super) fn put<const N: usize>(&mut self, value: [u8; N]) {
        let start = (self.end - ENCAPSULATION_BYTES).next_multiple_of(N) + ENCAPSULATION_BYTES;
        if self.bytes.len() < start + N {
            self.grow(start + N);
        }
        self.bytes[start..start + N].copy_from_slice(&value);
        self.end = start + N;
    }

    pub(super) fn put_slice(&mut self, bytes: &[u8]) {
        let end = self.end + bytes.len();
        if self.bytes.len() < end {
            self.grow(end);
        }
        self.bytes[self.end..end].copy_from_slice(bytes);
        self.end = end;
    }

    /// The length of a sequence. A sequence of more than 2^32 elements would need 4 GiB on the wire; the middleware
    /// refuses such a message long before, so the length saturates.
    pub(super) fn put_length(&mut self, length: usize) {
        self.put(u32::try_from(length).unwrap_or(u32::MAX).to_le_bytes());
    }

    #[cold]
    fn grow(&mut self, needed: usize) {
        self.bytes.resize(needed.max(2 * self.bytes.len()), 0);
    }
}
