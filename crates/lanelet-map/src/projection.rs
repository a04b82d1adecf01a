//! Latitude and longitude (WGS 84, degrees) to metres of the map frame, by the projectors Autoware knows.
//!
//! Agrees with GeographicLib to 1e-6 m and better wherever a map can be. A position that the projector cannot
//! represent without tearing the map is an error.

mod info;
mod transverse_mercator;

pub use info::read_projector_info;

use std::sync::LazyLock;

use self::transverse_mercator::TransverseMercator;
use crate::error::GridSquare;

/// Semi-major axis of the WGS 84 ellipsoid in metres.
const SEMI_MAJOR_M: f64 = 6_378_137.0;
/// Flattening of the WGS 84 ellipsoid.
const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// Scale on the central meridian of a UTM zone.
const UTM_SCALE: f64 = 0.9996;
/// The projection of all UTM zones.
static UTM: LazyLock<TransverseMercator> = LazyLock::new(|| TransverseMercator::new(UTM_SCALE));
/// Added to northings of the southern hemisphere, in metres.
const FALSE_NORTHING_M: f64 = 10_000_000.0;
/// Eastings are given from 0 to here, in metres; further away the projection tears.
const WIDEST_EASTING_M: f64 = 1_000_000.0;
/// Side of an MGRS square in metres.
const SQUARE_M: f64 = 100_000.0;

/// A position on the ellipsoid in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GeoPoint {
    /// Latitude, positive to the north.
    pub latitude_deg: f64,
    /// Longitude, positive to the east.
    pub longitude_deg: f64,
}

/// How the positions of a map become metres. Names are those of `projector_type`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projector {
    /// x and y are the tags `local_x` and `local_y` of the nodes, 0 where they are missing; latitude and
    /// longitude are not read. z is the elevation.
    Local,
    /// UTM coordinates inside the 100 km square of the point. z is the elevation.
    Mgrs,
    /// UTM coordinates minus those of the origin, all in the zone of the origin; also lanelet2's own UTM
    /// projector. z is the elevation.
    LocalCartesianUtm {
        /// Where x and y are 0.
        origin: GeoPoint,
    },
    /// East, north and up of the tangent plane at the origin, whose altitude is 0.
    LocalCartesian {
        /// Where x and y are 0.
        origin: GeoPoint,
    },
    /// Transverse Mercator around the meridian of the origin; y is 0 at the origin. z is the elevation.
    TransverseMercator {
        /// Where x and y are 0.
        origin: GeoPoint,
        /// Scale on the central meridian; Autoware keeps it as `f32`, 0.9996 if it is not given.
        scale: f64,
    },
}

/// Why a position has no coordinates.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProjectionError {
    /// Latitude outside of -90 to 90, or not finite.
    #[error("latitude {latitude_deg}, longitude {longitude_deg} is not a position on earth")]
    NotOnEarth {
        /// Latitude in degrees.
        latitude_deg: f64,
        /// Longitude in degrees.
        longitude_deg: f64,
    },
    /// UTM ends at latitudes 84 and -80.
    #[error("latitude {latitude_deg} is outside of the UTM zones (-80 to 84)")]
    Polar {
        /// Latitude in degrees.
        latitude_deg: f64,
    },
    /// The point lies too far from the UTM zone of the map's origin.
    #[error("the point lies too far from UTM zone {zone}, that of the origin")]
    FarFromZone {
        /// Zone of the origin.
        zone: u8,
    },
}

/// A [`Projector`] made ready: what depends on the origin is computed once.
#[derive(Debug, Clone)]
pub struct Projection(Kind);

#[derive(Debug, Clone)]
enum Kind {
    Local,
    Mgrs,
    LocalCartesianUtm { origin: Utm },
    LocalCartesian(TangentPlane),
    TransverseMercator { mercator: TransverseMercator, meridian_deg: f64, y0: f64 },
}

impl Projection {
    /// Prepares a projector.
    ///
    /// # Errors
    /// If the origin is not on earth, or is polar and the projector needs UTM.
    pub fn new(projector: Projector) -> Result<Self, ProjectionError> {
        Ok(Self(match projector {
            Projector::Local => Kind::Local,
            Projector::Mgrs => Kind::Mgrs,
            Projector::LocalCartesianUtm { origin } => {
                Kind::LocalCartesianUtm { origin: utm(checked(origin)?)? }
            }
            Projector::LocalCartesian { origin } => Kind::LocalCartesian(TangentPlane::new(checked(origin)?)),
            Projector::TransverseMercator { origin, scale } => {
                let origin = checked(origin)?;
                let mercator = TransverseMercator::new(scale);
                let [_, y0] = mercator.forward(origin.latitude_deg, 0.0);
                Kind::TransverseMercator { mercator, meridian_deg: origin.longitude_deg, y0 }
            }
        }))
    }

    /// x, y, z in metres of a position with an elevation in metres above the ellipsoid.
    ///
    /// # Errors
    /// If the position is not on earth or outside of what the projector covers.
    pub fn forward(&self, position: GeoPoint, elevation_m: f64) -> Result<[f64; 3], ProjectionError> {
        if matches!(self.0, Kind::Local) {
            return Ok([0.0, 0.0, elevation_m]);
        }
        let position = checked(position)?;
        match &self.0 {
            Kind::Local => Ok([0.0, 0.0, elevation_m]),
            Kind::Mgrs => {
                let utm = utm(position)?;
                Ok([utm.easting % SQUARE_M, utm.northing % SQUARE_M, elevation_m])
            }
            Kind::LocalCartesianUtm { origin } => {
                let point = utm_in_zone(position, origin.zone)?;
                if !(0.0..=WIDEST_EASTING_M).contains(&point.easting) {
                    return Err(ProjectionError::FarFromZone { zone: origin.zone });
                }
                // A map across the equator stays in one piece.
                let northing = point.metres_north() - origin.metres_north();
                Ok([point.easting - origin.easting, northing, elevation_m])
            }
            Kind::LocalCartesian(plane) => Ok(plane.forward(position, elevation_m)),
            Kind::TransverseMercator { mercator, meridian_deg, y0 } => {
                let longitude = normalized_deg(position.longitude_deg - meridian_deg);
                let [x, y] = mercator.forward(position.latitude_deg, longitude);
                Ok([x, y - y0, elevation_m])
            }
        }
    }
}

fn checked(position: GeoPoint) -> Result<GeoPoint, ProjectionError> {
    let GeoPoint { latitude_deg, longitude_deg } = position;
    if latitude_deg.abs() <= 90.0 && longitude_deg.is_finite() {
        Ok(GeoPoint { latitude_deg, longitude_deg: normalized_deg(longitude_deg) })
    } else {
        Err(ProjectionError::NotOnEarth { latitude_deg, longitude_deg })
    }
}

/// The same angle in -180 (inclusive) to 180 (exclusive).
fn normalized_deg(angle: f64) -> f64 {
    let turned = angle % 360.0;
    if turned >= 180.0 {
        turned - 360.0
    } else if turned < -180.0 {
        turned + 360.0
    } else {
        turned
    }
}

/// A position in its UTM zone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Utm {
    /// Zone, 1 to 60.
    pub zone: u8,
    /// Northern hemisphere.
    pub north: bool,
    /// Easting in metres.
    pub easting: f64,
    /// Northing in metres; 10 000 km are added in the southern hemisphere.
    pub northing: f64,
}

impl Utm {
    /// Metres from the equator, negative to the south.
    fn metres_north(&self) -> f64 {
        if self.north { self.northing } else { self.northing - FALSE_NORTHING_M }
    }

    /// The 100 km square of the position.
    #[must_use]
    pub fn square(&self) -> GridSquare {
        GridSquare {
            zone: self.zone,
            north: self.north,
            column: (self.easting / SQUARE_M).floor() as i32,
            row: (self.northing / SQUARE_M).floor() as i32,
        }
    }
}

/// UTM coordinates in the standard zone of the position, with the exceptions of Norway and Svalbard.
///
/// # Errors
/// At latitudes of 84 and above or below -80, and for positions that are not on earth.
pub fn utm(position: GeoPoint) -> Result<Utm, ProjectionError> {
    let GeoPoint { latitude_deg, longitude_deg } = checked(position)?;
    utm_in_zone(position, utm_zone(latitude_deg, longitude_deg))
}

/// As [`utm`], in a zone that need not be that of the position.
fn utm_in_zone(position: GeoPoint, zone: u8) -> Result<Utm, ProjectionError> {
    let GeoPoint { latitude_deg, longitude_deg } = checked(position)?;
    if !(-80.0..84.0).contains(&latitude_deg) {
        return Err(ProjectionError::Polar { latitude_deg });
    }
    let meridian = f64::from(zone) * 6.0 - 183.0;
    let [x, y] = UTM.forward(latitude_deg, normalized_deg(longitude_deg - meridian));
    let north = latitude_deg >= 0.0;
    let northing = if north { y } else { y + FALSE_NORTHING_M };
    Ok(Utm { zone, north, easting: x + 500_000.0, northing })
}

fn utm_zone(latitude_deg: f64, longitude_deg: f64) -> u8 {
    let degree = longitude_deg.floor() as i32;
    let zone = match latitude_deg {
        // The south-west of Norway belongs to zone 32, Svalbard to 31, 33, 35 and 37.
        56.0..64.0 if (3..6).contains(&degree) => 32,
        72.0.. if (0..42).contains(&degree) => 2 * ((degree + 183) / 12) + 1,
        _ => (degree + 180).div_euclid(6) + 1,
    };
    zone.clamp(1, 60) as u8
}

/// East, north and up at an origin on the ellipsoid.
#[derive(Debug, Clone)]
struct TangentPlane {
    origin: [f64; 3],
    sin_latitude: f64,
    cos_latitude: f64,
    sin_longitude: f64,
    cos_longitude: f64,
}

impl TangentPlane {
    fn new(origin: GeoPoint) -> Self {
        let (sin_latitude, cos_latitude) = origin.latitude_deg.to_radians().sin_cos();
        let (sin_longitude, cos_longitude) = origin.longitude_deg.to_radians().sin_cos();
        Self { origin: geocentric(origin, 0.0), sin_latitude, cos_latitude, sin_longitude, cos_longitude }
    }

    fn forward(&self, position: GeoPoint, height: f64) -> [f64; 3] {
        let [x, y, z] = geocentric(position, height);
        let (dx, dy, dz) = (x - self.origin[0], y - self.origin[1], z - self.origin[2]);
        let outward = self.cos_longitude * dx + self.sin_longitude * dy;
        [
            self.cos_longitude * dy - self.sin_longitude * dx,
            self.cos_latitude * dz - self.sin_latitude * outward,
            self.cos_latitude * outward + self.sin_latitude * dz,
        ]
    }
}

/// Earth-centred coordinates in metres.
fn geocentric(position: GeoPoint, height: f64) -> [f64; 3] {
    let (sin_latitude, cos_latitude) = position.latitude_deg.to_radians().sin_cos();
    let (sin_longitude, cos_longitude) = position.longitude_deg.to_radians().sin_cos();
    let eccentricity_2 = FLATTENING * (2.0 - FLATTENING);
    let normal = SEMI_MAJOR_M / (1.0 - eccentricity_2 * sin_latitude * sin_latitude).sqrt();
    let radius = (normal + height) * cos_latitude;
    [
        radius * cos_longitude,
        radius * sin_longitude,
        (normal * (1.0 - eccentricity_2) + height) * sin_latitude,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(latitude_deg: f64, longitude_deg: f64) -> GeoPoint {
        GeoPoint { latitude_deg, longitude_deg }
    }

    #[test]
    fn zones_and_their_exceptions() {
        for (latitude, longitude, zone) in [
            (0.0, -180.0, 1),
            (0.0, 180.0, 1),
            (0.0, 179.9, 60),
            (35.0, 139.7, 54),
            (60.0, 2.9, 31),
            (60.0, 3.0, 32),
            (64.0, 3.0, 31),
            (55.9, 3.0, 31),
            (72.0, 8.9, 31),
            (72.0, 9.0, 33),
            (80.0, 21.0, 35),
            (80.0, 33.0, 37),
            (80.0, 42.0, 38),
            (80.0, -0.1, 30),
        ] {
            assert_eq!(utm(at(latitude, longitude)).unwrap().zone, zone, "{latitude} {longitude}");
        }
    }

    #[test]
    fn the_poles_and_other_planets_are_refused() {
        assert!(matches!(utm(at(84.0, 0.0)), Err(ProjectionError::Polar { .. })));
        assert!(matches!(utm(at(-80.1, 0.0)), Err(ProjectionError::Polar { .. })));
        assert!(utm(at(-80.0, 0.0)).is_ok());
        assert!(matches!(utm(at(90.1, 0.0)), Err(ProjectionError::NotOnEarth { .. })));
        assert!(matches!(utm(at(f64::NAN, 0.0)), Err(ProjectionError::NotOnEarth { .. })));
        assert!(matches!(utm(at(0.0, f64::INFINITY)), Err(ProjectionError::NotOnEarth { .. })));
    }

    #[test]
    fn the_zone_of_the_origin_reaches_a_little_beyond_its_border() {
        let projection = Projection::new(Projector::LocalCartesianUtm { origin: at(49.0, 11.9) }).unwrap();
        assert_eq!(projection.forward(at(49.0, 11.9), 5.0).unwrap(), [0.0, 0.0, 5.0]);
        let [x, y, _] = projection.forward(at(49.0, 12.1), 0.0).unwrap();
        assert!((x - 14_600.0).abs() < 100.0 && y.abs() < 1000.0, "{x} {y}");
        let error = projection.forward(at(49.0, 17.0), 0.0).unwrap_err();
        assert_eq!(error, ProjectionError::FarFromZone { zone: 32 });
    }
}
