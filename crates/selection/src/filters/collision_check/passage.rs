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
