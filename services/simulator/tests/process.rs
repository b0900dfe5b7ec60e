//! Tests of the simulator as a process runs it: real ptys, a real bus, real time.

use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lager_plant::{Build, Warehouse};
use lager_ports::{Bus, BusConfig};
use lager_rig::{Domain, Host};
use lager_simulator::{RunError, SimulatorConfig};
use lager_topics::{Role, TruthPose};
use lager_wake::Shutdown;
use lager_wire::{
    Callsign, Command, Payload, ResetCause, Setting, SettingKey, SteerCommand, WheelCommand,
};

/// The longest wait for any condition; after it a test fails instead of hanging.
const WATCHDOG: Duration = Duration::from_secs(60);

/// A bus and a folder that only one test uses.
struct OwnBus(Domain);

impl OwnBus {
    fn new() -> Self {
        Self(Domain::new("lager-sim").unwrap())
    }

    fn open(&self, role: Role) -> Bus {
        let config = BusConfig {
            speed: 2.0,
            ..self.0.config()
        };
        Bus::open(&config, role).unwrap()
    }

    fn config(&self, resume: bool) -> SimulatorConfig {
        SimulatorConfig {
            build: Build::default(),
            warehouse: Warehouse::builtin("large").unwrap(),
            seed: 5,
            obstacles: 0,
            baud: 500_000,
            sensor_link: self.0.files().join("sensor"),
            steering_link: self.0.files().join("steering"),
            eeprom: Some(self.0.files().to_owned()),
            resume,
        }
    }

    fn start(&self, resume: bool) -> Simulator {
        let shutdown = Shutdown::new();
        let (bus, config) = (self.open(Role::Simulator), self.config(resume));
        let thread = {
            let shutdown = shutdown.clone();
            std::thread::spawn(move || lager_simulator::run(&bus, &config, &shutdown))
        };
        Simulator { shutdown, thread }
    }
}

impl Drop for OwnBus {
    fn drop(&mut self) {
        let left = self.0.home().segments();
        // The transport never removes one small segment of each bus.
        let is_left = |path: &PathBuf| path.extension().is_none_or(|end| end != "global_mgmt");
        if !std::thread::panicking() {
            assert!(!left.iter().any(is_left), "{left:?}");
        }
    }
}

struct Simulator {
    shutdown: Shutdown,
    thread: JoinHandle<Result<(), RunError>>,
}

impl Simulator {
    fn stop(self) {
        self.shutdown.request();
        self.thread.join().expect("it does not panic").unwrap();
    }
}

fn port(path: &Path) -> Host {
    Host::open(path, WATCHDOG).unwrap()
}

fn answer(board: &mut Host) {
    board.answer(|_| ()).unwrap();
}

/// Polls until `done`.
fn until(what: &str, mut done: impl FnMut() -> bool) {
    let deadline = Instant::now() + WATCHDOG;
    while !done() {
        assert!(Instant::now() < deadline, "never came: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_robot_is_driven_through_its_ports_and_goes_on_after_a_restart() {
    let place = OwnBus::new();
    let observer = place.open(Role::Supervisor);
    let mut keeper = observer.keeper::<TruthPose>().unwrap();
    let mut truth = observer.subscriber::<TruthPose>().unwrap();
    let config = place.config(false);

    let simulator = place.start(false);
    let mut sensor = port(&config.sensor_link);
    let mut steering = port(&config.steering_link);
    until("both boards", || {
        answer(&mut sensor);
        answer(&mut steering);
        sensor.link.is_up() && steering.link.is_up()
    });
    assert_eq!(sensor.link.callsign(), Some(Callsign::Sensor));
    assert_eq!(steering.link.callsign(), Some(Callsign::Steering));
    assert_eq!(steering.reset, Some(ResetCause::PowerOn));

    let code = Command::Wheel(WheelCommand::ManualForward).code();
    let forward = Payload::SteerCommand(SteerCommand { code, seq: 1 });
    let mut x = 0.0;
    until("a hundred millimetres", || {
        answer(&mut sensor);
        answer(&mut steering);
        steering.send(forward).unwrap();
        keeper.remember().unwrap();
        if let Some(sample) = truth.latest().unwrap() {
            x = sample.x_mm;
        }
        x > 100.0
    });
    drop((sensor, steering));
    simulator.stop();
    assert!(
        std::fs::symlink_metadata(&config.sensor_link).is_err(),
        "the link is gone"
    );

    keeper.remember().unwrap();
    let kept = *keeper.value().expect("it was told").0;
    assert!(kept.x_mm >= x && kept.good_count == 6);
    keeper.hand_over().unwrap();

    let simulator = place.start(true);
    until("the second's port", || {
        // The supervisor does this on its tick, so that a new process gets the kept sample.
        keeper.remember().unwrap();
        config.steering_link.exists()
    });
    let mut steering = port(&config.steering_link);
    until("the steering board", || {
        answer(&mut steering);
        steering.link.is_up()
    });
    assert_eq!(steering.reset, Some(ResetCause::External));
    let mut resumed = None;
    until("a truth of the second", || {
        while let Some(sample) = truth.receive().unwrap() {
            resumed = (sample.time_ns > kept.time_ns)
                .then_some(*sample)
                .or(resumed);
        }
        resumed.is_some()
    });
    let resumed = resumed.unwrap();
    assert!(
        (resumed.x_mm - kept.x_mm).abs() < 20.0,
        "{} {}",
        resumed.x_mm,
        kept.x_mm
    );
    assert_eq!((resumed.left_duty, resumed.right_duty), (0, 0));
    assert_eq!(resumed.servo_position, kept.servo_position);
    simulator.stop();
}

#[test]
fn what_a_board_keeps_without_power_is_there_after_a_restart() {
    let place = OwnBus::new();
    let link = place.config(false).steering_link;
    for (seq, asked, in_force) in [(1, 9, 9), (2, -1, 9)] {
        let simulator = place.start(false);
        let mut steering = port(&link);
        until("the steering board", || {
            answer(&mut steering);
            steering.link.is_up()
        });
        let setting = Setting {
            key: SettingKey::GainP,
            seq,
            value: asked,
        };
        steering.send(Payload::Setting(setting)).unwrap();
        let mut told = None;
        until("the answer", || {
            let reply = |payload| {
                if let Payload::SettingReply(reply) = payload {
                    told = Some(reply.value);
                }
            };
            steering.answer(reply).unwrap();
            told.is_some()
        });
        assert_eq!(told, Some(in_force));
        let file = place.0.files().join("steering.eeprom");
        until("the EEPROM's file", || {
            std::fs::read(&file).is_ok_and(|kept| kept.len() == 4_096 && kept[..3] == [1, 1, 9])
        });
        drop(steering);
        simulator.stop();
    }
}

#[test]
fn a_port_that_cannot_be_made_is_said_in_a_sentence() {
    let place = OwnBus::new();
    std::fs::write(place.0.files().join("sensor"), "not a link").unwrap();
    let simulator = place.start(false);
    let refused = simulator.thread.join().unwrap().unwrap_err();
    assert!(refused.to_string().contains("is not a link"), "{refused}");
}
