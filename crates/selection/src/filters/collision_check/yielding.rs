//! What objects cover that brake: the same for all candidates of a cycle, and found when the first one asks.
//!
//! Each thread that judges keeps its own. They belong to one content of [`Objects`], which has a number that no other
//! content ever has: when it is another, all are forgotten.

use super::objects::{Course, CourseBuffers, Object, Objects};
use super::settings::{ClassSettings, Settings};
use super::windows::{WindowColumns, WindowPlaces, Windows};
use motion::occupancy::{SpeedProfile, Sweep};

/// Most of them that are kept; a crowd costs time, not memory.
const MOST: usize = 512;
/// Accelerations that are tried for each course.
const TIERS: usize = 2;
const UNKNOWN: u32 = u32::MAX;

/// What braking objects cover.
#[derive(Debug, Default)]
pub(super) struct YieldingObjects {
    /// Number of the objects that all of it is about.
    about: u64,
    /// Place in `covers` for each course and acceleration.
    places: Vec<u32>,
    /// The first `used` are of this cycle.
    covers: Vec<Cover>,
    used: usize,
    sampling: CourseBuffers,
}

#[derive(Debug, Default)]
struct Cover {
    sweep: Sweep,
    columns: WindowColumns,
    windows: WindowPlaces,
}

impl YieldingObjects {
    /// What an object covers that brakes on a course from now on, with the tier-th of its class's accelerations, and the
    /// windows of its slices.
    pub(super) fn braking(
        &mut self,
        objects: &Objects,
        (object, course): (&Object, &Course),
        tier: usize,
        of_class: &ClassSettings,
        settings: &Settings,
    ) -> (&Sweep, Windows<'_>) {
        if self.about != objects.number || self.used == MOST {
            self.about = objects.number;
            self.used = 0;
            self.places.clear();
            self.places.resize(objects.courses.len() * TIERS, UNKNOWN);
        }
        let key = course.place * TIERS + tier;
        if self.places[key] == UNKNOWN {
            let place = self.used;
            if place == self.covers.len() {
                self.covers.push(Cover::default());
            }
            let cover = &mut self.covers[place];
            let acceleration_mps2 = of_class.object_tiers[tier];
            let profile = SpeedProfile { speed_mps: course.speed_mps, lag_s: 0.0, acceleration_mps2 };
            cover.sweep.clear();
            objects.sweep_way(
                &course.way,
                &profile,
                course.horizon_s,
                settings.resolution_s,
                &object.outline,
                &mut cover.sweep,
                &mut self.sampling,
            );
            let (before, after) = (of_class.object_earlier_ticks, of_class.ego_earlier_ticks);
            cover.columns.clear();
            cover.windows = cover.columns.push(cover.sweep.bounds(), before, after);
            self.used += 1;
            self.places[key] = place as u32;
        }
        let cover = &self.covers[self.places[key] as usize];
        (&cover.sweep, cover.columns.get(&cover.windows))
    }
}
