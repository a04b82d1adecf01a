//! Who passes a place first, and how close in time: post-encroachment time (PET).
//!
//! The search compares what the vehicle covers in a slice of time with what an object covers in the same slice and in
//! neighbouring ones. The PET of a hit is the time by which the object passes later: positive when the vehicle is
//! earlier, negative when the object is.

use super::settings::ClassSettings;
use motion::occupancy::{BoundsColumns, HullBuffers, Outline, Sweep, placed_meet, slices_meet};
use std::ops::Range;

/// A body whose slice `k` lasts from tick `k` to the next: a range of a sweep.
#[derive(Debug, Clone)]
pub(super) struct Body<'a> {
    pub(super) outline: &'a Outline,
    pub(super) sweep: &'a Sweep,
    pub(super) slices: Range<usize>,
}

impl Body<'_> {
    fn len(&self) -> usize {
        self.slices.len()
    }
}

/// A slice of the vehicle and one of an object that meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hit {
    /// Slice of the vehicle.
    pub(super) ego: usize,
    /// Slice of the object.
    pub(super) object: usize,
}

impl Hit {
    /// By how many ticks the object passes later.
    pub(super) fn pet_ticks(self) -> i64 {
        self.object as i64 - self.ego as i64
    }
}

/// What a search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Passages {
    /// The hit that decides who passes first: the earliest one, unless a later one has the object further ahead.
    pub(super) first: Hit,
    /// The hit with the smallest time between the passages.
    pub(super) worst: Hit,
}

/// Memory of a search.
#[derive(Debug, Default)]
pub(super) struct SearchBuffers {
    /// For each slice of the vehicle whether the object comes near it inside the search range.
    is_near: Vec<bool>,
    hulls: HullBuffers,
}

/// A search under way: both bodies, how many ticks apart their slices may be, what was found so far.
#[derive(Debug)]
pub(super) struct Search<'a, 'b> {
    ego: Body<'a>,
    object: Body<'a>,
    object_earlier_ticks: usize,
    ego_earlier_ticks: usize,
    found: Option<Passages>,
    buffers: &'b mut SearchBuffers,
    /// Range of the near slices of the vehicle.
    near: Range<usize>,
}

impl<'a, 'b> Search<'a, 'b> {
    /// A search inside the class's range.
    pub(super) fn new(
        ego: Body<'a>,
        object: Body<'a>,
        of_class: &ClassSettings,
        buffers: &'b mut SearchBuffers,
    ) -> Self {
        buffers.is_near.clear();
        let near = 0..ego.len();
        Self {
            ego,
            object,
            object_earlier_ticks: of_class.object_earlier_ticks,
            ego_earlier_ticks: of_class.ego_earlier_ticks,
            found: None,
            buffers,
            near,
        }
    }

    /// Looks only at slices of the vehicle that meet their window: the box around all slices of the object that they
    /// are compared with.
    pub(super) fn inside(mut self, windows: &BoundsColumns, places: &Range<usize>) -> Self {
        let (ego, is_near) = (&self.ego, &mut self.buffers.is_near);
        let bounds = ego.sweep.bounds();
        let pairs = ego.slices.clone().zip(places.clone());
        is_near.extend(pairs.map(|(slice, window)| bounds.get(slice).meets(&windows.get(window))));
        let first = is_near.iter().position(|&is_near| is_near).unwrap_or(is_near.len());
        let last = is_near.iter().rposition(|&is_near| is_near).map_or(first, |last| last + 1);
        self.near = first..last;
        self
    }

    /// All passages of one place by both bodies (`find_collision_timing`).
    pub(super) fn passages(mut self) -> Option<Passages> {
        if self.near.is_empty() {
            return None;
        }
        // The very first instant, then slice by slice: first with the object ahead, then with the vehicle ahead.
        self.try_ticks(self.object_earlier_ticks, |ticks| Hit { ego: ticks, object: 0 }, true);
        self.try_ticks(self.ego_earlier_ticks, |ticks| Hit { ego: 0, object: ticks }, true);
        let first = self.near.start.saturating_sub(self.object_earlier_ticks);
        for base in first..self.near.end.min(self.ego.len() - 1) {
            if self.found.is_some_and(|found| found.worst.pet_ticks() == 0) {
                break;
            }
            self.try_ticks(self.object_earlier_ticks, |ticks| Hit { ego: base + ticks, object: base }, false);
            self.try_ticks(self.ego_earlier_ticks, |ticks| Hit { ego: base, object: base + ticks }, false);
        }
        self.found
    }

    /// True if there is any passage.
    pub(super) fn has_passage(mut self) -> bool {
        let last = self.ego.len() - 1;
        self.near.clone().any(|ego| {
            let from = ego.saturating_sub(self.object_earlier_ticks);
            let to = (ego + self.ego_earlier_ticks + 1).min(self.object.len());
            // The last slice is the last sample alone: it only stands in for slices that begin after it.
            let to = if ego == last { to.min(last) } else { to };
            (from..to).any(|object| self.meet(Hit { ego, object }))
        }) || (last == 0 && self.passages().is_some())
    }

    fn try_ticks(&mut self, ticks: usize, hit_at: impl Fn(usize) -> Hit, at_start: bool) {
        for hit in (0..=ticks).map(hit_at) {
            if hit.ego >= self.ego.len() || hit.object >= self.object.len() {
                return;
            }
            if self.meet(hit) && (!at_start || self.starts_meet(hit)) {
                self.take(hit);
                return;
            }
        }
    }

    fn take(&mut self, hit: Hit) {
        let found = self.found.get_or_insert(Passages { first: hit, worst: hit });
        if hit.pet_ticks() < found.first.pet_ticks().min(0) {
            found.first = hit;
        }
        if hit.pet_ticks().abs() < found.worst.pet_ticks().abs() {
            found.worst = hit;
        }
        let ticks = found.worst.pet_ticks().unsigned_abs() as usize;
        self.object_earlier_ticks = self.object_earlier_ticks.min(ticks);
        self.ego_earlier_ticks = self.ego_earlier_ticks.min(ticks);
    }

    #[inline]
    fn meet(&mut self, hit: Hit) -> bool {
        let (ego, object) = (&self.ego, &self.object);
        // Without windows every slice is near.
        self.buffers.is_near.get(hit.ego).copied().unwrap_or(self.buffers.is_near.is_empty())
            && slices_meet(
                (ego.outline, ego.sweep, ego.slices.start + hit.ego),
                (object.outline, object.sweep, object.slices.start + hit.object),
                &mut self.buffers.hulls,
            )
    }

    /// True if the bodies touch where their slices begin.
    fn starts_meet(&mut self, hit: Hit) -> bool {
        let start = |body: &Body<'_>, at: usize| body.sweep.slice(body.slices.start + at).start;
        let (ego, object) = (start(&self.ego, hit.ego), start(&self.object, hit.object));
        placed_meet((self.ego.outline, &ego), (self.object.outline, &object), &mut self.buffers.hulls)
    }
}

#[cfg(test)]
mod tests {
    use super::super::settings::Settings;
    use super::*;
    use crate::parameters::{CollisionCheckParameters, ObjectClass, PerClass};
    use motion::VehicleInfo;
    use motion::occupancy::{Deviation, PlanarPose};

    /// A body at these places, 0.1 s apart.
    fn sweep(outline: &Outline, places: &[PlanarPose]) -> Sweep {
        let mut sweep = Sweep::default();
        for pair in places.windows(2) {
            sweep.push(outline, pair[0], pair[1], &Deviation::default());
        }
        let last = places[places.len() - 1];
        sweep.push(outline, last, last, &Deviation::default());
        sweep
    }

    fn search(ego: &[PlanarPose], object: &[PlanarPose], margin_s: f64) -> Option<Passages> {
        let mut parameters = CollisionCheckParameters::default();
        parameters.drac.pet_margin.ego_earlier = PerClass::all(margin_s);
        parameters.drac.pet_margin.object_earlier = PerClass::all(margin_s);
        let settings = Settings::new(&parameters, &VehicleInfo::default());
        let outline = Outline::rectangle(0.01, 0.01, 0.01, 0.01);
        let (ego, object) = (sweep(&outline, ego), sweep(&outline, object));
        fn body<'a>(outline: &'a Outline, sweep: &'a Sweep) -> Body<'a> {
            Body { outline, sweep, slices: 0..sweep.len() }
        }
        let of_class = settings.class(ObjectClass::Car);
        let mut buffers = SearchBuffers::default();
        let again = Search::new(body(&outline, &ego), body(&outline, &object), of_class, &mut buffers);
        let has_passage = again.has_passage();
        let found =
            Search::new(body(&outline, &ego), body(&outline, &object), of_class, &mut buffers).passages();
        assert_eq!(has_passage, found.is_some());
        found
    }

    /// Along x at this speed, from this place.
    fn along(from: f64, speed: f64) -> Vec<PlanarPose> {
        (0..60).map(|k| PlanarPose::new(from + speed * 0.1 * f64::from(k), 0.0, 0.0)).collect()
    }

    /// A place that crosses the x axis at `x` at a time.
    fn crossing(x: f64, at_s: f64) -> Vec<PlanarPose> {
        (0..60).map(|k| PlanarPose::new(x, 5.0 * (0.1 * f64::from(k) - at_s), 0.0)).collect()
    }

    #[test]
    fn two_opposite_crossings() {
        // The vehicle passes x = 1 at 1 s and x = 5 at 5 s; the object comes by at x = 1 at 2 s, at x = 5 at 4 s.
        let object: Vec<PlanarPose> = (0..60)
            .map(|k| 0.1 * f64::from(k))
            .map(|t| PlanarPose::new(1.0 + 2.0 * (t - 2.0), 3.0 * (t - 2.0) * (4.0 - t), 0.0))
            .collect();
        let found = search(&along(0.0, 1.0), &object, 1.5).unwrap();
        assert!((found.first.pet_ticks() + 10).abs() <= 1, "{found:?}");
        assert!(found.worst.pet_ticks() > 0, "{found:?}");
    }

    #[test]
    fn who_is_earlier_and_by_how_much() {
        for (at_s, margin_s, ticks) in [
            (2.0, 0.0, Some(0)),
            (2.5, 1.0, Some(5)),
            (1.5, 1.0, Some(-5)),
            (3.5, 1.0, None),
            (0.5, 1.0, None),
        ] {
            let found = search(&along(0.0, 1.0), &crossing(2.0, at_s), margin_s);
            let pet = found.map(|found| found.worst.pet_ticks());
            let is_near = pet.zip(ticks).is_some_and(|(pet, ticks)| (pet - ticks).abs() <= 1);
            assert!(is_near || pet == ticks, "{at_s}: {pet:?} instead of {ticks:?}");
        }
    }

    #[test]
    fn what_touches_from_the_start_is_simultaneous() {
        let still = vec![PlanarPose::new(0.0, 0.0, 0.0); 5];
        let found = search(&still, &still[..1], 1.0).unwrap();
        assert_eq!((found.first, found.worst), (Hit { ego: 0, object: 0 }, Hit { ego: 0, object: 0 }));
        assert!(search(&still[..1], &still, 1.0).is_some(), "a single sample");
    }
}
