//! The `trajectory-selector` program; everything it does is in the library beside it.

use std::process::ExitCode;
use trajectory_selector::allocations::CountingAllocator;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    ExitCode::from(trajectory_selector::commands::main())
}
