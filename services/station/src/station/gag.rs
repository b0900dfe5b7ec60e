//! The GaG that speaks for one of the robots.
//!
//! A GaG may send commands faster than its robot takes them, before the station has asked for them.
//! They wait in the robot's queue of commands ([`Robot::command`]) in their order, and so does a
//! `pickup_done` behind them (C5). The robot takes them first; then the station asks the GaG for
//! the next one.

use std::time::Duration;

use lager_floor::{Grid, Product, SideLength};
use lager_lines::gag::{Answer, Query, Request, Telemetry};
use lager_lines::{Name, Products, Text};
use lager_orders::Reason;
use lager_orders::lease::{LATEST_MOVE, TooLate};
use lager_plant::{Exit, Floor, NamedProduct, Warehouse};
use lager_wire::OperatorCommand;

use super::{Peer, Station};
use crate::robot::{ActRefused, CommandRefused, Robot};
use crate::warehouse;

/// How long a GaG may leave lines unread while its command moves the robot. A GaG that has read
/// everything is asked again after this time. The server looks every 50 ms, so a robot stands
/// within half a second when its GaG has frozen.
const UNREAD: Duration = LATEST_MOVE;
const ASKED_AGAIN: Duration = LATEST_MOVE;

/// What the GaG says.
impl Station {
    pub(super) fn gag_said(&mut self, late: Duration, line: &str) {
        if self.gag.is_none() {
            return;
        }
        let answer = match Answer::read(line) {
            Ok(answer) => answer,
            Err(error) => return self.correct_gag(&error.to_string()),
        };
        if let Err(why) = TooLate::check(late, answer.latest()) {
            return self.correct_gag(&format!("{answer}: {why}"));
        }
        if let Some(why) = self.meant_for_another(&answer) {
            return self.correct_gag(&why);
        }
        if let Some(by) = self.other_driver(&answer) {
            return self.correct_gag(&ActRefused::Driven { by }.to_string());
        }
        let Some(gag) = &mut self.gag else { return };
        let name = gag.robot.clone();
        if let Err(error) = gag.held.answer(&answer) {
            return match self.queue(name, &answer) {
                Some(Ok(())) => {}
                Some(Err(error)) => self.correct_gag(&error.to_string()),
                None => self.correct_gag(&error.to_string()),
            };
        }
        if let Err(error) = self.learn(&answer) {
            return self.correct_gag(&error.to_string());
        }
        if let Some(name) = name
            && let Some(robot) = self.robots.get_mut(&name)
        {
            // The robot does not ask this any more: ignore it.
            let line = robot.given(answer).ok();
            self.say(&name, line);
            self.ask_gag(&name);
        }
    }

    /// Puts a command in the queue that the station has not asked for. `None` if this is not a
    /// command, or if no robot is there.
    fn queue(&mut self, name: Option<Name>, answer: &Answer) -> Option<Result<(), CommandRefused>> {
        let name = name?;
        let robot = self.robots.get_mut(&name)?;
        let taken = match answer {
            Answer::Command(command) => robot.command(*command),
            Answer::PickupDone => robot.picked_up(),
            _ => return None,
        };
        Some(taken.map(|line| self.say(&name, line)))
    }

    /// The person who drives the GaG's robot by actions, if this answer would move the robot.
    fn other_driver(&self, answer: &Answer) -> Option<String> {
        let Answer::Command(command) = answer else {
            return None;
        };
        if *command == OperatorCommand::Stop {
            return None;
        }
        let name = self.gag.as_ref()?.robot.as_ref()?;
        self.robots.get(name)?.driver().map(str::to_owned)
    }

    /// Tells the station whether the GaG has read every line. Call it before each line of the GaG,
    /// and regularly.
    pub fn gag_has_read(&mut self, all: bool) {
        let Some(gag) = &mut self.gag else { return };
        if all {
            gag.unread = None;
            if gag.robot.is_some() && gag.is_told {
                // By now it knows for whom it speaks.
                gag.may_mean = None;
            }
        } else {
            gag.unread.get_or_insert(self.now);
        }
    }

    /// Whether the station needs to know what the GaG has read.
    pub fn watches_gag(&self) -> bool {
        let gag = self.gag.as_ref();
        gag.is_some_and(|gag| gag.may_mean.is_some()) || self.drives_by_gag().is_some()
    }

    /// The robot that moves by a command of the GaG.
    fn drives_by_gag(&self) -> Option<&Name> {
        let name = self.gag.as_ref()?.robot.as_ref()?;
        let robot = self.robots.get(name)?;
        robot.is_commanded().then_some(name)
    }

    /// Makes the robot of a GaG that does not read stand. A GaG that has read everything is asked
    /// again, so that it always has something to read.
    pub(super) fn watch_gag(&mut self) {
        let Some(name) = self.drives_by_gag().cloned() else {
            return;
        };
        let Some(gag) = &mut self.gag else { return };
        let since = |then: Duration| self.now.saturating_sub(then);
        match gag.unread {
            Some(unread) if since(unread) >= UNREAD => {
                gag.unread = None;
                let stands = self.robots.get_mut(&name).and_then(Robot::end_commands);
                self.say(&name, stands);
                let why = format!(
                    "you have read nothing for {} ms, so the robot stands; give the command anew",
                    UNREAD.as_millis()
                );
                self.put(Peer::Gag, &thought(&why));
            }
            None if since(gag.told) >= ASKED_AGAIN => {
                if let Some(query) = gag.held.get() {
                    self.put(Peer::Gag, &Request::Query(query));
                }
            }
            _ => {}
        }
    }

    /// Drops the commands that waited while the station was held up for so long.
    pub(super) fn forget_commands(&mut self, pause: Duration) {
        let waited = |(name, robot): (&Name, &mut Robot)| {
            let has_waited = robot.forget_commands();
            has_waited.then(|| name.clone())
        };
        let waited: Vec<Name> = self.robots.iter_mut().filter_map(waited).collect();
        for name in waited {
            self.tell_gag_of(&name, &TooLate(pause).to_string());
        }
    }

    /// Why an answer moves no robot: the GaG may have meant the robot for which it spoke before.
    fn meant_for_another(&self, answer: &Answer) -> Option<String> {
        let gag = self.gag.as_ref()?;
        let before = gag.may_mean.as_ref()?;
        let moves = answer.latest() < Duration::MAX;
        let now = gag.robot.as_ref();
        let now = now.map_or("for none".to_owned(), |now| format!("for {now}"));
        moves.then(|| {
            format!(
                "{answer} may be meant for {before}; you speak {now} from now on, so give it anew"
            )
        })
    }

    /// The warehouse could not be saved. Tells the GaG that described it.
    pub fn not_saved(&mut self, why: &str) {
        if self.gag.is_some() {
            self.put(Peer::Gag, &thought(why));
        }
    }

    /// Tells a GaG that speaks for this robot why its commands are dropped.
    pub(super) fn tell_gag_of(&mut self, name: &Name, why: &str) {
        let speaks = |gag: &super::Gag| gag.robot.as_ref() == Some(name);
        if self.gag.as_ref().is_some_and(speaks) {
            self.put(Peer::Gag, &thought(why));
        }
    }

    /// Tells the GaG what is wrong, and repeats the open question.
    fn correct_gag(&mut self, why: &str) {
        self.put(Peer::Gag, &thought(why));
        if let Some(gag) = &mut self.gag {
            gag.held.clear();
            if let Some(name) = gag.robot.clone() {
                self.ask_gag(&name);
            }
        }
    }

    /// Uses what the GaG says of the warehouse, once the GaG has said all of it.
    fn learn(&mut self, answer: &Answer) -> Result<(), Reason> {
        let Some(gag) = &mut self.gag else {
            return Ok(());
        };
        match answer {
            Answer::SideLength(side) => gag.side = Some(*side),
            Answer::Map(map) => gag.map = Some(*map),
            Answer::Products(_, products) => gag.products = Some(products.clone()),
            _ => return Ok(()),
        }
        let (Some(side), Some(map), Some(products)) = (gag.side, gag.map, &gag.products) else {
            return Ok(());
        };
        let told = described(self.warehouse.as_ref(), side, map, products);
        let checked = warehouse::told(&told);
        if checked.is_err() {
            gag.products = None;
        }
        checked?;
        if self.warehouse.as_ref() != Some(&told) {
            self.set_warehouse(told)?;
        }
        Ok(())
    }
}

/// For whom the GaG speaks.
impl Station {
    /// Lets the GaG speak for the robot whose turn it is.
    pub(super) fn seat_gag(&mut self) {
        let first = self.first();
        let Some(gag) = &mut self.gag else { return };
        let (link, first) = first.unzip();
        // Another robot may have a plain robot's name by now, but connections are never used twice.
        if gag.link == link && gag.robot == first {
            return;
        }
        gag.link = link;
        let before = core::mem::replace(&mut gag.robot, first.clone());
        if let Some(before) = before {
            gag.may_mean = Some(before.clone());
            gag.is_told = false;
            gag.held.clear();
            self.unseat(&before);
        }
        let Some(name) = first else { return };
        let Some(robot) = self.robots.get_mut(&name) else {
            return;
        };
        let line = robot.set_gag(true);
        let node = robot.node().map(Telemetry::Robot);
        let looks = robot.looks().map(Telemetry::Heading);
        for telemetry in node.into_iter().chain(looks) {
            self.put(Peer::Gag, &Request::Telemetry(telemetry));
        }
        self.say(&name, line);
        self.ask_gag(&name);
    }

    /// The GaG does not speak for this robot any more.
    pub(super) fn unseat(&mut self, name: &Name) {
        if let Some(robot) = self.robots.get_mut(name) {
            let line = robot.set_gag(false);
            self.say(name, line);
        }
    }

    /// Asks the GaG the robot's question, unless the GaG has it already.
    pub(super) fn ask_gag(&mut self, name: &Name) {
        let Some(gag) = &mut self.gag else { return };
        if gag.robot.as_ref() != Some(name) {
            return;
        }
        let asked: Option<Query> = self.robots.get(name).and_then(Robot::held);
        if let Some(query) = asked
            && gag.held.get() != Some(query)
        {
            gag.held.ask(query);
            self.put(Peer::Gag, &Request::Query(query));
        }
    }
}

/// A sentence for a GaG, or for a robot that has announced itself.
pub(super) fn thought(why: &str) -> Request {
    let text = Text::new(why.replace(['\r', '\n'], " "));
    Request::Telemetry(Telemetry::Thought(text.unwrap_or_default()))
}

/// The warehouse of before, changed as a GaG says. Products keep their names.
fn described(
    before: Option<&Warehouse>,
    side: SideLength,
    map: Grid,
    products: &Products,
) -> Warehouse {
    let known = |id: i32| {
        let mut known = before.iter().flat_map(|before| &before.products);
        known.find(|product| product.id == id)
    };
    let product = |product: &Product| NamedProduct {
        id: product.id.get(),
        name: known(product.id.get()).and_then(|known| known.name.clone()),
        square: product.square,
        side: product.side,
    };
    Warehouse {
        size: map.size(),
        side_length_cm: side.cm(),
        delivery: map.delivery(),
        products: products.as_slice().iter().map(product).collect(),
        exit: before.map_or_else(Exit::default, |before| before.exit),
        floor: before.map_or_else(Floor::default, |before| before.floor),
        obstacles: before.map_or_else(Vec::new, |before| before.obstacles.clone()),
    }
}
