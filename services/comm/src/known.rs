//! The last samples of the robot's other services.

use core::time::Duration;

use lager_home::Watched;
use lager_lines::extension::{Commissioning, Finding, FoundOut, KeptLine};
use lager_operator::Seen;
use lager_orders::Mode;
use lager_stop::Stop;
use lager_topics::{
    BlockedWays, BoardHealth, DistanceFrame, Durations, Health, LineFrame, NavigatorStatus,
    OrderQueue, Route, SteeringReport, Truth, WarehouseMap,
};
use lager_wire::Version;

/// The last sample of each topic that comm uses. `None`: no sample has come.
#[derive(Clone, Debug, Default)]
pub(crate) struct Known {
    pub(crate) health: Option<Health>,
    pub(crate) status: Option<NavigatorStatus>,
    pub(crate) queue: Option<OrderQueue>,
    pub(crate) report: Option<SteeringReport>,
    pub(crate) stood: Stood,
    pub(crate) route: Option<Box<Route>>,
    pub(crate) senses: Senses,
    /// Somebody has told where the robot really is, so there is a simulated world to ask.
    pub(crate) is_simulated: bool,
    /// When each board was last heard, in ns: sensor, steering.
    pub(crate) boards_ns: [Option<u64>; 2],
    /// How long the last sign took to the station and back, in ms.
    pub(crate) trip_ms: Option<u32>,
    /// How the machine is.
    pub(crate) machine: Machine,
    /// The services that `lager up` keeps alive.
    pub(crate) services: Vec<Watched>,
    /// The warehouse that this process or an earlier one has published.
    pub(crate) map: Option<Box<WarehouseMap>>,
    pub(crate) commission: Commissioned,
}

/// What the commissioning of the robot tells.
#[derive(Clone, Debug, Default)]
pub(crate) struct Commissioned {
    /// One is at work.
    pub(crate) is_at_work: bool,
    /// How far it is, or how the last one has ended.
    pub(crate) how: Box<Commissioning>,
    pub(crate) found: FoundOut,
    /// The description that it has saved.
    pub(crate) kept: Vec<KeptLine>,
}

/// When both wheels stood after the stop in force.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) enum Stood {
    /// Nobody has seen it: there is no stop, or it was set before comm started.
    #[default]
    Unseen,
    /// The stop was set, and the wheels still turn.
    Awaited,
    /// They stood so long after it.
    After(Duration),
}

/// New samples that only a station with the extension is told.
#[derive(Clone, Debug, Default)]
pub struct Senses {
    /// The line under the robot.
    pub line: Option<LineFrame>,
    /// What is in front of it.
    pub distance: Option<DistanceFrame>,
    /// The ways that are blocked.
    pub blocks: Option<Box<BlockedWays>>,
    /// How long sensor frames took until logic had decided, since logic started.
    pub latency: Option<Box<Durations>>,
    /// Where a simulated robot really is.
    pub truth: Option<Box<Truth>>,
}

/// How the robot's machine is, at one moment.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Machine {
    /// How many processes want a core, in percent of the cores; `None` is not known.
    pub load_percent: Option<u32>,
    /// How many cores it has.
    pub cores: Option<u16>,
    /// All its memory and what programs can still get, in MiB.
    pub memory_mib: Option<[u32; 2]>,
    /// What is wrong with the machine.
    pub found: Vec<Finding>,
}

impl Known {
    /// Takes the bridge's state. Returns the one before it.
    pub(crate) fn take_health(&mut self, now_ns: u64, health: &Health) -> Option<Health> {
        let before = self.health.replace(*health);
        let boards = |health: &Health| [health.sensor, health.steering];
        for (place, board) in boards(health).iter().enumerate() {
            let count = |board: &BoardHealth| (board.epoch, board.packets);
            let was = before.as_ref().map(|before| count(&boards(before)[place]));
            if board.up != 0 && was != Some(count(board)) {
                self.boards_ns[place] = Some(now_ns);
            }
        }
        before
    }

    /// Who may drive.
    pub(crate) fn mode(&self) -> Option<Mode> {
        self.health.and_then(|health| health.mode.get())
    }

    /// Whether a stop is in force.
    pub(crate) fn is_stopped(&self) -> bool {
        self.health.is_some_and(|health| health.stopped != 0)
    }

    /// What an operator must know.
    pub(crate) fn seen(&self) -> Seen {
        let stop = self.health.map_or(0, |health| health.stop_word);
        Seen {
            health: self.health,
            status: self.status,
            queue: self.queue,
            is_simulated: self.is_simulated,
            stop: Stop::of_word(stop).map(Stop::cause),
            refused: None,
        }
    }

    /// Whether the steering board reports what its motors do. An original board does not; the
    /// bridge then shows the command that the board was sent.
    pub(crate) fn board_tells_duties(&self) -> bool {
        let original = Version::Original as u8;
        self.health
            .is_some_and(|health| health.steering.version != original)
    }
}
