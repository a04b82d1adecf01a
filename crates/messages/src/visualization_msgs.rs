//! `visualization_msgs`: what RViz and Foxglove draw.

use crate::builtin_interfaces::Duration;
use crate::define::message;
use crate::geometry_msgs::{Point, Pose, Vector3};
use crate::sensor_msgs::CompressedImage;
use crate::std_msgs::{ColorRgba, Header};

message! {
    /// A place on a texture, both from 0 to 1.
    #[derive(Copy, Default)]
    UvCoordinate = "visualization_msgs/msg/UVCoordinate" {
        /// Horizontal.
        u: f32,
        /// Vertical.
        v: f32,
    }
}

message! {
    /// A mesh sent along with a marker.
    #[derive(Eq, Default)]
    MeshFile = "visualization_msgs/msg/MeshFile" {
        /// Name.
        filename: String,
        /// Content.
        data: Vec<u8>,
    }
}

message! {
    /// One thing to draw (the layout of Humble and later).
    #[derive(Default)]
    Marker = "visualization_msgs/msg/Marker" {
        /// Time and frame.
        header: Header,
        /// Namespace of `id`.
        ns: String,
        /// Identity within the namespace.
        id: i32,
        /// One of the type constants.
        r#type: i32,
        /// One of the action constants.
        action: i32,
        /// Where.
        pose: Pose,
        /// Size, m.
        scale: Vector3,
        /// Colour.
        color: ColorRgba,
        /// How long it stays; zero is for ever.
        lifetime: Duration,
        /// True if it moves with its frame.
        frame_locked: bool,
        /// Corners of lines and lists.
        points: Vec<Point>,
        /// Colours of `points`.
        colors: Vec<ColorRgba>,
        /// Texture by name.
        texture_resource: String,
        /// Texture by content.
        texture: CompressedImage,
        /// Places of `points` on the texture.
        uv_coordinates: Vec<UvCoordinate>,
        /// Text of text markers.
        text: String,
        /// Mesh by name.
        mesh_resource: String,
        /// Mesh by content.
        mesh_file: MeshFile,
        /// True to draw the mesh in its own colours.
        mesh_use_embedded_materials: bool,
    }
    constants {
        /// Type: connected line.
        LINE_STRIP: i32 = 4,
        /// Type: separate lines.
        LINE_LIST: i32 = 5,
        /// Type: text that faces the viewer.
        TEXT_VIEW_FACING: i32 = 9,
        /// Action: add or change.
        ADD: i32 = 0,
        /// Action: remove all markers of the topic.
        DELETEALL: i32 = 3,
    }
}

message! {
    /// Things to draw.
    #[derive(Default)]
    MarkerArray = "visualization_msgs/msg/MarkerArray" {
        /// The things.
        markers: Vec<Marker>,
    }
}
