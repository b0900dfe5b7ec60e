//! The bridge killed with SIGKILL again and again while the robot turns and drives: every turn is
//! carried out once, and the robot halts by itself meanwhile. And frozen, stopped, and let go on.
//!
//! It is a program without the test harness because it starts itself again as the bridge: only a
//! process can be killed like a process.

#[path = "bridge/harness/mod.rs"]
mod harness;

use std::error::Error;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use lager_bridge::{BridgeConfig, Ports};
use lager_orders::Mode;
use lager_ports::{Bus, Keeper};
use lager_rig::process::run_if_asked;
use lager_rig::{Parent, Process};
use lager_topics::{Finish, LinkHealth, Role, SteeringOrder};
use lager_wake::Shutdown;
use rustix::process::{Pid, Signal, kill_process};

use harness::{
    FOLLOW, Hands, Isolation, LEFT_PERP, PATIENCE, Plugged, SPEED, STANDBY, SensorBoard,
    SteeringBoard, logic, wait_until,
};

fn main() {
    run_if_asked(&[&[(BRIDGE, bridge)]]);
    if std::env::args().nth(1).as_deref() == Some("--list") {
        return;
    }
    a_turn_is_carried_out_once_however_often_the_bridge_is_killed();
    println!("test a_turn_is_carried_out_once_however_often_the_bridge_is_killed ... ok");
    a_frozen_bridge_that_goes_on_writes_standby_and_nothing_older();
    println!("test a_frozen_bridge_that_goes_on_writes_standby_and_nothing_older ... ok");
}

const BRIDGE: &str = "bridge";

/// The bridge as a process that does not outlive the test.
fn bridge(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let Some((bus, ports, resume)) = parent.hear::<(PathBuf, PathBuf, bool)>()? else {
        return Ok(());
    };
    let bus = Bus::open(&harness::bus_config(&bus), Role::Bridge).unwrap();
    let config = BridgeConfig {
        ports: Ports::Named([ports.join("sensor"), ports.join("steering")]),
        resume,
        ..BridgeConfig::default()
    };
    lager_bridge::run(&bus, &config, &Shutdown::new()).unwrap();
    Ok(())
}

fn start(isolation: &Isolation, resume: bool) -> Option<Process> {
    let mut process = Process::start(BRIDGE).unwrap();
    process.tell(&(isolation.bus_folder(), isolation.folder(), resume));
    Some(process)
}

struct Scene {
    /// `None` while there is none.
    bridge: Option<Process>,
    keeper: Keeper<LinkHealth>,
    supervisor: Bus,
    hands: Hands,
    steering: Plugged<SteeringBoard>,
    _sensor: Plugged<SensorBoard>,
    isolation: Isolation,
}

impl Scene {
    fn new() -> Self {
        let isolation = Isolation::new();
        let sensor = Plugged::new(SensorBoard::new(), isolation.folder().join("sensor"), SPEED);
        let steering = Plugged::new(
            SteeringBoard::new(),
            isolation.folder().join("steering"),
            SPEED,
        );
        let supervisor = isolation.open(Role::Supervisor);
        Self {
            bridge: start(&isolation, false),
            keeper: supervisor.keeper().unwrap(),
            hands: Hands::new(&isolation.open(Role::Operator)),
            supervisor,
            steering,
            _sensor: sensor,
            isolation,
        }
    }

    /// What a supervisor does when its bridge has died.
    fn restart(&mut self) {
        self.bridge = None;
        self.keeper.remember().unwrap();
        self.supervisor.sweep();
        self.keeper.hand_over().unwrap();
        self.bridge = start(&self.isolation, true);
    }

    /// Renews `order` until `condition` holds, and does the supervisor's work beside it.
    fn renew_until(
        &mut self,
        order: SteeringOrder,
        what: &str,
        mut condition: impl FnMut(&mut Self) -> bool,
    ) {
        let start = Instant::now();
        let mut renewed = None::<Instant>;
        while !condition(self) {
            assert!(start.elapsed() < PATIENCE, "waited in vain until {what}");
            if renewed.is_none_or(|at| at.elapsed() >= Duration::from_millis(40)) {
                renewed = Some(Instant::now());
                self.hands.give(order);
            }
            self.keeper.remember().unwrap();
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    fn turns(&self) -> usize {
        self.steering.with(|board| board.count(LEFT_PERP))
    }
}

fn a_turn_is_carried_out_once_however_often_the_bridge_is_killed() {
    let mut scene = Scene::new();
    scene
        .hands
        .wait_for_health("both boards are ready", |health| health.boards_are_ready());
    scene.hands.set_mode(Mode::Autonomous);
    let mut finishes = [0, 0];
    for round in 1..=6_u32 {
        // A turn takes 300 ms: the bridge dies before, in the middle and after it.
        let turn = logic(round * 10, LEFT_PERP);
        let delay = Duration::from_millis(u64::from(round - 1) * 70).div_f64(SPEED);
        let start = Instant::now();
        scene.renew_until(turn, "it is time to die", |scene| {
            scene.turns() == round as usize && start.elapsed() >= delay
        });
        scene.restart();
        wait_until(
            "the robot stands, at the latest by the board's own limit",
            || {
                let stands = scene.steering.with(|board| !board.moves());
                scene.keeper.remember().unwrap();
                stands
            },
        );
        let mut finish = Finish::None;
        scene.renew_until(turn, "the end of the turn is told", |scene| {
            for state in scene.hands.state.drain() {
                if state.finished_id == turn.id {
                    finish = state.finish.get().unwrap();
                }
            }
            finish != Finish::None
        });
        assert_eq!(
            scene.turns(),
            round as usize,
            "the turn was carried out once"
        );
        finishes[usize::from(finish == Finish::Done)] += 1;

        // The restarted bridge drives, and kept the mode.
        let drive = logic(round * 10 + 1, FOLLOW);
        scene.renew_until(drive, "it drives", |scene| {
            scene.steering.with(|board| board.moves())
        });
        let health = scene.hands.health.look().unwrap();
        assert_eq!(health.mode.get(), Some(Mode::Autonomous));
    }
    assert!(
        finishes[0] > 0,
        "some turns were cut short by the board's limit"
    );
    assert_eq!(scene.steering.with(|board| board.restarts), 0);
}

/// Orders wait on the bus for the bridge, and the stop is set, while it is frozen; the lease of
/// none of them has ended when it goes on.
fn a_frozen_bridge_that_goes_on_writes_standby_and_nothing_older() {
    let mut scene = Scene::new();
    scene
        .hands
        .wait_for_health("both boards are ready", |health| health.boards_are_ready());
    scene.hands.set_mode(Mode::Autonomous);
    let process = scene.bridge.as_ref().unwrap().pid();
    let process = Pid::from_raw(i32::try_from(process).unwrap()).unwrap();
    let mut id = 100;
    for round in 0..20 {
        id += 1;
        scene.renew_until(logic(id, FOLLOW), "it drives", |scene| {
            scene.steering.with(|board| board.moves())
        });
        kill_process(process, Signal::STOP).unwrap();
        wait_until("the bridge is frozen", || {
            let stat = std::fs::read_to_string(format!("/proc/{}/stat", process.as_raw_nonzero()));
            stat.unwrap().rsplit(") ").next().unwrap().starts_with('T')
        });
        // What came before is with the board by now.
        std::thread::sleep(Duration::from_millis(5));
        let before = scene.steering.with(|board| board.register.executed.len());
        let stop = scene.hands.stop();
        for _ in 0..10 {
            id += 1;
            scene.hands.give(logic(id, FOLLOW));
        }
        kill_process(process, Signal::CONT).unwrap();
        wait_until("the board reports wheels at rest after the stop", || {
            let rested = scene.hands.stop_told().rested();
            rested.is_some_and(|(of, _)| of == stop)
        });
        let after = scene
            .steering
            .with(|board| board.register.executed[before..].to_vec());
        assert!(
            after.iter().all(|code| *code == STANDBY.code()),
            "round {round}: {after:?}"
        );
        let answer = scene.hands.resume();
        assert_eq!(answer.stopped, 0);
    }
}
