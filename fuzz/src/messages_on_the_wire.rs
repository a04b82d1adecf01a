//! CDR of every message in both interfaces.

use messages::{Interface, Message};

/// Reads the bytes as a message.
type Read = fn(&[u8], Interface);

/// What decodes is encoded to bytes that decode to the same.
fn read<M: Message>(bytes: &[u8], interface: Interface) {
    let Ok(message) = M::from_cdr(bytes, interface, "/fuzzed") else { return };
    let written = message.to_cdr(interface);
    let again = M::from_cdr(&written, interface, "/fuzzed").expect("what we write we can read");
    // Bytes are compared: numbers that are none are not equal to themselves.
    assert!(again.to_cdr(interface) == written, "reading and writing once more changes it");
}

/// Every message that has a wire form of its own, with its ROS type.
pub const KINDS: [(&str, Read); 100] = [
    kind::<messages::autoware_internal_debug_msgs::ProcessingTimeNode>(),
    kind::<messages::autoware_internal_debug_msgs::ProcessingTimeTree>(),
    kind::<messages::autoware_internal_debug_msgs::Float64Stamped>(),
    kind::<messages::autoware_internal_debug_msgs::StringStamped>(),
    kind::<messages::autoware_internal_planning_msgs::GeneratorInfo>(),
    kind::<messages::autoware_internal_planning_msgs::CandidateTrajectory>(),
    kind::<messages::autoware_internal_planning_msgs::CandidateTrajectories>(),
    kind::<messages::autoware_internal_planning_msgs::ScoredCandidateTrajectory>(),
    kind::<messages::autoware_internal_planning_msgs::ScoredCandidateTrajectories>(),
    kind::<messages::autoware_internal_planning_msgs::ControlPoint>(),
    kind::<messages::autoware_internal_planning_msgs::SafetyFactor>(),
    kind::<messages::autoware_internal_planning_msgs::SafetyFactorArray>(),
    kind::<messages::autoware_internal_planning_msgs::PlanningFactor>(),
    kind::<messages::autoware_internal_planning_msgs::PlanningFactorArray>(),
    kind::<messages::autoware_map_msgs::LaneletMapBin>(),
    kind::<messages::autoware_perception_msgs::ObjectClassification>(),
    kind::<messages::autoware_perception_msgs::Shape>(),
    kind::<messages::autoware_perception_msgs::PredictedPath>(),
    kind::<messages::autoware_perception_msgs::PredictedObjectKinematics>(),
    kind::<messages::autoware_perception_msgs::PredictedObject>(),
    kind::<messages::autoware_perception_msgs::PredictedObjects>(),
    kind::<messages::autoware_perception_msgs::TrafficLightElement>(),
    kind::<messages::autoware_perception_msgs::PredictedTrafficLightState>(),
    kind::<messages::autoware_perception_msgs::TrafficLightGroup>(),
    kind::<messages::autoware_perception_msgs::TrafficLightGroupArray>(),
    kind::<messages::autoware_planning_msgs::TrajectoryPoint>(),
    kind::<messages::autoware_planning_msgs::Trajectory>(),
    kind::<messages::autoware_planning_msgs::LaneletPrimitive>(),
    kind::<messages::autoware_planning_msgs::LaneletSegment>(),
    kind::<messages::autoware_planning_msgs::LaneletRoute>(),
    kind::<messages::autoware_trajectory_validator::RiskLevel>(),
    kind::<messages::autoware_trajectory_validator::MetricReport>(),
    kind::<messages::autoware_trajectory_validator::ValidationReport>(),
    kind::<messages::autoware_trajectory_validator::ValidationReportArray>(),
    kind::<messages::autoware_vehicle_msgs::TurnIndicatorsCommand>(),
    kind::<messages::builtin_interfaces::Time>(),
    kind::<messages::builtin_interfaces::Duration>(),
    kind::<messages::diagnostic_msgs::KeyValue>(),
    kind::<messages::diagnostic_msgs::DiagnosticStatus>(),
    kind::<messages::diagnostic_msgs::DiagnosticArray>(),
    kind::<messages::geometry_msgs::Point>(),
    kind::<messages::geometry_msgs::Point32>(),
    kind::<messages::geometry_msgs::Vector3>(),
    kind::<messages::geometry_msgs::Quaternion>(),
    kind::<messages::geometry_msgs::Pose>(),
    kind::<messages::geometry_msgs::PoseWithCovariance>(),
    kind::<messages::geometry_msgs::Twist>(),
    kind::<messages::geometry_msgs::TwistWithCovariance>(),
    kind::<messages::geometry_msgs::Accel>(),
    kind::<messages::geometry_msgs::AccelWithCovariance>(),
    kind::<messages::geometry_msgs::AccelWithCovarianceStamped>(),
    kind::<messages::geometry_msgs::Polygon>(),
    kind::<messages::nav_msgs::Odometry>(),
    kind::<messages::rcl_interfaces::ParameterValue>(),
    kind::<messages::rcl_interfaces::Parameter>(),
    kind::<messages::rcl_interfaces::FloatingPointRange>(),
    kind::<messages::rcl_interfaces::IntegerRange>(),
    kind::<messages::rcl_interfaces::ParameterDescriptor>(),
    kind::<messages::rcl_interfaces::SetParametersResult>(),
    kind::<messages::rcl_interfaces::ListParametersResult>(),
    kind::<messages::rcl_interfaces::ParameterEvent>(),
    kind::<messages::rcl_interfaces::Log>(),
    kind::<messages::rcl_interfaces::GetParametersRequest>(),
    kind::<messages::rcl_interfaces::GetParametersResponse>(),
    kind::<messages::rcl_interfaces::GetParameterTypesRequest>(),
    kind::<messages::rcl_interfaces::GetParameterTypesResponse>(),
    kind::<messages::rcl_interfaces::SetParametersRequest>(),
    kind::<messages::rcl_interfaces::SetParametersResponse>(),
    kind::<messages::rcl_interfaces::SetParametersAtomicallyRequest>(),
    kind::<messages::rcl_interfaces::SetParametersAtomicallyResponse>(),
    kind::<messages::rcl_interfaces::DescribeParametersRequest>(),
    kind::<messages::rcl_interfaces::DescribeParametersResponse>(),
    kind::<messages::rcl_interfaces::ListParametersRequest>(),
    kind::<messages::rcl_interfaces::ListParametersResponse>(),
    kind::<messages::rosgraph_msgs::Clock>(),
    kind::<messages::sensor_msgs::CompressedImage>(),
    kind::<messages::std_msgs::Header>(),
    kind::<messages::std_msgs::Text>(),
    kind::<messages::std_msgs::ColorRgba>(),
    kind::<messages::unique_identifier_msgs::Uuid>(),
    kind::<messages::visualization_msgs::UvCoordinate>(),
    kind::<messages::visualization_msgs::MeshFile>(),
    kind::<messages::visualization_msgs::Marker>(),
    kind::<messages::visualization_msgs::MarkerArray>(),
    // Later ones behind: kept inputs name their message by its place.
    kind::<messages::foxglove_msgs::Color>(),
    kind::<messages::foxglove_msgs::KeyValuePair>(),
    kind::<messages::foxglove_msgs::ArrowPrimitive>(),
    kind::<messages::foxglove_msgs::CubePrimitive>(),
    kind::<messages::foxglove_msgs::SpherePrimitive>(),
    kind::<messages::foxglove_msgs::CylinderPrimitive>(),
    kind::<messages::foxglove_msgs::LinePrimitive>(),
    kind::<messages::foxglove_msgs::TriangleListPrimitive>(),
    kind::<messages::foxglove_msgs::TextPrimitive>(),
    kind::<messages::foxglove_msgs::ModelPrimitive>(),
    kind::<messages::foxglove_msgs::SceneEntity>(),
    kind::<messages::foxglove_msgs::SceneEntityDeletion>(),
    kind::<messages::foxglove_msgs::SceneUpdate>(),
    kind::<messages::geometry_msgs::PoseStamped>(),
    kind::<messages::nav_msgs::MapMetaData>(),
    kind::<messages::nav_msgs::OccupancyGrid>(),
];

const fn kind<M: Message>() -> (&'static str, Read) {
    (M::TYPE_NAME, read::<M>)
}

/// A message, behind a byte for its kind and one for the interface.
pub fn cdr(bytes: &[u8]) {
    let [kind, interface, message @ ..] = bytes else { return };
    let interface = if interface & 1 == 0 { Interface::V0_53 } else { Interface::V0_52 };
    KINDS[usize::from(*kind) % KINDS.len()].1(message, interface);
}
