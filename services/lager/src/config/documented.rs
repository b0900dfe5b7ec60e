//! The configuration as a file with every key explained: what `lager config` prints.

use std::path::PathBuf;

use lager_wire::{ArmPose, JointLimits};

use super::{Body, Config, PickBy, Waiting, WithoutLink};
use crate::realtime::CoreSet;

impl Config {
    /// The configuration as a file with every key explained: what `lager config` prints.
    pub fn documented(&self) -> String {
        let quoted = |text: &str| toml::Value::from(text).to_string();
        let unset = |name: &str, value: Option<&str>| match value {
            Some(value) => format!("{name} = {}", quoted(value)),
            None => format!("# {name} = \"...\""),
        };
        let cores = |cores: &CoreSet| format!("{:?}", cores.iter().collect::<Vec<_>>());
        let unset_path = |name: &str, path: &Option<PathBuf>| {
            unset(
                name,
                path.as_ref().map(|path| path.to_string_lossy()).as_deref(),
            )
        };
        let line = |name: &str, value: Option<u32>| match value {
            Some(value) => format!("{name} = {value}"),
            None => format!("# {name} = 17"),
        };
        format!(
            "\
# The robot's name: the middle part of every topic's name.
name = {name}
# How many times as fast as real time the robot's clock runs; real boards need 1, emulated ones run
# as fast as the machine can if that is less.
speed = {speed:?}
# What the services drive: \"sim\", the simulated robot, \"chip\", the boards' real images in an
# emulator, or \"serial\", the boards at [serial].
body = {body}
# A built-in warehouse (small, curved, large) or the path of a warehouse file.
warehouse = {warehouse}
# The folder that keeps what outlives `lager up`: a built-in warehouse as it was saved in the panel (a
# file's changes are saved in the file), the orders that wait, and which goods a real robot has not
# found in their place. Unset, .state in the folder of the bus if one is named, else $STATE_DIRECTORY,
# else $XDG_STATE_HOME/lager, else ~/.local/state/lager.
{state}

[log]
# File that all processes of the robot append their traces to: those that RUST_LOG asks for, or
# \"info\". Unset, nothing is traced unless RUST_LOG asks for it, and then on standard error.
{log}
# Traces as JSON, one value a line, for programs: into that file, or on standard error without one.
json = {log_json}

[bus]
# The folder in which all of the bus lives, at most 37 bytes; unset, it is /run/lager where that is
# this user's, else /dev/shm/lager-UID. Robots in different folders never meet.
{folder}
# How bridge and logic wait for samples: \"block\" (sleep), \"spin\" (a core for each) or \"adaptive\"
# (look without pause while samples come fast, sleep when they do not) ...
waiting = {waiting}
# ... and the longest that \"adaptive\" looks without pause for one sample, in microseconds.
longest_spin_us = {longest_spin_us}

[realtime]
# Priority of the bridge under SCHED_FIFO, 1 to 99; 0 is the normal scheduler. Logic gets one less
# and the bridge's readers two, 1 at the least, unless they wait by spinning. Above 49 they would go
# before the interrupt threads that bring the boards' bytes on a PREEMPT_RT kernel.
# Needs LimitRTPRIO= in the systemd unit, `ulimit -r`, or CAP_SYS_NICE: `lager doctor` tries it.
priority = {priority}
# Keep all memory of bridge and logic from being paged out (mlockall): some 40 MiB each,
# of which 25 MiB would not be in memory otherwise.
# Needs LimitMEMLOCK= in the systemd unit, `ulimit -l`, or CAP_IPC_LOCK: `lager doctor` tries it.
lock_memory = {lock_memory}

[realtime.cores]
# The cores each service may run on, by number from 0; none means any. On one core, such as
# bridge = [3] and logic = [3], they wake each other sooner than across two; with \"spin\" or
# \"adaptive\" each needs its own. isolcpus=3 on the kernel's command line keeps all else away.
bridge = {bridge}
logic = {logic_cores}
# The simulated robot stands for boards with processors of their own; only cores can be chosen.
simulator = {simulator}

[serial]
# The ports of the boards; given the wrong way round they work all the same.
sensor = {sensor}
steering = {steering}
# 500000, or 9600 for boards of the original build.
baud = {baud}
# Whether the sensor board sends the raw reading of all eleven sensors as well.
raw_line = {raw_line}
# Whether an original steering board is driven. Its commands have no age limit: where boards of this
# project stop the wheels within 200 ms of whatever dies, it drives on with what it was told last
# until the bridge, or its power switch, tells it to stand. If false it is told standby only.
original_boards = {original_boards}

[arm]
# What the arm may do; the steering board is told at every start, and the arm stands until the board
# has taken it. Positions are those of the servos, 0 to 1023, 0.29 degrees each; torque and load are
# 1 to 1023 of full. Torque limit of all servos ...
torque_limit = {torque_limit}
# ... and load that ends a squeeze.
squeeze_load = {squeeze_load}
# Positions of the gripper when open, and when closed on nothing.
gripper_open = {gripper_open}
gripper_closed = {gripper_closed}

# Where each joint may be sent, [lowest, highest]. A step that would lead outside is refused. Of the
# shoulder and the elbow the first servo counts (2 and 4); the other one faces it.
[arm.limits]
{limits}

# Where the arm goes when it has let go of goods, ...
[arm.neutral]
{neutral}

# ... where it lets go, ...
[arm.drop]
{drop}

# ... and where it is while the robot drives with goods.
[arm.carry]
{carry}

[logic]
# Speed in mm/s when both motors run at the standard duty of 100.
cruise_mm_per_s = {cruise:?}
# How far the line sensors are ahead of the wheels' axle, in mm.
sensor_ahead_mm = {ahead:?}
# Degrees per second of a turn on the spot at that duty.
turn_deg_per_s = {turn:?}
# Width of the tape, in mm.
tape_mm = {tape:?}
# How far the ranger at the front is ahead of the wheels' axle, in mm.
ranger_ahead_mm = {ranger_ahead:?}
# Battery, in tenths of a volt, below which the robot stands at the next crossing until it is
# charged or a person has put it down anew; 0 = never.
low_battery_decivolts = {low_battery}
# How far the ranger at the front sees, in cm: from 11 to 255, or 0 where there is none, and the robot
# looks at no way. What is 10 cm nearer than that, and than the next crossing, blocks a way.
ranger_cm = {ranger}
# After how many seconds ways that the robot has found blocked are tried again, before it calls a goal
# unreachable.
try_again_s = {try_again}
# Where shoulder and elbow are when the claw is around goods that stand as they should in front of the
# robot, in units of 0.29 degrees. A robot that picks by itself steps them there.
reach_shoulder = {reach_shoulder}
reach_elbow = {reach_elbow}
# Who picks the goods up: \"manual\" (a person moves the arm and says when it is done) or \"auto\" (the
# robot by itself). Unset, a person does on real boards, unless `--script` has it drive by itself, and
# simulated and emulated robots do it by themselves.
{pick}

[simulator]
# Seed of all noise: the same seed is the same robot.
seed = {seed}
# So many things come and go on the ways of the simulated floor, at random: 0 to 64. They need
# squares of 50 cm or more.
obstacles = {obstacles}

[chip]
# The emulator's program and the boards' images, built for [serial] baud. Unset, they are looked for
# beside this program and in the source tree.
{emulator}
{sensor_elf}
{steering_elf}
# Folder that keeps both boards' EEPROM, and so their settings. Unset, it lies with the bus: the
# settings outlive the robot until the machine restarts.
{eeprom}
# The page in which an emulator at the ports of [serial] publishes the robot's time; body = \"chip\"
# has its own.
{clock}

[station]
# Whether the robot talks to an external computer, which tells it its warehouse and what to fetch.
# If not, `lager up` tells it its warehouse.
wanted = {station_wanted}
# Host and port of one that runs already. Unset, `lager up` starts one at 127.0.0.1:7420, or at
# another port where that is taken.
{station_address}
# Where robots connect to the one that `lager up` starts, instead.
{station_listen}
# The path of the socket at which a GaG connects to it. Unset, it is in the robot's folder of the bus.
{station_gag}
# The file in which it keeps the warehouse as it was saved in the panel. Unset, the file that
# `warehouse` names, or for a built-in one NAME.toml in the state folder.
{station_warehouse}
# The file in which it keeps what waits to be fetched. Unset, queue.toml in the state folder.
{station_queue}
# Where the operator panel of such a station answers browsers of this machine. Unset, 127.0.0.1:7410,
# or another port where that is taken.
{station_panel}

[comm]
# What the robot does in autonomous mode while the external computer is out of reach: \"go-on\" (it
# carries out its orders) or \"stand\" (it drives on to the next crossing and stands there until the
# link is there again). In manual mode it stands at once.
link_lost = {link_lost}

[buttons]
# The robot's reset button and mode switch, as lines of a GPIO chip that a closed contact pulls to
# ground, such as /dev/gpiochip0. Unset, there are none.
{buttons_chip}
# The line of the reset button, by its offset: the robot has been put on the delivery node.
{buttons_reset}
# The line of the mode switch: open is manual, closed autonomous.
{buttons_switch}
# For how many ms a contact must be steady; at most 500.
debounce_ms = {debounce}

[gateway]
# Where Prometheus reads the robot's figures, such as 127.0.0.1:7430; whoever reaches that address may
# read them. Unset, nowhere.
{gateway_metrics}
# Where Foxglove looks on live, such as 127.0.0.1:8765; whoever reaches that address, and any page that
# a browser of that machine shows, may look. It needs a program with the feature foxglove.
{gateway_foxglove}
",
            name = quoted(&self.name),
            speed = self.speed,
            body = match self.body {
                Body::Sim => "\"sim\"",
                Body::Chip => "\"chip\"",
                Body::Serial => "\"serial\"",
            },
            warehouse = quoted(&self.warehouse),
            log = unset_path("file", &self.log.file),
            log_json = self.log.json,
            folder = unset_path("folder", &self.bus.folder),
            sensor = quoted(&self.serial.sensor.to_string_lossy()),
            steering = quoted(&self.serial.steering.to_string_lossy()),
            baud = self.serial.baud,
            raw_line = self.serial.raw_line,
            original_boards = self.serial.original_boards,
            waiting = match self.bus.waiting {
                Waiting::Block => "\"block\"",
                Waiting::Spin => "\"spin\"",
                Waiting::Adaptive => "\"adaptive\"",
            },
            longest_spin_us = self.bus.longest_spin_us,
            priority = self.realtime.priority,
            lock_memory = self.realtime.lock_memory,
            bridge = cores(&self.realtime.cores.bridge),
            logic_cores = cores(&self.realtime.cores.logic),
            simulator = cores(&self.realtime.cores.simulator),
            torque_limit = self.arm.torque_limit,
            squeeze_load = self.arm.squeeze_load,
            gripper_open = self.arm.gripper_open,
            gripper_closed = self.arm.gripper_closed,
            limits = limits(&self.arm.limits),
            neutral = pose(&self.arm.neutral),
            drop = pose(&self.arm.drop),
            carry = pose(&self.arm.carry),
            cruise = self.logic.cruise_mm_per_s,
            ahead = self.logic.sensor_ahead_mm,
            low_battery = self.logic.low_battery_decivolts,
            turn = self.logic.turn_deg_per_s,
            tape = self.logic.tape_mm,
            ranger_ahead = self.logic.ranger_ahead_mm,
            ranger = self.logic.ranger_cm,
            try_again = self.logic.try_again_s,
            reach_shoulder = self.logic.reach_shoulder,
            reach_elbow = self.logic.reach_elbow,
            pick = unset("pick", self.logic.pick.map(PickBy::key)),
            seed = self.simulator.seed,
            obstacles = self.simulator.obstacles,
            emulator = unset_path("emulator", &self.chip.emulator),
            sensor_elf = unset_path("sensor_elf", &self.chip.sensor_elf),
            steering_elf = unset_path("steering_elf", &self.chip.steering_elf),
            eeprom = unset_path("eeprom", &self.chip.eeprom),
            clock = unset_path("clock", &self.chip.clock),
            station_wanted = self.station.wanted,
            station_address = unset("address", self.station.address.as_deref()),
            buttons_chip = unset_path("chip", &self.buttons.chip),
            buttons_reset = line("reset", self.buttons.reset),
            buttons_switch = line("switch", self.buttons.switch),
            debounce = self.buttons.debounce_ms,
            link_lost = match self.comm.link_lost {
                WithoutLink::GoOn => "\"go-on\"",
                WithoutLink::Stand => "\"stand\"",
            },
            station_listen = unset(
                "listen",
                self.station.listen.map(|listen| listen.to_string()).as_deref()
            ),
            station_gag = unset_path("gag", &self.station.gag),
            station_warehouse = unset_path("warehouse", &self.station.warehouse),
            station_queue = unset_path("queue", &self.station.queue),
            state = unset_path("state", &self.state),
            gateway_metrics = unset(
                "metrics",
                self.gateway.metrics.map(|metrics| metrics.to_string()).as_deref()
            ),
            gateway_foxglove = unset(
                "foxglove",
                self.gateway.foxglove.map(|foxglove| foxglove.to_string()).as_deref()
            ),
            station_panel = unset(
                "panel",
                self.station.panel.map(|panel| panel.to_string()).as_deref()
            ),
        )
    }
}

/// The keys of `[arm.limits]`.
fn limits(limits: &JointLimits) -> String {
    [
        ("base", limits.base),
        ("shoulder", limits.shoulder),
        ("elbow", limits.elbow),
        ("wrist", limits.wrist),
        ("rotation", limits.rotation),
        ("gripper", limits.gripper),
    ]
    .map(|(joint, limits)| format!("{joint} = [{}, {}]", limits.lowest, limits.highest))
    .join("\n")
}

/// The keys of a pose.
fn pose(pose: &ArmPose) -> String {
    let ArmPose {
        base,
        shoulder,
        elbow,
        wrist,
    } = pose;
    format!("base = {base}\nshoulder = {shoulder}\nelbow = {elbow}\nwrist = {wrist}")
}

#[cfg(test)]
mod tests {
    use super::super::realtime::CoresSection;
    use super::super::{
        BusSection, ButtonsSection, ChipSection, CommSection, GatewaySection, LogSection,
        RealtimeSection, StationSection,
    };
    use super::*;
    use lager_wire::{ArmLimits, ArmProfile};

    #[test]
    fn the_documented_file_reads_back_with_every_key() {
        let config = Config {
            name: "r7".into(),
            speed: 2.5,
            body: Body::Serial,
            warehouse: "a \"quoted\" name".into(),
            state: Some("/var/lib/lager".into()),
            log: LogSection {
                file: Some("/var/log/lager".into()),
                json: true,
            },
            bus: BusSection {
                folder: Some("/run/warehouse".into()),
                waiting: Waiting::Adaptive,
                longest_spin_us: 700,
            },
            realtime: RealtimeSection {
                priority: 20,
                lock_memory: true,
                cores: CoresSection {
                    bridge: [0, 2].into_iter().collect(),
                    ..CoresSection::default()
                },
            },
            arm: ArmProfile {
                torque_limit: 700,
                limits: JointLimits {
                    elbow: ArmLimits {
                        lowest: 100,
                        highest: 900,
                    },
                    ..JointLimits::default()
                },
                ..ArmProfile::default()
            },
            chip: ChipSection {
                emulator: Some("/opt/emulator".into()),
                sensor_elf: Some("sensor.elf".into()),
                steering_elf: Some("steering.elf".into()),
                eeprom: Some("/var/eeprom".into()),
                clock: Some("/run/clock".into()),
            },
            station: StationSection {
                wanted: false,
                address: Some("192.168.1.5:7420".into()),
                listen: Some("127.0.0.1:7421".parse().expect("an address")),
                gag: Some("/run/gag".into()),
                warehouse: Some("/srv/hall.toml".into()),
                queue: Some("/srv/queue.toml".into()),
                panel: Some("127.0.0.1:7411".parse().expect("an address")),
            },
            comm: CommSection {
                link_lost: WithoutLink::Stand,
            },
            buttons: ButtonsSection {
                chip: Some("/dev/gpiochip4".into()),
                reset: Some(5),
                switch: Some(6),
                debounce_ms: 30,
            },
            gateway: GatewaySection {
                metrics: Some("127.0.0.1:7431".parse().expect("an address")),
                foxglove: Some("127.0.0.1:8766".parse().expect("an address")),
            },
            ..Config::default()
        };
        for config in [config, Config::default()] {
            let text = config.documented();
            let read: Config = toml::from_str(&text).expect("valid TOML");
            let plain = |config: &Config| toml::to_string(config).expect("serialisable");
            assert_eq!(plain(&read), plain(&config));
            for line in plain(&config).lines().filter(|line| !line.is_empty()) {
                let key = line.split(" = ").next().expect("a key");
                assert!(text.contains(key), "{key} is not explained");
            }
        }
    }
}
