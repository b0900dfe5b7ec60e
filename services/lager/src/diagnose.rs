//! Finds out why a robot does not answer, without using its bus.
//!
//! An error of the bus says only what failed. The program calls this after such an error, and
//! before a tool waits for a robot that is not up.

use std::path::PathBuf;

use anyhow::{Result, bail};
use lager_home::{Holder, OtherHome, Shortage};
use lager_topics::{LAGER, called};

use crate::config::Config;

/// Refuses to wait for a robot that is not up.
pub fn must_be_up(config: &Config) -> Result<()> {
    let bus = config.bus()?;
    let place = bus.home()?;
    let up = place.up();
    if up.contains_key(&bus.unit) {
        return Ok(());
    }
    let others: Vec<&str> = up.keys().map(|robot| robot.as_str()).collect();
    let others = match others.as_slice() {
        [] => others_folder().unwrap_or_else(|| "no other robot is up either".to_owned()),
        others => format!("up are: {} (--name chooses one)", others.join(", ")),
    };
    bail!(
        "no robot `{}` is up on the bus in {}; `lager up` starts one; {others}",
        bus.unit,
        place.folder().display()
    );
}

/// Where the robots of another user may be.
pub fn others_folder() -> Option<String> {
    let OtherHome { folder, uid, name } =
        lager_home::other_homes(LAGER.family).into_iter().next()?;
    let folder = folder.display();
    Some(format!(
        "{folder} belongs to UID {uid} ({name}); use `sudo -u {name} lager ...` there"
    ))
}

/// The damaged segments of the bus, if there are any.
fn damage(mut segments: Vec<PathBuf>) -> Option<String> {
    segments.sort();
    let first = segments.first()?.display();
    let more = match segments.len() - 1 {
        0 => String::new(),
        more => format!(", and so are {more} more of the bus"),
    };
    Some(format!(
        "{first} is damaged (emptied, or another user's){more}; `lager doctor --fix` removes what \
         nobody uses, and `lager doctor` says who uses the rest"
    ))
}

/// What keeps the robot from answering: a sentence for each cause that it finds.
pub fn causes(config: &Config) -> Vec<String> {
    let mut causes = Vec::new();
    if let Some(shortage) = Shortage::now() {
        causes.push(match shortage {
            Shortage::Memory { .. } => {
                format!("{shortage}; `lager doctor --fix` removes what dead processes left there")
            }
            _ => shortage.to_string(),
        });
    }
    let Ok(bus) = config.bus() else {
        return causes;
    };
    let Ok(place) = bus.home() else {
        // That error already names the folder and the cause.
        return causes;
    };
    causes.extend(damage(lager_home::damaged(&place)));
    let holders = place.up().remove(&bus.unit).unwrap_or_default();
    for Holder { what, pid, .. } in holders.iter().filter(|holder| holder.frozen) {
        causes.push(format!(
            "the {} of the robot `{}` (process {pid}) is frozen; `kill -CONT {pid}` lets it go on",
            called(what),
            bus.unit
        ));
    }
    causes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_segments_are_told_by_name() {
        let named = |names: &[&str]| damage(names.iter().map(PathBuf::from).collect());
        assert_eq!(named(&[]), None);
        let one = named(&["/dev/shm/lager_1_2.global_mgmt"]).expect("a cause");
        assert!(one.starts_with("/dev/shm/lager_1_2.global_mgmt is damaged"));
        assert!(!one.contains("more"), "{one}");
        let three = named(&["/dev/shm/c", "/dev/shm/a", "/dev/shm/b"]).expect("a cause");
        assert!(three.starts_with("/dev/shm/a is damaged"), "{three}");
        assert!(three.contains("2 more"), "{three}");
    }
}
