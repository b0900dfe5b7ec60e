//! The configuration as a file with every key explained: what `lager config` prints.

use std::path::PathBuf;

use super::{Body, Config, Waiting};
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

[bus]
# Only to keep a bus apart from others on the machine: prefix of its shared-memory files ...
{prefix}
# ... and folder of its bookkeeping files.
{root}
# How bridge and logic wait for samples: \"block\" (sleep), \"spin\" (a core for each) or \"adaptive\"
# (look without pause while samples come fast, sleep when they do not) ...
waiting = {waiting}
# ... and the longest that \"adaptive\" looks without pause for one sample, in microseconds.
longest_spin_us = {longest_spin_us}

[realtime]
# Priority of bridge and logic under SCHED_FIFO, 1 to 99; 0 is the normal scheduler. Above 49 they
# would go before the interrupt threads that bring the boards' bytes on a PREEMPT_RT kernel.
# Needs LimitRTPRIO= in the systemd unit, `ulimit -r`, or CAP_SYS_NICE: `lager doctor` tries it.
priority = {priority}
# Keep all memory of bridge and logic from being paged out (mlockall): 32 MiB each,
# of which 18 MiB would not be in memory otherwise.
# Needs LimitMEMLOCK= in the systemd unit, `ulimit -l`, or CAP_IPC_LOCK: `lager doctor` tries it.
lock_memory = {lock_memory}

[realtime.cores]
# The cores each service may run on, by number from 0; none means any. On the robot's four cores
# bridge = [2] and logic = [3] with isolcpus=2,3 on the kernel's command line keep all else away.
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

[logic]
# Speed in mm/s when both motors run at the standard duty of 100.
cruise_mm_per_s = {cruise:?}
# How far the line sensors are ahead of the wheels' axle, in mm.
sensor_ahead_mm = {ahead:?}

[simulator]
# Seed of all noise: the same seed is the same robot.
seed = {seed}

[chip]
# The emulator's program and the boards' images, built for [serial] baud. Unset, they are looked for
# beside this program and in the source tree.
{emulator}
{sensor_elf}
{steering_elf}
# Folder that keeps both boards' EEPROM, and so their settings; unset, as long as the robot is up.
{eeprom}
# The page in which an emulator at the ports of [serial] publishes the robot's time; body = \"chip\"
# has its own.
{clock}
",
            name = quoted(&self.name),
            speed = self.speed,
            body = match self.body {
                Body::Sim => "\"sim\"",
                Body::Chip => "\"chip\"",
                Body::Serial => "\"serial\"",
            },
            warehouse = quoted(&self.warehouse),
            prefix = unset("prefix", self.bus.prefix.as_deref()),
            root = unset_path("root", &self.bus.root),
            sensor = quoted(&self.serial.sensor.to_string_lossy()),
            steering = quoted(&self.serial.steering.to_string_lossy()),
            baud = self.serial.baud,
            raw_line = self.serial.raw_line,
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
            cruise = self.logic.cruise_mm_per_s,
            ahead = self.logic.sensor_ahead_mm,
            seed = self.simulator.seed,
            emulator = unset_path("emulator", &self.chip.emulator),
            sensor_elf = unset_path("sensor_elf", &self.chip.sensor_elf),
            steering_elf = unset_path("steering_elf", &self.chip.steering_elf),
            eeprom = unset_path("eeprom", &self.chip.eeprom),
            clock = unset_path("clock", &self.chip.clock),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::realtime::CoresSection;
    use super::super::{BusSection, ChipSection, RealtimeSection};
    use super::*;

    #[test]
    fn the_documented_file_reads_back_with_every_key() {
        let config = Config {
            name: "r7".into(),
            speed: 2.5,
            body: Body::Serial,
            warehouse: "a \"quoted\" name".into(),
            bus: BusSection {
                prefix: Some("p_".into()),
                root: Some("/tmp/root".into()),
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
            chip: ChipSection {
                emulator: Some("/opt/emulator".into()),
                sensor_elf: Some("sensor.elf".into()),
                steering_elf: Some("steering.elf".into()),
                eeprom: Some("/var/eeprom".into()),
                clock: Some("/run/clock".into()),
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
