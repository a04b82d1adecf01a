//! Where the golden files lie, which are not part of the repository.
#![allow(dead_code, unreachable_pub, reason = "several test programs share this, each uses its own part")]

use std::path::{Path, PathBuf};

/// The folder of the golden files: `golden` in `$SELECTOR_SHARED`, or in `shared` beside the workspace. Says so where
/// it is absent, and the caller skips its test.
pub fn golden(test: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let folder = std::env::var_os("SELECTOR_SHARED").map_or(beside, PathBuf::from).join("golden");
    if folder.join("FORMAT.md").is_file() {
        return Some(folder);
    }
    eprintln!("skipped: {test}: no golden files in {}", folder.display());
    None
}
