//! Plain CDR (XCDR1) as ROS 2 puts it on the wire.
//!
//! Owns the rules of alignment, lengths and byte order, and the guards that keep a corrupt length from costing more
//! memory than the message has bytes.

mod reader;
mod writer;

pub use reader::Reader;
pub use writer::Writer;

use crate::Interface;
use crate::define::Definitions;
use std::borrow::Cow;
use std::sync::Arc;

/// Bytes of the encapsulation header that stands before every serialised message.
pub const ENCAPSULATION_BYTES: usize = 4;

/// Writers may pad a message to a multiple of four bytes; more behind its end is another message's content.
const MAX_PADDING_BYTES: usize = 3;

/// Why bytes are not the message they should be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DecodeErrorKind {
    /// The message ends before its content does.
    #[error("the message ends here, {needed} more bytes are needed")]
    Truncated {
        /// Bytes that the next value needs beyond those left.
        needed: usize,
    },
    /// A sequence or string claims more elements than the rest of the message can hold.
    #[error("a length of {count} cannot fit in the {left} bytes left")]
    ImpossibleLength {
        /// Claimed number of elements.
        count: u32,
        /// Bytes left behind the length.
        left: usize,
    },
    /// The encapsulation header names something else than plain CDR.
    #[error("encapsulation {0:#06x} is not plain CDR (XCDR1); set the writer to XCDR1")]
    UnsupportedEncapsulation(u16),
    /// A string without its final NUL.
    #[error("a string of {0} bytes does not end with NUL")]
    UnterminatedString(u32),
    /// A bounded sequence with more elements than its type allows.
    #[error("a sequence of at most {limit} has {count} elements")]
    TooManyElements {
        /// Elements on the wire.
        count: usize,
        /// Elements that the type allows.
        limit: usize,
    },
    /// A bool that is neither 0 nor 1.
    #[error("{0} is no bool")]
    InvalidBool(u8),
    /// Content behind the end of the message.
    #[error("{0} bytes follow the end of the message; is autoware_interface set to the version on the wire?")]
    TrailingBytes(usize),
}

/// A message that could not be decoded. The message is lost, nothing else.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{topic}: malformed {type_name} at byte {offset}: {kind}")]
pub struct DecodeError {
    /// Topic that the message came from.
    pub topic: String,
    /// ROS type name that was expected.
    pub type_name: &'static str,
    /// Offset from the start of the serialised message, encapsulation header included.
    pub offset: usize,
    /// What is wrong there.
    pub kind: DecodeErrorKind,
}

/// A type with a CDR form: primitives, strings, sequences, arrays, messages.
pub trait Cdr: Sized {
    /// Fewest bytes that a value takes on the wire; bounds the length of sequences.
    const MIN_BYTES: usize;

    /// Appends the value.
    fn encode(&self, writer: &mut Writer);

    /// Takes a value.
    ///
    /// # Errors
    /// The bytes at the reader's position are no such value.
    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeErrorKind>;

    /// Type as definitions name it: `float64`, `string`, `geometry_msgs/Pose`.
    fn definition_name() -> Cow<'static, str>;

    /// Adds the definitions of the messages that this type consists of.
    fn collect_definitions(_definitions: &mut Definitions) {}

    /// Takes `count` values; `count` is already checked against the bytes left.
    ///
    /// # Errors
    /// As [`Cdr::decode`].
    fn decode_many(reader: &mut Reader<'_>, count: usize) -> Result<Vec<Self>, DecodeErrorKind> {
        let mut values = Vec::with_capacity(count);
        for _ in 0..count {
            values.push(Self::decode(reader)?);
        }
        Ok(values)
    }

    /// Appends the values of a sequence without its length.
    fn encode_many(values: &[Self], writer: &mut Writer) {
        for value in values {
            value.encode(writer);
        }
    }
}

/// Reads one whole message with its header; the error carries the offset at which reading stopped.
pub(crate) fn read_message<T: Cdr>(
    bytes: &[u8],
    interface: Interface,
) -> Result<T, (usize, DecodeErrorKind)> {
    let mut reader = Reader::new(bytes, interface).map_err(|kind| (0, kind))?;
    let value = T::decode(&mut reader).map_err(|kind| (reader.offset(), kind))?;
    if reader.left() > MAX_PADDING_BYTES {
        return Err((reader.offset(), DecodeErrorKind::TrailingBytes(reader.left())));
    }
    Ok(value)
}

macro_rules! primitive {
    ($($type:ty: $name:literal),* $(,)?) => {$(
        impl Cdr for $type {
            const MIN_BYTES: usize = size_of::<$type>();

            #[inline]
            fn encode(&self, writer: &mut Writer) {
                writer.put(self.to_le_bytes());
            }

            #[inline]
            fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeErrorKind> {
                let bytes = reader.take()?;
                Ok(if reader.big_endian() { Self::from_be_bytes(bytes) } else { Self::from_le_bytes(bytes) })
            }

            fn definition_name() -> Cow<'static, str> {
                Cow::Borrowed($name)
            }
        }
    )*};
}

primitive!(i32: "int32", i64: "int64", u16: "uint16", u32: "uint32", u64: "uint64", f32: "float32", f64: "float64");

impl Cdr for u8 {
    const MIN_BYTES: usize = 1;

    #[inline]
    fn encode(&self, writer: &mut Writer) {
        writer.put([*self]);
    }

    #[inline]
    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeErrorKind> {
        reader.take().map(|[byte]| byte)
    }

    fn definition_name() -> Cow<'static, str> {
        Cow::Borrowed("uint8")
    }

    fn decode_many(reader: &mut Reader<'_>, count: usize) -> Result<Vec<Self>, DecodeErrorKind> {
        reader.take_slice(count).map(<[u8]>::to_vec)
    }

    fn encode_many(values: &[Self], writer: &mut Writer) {
        writer.put_slice(values);
    }
}

impl Cdr for i8 {
    const MIN_BYTES: usize = 1;

    #[inline]
    fn encode(&self, writer: &mut Writer) {
        writer.put(self.to_le_bytes());
    }

    #[inline]
    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeErrorKind> {
        u8::decode(reader).map(u8::cast_signed)
    }

    fn definition_name() -> Cow<'static, str> {
        Cow::Borrowed("int8")
    }

    /// A grid has a million of them.
    fn decode_many(reader: &mut Reader<'_>, count: usize) -> Result<Vec<Self>, DecodeErrorKind> {
        let bytes = reader.take_slice(count)?;
        Ok(bytes.iter().copied().map(u8::cast_signed).collect())
    }
}

impl Cdr for bool {
    const MIN_BYTES: usize = 1;

    fn encode(&self, writer: &mut Writer) {
        writer.put([u8::from(*self)]);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeErrorKind> {
        match u8::decode(reader)? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(DecodeErrorKind::InvalidBool(other)),
        }
    }

    fn definition_name() -> Cow<'static, str> {
        Cow::Borrowed("bool")
    }
}

fn encode_text(text: &str, writer: &mut Writer) {
    writer.put_length(text.len() + 1);
    writer.put_slice(text.as_bytes());
    writer.put([0]);
}

impl Cdr for String {
    const MIN_BYTES: usize = 4;

    fn encode(&self, writer: &mut Writer) {
        encode_text(self, writer);
    }

    /// Bytes that are not UTF-8 are replaced: ROS strings are bytes, and a name in another encoding must not cost
    /// the message.
    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeErrorKind> {
        let length = reader.take_length(1)?;
        // Some writers send an empty string as length 0, without its NUL.
        let Some((&last, text)) = reader.take_slice(length)?.split_last() else {
            return Ok(Self::new());
        };
        if last != 0 {
            return Err(DecodeErrorKind::UnterminatedString(u32::try_from(length).unwrap_or(u32::MAX)));
        }
        Ok(Self::from_utf8_lossy(text).into_owned())
    }

    fn definition_name() -> Cow<'static, str> {
        Cow::Borrowed("string")
    }
}

/// Text that is mostly known at compile time, such as metric names; saves an allocation per use.
impl Cdr for Cow<'static, str> {
    const MIN_BYTES: usize = String::MIN_BYTES;

    fn encode(&self, writer: &mut Writer) {
        encode_text(self, writer);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeErrorKind> {
        String::decode(reader).map(Cow::Owned)
    }

    fn definition_name() -> Cow<'static, str> {
        String::definition_name()
    }
}

/// Shared parts, so that a set of candidates can be put together without copying them.
impl<T: Cdr> Cdr for Arc<T> {
    const MIN_BYTES: usize = T::MIN_BYTES;

    fn encode(&self, writer: &mut Writer) {
        T::encode(self, writer);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeErrorKind> {
        T::decode(reader).map(Self::new)
    }

    fn definition_name() -> Cow<'static, str> {
        T::definition_name()
    }

    fn collect_definitions(definitions: &mut Definitions) {
        T::collect_definitions(definitions);
    }
}

impl<T: Cdr> Cdr for Vec<T> {
    const MIN_BYTES: usize = 4;

    fn encode(&self, writer: &mut Writer) {
        writer.put_length(self.len());
        T::encode_many(self, writer);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeErrorKind> {
        let count = reader.take_length(T::MIN_BYTES)?;
        T::decode_many(reader, count)
    }

    fn definition_name() -> Cow<'static, str> {
        Cow::Owned(format!("{}[]", T::definition_name()))
    }

    fn collect_definitions(definitions: &mut Definitions) {
        T::collect_definitions(definitions);
    }
}

/// A bounded sequence of at most one element, `T[<=1]`.
impl<T: Cdr> Cdr for Option<T> {
    const MIN_BYTES: usize = 4;

    fn encode(&self, writer: &mut Writer) {
        writer.put_length(usize::from(self.is_some()));
        if let Some(value) = self {
            value.encode(writer);
        }
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeErrorKind> {
        match reader.take_length(T::MIN_BYTES)? {
            0 => Ok(None),
            1 => T::decode(reader).map(Some),
            count => Err(DecodeErrorKind::TooManyElements { count, limit: 1 }),
        }
    }

    fn definition_name() -> Cow<'static, str> {
        Cow::Owned(format!("{}[<=1]", T::definition_name()))
    }

    fn collect_definitions(definitions: &mut Definitions) {
        T::collect_definitions(definitions);
    }
}

impl<T: Cdr + Copy + Default, const N: usize> Cdr for [T; N] {
    const MIN_BYTES: usize = N * T::MIN_BYTES;

    fn encode(&self, writer: &mut Writer) {
        T::encode_many(self, writer);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeErrorKind> {
        let mut values = [T::default(); N];
        for value in &mut values {
            *value = T::decode(reader)?;
        }
        Ok(values)
    }

    fn definition_name() -> Cow<'static, str> {
        Cow::Owned(format!("{}[{N}]", T::definition_name()))
    }

    fn collect_definitions(definitions: &mut Definitions) {
        T::collect_definitions(definitions);
    }
}

#[cfg(test)]
pub(crate) mod tests;
