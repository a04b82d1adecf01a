//! `geometry_msgs`: points, poses, velocities and accelerations. Metres, radians, seconds; right-handed frames.

use crate::define::message;
use crate::std_msgs::Header;

message! {
    /// A position in metres.
    #[derive(Copy, Default)]
    Point = "geometry_msgs/msg/Point" {
        /// Forward or east.
        x: f64,
        /// Left or north.
        y: f64,
        /// Up.
        z: f64,
    }
}

message! {
    /// A position in metres, single precision.
    #[derive(Copy, Default)]
    Point32 = "geometry_msgs/msg/Point32" {
        /// Forward or east.
        x: f32,
        /// Left or north.
        y: f32,
        /// Up.
        z: f32,
    }
}

message! {
    /// A free vector; its unit comes from its use.
    #[derive(Copy, Default)]
    Vector3 = "geometry_msgs/msg/Vector3" {
        /// Forward or east.
        x: f64,
        /// Left or north.
        y: f64,
        /// Up.
        z: f64,
    }
}

message! {
    /// A rotation; a unit quaternion in well-formed messages.
    #[derive(Copy)]
    Quaternion = "geometry_msgs/msg/Quaternion" {
        /// First imaginary part.
        x: f64,
        /// Second imaginary part.
        y: f64,
        /// Third imaginary part.
        z: f64,
        /// Real part.
        w: f64,
    }
}

impl Default for Quaternion {
    /// No rotation.
    fn default() -> Self {
        Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }
    }
}

impl Quaternion {
    /// Rotation about the vertical axis, counter-clockwise positive.
    #[must_use]
    pub fn from_yaw(yaw_rad: f64) -> Self {
        let (z, w) = (yaw_rad * 0.5).sin_cos();
        Self { x: 0.0, y: 0.0, z, w }
    }
}

message! {
    /// Position and orientation.
    #[derive(Copy, Default)]
    Pose = "geometry_msgs/msg/Pose" in blocks of 56 {
        /// Where.
        position: Point,
        /// Facing where.
        orientation: Quaternion,
    }
}

message! {
    /// A pose with its time and frame.
    #[derive(Default)]
    PoseStamped = "geometry_msgs/msg/PoseStamped" {
        /// Time and frame.
        header: Header,
        /// The pose.
        pose: Pose,
    }
}

message! {
    /// A pose with its uncertainty.
    #[derive(Copy)]
    PoseWithCovariance = "geometry_msgs/msg/PoseWithCovariance" {
        /// The mean.
        pose: Pose,
        /// Row-major 6x6 covariance over x, y, z and rotations about them.
        covariance: [f64; 36],
    }
}

message! {
    /// Linear (m/s) and angular (rad/s) velocity.
    #[derive(Copy, Default)]
    Twist = "geometry_msgs/msg/Twist" {
        /// Metres per second.
        linear: Vector3,
        /// Radians per second.
        angular: Vector3,
    }
}

message! {
    /// A velocity with its uncertainty.
    #[derive(Copy)]
    TwistWithCovariance = "geometry_msgs/msg/TwistWithCovariance" {
        /// The mean.
        twist: Twist,
        /// Row-major 6x6 covariance.
        covariance: [f64; 36],
    }
}

message! {
    /// Linear (m/s^2) and angular (rad/s^2) acceleration.
    #[derive(Copy, Default)]
    Accel = "geometry_msgs/msg/Accel" {
        /// Metres per second squared.
        linear: Vector3,
        /// Radians per second squared.
        angular: Vector3,
    }
}

message! {
    /// An acceleration with its uncertainty.
    #[derive(Copy)]
    AccelWithCovariance = "geometry_msgs/msg/AccelWithCovariance" {
        /// The mean.
        accel: Accel,
        /// Row-major 6x6 covariance.
        covariance: [f64; 36],
    }
}

message! {
    /// An acceleration with its uncertainty, time and frame.
    #[derive(Default)]
    AccelWithCovarianceStamped = "geometry_msgs/msg/AccelWithCovarianceStamped" {
        /// Time and frame.
        header: Header,
        /// The acceleration.
        accel: AccelWithCovariance,
    }
}

message! {
    /// A polygon; its last point is not repeated.
    #[derive(Default)]
    Polygon = "geometry_msgs/msg/Polygon" {
        /// Corners in order.
        points: Vec<Point32>,
    }
}

macro_rules! zero_covariance {
    ($type:ident { $mean:ident }) => {
        impl Default for $type {
            /// Zero mean, zero covariance.
            fn default() -> Self {
                Self { $mean: Default::default(), covariance: [0.0; 36] }
            }
        }
    };
}

zero_covariance!(PoseWithCovariance { pose });
zero_covariance!(TwistWithCovariance { twist });
zero_covariance!(AccelWithCovariance { accel });
