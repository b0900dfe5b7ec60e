//! What the robot's other services have said last.

use lager_ports::Stop;
use lager_topics::{
    BlockedWays, DistanceFrame, Durations, Health, LineFrame, Mode, NavigatorStatus, OrderQueue,
    Refusal, Route, SteeringReport, Truth, WarehouseMap,
};
use lager_wire::Version;

/// The last sample of each topic that is told of. `None` has not been heard.
#[derive(Clone, Debug, Default)]
pub(crate) struct Known {
    pub(crate) health: Option<Health>,
    pub(crate) status: Option<NavigatorStatus>,
    pub(crate) queue: Option<OrderQueue>,
    pub(crate) report: Option<SteeringReport>,
    pub(crate) route: Option<Box<Route>>,
    pub(crate) senses: Senses,
    /// Somebody has told where it really is, so there is a world that can be asked.
    pub(crate) is_simulated: bool,
    /// The warehouse as this process or one before it has published it.
    pub(crate) map: Option<Box<WarehouseMap>>,
}

/// What only a station that speaks the extension is told, each as far as it is new.
#[derive(Clone, Debug, Default)]
pub struct Senses {
    /// The line under the robot.
    pub line: Option<LineFrame>,
    /// What is in front of it.
    pub distance: Option<DistanceFrame>,
    /// The ways on which something stands.
    pub blocks: Option<Box<BlockedWays>>,
    /// How long sensor frames took until logic had decided, since logic was started.
    pub latency: Option<Box<Durations>>,
    /// Where a simulated robot really is.
    pub truth: Option<Box<Truth>>,
}

impl Known {
    /// Who may drive.
    pub(crate) fn mode(&self) -> Option<Mode> {
        self.health.and_then(|health| health.mode.get())
    }

    /// Whether a stop is in force.
    pub(crate) fn is_stopped(&self) -> bool {
        self.health.is_some_and(|health| health.stopped != 0)
    }

    /// Which stop that is; 0 = none.
    pub(crate) fn stop_word(&self) -> u64 {
        self.health.map_or(0, |health| health.stop_word)
    }

    /// Why this stop is not released where another one is in force, as a sentence.
    pub(crate) fn newer_stop(&self, named: u64) -> String {
        match Stop::of_word(self.stop_word()).filter(|stop| stop.word() != named) {
            Some(stop) => {
                format!("a newer stop is set, {stop}; look at the robot and release that one")
            }
            // The bridge has seen it, and has not told it yet.
            None => "a newer stop is set; look at the robot and release that one".to_owned(),
        }
    }

    /// Whether the steering board tells what it does with its motors: an original one does not, and
    /// the bridge shows in its place what it was told.
    pub(crate) fn board_tells_duties(&self) -> bool {
        let original = Version::Original as u8;
        self.health
            .is_some_and(|health| health.steering.version != original)
    }

    /// Why nobody may move the robot now, if that is so.
    pub(crate) fn blocked(&self) -> Option<Refusal> {
        let why = self.health.and_then(|health| health.blocked.get());
        why.filter(|why| *why != Refusal::None)
    }
}
