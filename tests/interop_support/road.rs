//! A map of any size.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lanelet_map::{Map, MapBuilder};
use messages::autoware_map_msgs::LaneletMapBin;
use messages::{Interface, Message};

/// Lanelets of a road whose archive has 20 MB.
#[allow(dead_code, reason = "not every test needs it")]
pub(crate) const LANELETS_OF_20_MB: i64 = 72_500;

/// A straight road of lanelets of 10 m.
pub(crate) fn road(lanelets: i64) -> Map {
    let mut builder = MapBuilder::new();
    for index in 0..=lanelets {
        let x = 10.0 * index as f64;
        builder.point(2 * index + 1, [x, 2.0, 0.0], &[]).unwrap();
        builder.point(2 * index + 2, [x, -2.0, 0.0], &[]).unwrap();
    }
    let first_line = 10 * (lanelets + 1);
    for index in 0..lanelets {
        let (left, right) = (first_line + 3 * index, first_line + 3 * index + 1);
        builder.line_string(left, &[2 * index + 1, 2 * index + 3], &[]).unwrap();
        builder.line_string(right, &[2 * index + 2, 2 * index + 4], &[]).unwrap();
        builder.lanelet(first_line + 3 * index + 2, left, right, &[("subtype", "road")]).unwrap();
    }
    builder.build().unwrap()
}

/// The road as a map server sends it.
pub(crate) fn road_message(lanelets: i64) -> Vec<u8> {
    let data = lanelet_map::archive::encode(&road(lanelets));
    LaneletMapBin { data, ..LaneletMapBin::default() }.to_cdr(Interface::default())
}
