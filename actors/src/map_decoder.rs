//! Owns the thread that decodes maps: one at a time, the newest waiting one next.
//!
//! A city map takes longer to decode than several cycles last, and what filters derive from it again. Both happen here,
//! on a thread that is none of the pool that judges and that gives way to it, so a map never delays an anchor; and only
//! one map waits, so that a planner that sends maps without end costs one thread and two maps.

use crate::lifeline::Lifeline;
use crate::sensors::{MapDecoded, Sensors};
use actix::Addr;
use crossbeam_channel::{Receiver, Sender, TrySendError, bounded};
use messages::autoware_map_msgs::LaneletMapBin;
use selection::filters::prepare_map;
use selection::panics::caught;
use selection::parameters::ValidatorParameters;
use selection::scene::HdMap;
use std::io;
use std::sync::Arc;
use std::time::Instant;
use tracing::warn;

/// As `nice` counts: a tenth of the time of a judging thread where both want the same core.
#[cfg(target_os = "linux")]
const PRIORITY: i32 = 10;

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
    jobs: Sender<Order>,
    waiting: Receiver<Order>,
    parameters: Arc<ValidatorParameters>,
}

/// A map with the parameters of the filters that will derive something from it.
type Order = (MapJob, Arc<ValidatorParameters>);

impl MapDecoder {
    /// Starts the thread.
    ///
    /// # Errors
    /// The operating system gives none.
    pub(crate) fn start(parameters: ValidatorParameters, lifeline: Lifeline) -> io::Result<Self> {
        let (jobs, waiting) = bounded::<Order>(1);
        let queue = waiting.clone();
        std::thread::Builder::new().name("map-decoder".to_owned()).spawn(move || {
            let _lifeline = lifeline;
            give_way();
            for (job, parameters) in queue {
                job.sensors.do_send(decode(job.number, &job.message, &parameters));
            }
        })?;
        Ok(Self { jobs, waiting, parameters: Arc::new(parameters) })
    }

    /// Takes parameters for the maps that are handed over from now on.
    pub(crate) fn configure(&mut self, parameters: ValidatorParameters) {
        self.parameters = Arc::new(parameters);
    }

    /// Hands over a map; true if an older one that waited is dropped for it.
    pub(crate) fn submit(&self, job: MapJob) -> bool {
        let mut overtaken = false;
        let mut next = (job, self.parameters.clone());
        loop {
            match self.jobs.try_send(next) {
                Ok(()) | Err(TrySendError::Disconnected(_)) => return overtaken,
                Err(TrySendError::Full(order)) => {
                    overtaken |= self.waiting.try_recv().is_ok();
                    next = order;
                }
            }
        }
    }
}

/// Lets the threads that judge go before the calling one: a map can wait, an anchor cannot.
fn give_way() {
    // Where the system refuses, maps are decoded all the same. Elsewhere than on Linux this would slow down all threads.
    #[cfg(target_os = "linux")]
    let _ = rustix::process::setpriority_process(None, PRIORITY);
}

fn decode(number: u64, message: &LaneletMapBin, parameters: &ValidatorParameters) -> MapDecoded {
    let started = Instant::now();
    // The decoder promises not to panic; a map must not take the thread down if it breaks that promise.
    let outcome = caught(|| lanelet_map::archive::decode(&message.data));
    let map = match outcome {
        Ok(Ok(map)) => Ok(HdMap::new(Arc::from(message.header.frame_id.as_str()), Arc::new(map))),
        Ok(Err(error)) => Err(error.to_string()),
        Err(panic) => Err(format!("the decoder panicked: {panic}")),
    };
    if let Ok(map) = &map
        && let Err(panic) = caught(|| prepare_map(map, parameters))
    {
        // The filter that panicked will do so again where it counts, and is then reported with what it did not judge.
        warn!("what filters derive from map {number} could not be made ahead: {panic}");
    }
    MapDecoded { number, map, took: started.elapsed() }
}
