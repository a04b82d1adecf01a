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
    /// The hit with the smallest time between the passages. Some hit if the search was not asked for it.
    pub(super) worst: Hit,
}

/// What a search for passages is to find.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sought {
    /// Who passes first: the search ends when nothing that is still to come can change that.
    First,
    /// The passages that are closest in time as well.
    FirstAndWorst,
}

impl Passages {
    /// True if no further hit changes what is sought. The first one stays as soon as the vehicle is not ahead in it: see
    /// [`Search::take`].
    fn is_settled(&self, sought: Sought) -> bool {
        self.worst.pet_ticks() == 0 || (sought == Sought::First && self.first.pet_ticks() <= 0)
    }
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
    /// How many slices of the vehicle, from the same tick on, a slice of the object is still compared with.
    object_ahead: usize,
    /// How many slices of the object a slice of the vehicle is still compared with.
    ego_ahead: usize,
    found: Option<Passages>,
    /// True if the last slice of the vehicle is the end of its motion.
    ego_is_whole: bool,
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
        buffers.near.clear();
        windows.find_near(ego.sweep, &mut buffers.near);
        Self::of_near((ego, true), object, of_class, buffers)
    }

    /// The same for one group of the vehicle's slices, of which perhaps more are to come.
    pub(super) fn of_group(
        group: usize,
        ego: (Body<'a>, bool),
        object: Body<'a>,
        windows: Windows<'_>,
        of_class: &ClassSettings,
        buffers: &'b mut SearchBuffers,
    ) -> Self {
        buffers.near.clear();
        windows.find_near_in(group, ego.0.sweep, &mut buffers.near);
        Self::of_near(ego, object, of_class, buffers)
    }

    fn of_near(
        (ego, ego_is_whole): (Body<'a>, bool),
        object: Body<'a>,
        of_class: &ClassSettings,
        buffers: &'b mut SearchBuffers,
    ) -> Self {
        let SearchBuffers { near, hulls } = buffers;
        Self {
            ego,
            object,
            ego_is_whole,
            object_earlier_ticks: of_class.object_earlier_ticks,
            ego_earlier_ticks: of_class.ego_earlier_ticks,
            object_ahead: of_class.object_earlier_ticks + 1,
            ego_ahead: of_class.ego_earlier_ticks + 1,
            found: None,
            near,
            hulls,
        }
    }

    /// All passages of one place by both bodies (`find_collision_timing`).
    pub(super) fn passages(mut self, sought: Sought) -> Option<Passages> {
        let (Some(&first), Some(&last)) = (self.near.first(), self.near.last()) else { return None };
        // The very first instant, then slice by slice: first with the object ahead, then with the vehicle ahead.
        self.try_object_ahead(0, self.near, true);
        self.try_ego_ahead(0, first == 0, true);
        let mut near = self.near;
        let begin = first.saturating_sub(self.object_earlier_ticks);
        let end = (last + 1).min(self.ego.len() - 1).min(self.object.len());
        for base in begin..end {
            if self.found.is_some_and(|found| found.is_settled(sought)) {
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

    /// True if there is any passage, of the slices that are searched.
    pub(super) fn has_passage(mut self) -> bool {
        // No slice is the last one while more are to come.
        let last = if self.ego_is_whole { self.ego.len() - 1 } else { usize::MAX };
        self.near.iter().any(|&ego| {
            let from = ego.saturating_sub(self.object_earlier_ticks);
            let to = (ego + self.ego_earlier_ticks + 1).min(self.object.len());
            // The last slice is the last sample alone: it only stands in for slices that begin after it.
            let to = if ego == last { to.min(last) } else { to };
            self.first_ahead(ego, from..to, false).is_some()
        }) || (last == 0 && self.passages(Sought::First).is_some())
    }

    /// Takes the first hit of a slice of the object with slices of the vehicle from the same tick on. `near` has those
    /// that come into question.
    fn try_object_ahead(&mut self, object: usize, near: &[usize], at_start: bool) {
        let end = object + self.object_ahead;
        let around = self.object.bounds()[object];
        let bounds = self.ego.bounds();
        let mut hits = near
            .iter()
            .take_while(|&&ego| ego < end)
            .filter(|&&ego| around.meets(&bounds[ego]))
            .map(|&ego| Hit { ego, object });
        if let Some(hit) = hits.find(|&hit| self.meet_and_begin(hit, at_start)) {
            self.take(hit);
        }
    }

    /// Takes the first hit of a slice of the vehicle, if it is near, with slices of the object from the same tick on.
    fn try_ego_ahead(&mut self, ego: usize, is_near: bool, at_start: bool) {
        let end = (ego + self.ego_ahead).min(self.object.len());
        if is_near && let Some(hit) = self.first_ahead(ego, ego..end, at_start) {
            self.take(hit);
        }
    }

    /// The first hit of a slice of the vehicle with slices of the object.
    fn first_ahead(&mut self, ego: usize, objects: Range<usize>, at_start: bool) -> Option<Hit> {
        let around = self.ego.bounds()[ego];
        let bounds = self.object.bounds().get(objects.clone()).unwrap_or_default();
        // The innermost loop of all: plainly written it has half the instructions of chained iterators.
        for (at, bounds) in bounds.iter().enumerate() {
            let hit = Hit { ego, object: objects.start + at };
            if around.meets(bounds) && self.meet_and_begin(hit, at_start) {
                return Some(hit);
            }
        }
        None
    }

    /// True if two slices whose boxes meet do so; at the start of the search the bodies must touch where the slices
    /// begin.
    #[inline]
    fn meet_and_begin(&mut self, hit: Hit, at_start: bool) -> bool {
        self.meet(hit) && (!at_start || self.starts_meet(hit))
    }

    /// Takes a hit, and narrows the search to hits that can still change what was found. Such a hit is closer in time
    /// than the worst one: no other becomes the worst, and none takes the place of a first one that has the object ahead
    /// (it would have to be further ahead than the first, which no hit inside the search range of the worst is). Only
    /// where the first one has the vehicle ahead, one with the object as far ahead as the worst takes its place.
    fn take(&mut self, hit: Hit) {
        let found = self.found.get_or_insert(Passages { first: hit, worst: hit });
        if hit.pet_ticks() < found.first.pet_ticks().min(0) {
            found.first = hit;
        }
        if hit.pet_ticks().abs() < found.worst.pet_ticks().abs() {
            found.worst = hit;
        }
        let closer = found.worst.pet_ticks().unsigned_abs() as usize;
        let may_begin = usize::from(found.first.pet_ticks() > 0);
        self.object_ahead = self.object_ahead.min(closer + may_begin);
        self.ego_ahead = self.ego_ahead.min(closer);
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
    use motion::occupancy::{Deviation, PlanarPose, slices_meet};
    use proptest::prelude::*;

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
        let outline = Outline::rectangle(0.05, 0.01, 0.02, 0.02);
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
        let first = Search::new(ego.clone(), object.clone(), windows, of_class, &mut buffers);
        let first = first.passages(Sought::First).map(|found| found.first);
        let plain = plainly(&ego, &object, of_class);
        let found = Search::new(ego, object, windows, of_class, &mut buffers).passages(Sought::FirstAndWorst);
        assert_eq!(has_passage, found.is_some());
        assert_eq!(found, plain);
        assert_eq!(first, plain.map(|plain| plain.first));
        found
    }

    /// The same search, passing over nothing: every slice is compared with all those inside the range.
    fn plainly(ego: &Body<'_>, object: &Body<'_>, of_class: &ClassSettings) -> Option<Passages> {
        let mut hulls = HullBuffers::default();
        let mut found: Option<Passages> = None;
        let count = ego.len().saturating_sub(1).min(object.len());
        for (base, at_start) in std::iter::once((0, true)).chain((0..count).map(|base| (base, false))) {
            for object_is_ahead in [true, false] {
                if found.is_some_and(|found| found.worst.pet_ticks() == 0) {
                    return found;
                }
                let most =
                    if object_is_ahead { of_class.object_earlier_ticks } else { of_class.ego_earlier_ticks };
                let most =
                    found.map_or(most, |found| most.min(found.worst.pet_ticks().unsigned_abs() as usize));
                let hits = (base..=base + most).map(|later| {
                    if object_is_ahead {
                        Hit { ego: later, object: base }
                    } else {
                        Hit { ego: base, object: later }
                    }
                });
                let meet = |hit: &Hit| {
                    let (e, o) = (ego.slices.start + hit.ego, object.slices.start + hit.object);
                    let start = |body: &Body<'_>, at: usize| body.sweep.slice(at).start;
                    hit.ego < ego.len()
                        && hit.object < object.len()
                        && slices_meet(
                            (ego.outline, ego.sweep, e),
                            (object.outline, object.sweep, o),
                            &mut hulls,
                        )
                        && (!at_start
                            || placed_meet(
                                (ego.outline, &start(ego, e)),
                                (object.outline, &start(object, o)),
                                &mut hulls,
                            ))
                };
                if let Some(hit) = hits.into_iter().find(meet) {
                    let known = found.get_or_insert(Passages { first: hit, worst: hit });
                    if hit.pet_ticks() < known.first.pet_ticks() && hit.pet_ticks() < 0 {
                        known.first = hit;
                    }
                    if hit.pet_ticks().abs() < known.worst.pet_ticks().abs() {
                        known.worst = hit;
                    }
                }
            }
        }
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

    /// A motion that winds: where it starts, how it turns and how fast it is in its first and in its second half.
    fn winding((x, y, yaw): (f64, f64, f64), halves: [(f64, f64); 2], count: usize) -> Vec<PlanarPose> {
        let mut pose = PlanarPose::new(x, y, yaw);
        let mut yaw_rad = yaw;
        let step = |k: usize| {
            let (turn, speed) = halves[k * 2 / count];
            let here = pose;
            yaw_rad += 0.1 * turn;
            let ahead = pose.ahead(0.1 * speed).position;
            pose = PlanarPose::new(ahead.x, ahead.y, yaw_rad);
            here
        };
        (0..count).map(step).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        /// What the search passes over changes nothing (`search` compares it with a search that passes over nothing).
        #[test]
        fn finds_what_a_search_of_everything_finds(
            ego in (-1.0..1.0_f64, -1.0..1.0_f64, -3.2..3.2_f64),
            object in (-1.0..1.0_f64, -1.0..1.0_f64, -3.2..3.2_f64),
            ego_halves in [(-2.0..2.0_f64, 0.0..2.0_f64), (-2.0..2.0_f64, 0.0..2.0_f64)],
            object_halves in [(-2.0..2.0_f64, 0.0..2.0_f64), (-2.0..2.0_f64, 0.0..2.0_f64)],
            (ego_count, object_count) in (2..60_usize, 2..60_usize),
            margin_s in 0.0..1.5_f64,
        ) {
            search(&winding(ego, ego_halves, ego_count), &winding(object, object_halves, object_count), margin_s);
        }
    }
}
