//! Why a robot does not answer, as far as that can be found out without its bus.
//!
//! An error of the bus says what failed. This file is asked after such an error, and before a tool
//! waits for a robot that is not there.

use anyhow::{Result, bail};
use lager_ports::{Holder, Shortage};

use crate::config::Config;

/// Refuses to wait for a robot that is not up.
pub fn must_be_up(config: &Config) -> Result<()> {
    let bus = config.bus()?;
    let place = bus.place()?;
    let up = place.up();
    if up.contains_key(&bus.robot) {
        return Ok(());
    }
    let others: Vec<&str> = up.keys().map(|robot| robot.as_str()).collect();
    let others = match others.as_slice() {
        [] => match lager_ports::other_places().first() {
            Some(other) => other.to_string(),
            None => "no other robot is up either".to_owned(),
        },
        others => format!("up are: {} (--name chooses one)", others.join(", ")),
    };
    bail!(
        "no robot `{}` is up on the bus in {}; `lager up` starts one; {others}",
        bus.robot,
        place.folder().display()
    );
}

/// What keeps the robot from answering, a sentence for each cause that is found.
pub fn causes(config: &Config) -> Vec<String> {
    let mut causes = Vec::new();
    if let Some(shortage) = Shortage::now() {
        causes.push(shortage.to_string());
    }
    let Ok(bus) = config.bus() else {
        return causes;
    };
    let Ok(place) = bus.place() else {
        // That error already names folder and cause.
        return causes;
    };
    let holders = place.up().remove(&bus.robot).unwrap_or_default();
    for Holder { what, pid, .. } in holders.iter().filter(|holder| holder.frozen) {
        causes.push(format!(
            "the {what} of the robot `{}` (process {pid}) is frozen; `kill -CONT {pid}` lets it go on",
            bus.robot
        ));
    }
    causes
}
