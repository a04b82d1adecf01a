//! The pictures of the filter pages: for each filter a small scene in which it rejects a candidate and no other filter
//! does, and a second candidate that all of them accept.
//!
//! `cargo run --example draw_filter_pictures` writes the files; a test fails when one of them differs from what the
//! program draws.

mod course;
mod scenes;
mod street;

use super::explanation;
use super::picture::{self, Subject};
use crate::settings::generate::GeneratedFile;
use messages::builtin_interfaces::Time;
use selection::parameters::{FilterClass, ValidatorParameters};
use selection::validator::UnknownFilter;
use selection::{Candidate, Scene, Scratch, Validator, Verdict};

/// When all scenes happen.
const NOW: Time = Time { sec: 1_000, nanosec: 0 };

/// A scene that shows what one filter is for.
#[derive(Debug)]
pub struct Still {
    /// Short name of the filter, which is also that of its page.
    pub filter: &'static str,
    /// What is seen, in a few words.
    pub title: &'static str,
    /// The world.
    pub scene: Scene,
    /// The first is rejected by the filter, the second by none.
    pub candidates: Vec<Candidate>,
}

impl Still {
    /// One still for each filter, and one for the data-validity check.
    #[must_use]
    pub fn all() -> Vec<Self> {
        scenes::all()
    }

    /// Judges the candidates with every filter, all enforced, shipped parameters.
    ///
    /// # Errors
    /// Never, as long as the classes of filters name filters that exist.
    pub fn judge(&self) -> Result<(Validator, Vec<Verdict>), UnknownFilter> {
        let parameters = ValidatorParameters {
            filter_names: FilterClass::ALL.map(|class| class.class_name().to_owned()).to_vec(),
            shadow_mode_filter_names: Vec::new(),
            ..ValidatorParameters::default()
        };
        let mut validator = Validator::new(parameters, &self.scene.vehicle)?;
        validator.announce(&self.candidates);
        validator.observe(&self.scene);
        let mut scratch = Scratch::default();
        let judge = |candidate| validator.judge(&self.scene, candidate, &mut scratch, || 0, &mut []);
        let verdicts = self.candidates.iter().map(judge).collect();
        Ok((validator, verdicts))
    }

    /// Draws the picture of the filter's page.
    ///
    /// # Errors
    /// As [`Self::judge`].
    pub fn draw(&self) -> Result<String, UnknownFilter> {
        let (validator, verdicts) = self.judge()?;
        let explanation = explanation::explain(&validator, &self.candidates, &verdicts, 1, "anchor", NOW);
        Ok(picture::draw(&Subject {
            title: self.title,
            scene: &self.scene,
            candidates: &self.candidates,
            explanation: &explanation,
            focus: 0,
        }))
    }
}

/// All pictures as files of the repository.
///
/// # Errors
/// As [`Still::judge`].
pub fn generated_files() -> Result<Vec<GeneratedFile>, UnknownFilter> {
    let file = |still: &Still| {
        Ok(GeneratedFile { path: format!("docs/filters/{}.svg", still.filter), text: still.draw()? })
    };
    Still::all().iter().map(file).collect()
}
