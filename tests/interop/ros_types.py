"""The ROS 2 messages and services that the node speaks, as IDL types of CycloneDDS.

Written from the message definitions of ROS 2 and Autoware, not made from the node's own: whatever does not decode here,
no other node can decode either. `TYPES` finds a type by its ROS name.
"""

from dataclasses import dataclass
from types import new_class

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int8, int32, int64, sequence, uint8, uint16, uint32, uint64

TYPES = {}


def message(name, fields, typename=None):
    """Declares the type `package/msg/Name` with fields in wire order: a text of `type name` pairs, one a line."""
    package, kind, short = name.split("/")
    annotations = []
    for line in fields.strip().splitlines():
        type_text, field_name = line.split()
        annotations.append((field_name, idl_type(type_text)))
    body = {"__annotations__": dict(annotations), "__module__": __name__}
    keywords = {"typename": typename or f"{package}::{kind}::dds_::{short}_"}
    TYPES[name] = dataclass(new_class(short, (IdlStruct,), keywords, lambda namespace: namespace.update(body)))
    return TYPES[name]


def blob(length, name):
    """Any bytes of this length under the name of a type: what a node that is wrong about the type would send."""
    package, kind, short = name.split("/")
    body = {"__annotations__": {"content": array[uint8, length]}, "__module__": __name__}
    keywords = {"typename": f"{package}::{kind}::dds_::{short}_"}
    return dataclass(new_class(f"Blob{short}", (IdlStruct,), keywords, lambda namespace: namespace.update(body)))


PRIMITIVES = {
    "bool": bool, "byte": uint8, "int8": int8, "uint8": uint8, "uint16": uint16, "int32": int32, "uint32": uint32,
    "int64": int64, "uint64": uint64, "float32": float32, "float64": float64, "string": str,
}


def idl_type(text):
    if text.endswith("[]"):
        return sequence[idl_type(text[:-2])]
    if text.endswith("]"):
        base, count = text[:-1].split("[")
        if count.startswith("<="):
            return sequence[idl_type(base), int(count[2:])]
        return array[idl_type(base), int(count)]
    if text in PRIMITIVES:
        return PRIMITIVES[text]
    package, short = text.split("/")
    return TYPES[f"{package}/msg/{short}"]


message("builtin_interfaces/msg/Time", "int32 sec\nuint32 nanosec")
message("builtin_interfaces/msg/Duration", "int32 sec\nuint32 nanosec")
message("rosgraph_msgs/msg/Clock", "builtin_interfaces/Time clock")
message("std_msgs/msg/Header", "builtin_interfaces/Time stamp\nstring frame_id")
message("std_msgs/msg/String", "string data")
message("std_msgs/msg/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a")
message("unique_identifier_msgs/msg/UUID", "uint8[16] uuid")
for three in ("Point", "Vector3"):
    message(f"geometry_msgs/msg/{three}", "float64 x\nfloat64 y\nfloat64 z")
message("geometry_msgs/msg/Point32", "float32 x\nfloat32 y\nfloat32 z")
message("geometry_msgs/msg/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w")
message("geometry_msgs/msg/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation")
message("sensor_msgs/msg/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data")
message("visualization_msgs/msg/UVCoordinate", "float32 u\nfloat32 v")
message("visualization_msgs/msg/MeshFile", "string filename\nuint8[] data")
message("geometry_msgs/msg/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose")
message("geometry_msgs/msg/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance")
message("geometry_msgs/msg/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular")
message("geometry_msgs/msg/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance")
message("geometry_msgs/msg/Accel", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular")
message("geometry_msgs/msg/AccelWithCovariance", "geometry_msgs/Accel accel\nfloat64[36] covariance")
message(
    "geometry_msgs/msg/AccelWithCovarianceStamped",
    "std_msgs/Header header\ngeometry_msgs/AccelWithCovariance accel",
)
message("geometry_msgs/msg/Polygon", "geometry_msgs/Point32[] points")
message(
    "nav_msgs/msg/Odometry",
    """std_msgs/Header header
    string child_frame_id
    geometry_msgs/PoseWithCovariance pose
    geometry_msgs/TwistWithCovariance twist""",
)

message(
    "nav_msgs/msg/MapMetaData",
    """builtin_interfaces/Time map_load_time
    float32 resolution
    uint32 width
    uint32 height
    geometry_msgs/Pose origin""",
)
message("nav_msgs/msg/OccupancyGrid", "std_msgs/Header header\nnav_msgs/MapMetaData info\nint8[] data")
message("autoware_vehicle_msgs/msg/TurnIndicatorsCommand", "builtin_interfaces/Time stamp\nuint8 command")
message(
    "autoware_planning_msgs/msg/TrajectoryPoint",
    """builtin_interfaces/Duration time_from_start
    geometry_msgs/Pose pose
    float32 longitudinal_velocity_mps
    float32 lateral_velocity_mps
    float32 acceleration_mps2
    float32 heading_rate_rps
    float32 front_wheel_angle_rad
    float32 rear_wheel_angle_rad""",
)
message(
    "autoware_planning_msgs/msg/Trajectory",
    "std_msgs/Header header\nautoware_planning_msgs/TrajectoryPoint[] points",
)
message("autoware_planning_msgs/msg/LaneletPrimitive", "int64 id\nstring primitive_type")
message(
    "autoware_planning_msgs/msg/LaneletSegment",
    """autoware_planning_msgs/LaneletPrimitive preferred_primitive
    autoware_planning_msgs/LaneletPrimitive[] primitives""",
)
message(
    "autoware_planning_msgs/msg/LaneletRoute",
    """std_msgs/Header header
    geometry_msgs/Pose start_pose
    geometry_msgs/Pose goal_pose
    autoware_planning_msgs/LaneletSegment[] segments
    unique_identifier_msgs/UUID uuid
    bool allow_modification""",
)
message(
    "autoware_map_msgs/msg/LaneletMapBin",
    """std_msgs/Header header
    string version_map_format
    string version_map
    string name_map
    uint8[] data""",
)

message("autoware_perception_msgs/msg/ObjectClassification", "uint8 label\nfloat32 probability")
message(
    "autoware_perception_msgs/msg/PredictedPath",
    "geometry_msgs/Pose[] path\nbuiltin_interfaces/Duration time_step\nfloat32 confidence",
)
message(
    "autoware_perception_msgs/msg/PredictedObjectKinematics",
    """geometry_msgs/PoseWithCovariance initial_pose_with_covariance
    geometry_msgs/TwistWithCovariance initial_twist_with_covariance
    geometry_msgs/AccelWithCovariance initial_acceleration_with_covariance
    autoware_perception_msgs/PredictedPath[] predicted_paths""",
)
message(
    "autoware_perception_msgs/msg/Shape",
    "uint8 type\ngeometry_msgs/Polygon footprint\ngeometry_msgs/Vector3 dimensions",
)
message(
    "autoware_perception_msgs/msg/PredictedObject",
    """unique_identifier_msgs/UUID object_id
    float32 existence_probability
    autoware_perception_msgs/ObjectClassification[] classification
    autoware_perception_msgs/PredictedObjectKinematics kinematics
    autoware_perception_msgs/Shape shape""",
)
message(
    "autoware_perception_msgs/msg/PredictedObjects",
    "std_msgs/Header header\nautoware_perception_msgs/PredictedObject[] objects",
)
message(
    "autoware_perception_msgs/msg/TrafficLightElement",
    "uint8 color\nuint8 shape\nuint8 status\nfloat32 confidence",
)
message(
    "autoware_perception_msgs/msg/PredictedTrafficLightState",
    """builtin_interfaces/Time predicted_stamp
    autoware_perception_msgs/TrafficLightElement[] simultaneous_elements
    float32 reliability
    string information_source""",
)
message(
    "autoware_perception_msgs/msg/TrafficLightGroup",
    """int64 traffic_light_group_id
    autoware_perception_msgs/TrafficLightElement[] elements
    autoware_perception_msgs/PredictedTrafficLightState[] predictions""",
)
message(
    "autoware_perception_msgs/msg/TrafficLightGroupArray",
    "builtin_interfaces/Time stamp\nautoware_perception_msgs/TrafficLightGroup[] traffic_light_groups",
)

PLANNING = "autoware_internal_planning_msgs"
message(f"{PLANNING}/msg/GeneratorInfo", "unique_identifier_msgs/UUID generator_id\nstd_msgs/String generator_name")
message(
    f"{PLANNING}/msg/CandidateTrajectory",
    """std_msgs/Header header
    unique_identifier_msgs/UUID generator_id
    autoware_planning_msgs/TrajectoryPoint[] points
    autoware_vehicle_msgs/TurnIndicatorsCommand turn_indicators_command""",
)
message(
    f"{PLANNING}/msg/CandidateTrajectories",
    f"""{PLANNING}/CandidateTrajectory[] candidate_trajectories
    {PLANNING}/GeneratorInfo[] generator_info""",
)
message(
    f"{PLANNING}/msg/ScoredCandidateTrajectory",
    f"{PLANNING}/CandidateTrajectory candidate_trajectory\nfloat32 score",
)
message(
    f"{PLANNING}/msg/ScoredCandidateTrajectories",
    f"""{PLANNING}/ScoredCandidateTrajectory[] scored_candidate_trajectories
    {PLANNING}/GeneratorInfo[] generator_info""",
)
message(
    f"{PLANNING}/msg/ControlPoint",
    "geometry_msgs/Pose pose\nfloat32 velocity\nfloat32 shift_length\nfloat32 distance",
)
message(
    f"{PLANNING}/msg/SafetyFactor",
    """uint16 type
    unique_identifier_msgs/UUID object_id
    autoware_perception_msgs/PredictedPath predicted_path
    float32 ttc_begin
    float32 ttc_end
    geometry_msgs/Point[] points
    bool is_safe""",
)
message(
    f"{PLANNING}/msg/SafetyFactorArray",
    f"std_msgs/Header header\n{PLANNING}/SafetyFactor[] factors\nbool is_safe\nstring detail",
)
message(
    f"{PLANNING}/msg/PlanningFactor",
    f"""string module
    bool is_driving_forward
    {PLANNING}/ControlPoint[] control_points
    uint16 behavior
    string detail
    {PLANNING}/SafetyFactorArray safety_factors""",
)
message(f"{PLANNING}/msg/PlanningFactorArray", f"std_msgs/Header header\n{PLANNING}/PlanningFactor[] factors")

# The form of 0.52 has the same name on the wire, hence a name of its own here.
TYPES["0.52"] = message(
    f"{PLANNING}/msg/CandidateTrajectory052",
    """std_msgs/Header header
    unique_identifier_msgs/UUID generator_id
    autoware_planning_msgs/TrajectoryPoint[] points""",
    typename=f"{PLANNING}::msg::dds_::CandidateTrajectory052_",
)
message(
    f"{PLANNING}/msg/CandidateTrajectories052",
    f"""{PLANNING}/CandidateTrajectory052[] candidate_trajectories
    {PLANNING}/GeneratorInfo[] generator_info""",
    typename=f"{PLANNING}::msg::dds_::CandidateTrajectories_",
)

VALIDATOR = "autoware_trajectory_validator"
message(f"{VALIDATOR}/msg/RiskLevel", "uint8 level")
message(
    f"{VALIDATOR}/msg/MetricReport",
    f"""string validator_name
    string validator_category
    string metric_name
    float64 metric_value
    {VALIDATOR}/RiskLevel risk""",
)
message(
    f"{VALIDATOR}/msg/ValidationReport",
    f"""builtin_interfaces/Time trajectory_stamp
    unique_identifier_msgs/UUID generator_id
    string generator_name
    {VALIDATOR}/RiskLevel risk
    {VALIDATOR}/MetricReport[] metrics""",
)
message(f"{VALIDATOR}/msg/ValidationReportArray", f"{VALIDATOR}/ValidationReport[] reports")

DEBUG = "autoware_internal_debug_msgs"
message(
    f"{DEBUG}/msg/ProcessingTimeNode",
    "int32 id\nstring name\nfloat64 processing_time\nint32 parent_id\nstring comment",
)
message(f"{DEBUG}/msg/ProcessingTimeTree", f"{DEBUG}/ProcessingTimeNode[] nodes")
message(f"{DEBUG}/msg/Float64Stamped", "builtin_interfaces/Time stamp\nfloat64 data")
message(f"{DEBUG}/msg/StringStamped", "builtin_interfaces/Time stamp\nstring data")
message("diagnostic_msgs/msg/KeyValue", "string key\nstring value")
message(
    "diagnostic_msgs/msg/DiagnosticStatus",
    """byte level
    string name
    string message
    string hardware_id
    diagnostic_msgs/KeyValue[] values""",
)
message(
    "diagnostic_msgs/msg/DiagnosticArray",
    "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status",
)
message(
    "visualization_msgs/msg/Marker",
    """std_msgs/Header header
    string ns
    int32 id
    int32 type
    int32 action
    geometry_msgs/Pose pose
    geometry_msgs/Vector3 scale
    std_msgs/ColorRGBA color
    builtin_interfaces/Duration lifetime
    bool frame_locked
    geometry_msgs/Point[] points
    std_msgs/ColorRGBA[] colors
    string texture_resource
    sensor_msgs/CompressedImage texture
    visualization_msgs/UVCoordinate[] uv_coordinates
    string text
    string mesh_resource
    visualization_msgs/MeshFile mesh_file
    bool mesh_use_embedded_materials""",
)
message("visualization_msgs/msg/MarkerArray", "visualization_msgs/Marker[] markers")

RCL = "rcl_interfaces"
message(
    f"{RCL}/msg/Log",
    """builtin_interfaces/Time stamp
    uint8 level
    string name
    string msg
    string file
    string function
    uint32 line""",
)
message(
    f"{RCL}/msg/ParameterValue",
    """uint8 type
    bool bool_value
    int64 integer_value
    float64 double_value
    string string_value
    byte[] byte_array_value
    bool[] bool_array_value
    int64[] integer_array_value
    float64[] double_array_value
    string[] string_array_value""",
)
message(f"{RCL}/msg/Parameter", f"string name\n{RCL}/ParameterValue value")
message(f"{RCL}/msg/SetParametersResult", "bool successful\nstring reason")
message(f"{RCL}/msg/ListParametersResult", "string[] names\nstring[] prefixes")
message(f"{RCL}/msg/FloatingPointRange", "float64 from_value\nfloat64 to_value\nfloat64 step")
message(f"{RCL}/msg/IntegerRange", "int64 from_value\nint64 to_value\nuint64 step")
message(
    f"{RCL}/msg/ParameterDescriptor",
    f"""string name
    uint8 type
    string description
    string additional_constraints
    bool read_only
    bool dynamic_typing
    {RCL}/FloatingPointRange[<=1] floating_point_range
    {RCL}/IntegerRange[<=1] integer_range""",
)
message(
    f"{RCL}/msg/ParameterEvent",
    f"""builtin_interfaces/Time stamp
    string node
    {RCL}/Parameter[] new_parameters
    {RCL}/Parameter[] changed_parameters
    {RCL}/Parameter[] deleted_parameters""",
)

# Discovery of nodes, as Jazzy has it.
message("rmw_dds_common/msg/Gid", "uint8[16] data")
message(
    "rmw_dds_common/msg/NodeEntitiesInfo",
    """string node_namespace
    string node_name
    rmw_dds_common/Gid[] reader_gid_seq
    rmw_dds_common/Gid[] writer_gid_seq""",
)
message(
    "rmw_dds_common/msg/ParticipantEntitiesInfo",
    "rmw_dds_common/Gid gid\nrmw_dds_common/NodeEntitiesInfo[] node_entities_info_seq",
)


def service(name, request, response):
    """Both directions of a service, in the plain form and in that of rmw_cyclonedds with its header in front."""
    for part, fields in (("Request", request), ("Response", response)):
        typename = f"rcl_interfaces::srv::dds_::{name}_{part}_"
        message(f"{RCL}/srv/{name}_{part}", fields, typename)
        header = "uint64 client\nint64 number\n"
        message(f"{RCL}/srv/{name}_{part}_cyclone", header + fields, typename)


service("GetParameters", "string[] names", f"{RCL}/ParameterValue[] values")
service("GetParameterTypes", "string[] names", "uint8[] types")
service("SetParameters", f"{RCL}/Parameter[] parameters", f"{RCL}/SetParametersResult[] results")
service("SetParametersAtomically", f"{RCL}/Parameter[] parameters", f"{RCL}/SetParametersResult result")
service("DescribeParameters", "string[] names", f"{RCL}/ParameterDescriptor[] descriptors")
service("ListParameters", "string[] prefixes\nuint64 depth", f"{RCL}/ListParametersResult result")
