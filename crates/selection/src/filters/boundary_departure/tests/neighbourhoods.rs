//! A neighbourhood holds the nearest segments to every place of its cell.

use std::sync::Arc;

use motion::Point2;
use proptest::prelude::*;

use super::borders::{Borders, NEAREST, Neighbourhoods};
use super::scenes::MapSketch;

/// Short segments strewn at random: here the five nearest change within a step.
fn strewn() -> impl Strategy<Value = MapSketch> {
    let bit = (-4.0..4.0_f64, -4.0..4.0_f64, -0.3..0.3_f64, -0.3..0.3_f64)
        .prop_map(|(x, y, dx, dy)| vec![[x, y, 0.0], [x + dx, y + dy, 0.0]]);
    prop::collection::vec(bit, 1..200).prop_map(|lines| MapSketch { lines })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]

    #[test]
    fn the_nearest_are_in_the_neighbourhood(
        sketch in strewn(),
        places in prop::collection::vec((-5.0..5.0_f64, -5.0..5.0_f64), 100),
    ) {
        let map = sketch.map(1).value.map;
        let borders = Arc::new(Borders::new(&map, &["road_border".to_owned()]).unwrap());
        let mut neighbourhoods = Neighbourhoods::default();
        neighbourhoods.attach(&borders);
        for (x, y) in places {
            let place = Point2::new(x, y);
            let distance = |border: &u32| borders.line(*border).squared_distance_to_point(place);
            let mut all: Vec<u32> = (0..borders.len() as u32).collect();
            all.sort_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)));
            all.truncate(NEAREST);
            let near = neighbourhoods.around(&borders, place);
            for border in all {
                prop_assert!(near.borders.iter().any(|near| near.border == border));
                prop_assert!(near.possibly_nearest().any(|near| near.border == border));
            }
        }
    }
}
