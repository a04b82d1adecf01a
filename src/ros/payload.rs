//! Serialised messages as they are on the wire: our `messages` crate reads and writes them, the middleware only
//! carries them.
//!
//! So there is one definition of every message, a map of many megabytes is decoded once, and a message that is none of
//! ours is reported with what is wrong with it.

use messages::cdr::ENCAPSULATION_BYTES;
use rustdds::RepresentationIdentifier;
use rustdds::bytes::Bytes;
use rustdds::no_key::{Decode, DefaultDecoder, DeserializerAdapter, SerializerAdapter};
use std::convert::Infallible;

/// A serialised message, encapsulation header included. Cheap to clone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Payload(Bytes);

impl Payload {
    /// The whole message.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        &self.0
    }
}

impl From<Vec<u8>> for Payload {
    /// Takes a message as `Message::to_cdr` gives it: little endian, header in front.
    fn from(cdr: Vec<u8>) -> Self {
        Self(Bytes::from(cdr))
    }
}

/// Carries payloads through the middleware as they are.
#[derive(Debug, Clone, Copy)]
pub struct PayloadAdapter;

/// All encapsulations that exist: which of them can be read is for the message's own decoder to say.
const ENCODINGS: [RepresentationIdentifier; 10] = [
    RepresentationIdentifier::CDR_LE,
    RepresentationIdentifier::CDR_BE,
    RepresentationIdentifier::PL_CDR_LE,
    RepresentationIdentifier::PL_CDR_BE,
    RepresentationIdentifier::XCDR2_LE,
    RepresentationIdentifier::XCDR2_BE,
    RepresentationIdentifier::D_CDR2_LE,
    RepresentationIdentifier::D_CDR2_BE,
    RepresentationIdentifier::PL_XCDR2_LE,
    RepresentationIdentifier::PL_XCDR2_BE,
];

impl DeserializerAdapter<Payload> for PayloadAdapter {
    type Error = Infallible;
    type Decoded = Payload;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &ENCODINGS
    }

    fn transform_decoded(decoded: Payload) -> Payload {
        decoded
    }
}

impl DefaultDecoder<Payload> for PayloadAdapter {
    type Decoder = Self;
    const DECODER: Self = Self;
}

impl Decode<'_, Payload> for PayloadAdapter {
    type Error = Infallible;

    /// One copy, because the middleware lends the bytes only for the time of this call.
    fn decode_bytes(self, body: &[u8], encoding: RepresentationIdentifier) -> Result<Payload, Infallible> {
        let mut bytes = Vec::with_capacity(ENCAPSULATION_BYTES + body.len());
        bytes.extend(encoding.to_bytes());
        bytes.extend([0, 0]);
        bytes.extend(body);
        Ok(Payload(bytes.into()))
    }
}

impl SerializerAdapter<Payload> for PayloadAdapter {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    /// The middleware writes the header itself.
    fn to_bytes(payload: &Payload) -> Result<Bytes, Infallible> {
        Ok(payload.0.slice(ENCAPSULATION_BYTES.min(payload.0.len())..))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::builtin_interfaces::Time;
    use messages::{Interface, Message};

    #[test]
    fn what_is_written_is_what_is_read() {
        let time = Time { sec: -3, nanosec: 7 };
        let payload = Payload::from(time.to_cdr(Interface::default()));
        let body = PayloadAdapter::to_bytes(&payload).unwrap();
        assert_eq!(body.len(), 8, "without the header");
        let received = PayloadAdapter.decode_bytes(&body, PayloadAdapter::output_encoding()).unwrap();
        assert_eq!(received, payload);
        assert_eq!(Time::from_cdr(received.as_bytes(), Interface::default(), "/clock"), Ok(time));
    }

    #[test]
    fn the_byte_order_of_the_sender_is_kept() {
        let body = [0, 0, 0, 1, 0, 0, 0, 2];
        let received = PayloadAdapter.decode_bytes(&body, RepresentationIdentifier::CDR_BE).unwrap();
        let time = Time::from_cdr(received.as_bytes(), Interface::default(), "/clock");
        assert_eq!(time, Ok(Time { sec: 1, nanosec: 2 }));
    }
}
