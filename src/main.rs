//! The `trajectory-selector` program; everything it does is in the library beside it.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(trajectory_selector::commands::main())
}
