//! `std_msgs`: the header and small values.

use crate::builtin_interfaces::Time;
use crate::define::message;

message! {
    /// When and in which frame a message holds.
    #[derive(Eq, Default)]
    Header = "std_msgs/msg/Header" {
        /// Time of validity.
        stamp: Time,
        /// Coordinate frame, for example `map`.
        frame_id: String,
    }
}

message! {
    /// A text on its own.
    #[derive(Eq, Default)]
    Text = "std_msgs/msg/String" {
        /// The text.
        data: String,
    }
}

message! {
    /// A colour, each channel from 0 to 1.
    #[derive(Copy, Default)]
    ColorRgba = "std_msgs/msg/ColorRGBA" {
        /// Red.
        r: f32,
        /// Green.
        g: f32,
        /// Blue.
        b: f32,
        /// Opacity.
        a: f32,
    }
}
