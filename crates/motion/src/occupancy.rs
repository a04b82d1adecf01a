//! Which part of the plane a moving body covers, and when: sampled motions, swept slices between the samples, and
//! batched tests of many boxes at equal times.
//!
//! Two questions are answered. [`BoxTracks::first_collision`] asks whether a row of boxes meets any of several moving
//! boxes at the same time step: exact at the steps, and fast enough for a million trajectories per second. A [`Sweep`]
//! asks what a body covers *between* two samples: the convex hull of its outline at both, grown by what rotation and
//! bends may add, so that no contact between samples is missed whatever the sampling time is.
//!
//! Contact counts as overlap. Everything is laid out as structure of arrays where a loop runs over it. Buffers are
//! cleared and refilled; once grown they allocate nothing.

mod bounds;
mod box_tracks;
mod contact;
mod outline;
mod profile;
mod sweep;

pub use bounds::Bounds;
pub use box_tracks::{BoxCollision, BoxTracks};
pub use contact::{HullBuffers, near_slices_meet, placed_meet, slices_meet};
pub use outline::{Outline, PlanarPose};
pub use profile::{SpeedProfile, arc_pose, turn_per_metre};
pub use sweep::{Deviation, GROUP, Row, SUBDIVISION_TURN_RAD, Slice, Sweep};
