//! Asks the boards themselves when no robot is up: which program they run, what their sensors read,
//! and what they cannot hear.
//!
//! It opens the ports as the bridge does and takes the robot's name meanwhile, so no robot starts
//! beside it. It gives no command, so nothing moves. It only asks the sensor board for its raw
//! readings, and tells the steering board how the arm is described, because it then asks those servos.
//! A board forgets both at its next start. `--fix` restarts a board that answers and does not work.

use std::path::{Path, PathBuf};
use std::time::Duration;

use lager_bridge::serial::OpenPortError;
use lager_bridge::serial::find::NotFound;
use lager_loader::{Found, Runs, UpdateError};
use lager_topics::Misfit;
use lager_wake::Shutdown;
use lager_wire::{
    ArmData, ArmProfile, BoardStatus, Callsign, Centimetres, LineBits, Payload, Profile,
    ResetCause, Setting, SettingKey, SettingStatus, SteerData, SteerFlags, Version,
};

use super::{Bad, Check, Finding, Good, Hint};
use crate::board::{self, BoardLine};
use crate::config::{Body, Config};
use crate::exit::InUse;

/// How long it listens to a board. Each sends its counters twice a second.
const LISTENS: Duration = Duration::from_millis(2_500);

/// How long it waits for a board that was just switched on, and waits in its bootloader for a moment.
const STARTS: Duration = Duration::from_secs(5);

/// What a board has said.
#[derive(Debug, Default)]
struct Heard {
    bits: Option<LineBits>,
    distance: Option<Centimetres>,
    steer: Option<SteerData>,
    /// The servos that have answered, one bit each.
    servos: u8,
    /// Whether the board knows how the arm is described.
    knows_arm: bool,
    /// The first and the last of its counters.
    status: Option<(BoardStatus, BoardStatus)>,
}

/// The findings about both boards of a real robot. `fix` restarts a board that needs it.
pub fn findings(config: &Config, fix: bool) -> Vec<Check> {
    if config.body != Body::Serial {
        return Vec::new();
    }
    let _robot = match board::take_robot(config) {
        Ok(robot) => robot,
        Err(error) if error.is::<InUse>() => {
            return vec![(
                "boards",
                Good("the robot is up and has them; `lager top` shows how they are".into()),
            )];
        }
        Err(error) => return vec![("boards", Hint(format!("cannot be asked: {error:#}")))],
    };
    let mut seen = Vec::new();
    let mut checks = Vec::new();
    let ports = match config.serial.named() {
        // Another check says what is wrong with a port that does not exist.
        Some(ports) => ports.into_iter().filter(|port| port.exists()).collect(),
        None => found(config, &mut checks),
    };
    for port in &ports {
        match ask(config, port, fix) {
            Ok((found, _, _)) if seen.contains(&found.role) => checks.push((
                check(found.role),
                Bad(format!(
                    "the board at {} is a {} board, too; give each board the image of its own with `lager board flash`",
                    port.display(),
                    found.role
                )),
            )),
            Ok((found, heard, was_restarted)) => {
                seen.push(found.role);
                let told = judged(&found, &heard, port, &config.arm);
                checks.push((check(found.role), told.after(was_restarted)));
            }
            Err(error) => {
                let said = format!("{}: {error:#}", port.display());
                // A robot of another user may have it.
                let is_busy = matches!(error.downcast_ref(), Some(OpenPortError::Busy { .. }));
                checks.push(("boards", if is_busy { Hint(said) } else { Bad(said) }));
            }
        }
    }
    checks
}

/// The ports of the boards, where the configuration names none. Says why a board was not found.
fn found(config: &Config, checks: &mut Vec<Check>) -> Vec<PathBuf> {
    let found = match board::find(config, None, &Shutdown::new()) {
        Ok(found) => found,
        Err(error) => {
            checks.push(("boards", Bad(format!("{error:#}"))));
            return Vec::new();
        }
    };
    let [first, second] = &found;
    if first.is_err() && first == second {
        // Another check says that there is no device.
        return Vec::new();
    }
    let roles = [Callsign::Sensor, Callsign::Steering];
    let found = roles.into_iter().zip(found);
    let port = |(role, found): (_, Result<PathBuf, NotFound>)| {
        found
            .map_err(|error| checks.push((check(role), Bad(error.to_string()))))
            .ok()
    };
    found.filter_map(port).collect()
}

/// The subject of a board's finding.
fn check(board: Callsign) -> &'static str {
    match board {
        Callsign::Steering => "steering board",
        _ => "sensor board",
    }
}

/// Asks a board. Returns whether it was restarted before it said this, too.
fn ask(config: &Config, port: &Path, fix: bool) -> anyhow::Result<(Found, Heard, bool)> {
    // Whoever ends the doctor ends this process.
    let mut line = board::open(config, port, None, &Shutdown::new())?;
    let mut found = lager_loader::find(&mut line)?;
    if let Runs::Loader(Some(_)) = found.runs
        && let Some(up) = lager_loader::ask(&mut line, STARTS)?
    {
        found.runs = Runs::Application(up);
    }
    let heard = listen(&mut line, &found, &config.arm)?;
    if !fix || !needs_restart(&found, &heard) {
        return Ok((found, heard, false));
    }
    // Its motors are off from then on, and no robot is up.
    found.runs = Runs::Application(lager_loader::restart(&mut line, found.role)?);
    let heard = listen(&mut line, &found, &config.arm)?;
    Ok((found, heard, true))
}

/// Whether a board answers but does not do its work, which a restart may mend.
fn needs_restart(found: &Found, heard: &Heard) -> bool {
    match found.runs {
        Runs::Loader(image) => image.is_some(),
        Runs::Application(up) if up.version == Version::Original => false,
        Runs::Application(_) if heard.status.is_none() => true,
        Runs::Application(_) => match found.role {
            Callsign::Steering => heard.steer.is_none() || !heard.knows_arm,
            _ => heard.bits.is_none(),
        },
    }
}

/// What to do with a board that needs a restart.
fn restarts(who: Callsign) -> String {
    format!("`lager doctor --fix` or `lager board reset {who}` restarts it")
}

fn listen(line: &mut BoardLine, found: &Found, arm: &ArmProfile) -> Result<Heard, UpdateError> {
    match found.runs {
        Runs::Application(up) if up.version == Version::One => {}
        Runs::Application(_) | Runs::Loader(_) => return Ok(Heard::default()),
    }
    let raw_line = |value| Setting {
        key: SettingKey::RawLine,
        seq: 0,
        value,
    };
    let told: Vec<Setting> = match found.role {
        Callsign::Sensor => vec![raw_line(1)],
        _ => arm.settings().collect(),
    };
    let mut heard = Heard::default();
    lager_loader::listen(line, LISTENS, &told, |payload| heard.take(payload))?;
    if found.role == Callsign::Sensor {
        // The bridge asks for them by itself, if somebody wants them.
        lager_loader::listen(line, LISTENS / 10, &[raw_line(0)], |payload| {
            heard.take(payload);
        })?;
    }
    Ok(heard)
}

impl Heard {
    fn take(&mut self, payload: Payload) {
        match payload {
            Payload::RawLine(bits) => self.bits = Some(bits),
            Payload::Distance(distance) => self.distance = Some(distance),
            Payload::SteerData(data) => self.steer = Some(data),
            Payload::ArmData(data) => self.servos |= 1 << (data.servo - 1),
            Payload::SettingReply(reply) if reply.key == ArmProfile::CHECK => {
                self.knows_arm = reply.status == SettingStatus::Accepted;
                // Until then it has asked the servos that it knew before.
                self.servos = 0;
            }
            Payload::BoardStatus(status) => {
                let first = self.status.map_or(status, |(first, _)| first);
                self.status = Some((first, status));
            }
            _ => {}
        }
    }
}

/// What a board's words mean.
fn judged(found: &Found, heard: &Heard, port: &Path, arm: &ArmProfile) -> Finding {
    let (who, port) = (found.role, port.display());
    let up = match found.runs {
        Runs::Loader(None) => {
            return Bad(format!(
                "it waits in its bootloader without a whole image; `lager board update` gives it one (it is at {port})"
            ));
        }
        Runs::Loader(Some(build)) => {
            return Hint(format!(
                "it waits in its bootloader with build {build}; {} (it is at {port})",
                restarts(who)
            ));
        }
        Runs::Application(up) if up.version == Version::Original => {
            return Good(format!(
                "an original board is at {port}, which tells no more"
            ));
        }
        Runs::Application(up) => up,
    };
    let is = format!("build {} at {port}", up.build);
    let mut faults = Vec::new();
    if let Some(misfit) = Misfit::of(up.version as u8, up.build) {
        faults.push(misfit.to_string());
    }
    if let Some(why) = restarted(up.reset) {
        faults.push(why);
    }
    let Some((first, last)) = heard.status else {
        faults.push(format!("it answers, but sends nothing; {}", restarts(who)));
        return Bad(format!("{is}; {}", faults.join("; ")));
    };
    let told = match found.role {
        Callsign::Steering => steering(heard, (first, last), arm, &mut faults),
        _ => sensor(heard, &mut faults),
    };
    match faults.is_empty() {
        true => Good(format!("{is}; {told}")),
        false => Hint(format!("{is}; {}; {told}", faults.join("; "))),
    }
}

/// Why a board has started, if that is a fault.
fn restarted(why: ResetCause) -> Option<String> {
    let advice = match why {
        ResetCause::BrownOut => "its supply fell too low; look at battery and plugs",
        ResetCause::Watchdog | ResetCause::Panic => {
            "its program had stopped; save this for whoever keeps the robot"
        }
        _ => return None,
    };
    Some(format!("it has restarted by itself ({why:?}): {advice}"))
}

fn sensor(heard: &Heard, faults: &mut Vec<String>) -> String {
    let Some(bits) = heard.bits else {
        faults.push(format!(
            "no reading of the line sensors came; {}",
            restarts(Callsign::Sensor)
        ));
        return "the line is not known".into();
    };
    let line: String = (0..LineBits::SENSORS)
        .map(|index| if bits.sensor(index) { '#' } else { '.' })
        .collect();
    if line.bytes().all(|byte| byte == b'#') {
        faults.push(
            "all line sensors see tape; put the robot on its floor, and calibrate them with `lager calibrate` if it stays so".into(),
        );
    }
    let distance = heard
        .distance
        .map_or("not known".into(), |distance| format!("{} cm", distance.0));
    format!("tape under {line} (left to right), distance {distance}")
}

fn steering(
    heard: &Heard,
    (first, last): (BoardStatus, BoardStatus),
    arm: &ArmProfile,
    faults: &mut Vec<String>,
) -> String {
    let Some(data) = heard.steer else {
        faults.push(format!("no report came; {}", restarts(Callsign::Steering)));
        return "its state is not known".into();
    };
    if !data.flags.contains(SteerFlags::EXDE_OK) {
        faults.push(
            "it hears nothing from the sensor board; look at the three wires between the boards, and whether the sensor board is on".into(),
        );
    } else if last.exde_errors != first.exde_errors {
        faults.push(
            "it refuses words of the sensor board again and again; look at the three wires between the boards".into(),
        );
    }
    if !heard.knows_arm {
        faults.push(format!(
            "it has not taken [arm], so nobody knows its servos; {}",
            restarts(Callsign::Steering)
        ));
    }
    let servos: Vec<(usize, String)> = (0..usize::from(ArmData::SERVOS))
        .filter_map(|index| {
            let id = arm.servo_id(index)?;
            Some((index, format!("{id} ({})", ArmProfile::joint_name(index))))
        })
        .collect();
    let those = |wanted: &dyn Fn(usize) -> bool| {
        let those = servos.iter().filter(|(index, _)| wanted(*index));
        let those: Vec<&str> = those.map(|(_, name)| name.as_str()).collect();
        (!those.is_empty()).then(|| those.join(", "))
    };
    let answers = |index: usize| heard.servos >> index & 1 != 0;
    if heard.knows_arm
        && let Some(silent) = those(&|index| !answers(index))
    {
        faults.push(format!(
            "servos {silent} do not answer; look at their supply, their plugs and their ids ([arm.servos])"
        ));
    }
    if let Some(troubled) = those(&|index| answers(index) && data.servo_errors >> index & 1 != 0) {
        faults.push(format!(
            "servos {troubled} report an error; switch the arm off and on, and let it cool down"
        ));
    }
    let battery = match data.battery_decivolts {
        0 => "the battery is not measured".to_owned(),
        decivolts => format!("battery {:.1} V", f64::from(decivolts) / 10.0),
    };
    format!(
        "{battery}, {} of {} servos answer, ExDe errors {}",
        heard.servos.count_ones(),
        servos.len(),
        last.exde_errors
    )
}
