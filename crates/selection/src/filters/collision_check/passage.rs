//! Who passes a place first, and how close in time: post-encroachment time (PET).
//!
//! The search compares what the vehicle covers in a slice of time with what an object covers in the same slice and in
//! neighbouring ones. The PET of a hit is the time by which the object passes later: positive when the vehicle is
//! earlier, negative when the object is.

use super::settings::ClassSettings;
use super::windows::Windows;
use motion::occupancy::{Bounds, HullBuffers, Outline, Sweep, near_slices_meet, placed_meet};
use std::ops::Range;

/// A body whose slice `k` lasts from tick `k` to the next: a range of a sweep.
#[derive(Debug, Clone)]
pub(super) struct Body<'a> {
    pub(super) outline: &'a Outline,
    pub(super) sweep: &'a Sweep,
    pub(super) slices: Range<usize>,
}

impl<'a> Body<'a> {
    fn len(&self) -> usize {
        self.slices.len()
    }

    /// Boxes along the map axes around its slices.
    fn bounds(&self) -> &'a [Bounds] {
        &self.sweep.bounds()[self.slices.clone()]
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
    /// The slices of the vehicle that the object comes near to inside the search range, ascending.
    near: Vec<usize>,
    hulls: HullBuffers,
}

/// A search under way: both bodies, how many ticks apart their slices may be, what was found so far.
#[derive(Debug)]
pub(super) struct Search<'a, 'b> {
    /// Its slices begin with the first one of its sweep.
    ego: Body<'a>,
    object: Body<'a>,
    object_earlier_ticks: usize,
    ego_earlier_ticks: usize,
    found: Option<Passages>,
    near: &'b [usize],
    hulls: &'b mut HullBuffers,
}

impl<'a, 'b> Search<'a, 'b> {
    /// A search inside the class's range. The windows are those of the object's slices for this range: only slices of
    /// the vehicle that meet their window are looked at.
    pub(super) fn new(
        ego: Body<'a>,
        object: Body<'a>,
        windows: Windows<'_>,
        of_class: &ClassSettings,
        buffers: &'b mut SearchBuffers,
    ) -> Self {
        let SearchBuffers { near, hulls } = buffers;
        near.clear();
        windows.find_near(ego.sweep, near);
        Self {
            ego,
            object,
            object_earlier_ticks: of_class.object_earlier_ticks,
            ego_earlier_ticks: of_class.ego_earlier_ticks,
            found: None,
            near,
            hulls,
        }
    }

    /// All passages of one place by both bodies (`find_collision_timing`).
    pub(super) fn passages(mut self) -> Option<Passages> {
        let (Some(&first), Some(&last)) = (self.near.first(), self.near.last()) else { return None };
        // The very first instant, then slice by slice: first with the object ahead, then with the vehicle ahead.
        self.try_object_ahead(0, self.near, true);
        self.try_ego_ahead(0, first == 0, true);
        let mut near = self.near;
        let begin = first.saturating_sub(self.object_earlier_ticks);
        let end = (last + 1).min(self.ego.len() - 1).min(self.object.len());
        for base in begin..end {
            if self.found.is_some_and(|found| found.worst.pet_ticks() == 0) {
                break;
            }
            while let [passed, rest @ ..] = near
                && *passed < base
            {
                near = rest;
            }
            self.try_object_ahead(base, near, false);
            self.try_ego_ahead(base, near.first() == Some(&base), false);
        }
        self.found
    }

    /// True if there is any passage.
    pub(super) fn has_passage(mut self) -> bool {
        let last = self.ego.len() - 1;
        self.near.iter().any(|&ego| {
            let from = ego.saturating_sub(self.object_earlier_ticks);
            let to = (ego + self.ego_earlier_ticks + 1).min(self.object.len());
            // The last slice is the last sample alone: it only stands in for slices that begin after it.
            let to = if ego == last { to.min(last) } else { to };
            self.first_ahead(ego, from..to, false).is_some()
        }) || (last == 0 && self.passages().is_some())
    }

    /// Takes the first hit of a slice of the object with slices of the vehicle from the same tick on. `near` has those
    /// that come into question.
    fn try_object_ahead(&mut self, object: usize, near: &[usize], at_start: bool) {
        let end = object + self.object_earlier_ticks;
        let around = self.object.bounds()[object];
        let bounds = self.ego.bounds();
        let mut hits = near
            .iter()
            .take_while(|&&ego| ego <= end)
            .filter(|&&ego| around.meets(&bounds[ego]))
            .map(|&ego| Hit { ego, object });
        if let Some(hit) = hits.find(|&hit| self.meet_and_begin(hit, at_start)) {
            self.take(hit);
        }
    }

    /// Takes the first hit of a slice of the vehicle, if it is near, with slices of the object from the same tick on.
    fn try_ego_ahead(&mut self, ego: usize, is_near: bool, at_start: bool) {
        let end = (ego + self.ego_earlier_ticks + 1).min(self.object.len());
        if is_near && let Some(hit) = self.first_ahead(ego, ego..end, at_start) {
            self.take(hit);
        }
    }

    /// The first hit of a slice of the vehicle with slices of the object.
    fn first_ahead(&mut self, ego: usize, objects: Range<usize>, at_start: bool) -> Option<Hit> {
        let around = self.ego.bounds()[ego];
        let bounds = self.object.bounds().get(objects.clone()).unwrap_or_default();
        let mut hits = objects
            .zip(bounds)
            .filter(|(_, bounds)| around.meets(bounds))
            .map(|(object, _)| Hit { ego, object });
        hits.find(|&hit| self.meet_and_begin(hit, at_start))
    }

    /// True if two slices whose boxes meet do so; at the start of the search the bodies must touch where the slices
    /// begin.
    #[inline]
    fn meet_and_begin(&mut self, hit: Hit, at_start: bool) -> bool {
        self.meet(hit) && (!at_start || self.starts_meet(hit))
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
        near_slices_meet(
            (ego.outline, ego.sweep, ego.slices.start + hit.ego),
            (object.outline, object.sweep, object.slices.start + hit.object),
            self.hulls,
        )
    }

    /// True if the bodies touch where their slices begin.
    fn starts_meet(&mut self, hit: Hit) -> bool {
        let start = |body: &Body<'_>, at: usize| body.sweep.slice(body.slices.start + at).start;
        let (ego, object) = (start(&self.ego, hit.ego), start(&self.object, hit.object));
        placed_meet((self.ego.outline, &ego), (self.object.outline, &object), self.hulls)
    }
}

#[cfg(test)]
mod tests {
    use super::super::settings::Settings;
    use super::super::windows::WindowColumns;
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
        let (ego, object) = (body(&outline, &ego), body(&outline, &object));
        let mut columns = WindowColumns::default();
        let (before, after) = (of_class.object_earlier_ticks, of_class.ego_earlier_ticks);
        let windows = columns.push(object.sweep.bounds(), before, after);
        let windows = columns.get(&windows);
        let again = Search::new(ego.clone(), object.clone(), windows, of_class, &mut buffers);
        let has_passage = again.has_passage();
        let found = Search::new(ego, object, windows, of_class, &mut buffers).passages();
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
