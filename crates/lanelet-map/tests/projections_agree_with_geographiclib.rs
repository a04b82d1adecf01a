//! Every projection vector is reproduced to a micrometre.
#![allow(clippy::unwrap_used, clippy::panic)] // A test that cannot go on should stop.

#[path = "support/shared.rs"]
mod shared;

use lanelet_map::projection::{GeoPoint, Projection, ProjectionError, Projector, utm};

/// Largest deviation from GeographicLib in metres.
const TOLERANCE_M: f64 = 1e-6;

#[test]
fn every_vector() {
    let Some(dir) = shared::shared("every_vector") else { return };
    let text = std::fs::read_to_string(dir.join("data/maps/projection_vectors.csv")).unwrap();
    let (mut compared, mut polar, mut worst) = (0, 0, 0.0_f64);
    for line in text.lines().skip(1) {
        let columns: Vec<&str> = line.split(',').collect();
        let number = |at: usize| columns[at].parse::<f64>().unwrap();
        let position = GeoPoint { latitude_deg: number(4), longitude_deg: number(5) };
        let origin = || GeoPoint { latitude_deg: number(1), longitude_deg: number(2) };
        let elevation = number(6);
        let forward = |projector| Projection::new(projector).and_then(|p| p.forward(position, elevation));
        let found = match columns[0] {
            "UTMUPS_raw" => utm(position).map(|utm| {
                let hemisphere = if utm.north { "N" } else { "S" };
                let zone = columns[10].split(' ').next().unwrap();
                assert_eq!(format!("{:02}{hemisphere}", utm.zone), format!("{zone:0>3}"), "{line}");
                [utm.easting, utm.northing, elevation]
            }),
            "MGRS" => forward(Projector::Mgrs),
            "LocalCartesianUTM" => forward(Projector::LocalCartesianUtm { origin: origin() }),
            "LocalCartesian" => forward(Projector::LocalCartesian { origin: origin() }),
            "TransverseMercator" => {
                forward(Projector::TransverseMercator { origin: origin(), scale: number(3) })
            }
            other => panic!("unknown projector {other}"),
        };
        match found {
            Ok(found) => {
                for (axis, value) in found.iter().enumerate() {
                    let error = (value - number(7 + axis)).abs();
                    assert!(error <= TOLERANCE_M, "{line}: found {found:?}");
                    worst = worst.max(error);
                }
                compared += 1;
            }
            Err(ProjectionError::Polar { .. }) => {
                let latitude = position.latitude_deg;
                assert!(!(-80.0..84.0).contains(&latitude), "{line}");
                polar += 1;
            }
            Err(error) => panic!("{line}: {error}"),
        }
    }
    println!("{compared} vectors within {worst:e} m, {polar} polar ones refused");
    assert_eq!(compared + polar, 1024);
    assert!(polar <= 64);
}
