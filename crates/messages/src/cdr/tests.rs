//! Properties that every message shares, and the layout rules one by one.

use super::*;
use crate::Message;
use crate::builtin_interfaces::{Duration, Time};
use crate::std_msgs::Text;
use proptest::prelude::*;

/// A small deterministic generator (splitmix64) that fills messages; proptest supplies its seed.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, bound: u64) -> u64 {
        self.next() % bound
    }
}

/// A type that the generator can fill.
pub(crate) trait Sample {
    fn sample(random: &mut Random) -> Self;
}

macro_rules! sample_integers {
    ($($type:ty),*) => {$(
        impl Sample for $type {
            fn sample(random: &mut Random) -> Self {
                random.next() as $type
            }
        }
    )*};
}

sample_integers!(u8, u16, u32, u64, i8, i32, i64);

impl Sample for f64 {
    fn sample(random: &mut Random) -> Self {
        (random.next() as i64) as f64 * 1e-12
    }
}

impl Sample for f32 {
    fn sample(random: &mut Random) -> Self {
        f64::sample(random) as f32
    }
}

impl Sample for bool {
    fn sample(random: &mut Random) -> Self {
        random.below(2) == 1
    }
}

impl Sample for String {
    fn sample(random: &mut Random) -> Self {
        (0..random.below(9)).map(|_| ['a', 'ß', '漢', ' ', '/'][random.below(5) as usize]).collect()
    }
}

impl Sample for Cow<'static, str> {
    fn sample(random: &mut Random) -> Self {
        Cow::Owned(String::sample(random))
    }
}

impl<T: Sample> Sample for Arc<T> {
    fn sample(random: &mut Random) -> Self {
        Self::new(T::sample(random))
    }
}

impl<T: Sample> Sample for Vec<T> {
    fn sample(random: &mut Random) -> Self {
        (0..random.below(4)).map(|_| T::sample(random)).collect()
    }
}

impl<T: Sample> Sample for Option<T> {
    fn sample(random: &mut Random) -> Self {
        (random.below(2) == 1).then(|| T::sample(random))
    }
}

impl<T: Sample, const N: usize> Sample for [T; N] {
    fn sample(random: &mut Random) -> Self {
        std::array::from_fn(|_| T::sample(random))
    }
}

/// Runs `$check::<M>($($argument),*)` for every message that stands on a topic.
macro_rules! for_every_message {
    ($check:ident($($argument:expr),*)) => {{
        use crate::*;
        $check::<autoware_internal_debug_msgs::Float64Stamped>($($argument),*);
        $check::<autoware_internal_debug_msgs::ProcessingTimeTree>($($argument),*);
        $check::<autoware_internal_debug_msgs::StringStamped>($($argument),*);
        $check::<autoware_internal_planning_msgs::CandidateTrajectories>($($argument),*);
        $check::<autoware_internal_planning_msgs::PlanningFactorArray>($($argument),*);
        $check::<autoware_internal_planning_msgs::ScoredCandidateTrajectories>($($argument),*);
        $check::<autoware_map_msgs::LaneletMapBin>($($argument),*);
        $check::<autoware_perception_msgs::PredictedObjects>($($argument),*);
        $check::<autoware_perception_msgs::TrafficLightGroupArray>($($argument),*);
        $check::<autoware_planning_msgs::LaneletRoute>($($argument),*);
        $check::<autoware_planning_msgs::Trajectory>($($argument),*);
        $check::<autoware_trajectory_validator::ValidationReportArray>($($argument),*);
        $check::<autoware_vehicle_msgs::TurnIndicatorsCommand>($($argument),*);
        $check::<diagnostic_msgs::DiagnosticArray>($($argument),*);
        $check::<foxglove_msgs::SceneUpdate>($($argument),*);
        $check::<geometry_msgs::AccelWithCovarianceStamped>($($argument),*);
        $check::<geometry_msgs::PoseStamped>($($argument),*);
        $check::<nav_msgs::OccupancyGrid>($($argument),*);
        $check::<nav_msgs::Odometry>($($argument),*);
        $check::<rcl_interfaces::DescribeParametersRequest>($($argument),*);
        $check::<rcl_interfaces::DescribeParametersResponse>($($argument),*);
        $check::<rcl_interfaces::GetParameterTypesRequest>($($argument),*);
        $check::<rcl_interfaces::GetParameterTypesResponse>($($argument),*);
        $check::<rcl_interfaces::GetParametersRequest>($($argument),*);
        $check::<rcl_interfaces::GetParametersResponse>($($argument),*);
        $check::<rcl_interfaces::ListParametersRequest>($($argument),*);
        $check::<rcl_interfaces::ListParametersResponse>($($argument),*);
        $check::<rcl_interfaces::Log>($($argument),*);
        $check::<rcl_interfaces::ParameterEvent>($($argument),*);
        $check::<rcl_interfaces::SetParametersAtomicallyRequest>($($argument),*);
        $check::<rcl_interfaces::SetParametersAtomicallyResponse>($($argument),*);
        $check::<rcl_interfaces::SetParametersRequest>($($argument),*);
        $check::<rcl_interfaces::SetParametersResponse>($($argument),*);
        $check::<rosgraph_msgs::Clock>($($argument),*);
        $check::<visualization_msgs::MarkerArray>($($argument),*);
    }};
}

/// Interface 0.52 drops a field, so the comparison is between the bytes of two rounds.
fn round_trips<M: Message + Sample + PartialEq + std::fmt::Debug>(seed: u64, interface: Interface) {
    let message = M::sample(&mut Random(seed));
    let bytes = message.to_cdr(interface);
    let read = M::from_cdr(&bytes, interface, "/topic").unwrap();
    assert_eq!(read.to_cdr(interface), bytes);
    if interface == Interface::V0_53 {
        assert_eq!(read, message);
    }
}

fn truncation_is_an_error<M: Message + Sample>(seed: u64) {
    let bytes = M::sample(&mut Random(seed)).to_cdr(Interface::V0_53);
    for length in 0..bytes.len() {
        let Err(error) = M::from_cdr(&bytes[..length], Interface::V0_53, "/topic") else {
            panic!("{} cut at {length} of {} was accepted", M::TYPE_NAME, bytes.len());
        };
        assert!(error.offset <= length, "{error}");
        assert!(error.to_string().starts_with("/topic: malformed "), "{error}");
    }
}

fn mutation_does_no_harm<M: Message + Sample>(seed: u64) {
    let mut random = Random(seed);
    let mut bytes = M::sample(&mut random).to_cdr(Interface::V0_53);
    for _ in 0..4 {
        let at = random.below(bytes.len() as u64) as usize;
        bytes[at] = random.next() as u8;
    }
    // Accepted or refused: both are fine, a panic or a huge allocation is not.
    let _ = M::from_cdr(&bytes, Interface::V0_53, "/topic");
    let _ = M::from_cdr(&bytes, Interface::V0_52, "/topic");
}

proptest! {
    #[test]
    fn every_message_survives_the_wire(seed: u64) {
        for interface in [Interface::V0_52, Interface::V0_53] {
            for_every_message!(round_trips(seed, interface));
        }
    }

    #[test]
    fn every_mutation_ends_in_a_value_or_an_error(seed: u64) {
        for_every_message!(mutation_does_no_harm(seed));
    }
}

#[test]
fn every_truncation_is_an_error_with_its_place() {
    for seed in 0..4 {
        for_every_message!(truncation_is_an_error(seed));
    }
}

#[test]
fn primitives_are_aligned_to_their_size_behind_the_header() {
    let text = Text { data: "ab".to_owned() };
    assert_eq!(text.to_cdr(Interface::V0_53), [0, 1, 0, 0, 3, 0, 0, 0, b'a', b'b', 0]);
    // bool at 0, then a u32 length at 4, then f64 at 16
    let mut writer = Writer::new(Interface::V0_53);
    true.encode(&mut writer);
    vec![1.0_f64].encode(&mut writer);
    let bytes = writer.finish();
    assert_eq!(bytes.len(), 4 + 16);
    assert_eq!(bytes[4..12], [1, 0, 0, 0, 1, 0, 0, 0]);
    assert_eq!(bytes[12..], 1.0_f64.to_le_bytes());
}

#[test]
fn an_empty_sequence_of_doubles_takes_no_padding() {
    let mut writer = Writer::new(Interface::V0_53);
    Vec::<f64>::new().encode(&mut writer);
    7_u8.encode(&mut writer);
    assert_eq!(writer.finish()[4..], [0, 0, 0, 0, 7]);
}

#[test]
fn big_endian_is_read_too() {
    let bytes = [0, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0, 7];
    assert_eq!(Time::from_cdr(&bytes, Interface::V0_53, "t").unwrap(), Time { sec: 5, nanosec: 7 });
}

#[test]
fn wrong_bytes_are_named() {
    let read = |bytes: &[u8]| Text::from_cdr(bytes, Interface::V0_53, "/t").unwrap_err();
    assert_eq!(read(&[0, 1]).kind, DecodeErrorKind::Truncated { needed: 2 });
    assert_eq!(read(&[0, 7, 0, 0, 1, 0, 0, 0, 0]).kind, DecodeErrorKind::UnsupportedEncapsulation(7));
    let huge = read(&[0, 1, 0, 0, 255, 255, 255, 255, 0]);
    assert_eq!((huge.offset, huge.kind), (8, DecodeErrorKind::ImpossibleLength { count: u32::MAX, left: 1 }));
    assert_eq!(read(&[0, 1, 0, 0, 1, 0, 0, 0, 9]).kind, DecodeErrorKind::UnterminatedString(1));
    let trailing = read(&[0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(trailing.kind, DecodeErrorKind::TrailingBytes(4));
    assert!(Text::from_cdr(&[0, 1, 0, 0, 0, 0, 0, 0], Interface::V0_53, "/t").unwrap().data.is_empty());
}

#[test]
fn a_bounded_sequence_holds_at_most_its_bound() {
    use crate::rcl_interfaces::{IntegerRange, ParameterDescriptor};
    let range = IntegerRange { from_value: 1, to_value: 9, step: 2 };
    let descriptor = ParameterDescriptor { integer_range: Some(range), ..Default::default() };
    let mut bytes = descriptor.to_cdr(Interface::V0_53);
    assert_eq!(bytes[bytes.len() - 8..], 2_u64.to_le_bytes());
    let definition = ParameterDescriptor::definition(Interface::V0_53);
    assert!(definition.contains("rcl_interfaces/IntegerRange[<=1] integer_range\n"), "{definition}");
    // The length of the sequence stands in the four bytes before the padding of its first number.
    let length_at = bytes.len() - size_of::<[u64; 3]>() - 4;
    assert_eq!(bytes[length_at], 1);
    bytes[length_at] = 2;
    bytes.extend_from_slice(&[0; 24]);
    let error = ParameterDescriptor::from_cdr(&bytes, Interface::V0_53, "/t").unwrap_err();
    assert_eq!(error.kind, DecodeErrorKind::TooManyElements { count: 2, limit: 1 });
}

/// Bytes written by hand from the layout of ROS 2.
#[test]
fn the_request_of_set_parameters_has_the_layout_of_ros() {
    use crate::rcl_interfaces::{Parameter, ParameterType, ParameterValue, SetParametersRequest};
    let value = ParameterValue { r#type: ParameterType::DOUBLE, double_value: 1.5, ..Default::default() };
    let request = SetParametersRequest { parameters: vec![Parameter { name: "abc".to_owned(), value }] };
    let mut expected = vec![0, 1, 0, 0];
    expected.extend([1, 0, 0, 0]); // one parameter
    expected.extend([4, 0, 0, 0, b'a', b'b', b'c', 0]);
    expected.extend([3, 0, 0, 0]); // type, bool, padding to 16
    expected.extend([0; 8]); // integer
    expected.extend(1.5_f64.to_le_bytes());
    expected.extend([1, 0, 0, 0, 0, 0, 0, 0]); // empty text with its NUL, padding
    expected.extend([0; 20]); // five empty sequences
    assert_eq!(request.to_cdr(Interface::V0_53), expected);
}

#[test]
fn a_message_of_the_other_interface_is_refused() {
    use crate::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory};
    let message = CandidateTrajectories {
        candidate_trajectories: vec![Arc::new(CandidateTrajectory::default())],
        generator_info: vec![Default::default()],
    };
    for (written, read) in [(Interface::V0_53, Interface::V0_52), (Interface::V0_52, Interface::V0_53)] {
        assert!(CandidateTrajectories::from_cdr(&message.to_cdr(written), read, "/t").is_err());
    }
}

#[test]
fn definitions_list_each_message_once() {
    let text = crate::nav_msgs::Odometry::definition(Interface::V0_53);
    assert!(text.starts_with("std_msgs/Header header\nstring child_frame_id\n"), "{text}");
    assert_eq!(text.matches("MSG: geometry_msgs/Vector3\n").count(), 1);
    let separator = format!("{}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n", "=".repeat(80));
    assert!(text.contains(&separator), "{text}");
}

#[test]
fn definitions_follow_the_interface() {
    use crate::autoware_internal_planning_msgs::CandidateTrajectories;
    let field = "autoware_vehicle_msgs/TurnIndicatorsCommand turn_indicators_command";
    assert!(CandidateTrajectories::definition(Interface::V0_53).contains(field));
    assert!(!CandidateTrajectories::definition(Interface::V0_52).contains("TurnIndicatorsCommand"));
    let diagnostics = crate::diagnostic_msgs::DiagnosticArray::definition(Interface::V0_53);
    assert!(diagnostics.contains("uint8 WARN=1\n") && diagnostics.contains("byte level\n"), "{diagnostics}");
}

#[test]
fn the_smallest_wire_size_is_never_overstated() {
    // An empty message of defaults is as small as it gets, padding included.
    let empty = crate::autoware_perception_msgs::PredictedPath::default().to_cdr(Interface::V0_53);
    assert!(crate::autoware_perception_msgs::PredictedPath::MIN_BYTES <= empty.len() - ENCAPSULATION_BYTES);
    let _ = Duration::default();
}

/// What [`Cdr::decode_many`] does where nothing is known about the layout.
fn one_by_one<T: Cdr>(reader: &mut Reader<'_>, count: usize) -> Result<Vec<T>, DecodeErrorKind> {
    (0..count).map(|_| T::decode(reader)).collect()
}

/// Reading in blocks gives what reading one by one gives: the same values, the same place behind them, and of a message
/// that is too short the same error.
fn assert_blocks<T: Cdr + Sample + PartialEq + std::fmt::Debug>(block: usize) {
    for skipped in 0..2 * align_of::<u64>() {
        let mut writer = Writer::new(Interface::default());
        (0..skipped).for_each(|_| writer.put([7_u8]));
        let values: Vec<T> = (0..5).map(|seed| T::sample(&mut Random(seed))).collect();
        T::encode_many(&values, &mut writer);
        let mut bytes = writer.finish();
        assert!(skipped > 0 || bytes.len() == ENCAPSULATION_BYTES + 5 * block, "{} bytes", bytes.len());
        for is_big_endian in [false, true] {
            bytes[1] = u8::from(!is_big_endian);
            for length in ENCAPSULATION_BYTES + skipped..=bytes.len() {
                let reader = || {
                    let mut reader = Reader::new(&bytes[..length], Interface::default()).unwrap();
                    reader.take_slice(skipped).unwrap();
                    reader
                };
                let (mut many, mut single) = (reader(), reader());
                let (of_many, of_single) = (T::decode_many(&mut many, 5), one_by_one::<T>(&mut single, 5));
                assert_eq!(of_many, of_single, "{length} bytes behind {skipped}");
                assert_eq!(many.offset(), single.offset(), "{length} bytes behind {skipped}");
                assert!(is_big_endian || length < bytes.len() || of_many.as_ref() == Ok(&values));
            }
        }
    }
}

#[test]
fn blocks_are_what_is_read_one_by_one() {
    assert_blocks::<crate::geometry_msgs::Pose>(56);
    assert_blocks::<crate::autoware_planning_msgs::TrajectoryPoint>(88);
}
