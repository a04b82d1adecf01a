//! `sensor_msgs`: only what a marker may carry.

use crate::define::message;
use crate::std_msgs::Header;

message! {
    /// A compressed image, the texture of a marker.
    #[derive(Eq, Default)]
    CompressedImage = "sensor_msgs/msg/CompressedImage" {
        /// Time and frame.
        header: Header,
        /// Codec, for example `png`.
        format: String,
        /// Encoded image.
        data: Vec<u8>,
    }
}
