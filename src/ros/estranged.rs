//! Peers that the middleware took for gone and that are not.
//!
//! A peer that is silent for longer than its lease is given up, with its endpoints. That happens to living ones, too: this
//! process was suspended, a cable was out. When such a peer is heard again, RustDDS 0.15.1 does not take up its endpoints:
//! its announcements are those of before, and are passed over. Nothing would ever come from it, and it would not notice.
//! All that the middleware does is to say in its log, at each sign of life, that it does not know the peer. So its log is
//! listened to, and a node that has such a peer leaves the graph and joins it anew. Only for peers that send it something:
//! somebody who merely looks on over a bad line must not cost everybody else's messages.

use rustdds::{DomainParticipantStatusEvent, GUID, LostReason};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Where the middleware says so, and how that begins; the peer's number in 24 digits follows.
const TARGET: &str = "rustdds::discovery::discovery_db";
const SIGN_OF_LIFE: &str = "Participant alive update for unknown ";
const DIGITS: usize = 24;
/// What comes sooner than this after the loss may have been on its way before; and for so long the middleware may still
/// take up the peer.
const PATIENCE: Duration = Duration::from_secs(1);
/// Lost peers that are remembered, the latest ones.
const MOST: usize = 256;

/// Peers that were lost by silence, and which of them were heard again. Clones share everything.
#[derive(Debug, Clone, Default)]
pub struct Estranged(Arc<Mutex<Peers>>);

#[derive(Debug, Default)]
struct Peers {
    /// Those that send something.
    senders: BTreeSet<String>,
    /// Those of them that were lost.
    lost: BTreeMap<String, Lost>,
}

#[derive(Debug, Clone, Copy)]
struct Lost {
    at: Instant,
    heard: Option<Instant>,
}

impl Estranged {
    /// Takes in what the middleware tells of peers. `is_input` says of a reader of this node whether it is for an input.
    pub(super) fn take(
        &self,
        event: &DomainParticipantStatusEvent,
        is_input: impl Fn(GUID) -> bool,
        now: Instant,
    ) {
        match event {
            DomainParticipantStatusEvent::RemoteWriterMatched { local_reader, remote_writer }
                if is_input(*local_reader) =>
            {
                self.listen_to(name(remote_writer.prefix));
            }
            DomainParticipantStatusEvent::ParticipantLost { id, reason: LostReason::Timeout { .. } } => {
                self.lose(&name(*id), now);
            }
            DomainParticipantStatusEvent::ParticipantLost { id, .. } => self.see_off(&name(*id)),
            DomainParticipantStatusEvent::ParticipantDiscovered { dpd } => self.find(&name(dpd.guid.prefix)),
            _ => {}
        }
    }

    /// Takes in a line of the middleware's log.
    pub(super) fn overhear(&self, record: &log::Record<'_>, now: Instant) {
        if record.target() == TARGET {
            self.hear(&record.args().to_string(), now);
        }
    }

    /// A peer that lives and that the middleware will not take up again.
    pub(super) fn any(&self, now: Instant) -> Option<String> {
        let is_estranged =
            |lost: &Lost| lost.heard.is_some_and(|heard| now.saturating_duration_since(heard) >= PATIENCE);
        self.peers().lost.iter().find(|(_, lost)| is_estranged(lost)).map(|(id, _)| id.clone())
    }

    /// Forgets all: for a node that has joined anew, everybody is new.
    pub(super) fn clear(&self) {
        *self.peers() = Peers::default();
    }

    fn listen_to(&self, id: String) {
        let senders = &mut self.peers().senders;
        // So many nodes have no vehicle; it is a bound, no more.
        if senders.len() < MOST {
            senders.insert(id);
        }
    }

    fn lose(&self, id: &str, now: Instant) {
        let mut peers = self.peers();
        if let Some(id) = peers.senders.take(id) {
            peers.lost.insert(id, Lost { at: now, heard: None });
        }
        let first = peers.lost.iter().min_by_key(|(_, lost)| lost.at).map(|(id, _)| id.clone());
        if let Some(first) = first.filter(|_| peers.lost.len() > MOST) {
            peers.lost.remove(&first);
        }
    }

    fn see_off(&self, id: &str) {
        let mut peers = self.peers();
        peers.senders.remove(id);
        peers.lost.remove(id);
    }

    fn find(&self, id: &str) {
        self.peers().lost.remove(id);
    }

    fn hear(&self, text: &str, now: Instant) {
        let id = text.strip_prefix(SIGN_OF_LIFE).and_then(|rest| rest.get(..DIGITS));
        let mut peers = self.peers();
        if let Some(lost) = id.and_then(|id| peers.lost.get_mut(id))
            && now.saturating_duration_since(lost.at) >= PATIENCE
        {
            lost.heard.get_or_insert(now);
        }
    }

    fn peers(&self) -> MutexGuard<'_, Peers> {
        // Each change is whole by itself.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A participant's number, as the middleware writes it in its log.
fn name(participant: impl std::fmt::Debug) -> String {
    format!("{participant:?}")
}

#[cfg(test)]
mod tests {
    use super::*;

    const ID: &str = "0110d015a5d1cc4465d0a744";

    fn sign(of: &str) -> String {
        format!("{SIGN_OF_LIFE}{of}. This is normal, if the message does not repeat.")
    }

    #[test]
    fn who_was_lost_and_is_heard_again_is_estranged() {
        let (estranged, start) = (Estranged::default(), Instant::now());
        let at = |seconds| start + Duration::from_secs_f64(seconds);
        estranged.hear(&sign(ID), at(0.0));
        estranged.listen_to(ID.to_owned());
        estranged.lose(ID, at(1.0));
        // On its way before, somebody else, and something else.
        estranged.hear(&sign(ID), at(1.5));
        estranged.hear(&sign("0110d015a5d1cc4465d0a745"), at(3.0));
        estranged.hear(&format!("Participant alive update for {ID}, but no full update."), at(3.0));
        estranged.hear(SIGN_OF_LIFE, at(3.0));
        assert_eq!(estranged.any(at(60.0)), None);
        estranged.hear(&sign(ID), at(7.0));
        // The middleware may take it up yet.
        assert_eq!(estranged.any(at(7.5)), None);
        estranged.hear(&sign(ID), at(7.6));
        assert_eq!(estranged.any(at(8.0)).as_deref(), Some(ID));
        estranged.clear();
        assert_eq!(estranged.any(at(9.0)), None);
    }

    #[test]
    fn who_was_found_again_is_not() {
        let (estranged, start) = (Estranged::default(), Instant::now());
        let at = |seconds| start + Duration::from_secs(seconds);
        for back in [Estranged::find, Estranged::see_off] {
            estranged.listen_to(ID.to_owned());
            estranged.lose(ID, at(0));
            estranged.hear(&sign(ID), at(5));
            assert!(estranged.any(at(60)).is_some());
            back(&estranged, ID);
            assert_eq!(estranged.any(at(60)), None);
        }
    }

    #[test]
    fn who_only_looked_on_is_not_missed() {
        let (estranged, start) = (Estranged::default(), Instant::now());
        estranged.lose(ID, start);
        estranged.hear(&sign(ID), start + 5 * PATIENCE);
        assert_eq!(estranged.any(start + 60 * PATIENCE), None);
    }

    #[test]
    fn the_latest_losses_are_remembered() {
        let (estranged, start) = (Estranged::default(), Instant::now());
        let lost = |number: usize| start + Duration::from_millis(number as u64);
        for number in 0..2 * MOST {
            estranged.listen_to(format!("{number:024}"));
            estranged.lose(&format!("{number:024}"), lost(number));
        }
        let peers = estranged.peers();
        assert_eq!((peers.lost.len(), peers.senders.len()), (MOST, 0));
        assert!(peers.lost.values().all(|peer| peer.at >= lost(MOST)));
    }
}
