//! Writes the configuration files, their schemas and the parameter tables from the parameter structs.
use std::path::Path;

use trajectory_selector::settings::generate::generated_files;

fn main() -> std::io::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for file in generated_files() {
        let path = root.join(&file.path);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        std::fs::write(&path, file.text)?;
        println!("{}", file.path);
    }
    Ok(())
}
