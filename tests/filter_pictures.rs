//! The pictures of the filter pages are what the program draws, and show what they say.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail loudly")]

use std::fs;
use std::path::{Path, PathBuf};

use selection::data_validity;
use selection::filters::CLASSES;
use trajectory_selector::report::filter_pictures::{Still, generated_files};

const COMMAND: &str = "cargo run --example draw_filter_pictures";
/// A page that is read over a slow line shows its picture at once.
const MOST_BYTES: usize = 60_000;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn committed_pictures_are_what_the_program_draws() {
    let files = generated_files().unwrap();
    for file in &files {
        let on_disk = fs::read_to_string(root().join(&file.path))
            .unwrap_or_else(|error| panic!("{}: {error}; draw it with `{COMMAND}`", file.path));
        assert!(on_disk == file.text, "{} differs from the program; draw it with `{COMMAND}`", file.path);
        assert!(file.text.len() < MOST_BYTES, "{} has {} bytes", file.path, file.text.len());
    }
    let drawn: Vec<PathBuf> = files.iter().map(|file| root().join(&file.path)).collect();
    for entry in fs::read_dir(root().join("docs/filters")).unwrap() {
        let path = entry.unwrap().path();
        let is_picture = path.extension().is_some_and(|ending| ending == "svg");
        assert!(!is_picture || drawn.contains(&path), "{} is drawn by nobody", path.display());
    }
}

#[test]
fn exactly_the_filter_of_the_picture_rejects_and_the_other_candidate_is_accepted() {
    for still in Still::all() {
        let (validator, verdicts) = still.judge().unwrap();
        let name = still.filter;
        if name == data_validity::NAME {
            assert!(!verdicts[0].data_validity.feasible, "{name}");
        } else {
            assert!(verdicts[0].data_validity.feasible, "{name}");
            let judged = validator.filters().iter().zip(&verdicts[0].judgements);
            let objectors: Vec<_> = judged.filter(|(_, said)| !said.feasible).collect();
            let words: Vec<_> =
                objectors.iter().map(|(loaded, said)| (loaded.name(), loaded.explain(said))).collect();
            assert!(objectors.len() == 1 && objectors[0].0.name() == name, "{name}: {words:?}");
            assert!(objectors[0].1.evidence.is_some(), "{name}: nothing to mark");
        }
        let words: Vec<_> =
            validator.filters().iter().zip(&verdicts[1].judgements).map(|(f, j)| f.explain(j)).collect();
        assert!(verdicts[1].feasible, "{name}: {words:?}");
    }
}

#[test]
fn every_filter_has_a_picture_on_its_page() {
    let mut names: Vec<&str> = CLASSES.iter().map(|class| class.short_name).collect();
    names.push(data_validity::NAME);
    names.sort_unstable();
    let drawn: Vec<&str> = Still::all().iter().map(|still| still.filter).collect();
    assert_eq!(drawn, names);
    for name in names {
        let page = fs::read_to_string(root().join(format!("docs/filters/{name}.md"))).unwrap();
        assert!(page.contains(&format!("]({name}.svg)")), "{name}.md does not show its picture");
    }
}
