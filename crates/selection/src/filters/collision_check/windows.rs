//! With which slices of an object each slice of the vehicle is compared, as boxes around them.
//!
//! The boxes tell at a glance that a slice of the vehicle meets nothing inside its window. They come in groups as
//! slices do, so that most of them are not even looked at.

use motion::occupancy::{Bounds, GROUP, Sweep};
use std::ops::Range;

/// The windows of several rows of slices.
#[derive(Debug, Default)]
pub(super) struct WindowColumns {
    boxes: Vec<Bounds>,
    groups: Vec<Bounds>,
    /// Boxes around the slices from each one of a block to its end.
    to_block_end: Vec<Bounds>,
}

/// Places of the windows of one row in [`WindowColumns`].
#[derive(Debug, Clone, Default)]
pub(super) struct WindowPlaces {
    boxes: Range<usize>,
    groups: Range<usize>,
}

/// For each tick of the vehicle the box around all slices of an object that its slice is compared with, and one box
/// around each [`GROUP`] of these.
#[derive(Debug, Clone, Copy)]
pub(super) struct Windows<'a> {
    boxes: &'a [Bounds],
    groups: &'a [Bounds],
}

impl WindowColumns {
    /// Forgets all windows and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.boxes.clear();
        self.groups.clear();
    }

    /// Adds the windows of a row of slices: for each tick up to `before` ticks after the last slice the box around the
    /// slices from `before` ticks before to `after` ticks after it.
    ///
    /// Slices are taken in blocks as long as a window. A window ends in the block after the one it begins in at most, so
    /// it is joined of two parts: from its beginning to the end of the block, and from the beginning of a block to its
    /// end.
    pub(super) fn push(&mut self, slices: &[Bounds], before: usize, after: usize) -> WindowPlaces {
        let Self { boxes, groups, to_block_end } = self;
        let (first_box, first_group) = (boxes.len(), groups.len());
        let length = before + after + 1;
        // Windows that begin with the first slice, before they are full.
        let mut around = Bounds::around_all(&slices[..after.min(slices.len())]);
        boxes.extend((after..after + before).map(|last| {
            around = slices.get(last).map_or(around, |entering| around.joined(entering));
            around
        }));
        for (number, block) in slices.chunks(length).enumerate() {
            to_block_end.clear();
            to_block_end.extend_from_slice(block);
            for at in (1..block.len()).rev() {
                to_block_end[at - 1] = to_block_end[at - 1].joined(&to_block_end[at]);
            }
            // The windows that begin in the block; each next one reaches one slice further into the block after it.
            let mut entering = slices.get((number + 1) * length..).unwrap_or_default().iter();
            let mut beyond = Bounds::EMPTY;
            boxes.extend(to_block_end.iter().map(|to_end| {
                let window = to_end.joined(&beyond);
                beyond = entering.next().map_or(beyond, |slice| beyond.joined(slice));
                window
            }));
        }
        groups.extend(boxes[first_box..].chunks(GROUP).map(Bounds::around_all));
        WindowPlaces { boxes: first_box..boxes.len(), groups: first_group..groups.len() }
    }

    /// The windows of one row.
    pub(super) fn get(&self, places: &WindowPlaces) -> Windows<'_> {
        Windows { boxes: &self.boxes[places.boxes.clone()], groups: &self.groups[places.groups.clone()] }
    }
}

impl Windows<'_> {
    /// The first group of slices that meets the box around its windows; no slice before it meets its window.
    pub(super) fn first_near_group(&self, ego: &Sweep) -> Option<usize> {
        ego.groups().iter().zip(self.groups).position(|(slices, window)| slices.meets(window))
    }

    /// Number of groups.
    pub(super) fn groups(&self) -> usize {
        self.groups.len()
    }

    /// False if no slice of a group meets its window.
    pub(super) fn is_near_group(&self, ego: &Sweep, group: usize) -> bool {
        ego.groups().get(group).is_some_and(|slices| slices.meets(&self.groups[group]))
    }

    /// Adds the slices that meet their windows, ascending. Whole groups are passed over where they do not meet.
    pub(super) fn find_near(&self, ego: &Sweep, near: &mut Vec<usize>) {
        for (group, (slices, window)) in ego.groups().iter().zip(self.groups).enumerate() {
            if slices.meets(window) {
                self.find_near_in(group, ego, near);
            }
        }
    }

    /// Adds the slices of one group that meet their windows, ascending.
    pub(super) fn find_near_in(&self, group: usize, ego: &Sweep, near: &mut Vec<usize>) {
        let first = group * GROUP;
        let pairs = ego.bounds()[first..].iter().zip(&self.boxes[first..]).take(GROUP);
        for (at, (slice, window)) in pairs.enumerate() {
            if slice.meets(window) {
                near.push(first + at);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motion::Point2;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_window_is_the_box_around_its_slices(
            xs in proptest::collection::vec(-50.0..50.0_f64, 1..70), before in 0..12_usize, after in 0..12_usize,
        ) {
            let at = |x: f64| Bounds { min: Point2::new(x, x), max: Point2::new(x + 1.0, x + 2.0) };
            let slices: Vec<Bounds> = xs.into_iter().map(at).collect();
            let mut columns = WindowColumns::default();
            columns.push(&slices[..1], after, before);
            let places = columns.push(&slices, before, after);
            let windows = columns.get(&places);
            prop_assert_eq!(windows.boxes.len(), slices.len() + before);
            for (tick, window) in windows.boxes.iter().enumerate() {
                let last = (tick + after).min(slices.len() - 1);
                prop_assert_eq!(*window, Bounds::around_all(&slices[tick.saturating_sub(before)..=last]));
            }
            for (group, boxes) in windows.groups.iter().zip(windows.boxes.chunks(GROUP)) {
                prop_assert_eq!(*group, Bounds::around_all(boxes));
            }
        }
    }
}
