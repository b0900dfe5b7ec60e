//! `robot.toml`: how one robot is built, in a file of its own that goes to another machine with the
//! robot.
//!
//! ```text
//!   robot = FILE of the configuration, else of real boards robot.toml in the robot's state folder
//!     [wheels] [line] [distance] [battery] [arm] [logic] [buttons]   as in the configuration
//! ```
//!
//! It stands apart from the configuration because that is of a machine: ports, addresses, rights.
//! Real boards without such a file stand until there is one, because nobody knows which way they
//! would drive; it may be empty.
//!
//! A section may stand in one of the two files. If both say something else, nobody knows which one
//! is right, and the robot does not start.
//!
//! Services do not read it: they get the configuration of the `up` that started them, with the
//! description in it.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use lager_commission::Built;
use lager_station::files;
use lager_supervisor::state_folder::StateFolder;
use lager_wire::{ArmProfile, IrModel, LineProfile, RangerProfile, RobotProfile, WheelsProfile};
use serde::{Deserialize, Serialize};

use super::invalid;
use super::{BatterySection, Body, ButtonsSection, Config, LogicSection};

/// The sections of the file; those that it leaves out are as the configuration has them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RobotFile {
    wheels: Option<WheelsProfile>,
    line: Option<LineProfile>,
    distance: Option<RangerProfile>,
    battery: Option<BatterySection>,
    arm: Option<ArmProfile>,
    logic: Option<LogicSection>,
    buttons: Option<ButtonsSection>,
}

/// The names of these sections, in the order of printing.
const SECTIONS: [&str; 7] = [
    "wheels", "line", "distance", "battery", "arm", "logic", "buttons",
];

impl Config {
    /// Whether somebody has said how this robot is built. A simulated one is built as it is.
    pub fn is_described(&self) -> bool {
        self.robot.is_some() || self.body != Body::Serial
    }

    /// Takes over the description of the robot from its file, if there is one.
    ///
    /// # Errors
    /// The file cannot be read or is not valid, or it contradicts the configuration.
    pub fn describe(&mut self) -> Result<()> {
        let Some(path) = self.robot_file()? else {
            return Ok(());
        };
        let read = || format!("cannot read the robot's description {}", path.display());
        let text = files::read(&path).with_context(read)?;
        let file: RobotFile = toml::from_str(&text).map_err(|error| {
            anyhow!(
                "the robot's description {} is not valid: {}. `lager config --robot` prints one with every key",
                path.display(),
                invalid::why(&text, &error)
            )
        })?;
        self.take(file, &path)?;
        self.validate()
            .with_context(|| format!("the robot's description {}", path.display()))?;
        self.robot = Some(path);
        Ok(())
    }

    /// Takes the file's sections over.
    fn take(&mut self, file: RobotFile, path: &Path) -> Result<()> {
        take(&mut self.wheels, file.wheels, "wheels", path)?;
        take(&mut self.line, file.line, "line", path)?;
        take(&mut self.distance, file.distance, "distance", path)?;
        take(&mut self.battery, file.battery, "battery", path)?;
        take(&mut self.arm, file.arm, "arm", path)?;
        take(&mut self.logic, file.logic, "logic", path)?;
        take(&mut self.buttons, file.buttons, "buttons", path)
    }

    /// How this robot is built, as far as commissioning finds it out.
    pub fn commissioned(&self) -> Built {
        Built {
            robot: self.robot(),
            cruise_mm_per_s: self.logic.cruise_mm_per_s,
            reach_shoulder: self.logic.reach_shoulder,
            reach_elbow: self.logic.reach_elbow,
            buttons: self.buttons.commissioned(),
        }
    }

    /// Takes over what commissioning has found out.
    pub fn take_commissioned(&mut self, built: &Built) {
        let RobotProfile {
            steering,
            sensors,
            arm,
        } = built.robot;
        self.wheels = steering.wheels;
        self.battery.divider = Some(steering.divider);
        self.line = sensors.line;
        self.distance = sensors.ranger;
        self.arm = arm;
        self.logic.cruise_mm_per_s = built.cruise_mm_per_s;
        self.logic.reach_shoulder = built.reach_shoulder;
        self.logic.reach_elbow = built.reach_elbow;
        self.buttons.take_commissioned(&built.buttons);
    }

    /// Writes how this robot is built into its file, whose earlier text
    /// [`Config::forget_description`] brings back. `configured` is what the configuration says
    /// without that file; `has_calibrated`, whether the line sensors have other thresholds than
    /// before. Returns the file.
    ///
    /// # Errors
    /// The configuration would contradict the file, or the disk refuses it; then the old text stays.
    pub fn keep_description(&self, configured: &Self, has_calibrated: bool) -> Result<PathBuf> {
        self.validate()?;
        let path = self.place_of_description()?;
        let text = self.described();
        let file = toml::from_str(&text).context("this is a fault of the program")?;
        configured.clone().take(file, &path)?;
        let write = || format!("cannot write the robot's description {}", path.display());
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).with_context(write)?;
        }
        let before = match path.exists() {
            true => files::read(&path).with_context(write)?,
            false => String::new(),
        };
        let (_, before) = uncalibrated(&before);
        let mark = if has_calibrated { CALIBRATED } else { "" };
        let before = format!("{mark}{before}");
        files::replace(&before_of(&path), &before).with_context(write)?;
        files::replace(&path, &text).with_context(write)?;
        Ok(path)
    }

    /// Puts back the description before the last [`Config::keep_description`]. Doing it twice
    /// changes nothing. Returns the file, and whether the line sensors' thresholds are to come back,
    /// too ([`Config::forget_calibration`]).
    ///
    /// # Errors
    /// No description was kept before, or the disk refuses it.
    pub fn forget_description(&self) -> Result<(PathBuf, bool)> {
        let path = self.place_of_description()?;
        let kept = before_of(&path);
        if !kept.exists() {
            bail!(
                "{} was not written by `lager commission`, so there is nothing to go back to",
                path.display()
            );
        }
        let write = || format!("cannot go back to {}", kept.display());
        let before = files::read(&kept).with_context(write)?;
        let (has_calibrated, before) = uncalibrated(&before);
        match before.is_empty() {
            true if !path.exists() => {}
            true => fs::remove_file(&path).with_context(write)?,
            false => files::replace(&path, before).with_context(write)?,
        }
        Ok((path, has_calibrated))
    }

    /// Whether there is a description to which [`Config::forget_description`] goes back.
    ///
    /// # Errors
    /// The robot has no place for a description.
    pub fn has_former_description(&self) -> Result<bool> {
        Ok(before_of(&self.place_of_description()?).exists())
    }

    /// The line sensors have the thresholds again from before the last [`Config::keep_description`].
    ///
    /// # Errors
    /// The disk refuses to note that.
    pub fn forget_calibration(&self) -> Result<()> {
        let kept = before_of(&self.place_of_description()?);
        let write = || format!("cannot write {}", kept.display());
        let before = files::read(&kept).with_context(write)?;
        files::replace(&kept, uncalibrated(&before).1).with_context(write)
    }

    /// The same without what the robot's file says. Of a section that stands in both files nobody
    /// knows this any more, and it counts as the file's.
    ///
    /// # Errors
    /// The file cannot be read any more.
    pub fn undescribed(&self) -> Result<Self> {
        let mut bare = self.clone();
        let Some(path) = self.robot_file()?.filter(|path| path.exists()) else {
            return Ok(bare);
        };
        let read = || format!("cannot read the robot's description {}", path.display());
        let text = files::read(&path).with_context(read)?;
        let file: RobotFile = toml::from_str(&text).with_context(read)?;
        let usual = Self::default();
        macro_rules! leave {
            ($($section:ident),*) => { $(
                if file.$section.is_some() {
                    bare.$section = usual.$section;
                }
            )* };
        }
        leave!(wheels, line, distance, battery, arm, logic, buttons);
        Ok(bare)
    }

    /// The same with the description as it is saved now. `undescribed` is the configuration from
    /// before one was read.
    ///
    /// # Errors
    /// The file cannot be read, or describes no robot.
    pub fn described_anew(&self, undescribed: &Self) -> Result<Self> {
        let mut described = Self {
            robot: self.robot.clone(),
            ..undescribed.clone()
        };
        described.describe()?;
        let mut anew = self.clone();
        macro_rules! put {
            ($($section:ident),*) => { $(anew.$section = described.$section;)* };
        }
        put!(wheels, line, distance, battery, arm, logic, buttons);
        anew.robot = described.robot;
        anew.validate()?;
        Ok(anew)
    }

    /// Where the description of this robot is, or would be.
    pub fn place_of_description(&self) -> Result<PathBuf> {
        match (&self.robot, self.body) {
            (Some(named), _) => Ok(named.clone()),
            (None, Body::Serial) => {
                Ok(StateFolder::of_robot(&self.state_root()?, &self.name).robot())
            }
            (None, Body::Sim | Body::Chip) => bail!(
                "a robot without boards has no description of its own; name a file for it (robot = \"FILE\" in the configuration)"
            ),
        }
    }

    /// The file that describes this robot, if there is one.
    ///
    /// # Errors
    /// Nothing says where the state folder is.
    pub fn robot_file(&self) -> Result<Option<PathBuf>> {
        if let Some(named) = &self.robot {
            return Ok(Some(named.clone()));
        }
        // A simulated robot is not the real one of this name.
        if self.body != Body::Serial {
            return Ok(None);
        }
        let kept = self.place_of_description()?;
        Ok(kept.exists().then_some(kept))
    }

    /// The description alone, as a file for another machine.
    pub fn described(&self) -> String {
        let documented = self.documented();
        let mut text = String::new();
        for block in documented.split("\n\n") {
            let head = block.lines().find_map(|line| line.strip_prefix('['));
            let name = head.and_then(|head| head.split([']', '.']).next());
            if name.is_some_and(|name| SECTIONS.contains(&name)) {
                // Writing to a String cannot fail.
                let _ = writeln!(text, "{}\n", block.trim());
            }
        }
        text
    }

    /// How this robot differs from the simulated one, in a few words.
    pub fn built(&self) -> String {
        let (usual, usual_arm) = (WheelsProfile::default(), ArmProfile::default());
        let (wheels, ranger) = (&self.wheels, &self.distance);
        let model = match ranger.model {
            IrModel::Own => Some("an IR ranger with a curve of its own".to_owned()),
            model if model == RangerProfile::default().model => None,
            model => Some(format!("IR ranger {}", format!("{model:?}").to_uppercase())),
        };
        let when = |holds: bool, words: &str| holds.then(|| words.to_owned());
        let duty = format!("duty {}", wheels.duty);
        let turn = format!("a full turn in {} ms", wheels.full_turn_ms);
        let differs = [
            when(wheels.swapped, "motors swapped"),
            when(wheels.left_reversed, "left motor reversed"),
            when(wheels.right_reversed, "right motor reversed"),
            when(wheels.duty != usual.duty, &duty),
            when(wheels.full_turn_ms != usual.full_turn_ms, &turn),
            when(
                !self.line.dark_is_high,
                "line sensors that read low over tape",
            ),
            model,
            when(!self.robot().steering.divider, "no battery divider"),
            when(self.arm.servos != usual_arm.servos, "servos with other ids"),
            when(self.arm.reversed != usual_arm.reversed, "reversed joints"),
            when(
                ArmProfile {
                    servos: usual_arm.servos,
                    reversed: usual_arm.reversed,
                    ..self.arm
                } != usual_arm,
                "an arm of its own",
            ),
        ];
        let differs: Vec<_> = differs.into_iter().flatten().collect();
        match differs.is_empty() {
            true => "as the simulated robot".to_owned(),
            false => differs.join(", "),
        }
    }
}

/// The first line of a former description after which the line sensors were calibrated.
const CALIBRATED: &str = "# After this the line sensors were calibrated.\n";

/// Whether they were, and the description.
fn uncalibrated(before: &str) -> (bool, &str) {
    match before.strip_prefix(CALIBRATED) {
        Some(rest) => (true, rest),
        None => (false, before),
    }
}

/// Where the text stands that a description had before it was written.
fn before_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".before");
    name.into()
}

/// Takes a section over, unless the configuration says something else.
fn take<T: Clone + Default + PartialEq>(
    here: &mut T,
    there: Option<T>,
    name: &str,
    path: &Path,
) -> Result<()> {
    let Some(there) = there else {
        return Ok(());
    };
    if *here != T::default() && *here != there {
        bail!(
            "[{name}] stands in the configuration and, with other values, in the robot's description {}; take it out of one of them",
            path.display()
        );
    }
    *here = there;
    Ok(())
}

#[cfg(test)]
mod tests;
