//! The ROS 2 door: the node in its graph.
//!
//! The modules `arguments`, `names`, `parameter_files`, `parameters`, `environment` and `logging` are pure: they know
//! the rules of ROS 2 and neither sockets nor clocks. `graph`, `payload`, `qos`, `subscriptions`, `publications`,
//! `services`, `rosout` and `events` are the network side, `middleware`, `waits` and `estranged` bear with what the
//! middleware does not; `node` puts all together.

// A build for both would quietly be one for the newer.
#[cfg(all(feature = "humble", feature = "jazzy"))]
compile_error!("a build is for one release of ROS 2: for Humble add `--no-default-features`");
#[cfg(not(any(feature = "humble", feature = "jazzy")))]
compile_error!("a build is for one release of ROS 2: choose the feature `jazzy` or `humble`");

pub mod arguments;
pub mod encoder;
pub mod environment;
pub mod estranged;
pub mod events;
pub mod graph;
pub mod logging;
mod middleware;
pub mod names;
pub mod node;
pub mod parameter_files;
pub mod parameters;
pub mod payload;
pub mod publications;
pub mod qos;
pub mod rosout;
pub mod services;
pub mod subscriptions;
#[cfg(target_os = "linux")]
mod waits;
pub mod watcher;
