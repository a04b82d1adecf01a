//! `autoware_map_msgs`: the HD map.

use crate::define::message;
use crate::std_msgs::Header;

message! {
    /// A Lanelet2 map as a binary archive.
    #[derive(Eq, Default)]
    LaneletMapBin = "autoware_map_msgs/msg/LaneletMapBin" {
        /// Time and frame of the map.
        header: Header,
        /// Version of the map format, may be empty.
        version_map_format: String,
        /// Version of this map, may be empty.
        version_map: String,
        /// Name of this map, may be empty.
        name_map: String,
        /// Boost binary archive of the Lanelet2 map.
        data: Vec<u8>,
    }
}
