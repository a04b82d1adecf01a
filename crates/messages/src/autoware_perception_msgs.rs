//! `autoware_perception_msgs`: road users with their predicted paths, and traffic lights.

use crate::builtin_interfaces::{Duration, Time};
use crate::define::message;
use crate::geometry_msgs::{
    AccelWithCovariance, Polygon, Pose, PoseWithCovariance, TwistWithCovariance, Vector3,
};
use crate::std_msgs::Header;
use crate::unique_identifier_msgs::Uuid;

message! {
    /// What an object may be.
    #[derive(Copy, Default)]
    ObjectClassification = "autoware_perception_msgs/msg/ObjectClassification" {
        /// One of the constants.
        label: u8,
        /// From 0 to 1.
        probability: f32,
    }
    constants {
        /// Not known.
        UNKNOWN: u8 = 0,
        /// Passenger car.
        CAR: u8 = 1,
        /// Truck.
        TRUCK: u8 = 2,
        /// Bus.
        BUS: u8 = 3,
        /// Trailer.
        TRAILER: u8 = 4,
        /// Motorcycle.
        MOTORCYCLE: u8 = 5,
        /// Bicycle.
        BICYCLE: u8 = 6,
        /// Person on foot.
        PEDESTRIAN: u8 = 7,
        /// Animal.
        ANIMAL: u8 = 8,
        /// Obstacle of unknown kind that must not be hit.
        HAZARD: u8 = 9,
        /// May be driven over.
        OVER_DRIVABLE: u8 = 10,
        /// May be driven under.
        UNDER_DRIVABLE: u8 = 11,
    }
}

message! {
    /// Extent of an object.
    #[derive(Default)]
    Shape = "autoware_perception_msgs/msg/Shape" {
        /// One of the constants.
        r#type: u8,
        /// Outline in the object's frame, for polygons.
        footprint: Polygon,
        /// Length, width and height; diameter twice and height for cylinders. Metres.
        dimensions: Vector3,
    }
    constants {
        /// Box with `dimensions`.
        BOUNDING_BOX: u8 = 0,
        /// Upright cylinder with `dimensions`.
        CYLINDER: u8 = 1,
        /// Upright prism over `footprint`.
        POLYGON: u8 = 2,
    }
}

message! {
    /// One way in which an object may go on.
    #[derive(Default)]
    PredictedPath = "autoware_perception_msgs/msg/PredictedPath" {
        /// Poses, `time_step` apart, the first at the time of the message.
        path: Vec<Pose>,
        /// Time between two poses.
        time_step: Duration,
        /// From 0 to 1; the confidences of an object need not sum to 1.
        confidence: f32,
    }
}

message! {
    /// How an object moves.
    #[derive(Default)]
    PredictedObjectKinematics = "autoware_perception_msgs/msg/PredictedObjectKinematics" {
        /// Pose now, map frame.
        initial_pose_with_covariance: PoseWithCovariance,
        /// Velocity now, object frame.
        initial_twist_with_covariance: TwistWithCovariance,
        /// Acceleration now, object frame.
        initial_acceleration_with_covariance: AccelWithCovariance,
        /// Where it may go.
        predicted_paths: Vec<PredictedPath>,
    }
}

message! {
    /// A road user or obstacle.
    #[derive(Default)]
    PredictedObject = "autoware_perception_msgs/msg/PredictedObject" {
        /// Identity over time.
        object_id: Uuid,
        /// From 0 to 1.
        existence_probability: f32,
        /// What it may be; not sorted.
        classification: Vec<ObjectClassification>,
        /// How it moves.
        kinematics: PredictedObjectKinematics,
        /// How large it is.
        shape: Shape,
    }
}

message! {
    /// All road users and obstacles seen at one time.
    #[derive(Default)]
    PredictedObjects = "autoware_perception_msgs/msg/PredictedObjects" {
        /// Time and frame.
        header: Header,
        /// The objects.
        objects: Vec<PredictedObject>,
    }
}

message! {
    /// One lamp of a traffic light.
    #[derive(Copy, Default)]
    TrafficLightElement = "autoware_perception_msgs/msg/TrafficLightElement" {
        /// One of the colours.
        color: u8,
        /// One of the shapes.
        shape: u8,
        /// One of the states.
        status: u8,
        /// From 0 to 1.
        confidence: f32,
    }
    constants {
        /// Not known; colour, shape and state share this value.
        UNKNOWN: u8 = 0,
        /// Colour.
        RED: u8 = 1,
        /// Colour.
        AMBER: u8 = 2,
        /// Colour.
        GREEN: u8 = 3,
        /// Colour.
        WHITE: u8 = 4,
        /// Shape.
        CIRCLE: u8 = 1,
        /// Shape.
        LEFT_ARROW: u8 = 2,
        /// Shape.
        RIGHT_ARROW: u8 = 3,
        /// Shape.
        UP_ARROW: u8 = 4,
        /// Shape.
        UP_LEFT_ARROW: u8 = 5,
        /// Shape.
        UP_RIGHT_ARROW: u8 = 6,
        /// Shape.
        DOWN_ARROW: u8 = 7,
        /// Shape.
        DOWN_LEFT_ARROW: u8 = 8,
        /// Shape.
        DOWN_RIGHT_ARROW: u8 = 9,
        /// Shape.
        CROSS: u8 = 10,
        /// State.
        SOLID_OFF: u8 = 1,
        /// State.
        SOLID_ON: u8 = 2,
        /// State.
        FLASHING: u8 = 3,
    }
}

message! {
    /// What a traffic light will show.
    #[derive(Default)]
    PredictedTrafficLightState = "autoware_perception_msgs/msg/PredictedTrafficLightState" {
        /// From when on.
        predicted_stamp: Time,
        /// Lamps lit together.
        simultaneous_elements: Vec<TrafficLightElement>,
        /// From 0 to 1.
        reliability: f32,
        /// Who says so, for example `V2I`.
        information_source: String,
    }
}

message! {
    /// State of one group of lights, named by its regulatory element.
    #[derive(Default)]
    TrafficLightGroup = "autoware_perception_msgs/msg/TrafficLightGroup" {
        /// Id of the regulatory element in the map.
        traffic_light_group_id: i64,
        /// Lamps.
        elements: Vec<TrafficLightElement>,
        /// Coming states.
        predictions: Vec<PredictedTrafficLightState>,
    }
}

message! {
    /// State of all traffic lights in sight.
    #[derive(Default)]
    TrafficLightGroupArray = "autoware_perception_msgs/msg/TrafficLightGroupArray" {
        /// When.
        stamp: Time,
        /// The groups.
        traffic_light_groups: Vec<TrafficLightGroup>,
    }
}
