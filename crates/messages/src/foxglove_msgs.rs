//! `foxglove_msgs`: scenes whose parts say what they are when they are clicked.
//!
//! The well-known schema `SceneUpdate` in its ROS 2 form: plain CDR like every other topic, because programs of ROS 2
//! refuse a recording with more than one serialisation.

use crate::builtin_interfaces::{Duration, Time};
use crate::define::message;
use crate::geometry_msgs::{Point, Pose, Vector3};

message! {
    /// A colour, each part from 0 to 1.
    #[derive(Copy, Default)]
    Color = "foxglove_msgs/msg/Color" {
        /// Red.
        r: f64,
        /// Green.
        g: f64,
        /// Blue.
        b: f64,
        /// Opacity.
        a: f64,
    }
}

message! {
    /// Something to know about an entity.
    #[derive(Eq, Default)]
    KeyValuePair = "foxglove_msgs/msg/KeyValuePair" {
        /// Name; unique within the entity.
        key: String,
        /// Text.
        value: String,
    }
}

message! {
    /// An arrow along its own x axis.
    #[derive(Default)]
    ArrowPrimitive = "foxglove_msgs/msg/ArrowPrimitive" {
        /// Where its tail is.
        pose: Pose,
        /// Of the shaft, m.
        shaft_length: f64,
        /// Of the shaft, m.
        shaft_diameter: f64,
        /// Of the head, m.
        head_length: f64,
        /// Of the head, m.
        head_diameter: f64,
        /// Colour.
        color: Color,
    }
}

message! {
    /// A box.
    #[derive(Default)]
    CubePrimitive = "foxglove_msgs/msg/CubePrimitive" {
        /// Where its middle is.
        pose: Pose,
        /// Lengths along its axes, m.
        size: Vector3,
        /// Colour.
        color: Color,
    }
}

message! {
    /// A ball.
    #[derive(Default)]
    SpherePrimitive = "foxglove_msgs/msg/SpherePrimitive" {
        /// Where its middle is.
        pose: Pose,
        /// Diameters along its axes, m.
        size: Vector3,
        /// Colour.
        color: Color,
    }
}

message! {
    /// A cylinder or a cone that stands on its own z axis.
    #[derive(Default)]
    CylinderPrimitive = "foxglove_msgs/msg/CylinderPrimitive" {
        /// Where its middle is.
        pose: Pose,
        /// Of the box around it, m.
        size: Vector3,
        /// Width of the lower face over that of the box.
        bottom_scale: f64,
        /// Width of the upper face over that of the box.
        top_scale: f64,
        /// Colour.
        color: Color,
    }
}

message! {
    /// Lines.
    #[derive(Default)]
    LinePrimitive = "foxglove_msgs/msg/LinePrimitive" {
        /// One of the constants.
        r#type: u8,
        /// Where their coordinates begin.
        pose: Pose,
        /// In m, or in pixels.
        thickness: f64,
        /// True for pixels.
        scale_invariant: bool,
        /// Corners.
        points: Vec<Point>,
        /// Colour of all.
        color: Color,
        /// Colours of the corners instead.
        colors: Vec<Color>,
        /// Which corners in which order; empty for all in theirs.
        indices: Vec<u32>,
    }
    constants {
        /// From corner to corner.
        LINE_STRIP: u8 = 0,
        /// The same, and back to the first.
        LINE_LOOP: u8 = 1,
        /// From the first to the second, from the third to the fourth.
        LINE_LIST: u8 = 2,
    }
}

message! {
    /// Triangles, three corners each.
    #[derive(Default)]
    TriangleListPrimitive = "foxglove_msgs/msg/TriangleListPrimitive" {
        /// Where their coordinates begin.
        pose: Pose,
        /// Corners.
        points: Vec<Point>,
        /// Colour of all.
        color: Color,
        /// Colours of the corners instead.
        colors: Vec<Color>,
        /// Which corners in which order; empty for all in theirs.
        indices: Vec<u32>,
    }
}

message! {
    /// A text.
    #[derive(Default)]
    TextPrimitive = "foxglove_msgs/msg/TextPrimitive" {
        /// Where its middle is.
        pose: Pose,
        /// True if it faces whoever looks.
        billboard: bool,
        /// Height of a line in m, or in pixels.
        font_size: f64,
        /// True for pixels.
        scale_invariant: bool,
        /// Colour.
        color: Color,
        /// The text.
        text: String,
    }
}

message! {
    /// A model from elsewhere.
    #[derive(Default)]
    ModelPrimitive = "foxglove_msgs/msg/ModelPrimitive" {
        /// Where it is.
        pose: Pose,
        /// Factors along its axes.
        scale: Vector3,
        /// Colour, if the model's own does not count.
        color: Color,
        /// True if it does not.
        override_color: bool,
        /// Where the model is found.
        url: String,
        /// Type of `data`.
        media_type: String,
        /// The model itself.
        data: Vec<u8>,
    }
}

message! {
    /// One thing in a scene.
    #[derive(Default)]
    SceneEntity = "foxglove_msgs/msg/SceneEntity" {
        /// When it is so.
        timestamp: Time,
        /// Frame of its coordinates.
        frame_id: String,
        /// Identity; a later one replaces it.
        id: String,
        /// How long it stays; zero is until it is replaced or removed.
        lifetime: Duration,
        /// True if it moves with its frame.
        frame_locked: bool,
        /// What is shown when it is clicked.
        metadata: Vec<KeyValuePair>,
        /// Arrows.
        arrows: Vec<ArrowPrimitive>,
        /// Boxes.
        cubes: Vec<CubePrimitive>,
        /// Balls.
        spheres: Vec<SpherePrimitive>,
        /// Cylinders.
        cylinders: Vec<CylinderPrimitive>,
        /// Lines.
        lines: Vec<LinePrimitive>,
        /// Triangles.
        triangles: Vec<TriangleListPrimitive>,
        /// Texts.
        texts: Vec<TextPrimitive>,
        /// Models.
        models: Vec<ModelPrimitive>,
    }
}

message! {
    /// Things that are no longer in a scene.
    #[derive(Eq, Default)]
    SceneEntityDeletion = "foxglove_msgs/msg/SceneEntityDeletion" {
        /// Only what is older than this goes.
        timestamp: Time,
        /// One of the constants.
        r#type: u8,
        /// Which one.
        id: String,
    }
    constants {
        /// The one with this identity.
        MATCHING_ID: u8 = 0,
        /// All of the topic.
        ALL: u8 = 1,
    }
}

message! {
    /// A change of a scene: first what goes, then what comes or is replaced.
    #[derive(Default)]
    SceneUpdate = "foxglove_msgs/msg/SceneUpdate" {
        /// What goes.
        deletions: Vec<SceneEntityDeletion>,
        /// What comes.
        entities: Vec<SceneEntity>,
    }
}
