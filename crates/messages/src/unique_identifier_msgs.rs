//! `unique_identifier_msgs`: identities of generators, objects and routes.

use crate::define::message;
use std::fmt;

message! {
    /// A universally unique identifier. Shown as 32 lower-case hexadecimal digits, byte 0 first.
    #[derive(Copy, Eq, Hash, PartialOrd, Ord, Default)]
    Uuid = "unique_identifier_msgs/msg/UUID" {
        /// The sixteen bytes.
        uuid: [u8; 16],
    }
}

impl fmt::Display for Uuid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.uuid.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

#[cfg(test)]
mod tests {
    use super::Uuid;

    #[test]
    fn shown_as_hexadecimal_digits_from_byte_0() {
        let mut uuid = [0; 16];
        (uuid[0], uuid[15]) = (0x0a, 0xf1);
        assert_eq!(Uuid { uuid }.to_string(), "0a0000000000000000000000000000f1");
    }
}
