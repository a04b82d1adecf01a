//! Writes the configuration files, their schemas and the parameter tables from the parameter structs.
use std::path::Path;

use trajectory_selector::settings::generate::{generated_files, generated_tables};

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
    for table in generated_tables() {
        let path = root.join(&table.path);
        let page = std::fs::read_to_string(&path)?;
        let page = table.put_into(&page).ok_or_else(|| {
            std::io::Error::other(format!("{}: the markers of the parameter table are missing", table.path))
        })?;
        std::fs::write(&path, page)?;
        println!("{} (table)", table.path);
    }
    Ok(())
}
