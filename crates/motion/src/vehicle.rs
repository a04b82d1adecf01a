//! Dimensions of the vehicle, checked once, and what follows from them: outline in base_link, curvature of a steering
//! angle and back.
//!
//! A [`VehicleInfo`] that exists is sane: every number is finite and within its physical range.

use crate::footprint::Footprint;
use crate::geometry::Point2;

/// Dimensions as a vehicle description file gives them (`autoware_vehicle_info_utils`), not checked yet.
///
/// The default is the car of `autoware_sample_vehicle_description`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleDimensions {
    /// Wheel radius \[m\].
    pub wheel_radius_m: f64,
    /// Wheel width \[m\].
    pub wheel_width_m: f64,
    /// Distance between the axles \[m\].
    pub wheel_base_m: f64,
    /// Distance between the middles of the left and the right wheels \[m\].
    pub wheel_tread_m: f64,
    /// From the front axle to the foremost point \[m\].
    pub front_overhang_m: f64,
    /// From the rear axle to the rearmost point \[m\].
    pub rear_overhang_m: f64,
    /// From the middle of the left wheels to the leftmost point \[m\].
    pub left_overhang_m: f64,
    /// From the middle of the right wheels to the rightmost point \[m\].
    pub right_overhang_m: f64,
    /// From the ground to the highest point \[m\].
    pub vehicle_height_m: f64,
    /// Largest front-wheel angle to either side \[rad\].
    pub max_steer_angle_rad: f64,
}

impl Default for VehicleDimensions {
    fn default() -> Self {
        Self {
            wheel_radius_m: 0.383,
            wheel_width_m: 0.235,
            wheel_base_m: 2.79,
            wheel_tread_m: 1.64,
            front_overhang_m: 1.0,
            rear_overhang_m: 1.1,
            left_overhang_m: 0.128,
            right_overhang_m: 0.128,
            vehicle_height_m: 2.5,
            max_steer_angle_rad: 0.70,
        }
    }
}

/// Why vehicle dimensions were refused. The field is named as in a vehicle description file.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum VehicleError {
    /// A length that must be greater than zero is not, or is not finite.
    #[error(
        "vehicle parameter `{field}` is {value}, but must be a finite number greater than zero; correct the vehicle description"
    )]
    NotPositive {
        /// Name of the parameter.
        field: &'static str,
        /// The value that was refused.
        value: f64,
    },
    /// An overhang is negative or not finite.
    #[error(
        "vehicle parameter `{field}` is {value}, but must be a finite number, zero or greater; correct the vehicle description"
    )]
    Negative {
        /// Name of the parameter.
        field: &'static str,
        /// The value that was refused.
        value: f64,
    },
    /// A steering angle of a quarter turn or more: probably degrees were given.
    #[error("vehicle parameter `max_steer_angle` is {value} rad, but must be below pi/2; is it in degrees?")]
    SteerAngleTooLarge {
        /// The value that was refused, in radians.
        value: f64,
    },
}

/// Checked vehicle dimensions. Offsets are in base_link: x forward from the rear axle, y to the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleInfo {
    dimensions: VehicleDimensions,
}

impl Default for VehicleInfo {
    /// The car of `autoware_sample_vehicle_description`: 4.89 m long, 1.896 m wide.
    fn default() -> Self {
        Self { dimensions: VehicleDimensions::default() }
    }
}

impl VehicleInfo {
    /// Checks the dimensions.
    ///
    /// Upstream only logs bad values and goes on with them; a wrong outline makes every later check worthless, so
    /// here they are an error.
    ///
    /// # Errors
    /// The first field that is not finite or out of its physical range. Overhangs may be zero, all else is positive.
    pub fn new(dimensions: VehicleDimensions) -> Result<Self, VehicleError> {
        let d = &dimensions;
        for (field, value) in [
            ("wheel_radius", d.wheel_radius_m),
            ("wheel_width", d.wheel_width_m),
            ("wheel_base", d.wheel_base_m),
            ("wheel_tread", d.wheel_tread_m),
            ("vehicle_height", d.vehicle_height_m),
            ("max_steer_angle", d.max_steer_angle_rad),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(VehicleError::NotPositive { field, value });
            }
        }
        for (field, value) in [
            ("front_overhang", d.front_overhang_m),
            ("rear_overhang", d.rear_overhang_m),
            ("left_overhang", d.left_overhang_m),
            ("right_overhang", d.right_overhang_m),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(VehicleError::Negative { field, value });
            }
        }
        if d.max_steer_angle_rad >= std::f64::consts::FRAC_PI_2 {
            return Err(VehicleError::SteerAngleTooLarge { value: d.max_steer_angle_rad });
        }
        Ok(Self { dimensions })
    }

    /// The dimensions this was made from.
    #[must_use]
    pub fn dimensions(&self) -> &VehicleDimensions {
        &self.dimensions
    }

    /// Distance between the axles \[m\].
    #[must_use]
    #[inline]
    pub fn wheel_base_m(&self) -> f64 {
        self.dimensions.wheel_base_m
    }

    /// From the front axle to the foremost point \[m\].
    #[must_use]
    #[inline]
    pub fn front_overhang_m(&self) -> f64 {
        self.dimensions.front_overhang_m
    }

    /// From bumper to bumper \[m\].
    #[must_use]
    pub fn vehicle_length_m(&self) -> f64 {
        let d = &self.dimensions;
        d.front_overhang_m + d.wheel_base_m + d.rear_overhang_m
    }

    /// From the leftmost to the rightmost point \[m\].
    #[must_use]
    pub fn vehicle_width_m(&self) -> f64 {
        let d = &self.dimensions;
        d.wheel_tread_m + d.left_overhang_m + d.right_overhang_m
    }

    /// From the ground to the highest point \[m\].
    #[must_use]
    #[inline]
    pub fn vehicle_height_m(&self) -> f64 {
        self.dimensions.vehicle_height_m
    }

    /// x of the rear bumper in base_link \[m\], zero or negative.
    #[must_use]
    pub fn min_longitudinal_offset_m(&self) -> f64 {
        -self.dimensions.rear_overhang_m
    }

    /// x of the front bumper in base_link \[m\].
    #[must_use]
    pub fn max_longitudinal_offset_m(&self) -> f64 {
        self.dimensions.front_overhang_m + self.dimensions.wheel_base_m
    }

    /// y of the right side in base_link \[m\], negative.
    #[must_use]
    pub fn min_lateral_offset_m(&self) -> f64 {
        -(self.dimensions.wheel_tread_m / 2.0 + self.dimensions.right_overhang_m)
    }

    /// y of the left side in base_link \[m\].
    #[must_use]
    pub fn max_lateral_offset_m(&self) -> f64 {
        self.dimensions.wheel_tread_m / 2.0 + self.dimensions.left_overhang_m
    }

    /// Curvature of the tightest turn \[1/m\], positive (`calcMaxCurvature`).
    #[must_use]
    pub fn max_curvature(&self) -> f64 {
        1.0 / (self.dimensions.wheel_base_m / self.dimensions.max_steer_angle_rad.tan())
    }

    /// Curvature \[1/m\] of the base_link path at a front-wheel angle \[rad\], both positive to the left
    /// (`calcCurvatureFromSteerAngle`).
    #[must_use]
    #[inline]
    pub fn curvature_from_steering_angle(&self, steering_angle_rad: f64) -> f64 {
        steering_angle_rad.tan() / self.dimensions.wheel_base_m
    }

    /// Front-wheel angle \[rad\] that drives a curvature \[1/m\], both positive to the left.
    ///
    /// Inverse of [`Self::curvature_from_steering_angle`]. Upstream's `calcSteerAngleFromCurvature` gives an angle in
    /// (π/2, π) for right turns and zero below 1e-6/m; no check uses it, so here it is the true inverse.
    #[must_use]
    #[inline]
    pub fn steering_angle_from_curvature(&self, curvature: f64) -> f64 {
        (self.dimensions.wheel_base_m * curvature).atan()
    }

    /// Outline in base_link, widened by a margin \[m\] to the left and right and one to the front and rear.
    #[must_use]
    pub fn footprint(&self, lateral_margin_m: f64, longitudinal_margin_m: f64) -> Footprint {
        let front = self.max_longitudinal_offset_m() + longitudinal_margin_m;
        let center = self.dimensions.wheel_base_m / 2.0;
        let rear = self.min_longitudinal_offset_m() - longitudinal_margin_m;
        let left = self.max_lateral_offset_m() + lateral_margin_m;
        let right = self.min_lateral_offset_m() - lateral_margin_m;
        Footprint::new([
            Point2::new(front, left),
            Point2::new(front, right),
            Point2::new(center, right),
            Point2::new(rear, right),
            Point2::new(rear, left),
            Point2::new(center, left),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(actual: f64, expected: f64) {
        assert!((actual - expected).abs() < 1e-12, "{actual} instead of {expected}");
    }

    #[test]
    fn sample_vehicle_has_its_published_size() {
        let v = VehicleInfo::default();
        close(v.vehicle_length_m(), 4.89);
        close(v.vehicle_width_m(), 1.896);
        close(v.max_longitudinal_offset_m(), 3.79);
        close(v.min_longitudinal_offset_m(), -1.1);
        close(v.max_lateral_offset_m(), 0.948);
        close(v.min_lateral_offset_m(), -0.948);
        assert_eq!(VehicleInfo::new(VehicleDimensions::default()), Ok(v));
    }

    #[test]
    fn left_and_right_overhang_are_not_mixed_up() {
        let v = VehicleInfo::new(VehicleDimensions {
            left_overhang_m: 2.5,
            vehicle_height_m: 0.128,
            ..VehicleDimensions::default()
        })
        .unwrap();
        close(v.max_lateral_offset_m(), 3.32);
        close(v.min_lateral_offset_m(), -0.948);
    }

    #[test]
    fn margins_widen_each_side() {
        let f = VehicleInfo::default().footprint(0.5, 0.25);
        close(f.front_left().x, 4.04);
        close(f.front_left().y, 1.448);
        close(f.rear_right().x, -1.35);
        close(f.rear_right().y, -1.448);
    }

    #[test]
    fn impossible_dimensions_are_refused_by_name() {
        type Change = fn(&mut VehicleDimensions);
        let cases: [(&str, Change); 10] = [
            ("wheel_radius", |d| d.wheel_radius_m = 0.0),
            ("wheel_width", |d| d.wheel_width_m = -0.1),
            ("wheel_base", |d| d.wheel_base_m = f64::NAN),
            ("wheel_tread", |d| d.wheel_tread_m = f64::INFINITY),
            ("vehicle_height", |d| d.vehicle_height_m = 0.0),
            ("max_steer_angle", |d| d.max_steer_angle_rad = 40.0),
            ("front_overhang", |d| d.front_overhang_m = -1.0),
            ("rear_overhang", |d| d.rear_overhang_m = f64::NAN),
            ("left_overhang", |d| d.left_overhang_m = f64::NEG_INFINITY),
            ("right_overhang", |d| d.right_overhang_m = -1e-9),
        ];
        for (field, change) in cases {
            let mut dimensions = VehicleDimensions::default();
            change(&mut dimensions);
            let error = VehicleInfo::new(dimensions).unwrap_err();
            assert!(error.to_string().contains(&format!("`{field}`")), "{field}: {error}");
        }
        let flush = VehicleDimensions { left_overhang_m: 0.0, ..VehicleDimensions::default() };
        assert!(VehicleInfo::new(flush).is_ok());
    }

    #[test]
    fn steering_and_curvature_are_inverse_to_both_sides() {
        let v = VehicleInfo::default();
        close(v.max_curvature(), 0.7_f64.tan() / 2.79);
        for angle in [-0.7, -0.1, 0.0, 1e-9, 0.3] {
            close(v.steering_angle_from_curvature(v.curvature_from_steering_angle(angle)), angle);
        }
        // upstream's own form, valid for left turns
        close(v.steering_angle_from_curvature(0.1), 2.79_f64.atan2(1.0 / 0.1));
    }
}
