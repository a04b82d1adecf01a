//! Numbers and strings of the archive, with the offset of the first bad byte.

use crate::error::ArchiveProblem;

/// A damaged place; small, since every read returns one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fault {
    pub(super) offset: usize,
    pub(super) problem: ArchiveProblem,
}

pub(super) struct Reader<'a> {
    rest: &'a [u8],
    total: usize,
}

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, total: bytes.len() }
    }

    pub(super) fn left(&self) -> usize {
        self.rest.len()
    }

    /// A fault that begins `back` bytes before the current place.
    #[cold]
    pub(super) fn fault(&self, back: usize, problem: ArchiveProblem) -> Fault {
        Fault { offset: (self.total - self.rest.len()).saturating_sub(back), problem }
    }

    #[inline]
    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        match self.rest.split_first_chunk::<N>() {
            Some((head, rest)) => {
                self.rest = rest;
                Ok(*head)
            }
            None => Err(self.fault(0, ArchiveProblem::Truncated { needed: N - self.rest.len() })),
        }
    }

    #[inline]
    pub(super) fn u8(&mut self) -> Result<u8, Fault> {
        self.array::<1>().map(|[byte]| byte)
    }

    /// A byte that must be 0 or 1.
    #[inline]
    pub(super) fn flag(&mut self) -> Result<bool, Fault> {
        match self.u8()? {
            0 => Ok(false),
            1 => Ok(true),
            found => Err(self.fault(1, ArchiveProblem::BadFlag { found })),
        }
    }

    #[inline]
    pub(super) fn u16(&mut self) -> Result<u16, Fault> {
        self.array().map(u16::from_le_bytes)
    }

    #[inline]
    pub(super) fn i16(&mut self) -> Result<i16, Fault> {
        self.array().map(i16::from_le_bytes)
    }

    #[inline]
    pub(super) fn u32(&mut self) -> Result<u32, Fault> {
        self.array().map(u32::from_le_bytes)
    }

    #[inline]
    pub(super) fn i32(&mut self) -> Result<i32, Fault> {
        self.array().map(i32::from_le_bytes)
    }

    #[inline]
    pub(super) fn u64(&mut self) -> Result<u64, Fault> {
        self.array().map(u64::from_le_bytes)
    }

    #[inline]
    pub(super) fn i64(&mut self) -> Result<i64, Fault> {
        self.array().map(i64::from_le_bytes)
    }

    #[inline]
    pub(super) fn f64(&mut self) -> Result<f64, Fault> {
        self.array().map(f64::from_le_bytes)
    }

    /// A count of elements of at least `smallest` bytes each, `promised` bytes being spoken for already.
    #[inline]
    pub(super) fn count(&mut self, smallest: usize, promised: usize) -> Result<usize, Fault> {
        let count = self.u64()?;
        let room = self.rest.len().saturating_sub(promised);
        match usize::try_from(count) {
            Ok(fits) if fits.checked_mul(smallest).is_some_and(|bytes| bytes <= room) => Ok(fits),
            _ => Err(self.fault(8, ArchiveProblem::CountTooLarge { count })),
        }
    }

    #[inline]
    pub(super) fn bytes(&mut self) -> Result<&'a [u8], Fault> {
        let length = self.count(1, 0)?;
        let (head, rest) = self.rest.split_at(length);
        self.rest = rest;
        Ok(head)
    }
}
