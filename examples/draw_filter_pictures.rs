//! Draws the pictures of the filter pages: `docs/filters/*.svg`.
use std::path::Path;

use trajectory_selector::report::filter_pictures::generated_files;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for file in generated_files()? {
        std::fs::write(root.join(&file.path), &file.text)?;
        println!("{} ({} bytes)", file.path, file.text.len());
    }
    Ok(())
}
