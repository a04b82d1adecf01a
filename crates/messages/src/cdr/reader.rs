//! Takes values from a serialised message; owns position, alignment and the guards on lengths.

use super::{Cdr, DecodeErrorKind, ENCAPSULATION_BYTES};
use crate::Interface;

const CDR_BIG_ENDIAN: u16 = 0x0000;
const CDR_LITTLE_ENDIAN: u16 = 0x0001;

/// A position in a serialised message. Values are aligned relative to the byte behind the encapsulation header.
#[derive(Debug)]
pub struct Reader<'a> {
    body: &'a [u8],
    position: usize,
    big_endian: bool,
    interface: Interface,
}

impl<'a> Reader<'a> {
    /// Starts behind the encapsulation header of `bytes`.
    ///
    /// # Errors
    /// There is no header, or it names an encoding other than plain CDR.
    pub fn new(bytes: &'a [u8], interface: Interface) -> Result<Self, DecodeErrorKind> {
        let Some((header, body)) = bytes.split_first_chunk::<ENCAPSULATION_BYTES>() else {
            return Err(DecodeErrorKind::Truncated { needed: ENCAPSULATION_BYTES - bytes.len() });
        };
        let big_endian = match u16::from_be_bytes([header[0], header[1]]) {
            CDR_BIG_ENDIAN => true,
            CDR_LITTLE_ENDIAN => false,
            other => return Err(DecodeErrorKind::UnsupportedEncapsulation(other)),
        };
        Ok(Self { body, position: 0, big_endian, interface })
    }

    /// The interface that the message was written for.
    #[must_use]
    pub fn interface(&self) -> Interface {
        self.interface
    }

    /// Offset from the start of the message, header included.
    #[must_use]
    pub fn offset(&self) -> usize {
        ENCAPSULATION_BYTES + self.position
    }

    /// Bytes not taken yet.
    #[must_use]
    pub fn left(&self) -> usize {
        self.body.len() - self.position
    }

    #[inline]
    pub(super) fn big_endian(&self) -> bool {
        self.big_endian
    }

    /// The bytes of one primitive, aligned to its size.
    #[inline(always)]
    pub(super) fn take<const N: usize>(&mut self) -> Result<[u8; N], DecodeErrorKind> {
        let start = self.position.next_multiple_of(N);
        let taken = self.body.get(start..).and_then(|rest| rest.first_chunk::<N>());
        let Some(bytes) = taken else {
            return Err(DecodeErrorKind::Truncated { needed: start + N - self.body.len() });
        };
        self.position = start + N;
        Ok(*bytes)
    }

    /// `count` bytes as they stand.
    pub(super) fn take_slice(&mut self, count: usize) -> Result<&'a [u8], DecodeErrorKind> {
        let left = self.left();
        if count > left {
            return Err(DecodeErrorKind::Truncated { needed: count - left });
        }
        let slice = &self.body[self.position..self.position + count];
        self.position += count;
        Ok(slice)
    }

    /// `count` values that consist of primitives alone and take `N` bytes each, a multiple of eight, where they begin at
    /// one. Behind the first value all do; what stands where in them is then known to the compiler.
    pub(crate) fn take_blocks<const N: usize, T: Cdr>(
        &mut self,
        count: usize,
    ) -> Result<Vec<T>, DecodeErrorKind> {
        let mut values = Vec::with_capacity(count);
        while values.len() < count && !self.position.is_multiple_of(8) {
            values.push(T::decode(self)?);
        }
        let (blocks, _) = self.body[self.position..].as_chunks::<N>();
        let blocks = &blocks[..blocks.len().min(count - values.len())];
        for block in blocks {
            let mut reader = Self { body: block, position: 0, ..*self };
            values.push(T::decode(&mut reader)?);
        }
        self.position += N * blocks.len();
        // Too few bytes for the last ones: the reader says how many are missing.
        while values.len() < count {
            values.push(T::decode(self)?);
        }
        Ok(values)
    }

    /// The length of a sequence whose elements take at least `min_bytes` each; refused if they cannot fit.
    pub(super) fn take_length(&mut self, min_bytes: usize) -> Result<usize, DecodeErrorKind> {
        let count = u32::decode(self)?;
        let left = self.left();
        match usize::try_from(count) {
            Ok(length) if length.saturating_mul(min_bytes.max(1)) <= left => Ok(length),
            _ => Err(DecodeErrorKind::ImpossibleLength { count, left }),
        }
    }
}
