//! Owns the newest message of each input and the decoded map; gives out one immutable snapshot.
//!
//! The newest messages wait in slots until a snapshot is asked for. A map is decoded on a thread of its own, so that it
//! never delays an anchor, and arrives as a message. A map that cannot be decoded is reported and changes nothing. Inputs
//! never expire, as in upstream; their age is reported.

use crate::clock::Clock;
use crate::inlets::SensorSlots;
use crate::lifeline::Lifeline;
use crate::map_decoder::{MapDecoder, MapJob};
use crate::publisher::{MapCallbackTime, Publisher};
use crate::tally::{DropReason, Tally};
use crate::topics::{Input, InputTopic};
use crate::validation::SetValidatorParameters;
use actix::{Actor, Addr, AsyncContext, Context, Handler, Message, MessageResult};
use crossbeam_channel::Sender;
use messages::autoware_map_msgs::LaneletMapBin;
use messages::builtin_interfaces::Time;
use selection::Scene;
use selection::scene::{Epoch, HdMap};
use std::sync::Arc;
use std::time::Duration;
use tracing::{error, info};

/// The owner of the sensor state.
#[derive(Debug)]
pub(crate) struct Sensors {
    scene: Scene,
    slots: Arc<SensorSlots>,
    tally: Arc<Tally>,
    clock: Clock,
    decoder: MapDecoder,
    publisher: Addr<Publisher>,
    /// Maps being decoded or waiting for it; the newest one wins.
    decoding: u32,
    newest_map: u64,
    waiting: Vec<Sender<()>>,
    _lifeline: Lifeline,
}

impl Sensors {
    /// `scene` says what is known before the first message.
    pub(crate) fn new(
        scene: Scene,
        slots: Arc<SensorSlots>,
        tally: Arc<Tally>,
        clock: Clock,
        decoder: MapDecoder,
        publisher: Addr<Publisher>,
        lifeline: Lifeline,
    ) -> Self {
        Self {
            scene,
            slots,
            tally,
            clock,
            decoder,
            publisher,
            decoding: 0,
            newest_map: 0,
            waiting: Vec::new(),
            _lifeline: lifeline,
        }
    }

    fn decode_map(&mut self, message: Arc<LaneletMapBin>, ctx: &Context<Self>) {
        self.newest_map += 1;
        let job = MapJob { number: self.newest_map, message, sensors: ctx.address() };
        if self.decoder.submit(job) {
            self.tally.count_dropped(InputTopic::Map, DropReason::Superseded, 1);
            info!("A map that a newer one has overtaken is dropped");
        } else {
            self.decoding += 1;
        }
    }

    fn set_map(&mut self, map: HdMap) {
        let number = self.scene.map.as_ref().map_or(0, |map| map.number) + 1;
        info!("Map {number}: {} lanelets, frame \"{}\"", map.map.lanelets().len(), map.frame_id);
        self.scene.map = Some(Epoch { number, value: map });
    }
}

impl Actor for Sensors {
    type Context = Context<Self>;
}

/// A map or a route.
#[derive(Debug)]
pub(crate) struct Sense(pub(crate) Input);

impl Message for Sense {
    type Result = ();
}

impl Handler<Sense> for Sensors {
    type Result = ();

    fn handle(&mut self, Sense(input): Sense, ctx: &mut Self::Context) {
        match input {
            Input::Map(message) => self.decode_map(message, ctx),
            Input::ReadyMap(map, frame_id) => {
                self.newest_map += 1;
                self.set_map(HdMap::new(frame_id, map));
            }
            Input::Route(route) => {
                let number = self.scene.route.as_ref().map_or(0, |route| route.number) + 1;
                self.scene.route = Some(Epoch { number, value: route });
            }
            // Sensors come through their slots, candidates go to the buffer, goals to the provider.
            Input::Odometry(_)
            | Input::Acceleration(_)
            | Input::Objects(_)
            | Input::TrafficSignals(_)
            | Input::Generative(_)
            | Input::Backup(_)
            | Input::GoalPose(_)
            | Input::OccupancyGrid(_) => {}
        }
    }
}

/// A map came back from decoding.
#[derive(Debug)]
pub(crate) struct MapDecoded {
    pub(crate) number: u64,
    pub(crate) map: Result<HdMap, String>,
    pub(crate) took: Duration,
}

impl Message for MapDecoded {
    type Result = ();
}

impl Handler<MapDecoded> for Sensors {
    type Result = ();

    fn handle(&mut self, decoded: MapDecoded, _: &mut Self::Context) {
        self.decoding -= 1;
        match decoded.map {
            Ok(map) if decoded.number == self.newest_map => self.set_map(map),
            Ok(_) => {
                self.tally.count_dropped(InputTopic::Map, DropReason::Superseded, 1);
                info!("A map that a newer one has overtaken is dropped");
            }
            Err(why) => {
                self.tally.count_dropped(InputTopic::Map, DropReason::Malformed, 1);
                error!("The lanelet map cannot be decoded and is ignored: {why}");
            }
        }
        self.publisher.do_send(MapCallbackTime { took: decoded.took, now: self.clock.now() });
        if self.decoding == 0 {
            for waiting in self.waiting.drain(..) {
                // Whoever no longer waits does not need the answer.
                let _ = waiting.send(());
            }
        }
    }
}

/// Parameters for maps that come from now on.
impl Handler<SetValidatorParameters> for Sensors {
    type Result = ();

    fn handle(&mut self, SetValidatorParameters(parameters): SetValidatorParameters, _: &mut Self::Context) {
        self.decoder.configure(parameters);
    }
}

/// Asks for the world as it is known now.
#[derive(Debug)]
pub(crate) struct TakeSnapshot(pub(crate) Time);

impl Message for TakeSnapshot {
    type Result = Arc<Scene>;
}

impl Handler<TakeSnapshot> for Sensors {
    type Result = MessageResult<TakeSnapshot>;

    fn handle(&mut self, TakeSnapshot(now): TakeSnapshot, _: &mut Self::Context) -> Self::Result {
        self.slots.take_into(&mut self.scene);
        MessageResult(Arc::new(Scene { now, ..self.scene.clone() }))
    }
}

/// Asks to be told when everything received so far is in the snapshot.
#[derive(Debug)]
pub(crate) struct WaitForSensors(pub(crate) Sender<()>);

impl Message for WaitForSensors {
    type Result = ();
}

impl Handler<WaitForSensors> for Sensors {
    type Result = ();

    fn handle(&mut self, WaitForSensors(reply): WaitForSensors, _: &mut Self::Context) {
        if self.decoding == 0 {
            // Whoever no longer waits does not need the answer.
            let _ = reply.send(());
        } else {
            self.waiting.push(reply);
        }
    }
}
