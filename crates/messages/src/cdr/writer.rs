//! Appends values to a message being serialised; owns alignment.

use super::ENCAPSULATION_BYTES;
use crate::Interface;

/// A message being written, little endian, header first.
#[derive(Debug)]
pub struct Writer {
    bytes: Vec<u8>,
    interface: Interface,
}

impl Writer {
    /// Starts a message with its encapsulation header (`CDR_LE`, no options).
    #[must_use]
    pub fn new(interface: Interface) -> Self {
        Self { bytes: vec![0, 1, 0, 0], interface }
    }

    /// The interface to write for.
    #[must_use]
    pub fn interface(&self) -> Interface {
        self.interface
    }

    /// The bytes of the whole message.
    #[must_use]
    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }

    /// One primitive, aligned to its size.
    #[inline]
    pub(super) fn put<const N: usize>(&mut self, value: [u8; N]) {
        let position = self.bytes.len() - ENCAPSULATION_BYTES;
        let padding = position.next_multiple_of(N) - position;
        self.bytes.extend_from_slice(&[0; 8][..padding]);
        self.bytes.extend_from_slice(&value);
    }

    pub(super) fn put_slice(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// The length of a sequence. A sequence of more than 2^32 elements would need 4 GiB on the wire; the middleware
    /// refuses such a message long before, so the length saturates.
    pub(super) fn put_length(&mut self, length: usize) {
        self.put(u32::try_from(length).unwrap_or(u32::MAX).to_le_bytes());
    }
}
