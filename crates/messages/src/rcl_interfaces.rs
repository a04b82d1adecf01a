//! `rcl_interfaces`: parameters and log lines, as every ROS 2 node speaks of them.
//!
//! Requests and responses of services are messages like others, named `package/srv/Service_Request`.

use crate::builtin_interfaces::Time;
use crate::define::message;

message! {
    /// A value of one of the types of parameters. All fields are always on the wire; `r#type` says which one counts.
    #[derive(Default)]
    ParameterValue = "rcl_interfaces/msg/ParameterValue" {
        /// One of the constants of [`ParameterType`].
        r#type: u8,
        /// Truth value.
        bool_value: bool,
        /// Whole number.
        integer_value: i64,
        /// Number.
        double_value: f64,
        /// Text.
        string_value: String,
        /// Bytes.
        byte_array_value: Vec<u8> as "byte[]",
        /// Truth values.
        bool_array_value: Vec<bool>,
        /// Whole numbers.
        integer_array_value: Vec<i64>,
        /// Numbers.
        double_array_value: Vec<f64>,
        /// Texts.
        string_array_value: Vec<String>,
    }
}

/// Types of parameters, as numbers on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParameterType;

impl ParameterType {
    /// No value.
    pub const NOT_SET: u8 = 0;
    /// Truth value.
    pub const BOOL: u8 = 1;
    /// Whole number.
    pub const INTEGER: u8 = 2;
    /// Number.
    pub const DOUBLE: u8 = 3;
    /// Text.
    pub const STRING: u8 = 4;
    /// Bytes.
    pub const BYTE_ARRAY: u8 = 5;
    /// Truth values.
    pub const BOOL_ARRAY: u8 = 6;
    /// Whole numbers.
    pub const INTEGER_ARRAY: u8 = 7;
    /// Numbers.
    pub const DOUBLE_ARRAY: u8 = 8;
    /// Texts.
    pub const STRING_ARRAY: u8 = 9;
}

message! {
    /// A parameter: a name and its value.
    #[derive(Default)]
    Parameter = "rcl_interfaces/msg/Parameter" {
        /// Name, groups joined with dots.
        name: String,
        /// Value.
        value: ParameterValue,
    }
}

message! {
    /// Range of a floating point parameter; both ends belong to it.
    #[derive(Copy, Default)]
    FloatingPointRange = "rcl_interfaces/msg/FloatingPointRange" {
        /// Lower end.
        from_value: f64,
        /// Upper end.
        to_value: f64,
        /// Distance of allowed values, counted from the lower end; 0 allows all.
        step: f64,
    }
}

message! {
    /// Range of an integer parameter; both ends belong to it.
    #[derive(Copy, Eq, Default)]
    IntegerRange = "rcl_interfaces/msg/IntegerRange" {
        /// Lower end.
        from_value: i64,
        /// Upper end.
        to_value: i64,
        /// Distance of allowed values, counted from the lower end; 0 and 1 allow all.
        step: u64,
    }
}

message! {
    /// What is known about a parameter beside its value.
    #[derive(Default)]
    ParameterDescriptor = "rcl_interfaces/msg/ParameterDescriptor" {
        /// Name.
        name: String,
        /// One of the constants of [`ParameterType`].
        r#type: u8,
        /// Meaning, in words.
        description: String,
        /// What ranges cannot say, in words.
        additional_constraints: String,
        /// True when fixed at start.
        read_only: bool,
        /// True when the type may change.
        dynamic_typing: bool,
        /// Range of a floating point parameter.
        floating_point_range: Option<FloatingPointRange>,
        /// Range of an integer parameter.
        integer_range: Option<IntegerRange>,
    }
}

message! {
    /// How the setting of a parameter, or of a group of them, went.
    #[derive(Eq, Default)]
    SetParametersResult = "rcl_interfaces/msg/SetParametersResult" {
        /// True when the value is set.
        successful: bool,
        /// Why not.
        reason: String,
    }
}

message! {
    /// Names of parameters and of the groups that they are in.
    #[derive(Eq, Default)]
    ListParametersResult = "rcl_interfaces/msg/ListParametersResult" {
        /// Parameters.
        names: Vec<String>,
        /// Groups.
        prefixes: Vec<String>,
    }
}

message! {
    /// Parameters of a node came, changed or went.
    #[derive(Default)]
    ParameterEvent = "rcl_interfaces/msg/ParameterEvent" {
        /// When.
        stamp: Time,
        /// Fully qualified name of the node.
        node: String,
        /// Parameters that are new.
        new_parameters: Vec<Parameter>,
        /// Parameters with a new value.
        changed_parameters: Vec<Parameter>,
        /// Parameters that are gone.
        deleted_parameters: Vec<Parameter>,
    }
}

message! {
    /// A line of a log.
    #[derive(Eq, Default)]
    Log = "rcl_interfaces/msg/Log" {
        /// When.
        stamp: Time,
        /// One of the constants.
        level: u8,
        /// Name of the logger.
        name: String,
        /// Text.
        msg: String,
        /// Source file.
        file: String,
        /// Function in it.
        function: String,
        /// Line in it.
        line: u32,
    }
    constants {
        /// For developers.
        DEBUG: u8 = 10,
        /// Worth knowing.
        INFO: u8 = 20,
        /// Odd.
        WARN: u8 = 30,
        /// Something failed.
        ERROR: u8 = 40,
        /// The end.
        FATAL: u8 = 50,
    }
}

message! {
    /// Asks for values.
    #[derive(Eq, Default)]
    GetParametersRequest = "rcl_interfaces/srv/GetParameters_Request" {
        /// Parameters.
        names: Vec<String>,
    }
}

message! {
    /// The values in the order of the names.
    #[derive(Default)]
    GetParametersResponse = "rcl_interfaces/srv/GetParameters_Response" {
        /// Values.
        values: Vec<ParameterValue>,
    }
}

message! {
    /// Asks for types.
    #[derive(Eq, Default)]
    GetParameterTypesRequest = "rcl_interfaces/srv/GetParameterTypes_Request" {
        /// Parameters.
        names: Vec<String>,
    }
}

message! {
    /// The types in the order of the names.
    #[derive(Eq, Default)]
    GetParameterTypesResponse = "rcl_interfaces/srv/GetParameterTypes_Response" {
        /// Constants of [`ParameterType`].
        types: Vec<u8>,
    }
}

message! {
    /// Sets parameters one by one.
    #[derive(Default)]
    SetParametersRequest = "rcl_interfaces/srv/SetParameters_Request" {
        /// Parameters with their new values.
        parameters: Vec<Parameter>,
    }
}

message! {
    /// How each of them went.
    #[derive(Eq, Default)]
    SetParametersResponse = "rcl_interfaces/srv/SetParameters_Response" {
        /// One for each parameter.
        results: Vec<SetParametersResult>,
    }
}

message! {
    /// Sets all of the parameters or none.
    #[derive(Default)]
    SetParametersAtomicallyRequest = "rcl_interfaces/srv/SetParametersAtomically_Request" {
        /// Parameters with their new values.
        parameters: Vec<Parameter>,
    }
}

message! {
    /// How it went.
    #[derive(Eq, Default)]
    SetParametersAtomicallyResponse = "rcl_interfaces/srv/SetParametersAtomically_Response" {
        /// One for all.
        result: SetParametersResult,
    }
}

message! {
    /// Asks for descriptions.
    #[derive(Eq, Default)]
    DescribeParametersRequest = "rcl_interfaces/srv/DescribeParameters_Request" {
        /// Parameters.
        names: Vec<String>,
    }
}

message! {
    /// The descriptions in the order of the names.
    #[derive(Default)]
    DescribeParametersResponse = "rcl_interfaces/srv/DescribeParameters_Response" {
        /// Descriptions.
        descriptors: Vec<ParameterDescriptor>,
    }
}

message! {
    /// Asks for names.
    #[derive(Eq, Default)]
    ListParametersRequest = "rcl_interfaces/srv/ListParameters_Request" {
        /// Groups to list; none lists all.
        prefixes: Vec<String>,
        /// Levels of groups to go down; [`Self::DEPTH_RECURSIVE`] goes to the bottom.
        depth: u64,
    }
    constants {
        /// To the bottom.
        DEPTH_RECURSIVE: u64 = 0,
    }
}

message! {
    /// The names.
    #[derive(Eq, Default)]
    ListParametersResponse = "rcl_interfaces/srv/ListParameters_Response" {
        /// Names and groups.
        result: ListParametersResult,
    }
}
