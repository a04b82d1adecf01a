//! The ROS 2 door: what a node needs besides the messages on its topics.
//!
//! The modules below `arguments`, `names`, `parameter_files`, `parameters`, `environment` and `logging` are pure: they
//! know the rules of ROS 2 and neither sockets nor clocks.

pub mod arguments;
pub mod environment;
pub mod logging;
pub mod names;
pub mod parameter_files;
pub mod parameters;
