//! Transverse Mercator on the WGS 84 ellipsoid by Krueger's series of order 6 (exact to nanometres inside
//! a UTM zone and to 1e-6 m far beyond).

use super::{FLATTENING, SEMI_MAJOR_M};

#[derive(Debug, Clone)]
pub(super) struct TransverseMercator {
    /// Scale times the radius of the rectifying sphere, in metres.
    radius_m: f64,
    series: [f64; 6],
    eccentricity: f64,
}

impl TransverseMercator {
    pub(super) fn new(scale: f64) -> Self {
        let n = FLATTENING / (2.0 - FLATTENING);
        let powers: [f64; 6] = std::array::from_fn(|k| n.powi(k as i32 + 1));
        let n2 = n * n;
        let rectifying = SEMI_MAJOR_M / (1.0 + n) * (1.0 + n2 * (1.0 / 4.0 + n2 * (1.0 / 64.0 + n2 / 256.0)));
        let series = COEFFICIENTS
            .map(|row| row.iter().zip(powers).map(|(coefficient, power)| coefficient * power).sum::<f64>());
        Self { radius_m: scale * rectifying, series, eccentricity: (FLATTENING * (2.0 - FLATTENING)).sqrt() }
    }

    /// x to the east of the central meridian, y to the north of the equator, in metres.
    pub(super) fn forward(&self, latitude_deg: f64, longitude_from_meridian_deg: f64) -> [f64; 2] {
        let tau = latitude_deg.to_radians().tan();
        let (sin_longitude, cos_longitude) = longitude_from_meridian_deg.to_radians().sin_cos();
        let hypotenuse = tau.hypot(1.0);
        let sigma = (self.eccentricity * (self.eccentricity * tau / hypotenuse).atanh()).sinh();
        let conformal = tau * sigma.hypot(1.0) - sigma * hypotenuse;
        let xi0 = conformal.atan2(cos_longitude);
        let eta0 = (sin_longitude / conformal.hypot(cos_longitude)).asinh();
        let (xi, eta) = self.corrected(xi0, eta0);
        [self.radius_m * eta, self.radius_m * xi]
    }

    /// Adds the sum of factor k times sin(2 k (xi + i eta)), by Clenshaw's recurrence in complex numbers.
    fn corrected(&self, xi: f64, eta: f64) -> (f64, f64) {
        let (sin, cos) = (2.0 * xi).sin_cos();
        let (sinh, cosh) = ((2.0 * eta).sinh(), (2.0 * eta).cosh());
        // 2 cos(2 (xi + i eta)).
        let (re, im) = (2.0 * cos * cosh, -2.0 * sin * sinh);
        let (mut next, mut after) = ((0.0, 0.0), (0.0, 0.0));
        for factor in self.series.iter().rev() {
            let current = (factor + re * next.0 - im * next.1 - after.0, re * next.1 + im * next.0 - after.1);
            (next, after) = (current, next);
        }
        // Times sin(2 (xi + i eta)).
        let (sin_re, sin_im) = (sin * cosh, cos * sinh);
        (xi + sin_re * next.0 - sin_im * next.1, eta + sin_re * next.1 + sin_im * next.0)
    }
}

/// Row k holds the factors of n, n^2, ... n^6 in the k-th term of the series.
const COEFFICIENTS: [[f64; 6]; 6] = [
    [1.0 / 2.0, -2.0 / 3.0, 5.0 / 16.0, 41.0 / 180.0, -127.0 / 288.0, 7891.0 / 37_800.0],
    [0.0, 13.0 / 48.0, -3.0 / 5.0, 557.0 / 1440.0, 281.0 / 630.0, -1_983_433.0 / 1_935_360.0],
    [0.0, 0.0, 61.0 / 240.0, -103.0 / 140.0, 15_061.0 / 26_880.0, 167_603.0 / 181_440.0],
    [0.0, 0.0, 0.0, 49_561.0 / 161_280.0, -179.0 / 168.0, 6_601_661.0 / 7_257_600.0],
    [0.0, 0.0, 0.0, 0.0, 34_729.0 / 80_640.0, -3_418_889.0 / 1_995_840.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, 212_378_941.0 / 319_334_400.0],
];
