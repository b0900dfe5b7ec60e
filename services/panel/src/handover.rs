//! One person asks the driver of a robot for the wheel, and the driver answers.
//!
//! ```text
//!            asks                     the driver hands over or leaves
//!   nobody ───────> one page asks ──────────────────────────────────────> it has the wheel
//!                      │ the driver keeps the wheel, or says nothing for 20 s
//!                      └──────────────────────────────────────────────────> refused
//! ```
//!
//! One page asks at a time. The station gives the wheel; nothing here drives.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use lager_lines::Name;

/// How long a driver may think.
const PATIENCE: Duration = Duration::from_secs(20);

/// The state of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Request {
    /// The driver has not said anything.
    Waits,
    /// The driver keeps the wheel.
    Kept,
    /// The driver has said nothing for too long.
    Unanswered,
}

#[derive(Debug)]
struct Asked {
    /// The number of the page that asks, and its name.
    page: u32,
    name: String,
    since: Instant,
    is_kept: bool,
}

/// The requests, at most one for each robot.
#[derive(Debug, Default)]
pub(crate) struct Handover(BTreeMap<Name, Asked>);

impl Handover {
    /// A page asks for the wheel of a robot. `Err` is the name of a page that asked before.
    pub(crate) fn ask(
        &mut self,
        robot: &Name,
        page: u32,
        name: &str,
        now: Instant,
    ) -> Result<(), String> {
        match self.0.get(robot) {
            Some(asked) if asked.page != page => return Err(asked.name.clone()),
            _ => {}
        }
        let asked = Asked {
            page,
            name: name.to_owned(),
            since: now,
            is_kept: false,
        };
        self.0.insert(robot.clone(), asked);
        Ok(())
    }

    /// The page that asks and has no answer yet.
    pub(crate) fn who(&self, robot: &Name) -> Option<&str> {
        let asked = self.0.get(robot).filter(|asked| !asked.is_kept)?;
        Some(&asked.name)
    }

    /// The driver keeps the wheel.
    pub(crate) fn keep(&mut self, robot: &Name) {
        if let Some(asked) = self.0.get_mut(robot) {
            asked.is_kept = true;
        }
    }

    /// The state of this page's request.
    pub(crate) fn look(&self, robot: &Name, page: u32, now: Instant) -> Request {
        match self.0.get(robot).filter(|asked| asked.page == page) {
            Some(asked) if asked.is_kept => Request::Kept,
            Some(asked) if now.duration_since(asked.since) < PATIENCE => Request::Waits,
            _ => Request::Unanswered,
        }
    }

    /// The page does not ask any more.
    pub(crate) fn withdraw(&mut self, robot: &Name, page: u32) {
        if self.0.get(robot).is_some_and(|asked| asked.page == page) {
            self.0.remove(robot);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_asks_at_a_time_and_learns_what_the_driver_says() {
        let (robot, now) = (Name::new("r1").unwrap(), Instant::now());
        let mut handover = Handover::default();
        assert_eq!(handover.who(&robot), None);
        handover.ask(&robot, 2, "panel-2", now).unwrap();
        assert_eq!(handover.who(&robot), Some("panel-2"));
        assert_eq!(
            handover.ask(&robot, 3, "panel-3", now),
            Err("panel-2".into())
        );
        assert_eq!(handover.look(&robot, 2, now), Request::Waits);
        handover.keep(&robot);
        assert_eq!(handover.who(&robot), None);
        assert_eq!(handover.look(&robot, 2, now), Request::Kept);
        handover.withdraw(&robot, 3);
        assert_eq!(
            handover.look(&robot, 2, now),
            Request::Kept,
            "it is not page 3's"
        );
        handover.withdraw(&robot, 2);
        handover.ask(&robot, 3, "panel-3", now).unwrap();
        assert_eq!(
            handover.look(&robot, 3, now + PATIENCE),
            Request::Unanswered
        );
    }
}
