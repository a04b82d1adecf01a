//! Owns the thread that decodes maps: one at a time, the newest waiting one next.
//!
//! A city map takes longer to decode than several cycles last. The thread is none of the pool that judges, so a map
//! never delays an anchor; and only one map waits, so that a planner that sends maps without end costs one thread and
//! two maps.

use crate::lifeline::Lifeline;
use crate::sensors::{MapDecoded, Sensors};
use actix::Addr;
use crossbeam_channel::{Receiver, Sender, TrySendError, bounded};
use messages::autoware_map_msgs::LaneletMapBin;
use selection::panics::caught;
use std::io;
use std::sync::Arc;
use std::time::Instant;

/// A map to decode.
#[derive(Debug)]
pub(crate) struct MapJob {
    /// Number of the map message, from 1.
    pub(crate) number: u64,
    pub(crate) message: Arc<LaneletMapBin>,
    /// Who gets the map.
    pub(crate) sensors: Addr<Sensors>,
}

/// The way to the decoding thread, which ends when this is dropped.
#[derive(Debug)]
pub(crate) struct MapDecoder {
    jobs: Sender<MapJob>,
    waiting: Receiver<MapJob>,
}

impl MapDecoder {
    /// Starts the thread.
    ///
    /// # Errors
    /// The operating system gives none.
    pub(crate) fn start(lifeline: Lifeline) -> io::Result<Self> {
        let (jobs, waiting) = bounded::<MapJob>(1);
        let queue = waiting.clone();
        std::thread::Builder::new().name("map-decoder".to_owned()).spawn(move || {
            let _lifeline = lifeline;
            for job in queue {
                let MapJob { number, message, sensors } = job;
                sensors.do_send(decode(number, &message));
            }
        })?;
        Ok(Self { jobs, waiting })
    }

    /// Hands over a map; true if an older one that waited is dropped for it.
    pub(crate) fn submit(&self, job: MapJob) -> bool {
        let mut overtaken = false;
        let mut next = job;
        loop {
            match self.jobs.try_send(next) {
                Ok(()) | Err(TrySendError::Disconnected(_)) => return overtaken,
                Err(TrySendError::Full(job)) => {
                    overtaken |= self.waiting.try_recv().is_ok();
                    next = job;
                }
            }
        }
    }
}

fn decode(number: u64, message: &LaneletMapBin) -> MapDecoded {
    let started = Instant::now();
    // The decoder promises not to panic; a map must not take the thread down if it breaks that promise.
    let outcome = caught(|| lanelet_map::archive::decode(&message.data));
    let map = match outcome {
        Ok(Ok(map)) => Ok(Arc::new(map)),
        Ok(Err(error)) => Err(error.to_string()),
        Err(panic) => Err(format!("the decoder panicked: {panic}")),
    };
    let frame_id = Arc::from(message.header.frame_id.as_str());
    MapDecoded { number, map, frame_id, took: started.elapsed() }
}
