//! The commands that do what a person's hands would do: `place` and `obstacle`. They ask a
//! simulated world to do it; on a real floor a person has done it.

use std::fmt::Write;

use anyhow::{Result, bail};
use lager_topics::{
    Heading, Input, InputKind, Mode, NavStatus, Outcome, Phase, TruthPose, WorldAsk, WorldAskKind,
    WorldRefusal, WorldRequest,
};
use lager_wire::{Command, WheelCommand};

use super::{Operator, first};

impl Operator {
    /// `lager place`: puts a simulated robot on a node, the delivery node if none is named, and
    /// tells logic. A real one has been put there by a person, who names the node.
    pub fn place(&mut self, place: Option<Place>) -> Result<String> {
        let mut status = self.bus.subscriber::<NavStatus>()?;
        let logic = first(&mut status, &self.bus, &self.patience)?;
        let health = self.health()?;
        let drives = |code| {
            let standby = Command::Wheel(WheelCommand::Standby);
            Command::from_code(code).is_some_and(|command| command != standby)
        };
        let logic_drives = health.mode.get() == Some(Mode::Autonomous) && health.stopped == 0;
        if drives(health.current_code) || (logic_drives && drives(logic.code)) {
            bail!("the robot is moving; `lager mode manual` or `lager stop` first");
        }
        let simulated = self.running.body.service().is_some();
        if place.is_none() && !simulated {
            bail!(
                "put the robot on a crossing and name it, as in `lager place 2,1,up`; `lager reset` says that it stands on the delivery node"
            );
        }
        let warehouse = self.running.warehouse()?;
        let on = place.unwrap_or(Place {
            x: warehouse.delivery[0],
            y: warehouse.delivery[1],
            heading: match warehouse.starts_towards_plus_x() {
                true => Heading::Right,
                false => Heading::Left,
            },
        });
        if simulated {
            let [columns, rows] = warehouse.size;
            let there_is_none =
                || format!("there is no crossing {on}: they go from 0,0 to {columns},{rows}");
            self.world(on.ask(WorldAskKind::Place), there_is_none)?;
        }
        self.press_until(on.input(), &mut status, |status| {
            Ok(status.phase == Phase::WaitingForOrder
                && (status.x, status.y) == (on.x.into(), on.y.into())
                && status.heading == on.heading)
        })?;
        Ok(format!("the robot stands on crossing {on}"))
    }

    /// `lager obstacle put|take`.
    pub fn obstacle(&self, obstacle: Obstacle) -> Result<String> {
        self.must_be_simulated()?;
        let (kind, way, said) = match obstacle {
            Obstacle::Put(way) => (WorldAskKind::Put, way, "stands on"),
            Obstacle::Take(way) => (WorldAskKind::Take, way, "is gone from"),
        };
        let way_of =
            format!("the way from ({}, {}) {:?}", way.x, way.y, way.heading).to_lowercase();
        let [columns, rows] = self.running.warehouse()?.size;
        self.world(way.ask(kind), || {
            format!("there is no {way_of}: crossings go from 0,0 to {columns},{rows}")
        })?;
        Ok(format!("a thing {said} {way_of}"))
    }

    /// `lager obstacle`: what stands on the ways.
    pub fn obstacles(&self) -> Result<String> {
        self.must_be_simulated()?;
        let mut truth = self.bus.subscriber::<TruthPose>()?;
        let world = first(&mut truth, &self.bus, &self.patience)?;
        let mut told = String::new();
        for stands in world.obstacles() {
            let heading = match stands.heading.get() {
                Some(heading) => format!("{heading:?}").to_lowercase(),
                None => "somewhere".into(),
            };
            let leaves = match stands.by_chance {
                0 => "",
                _ => ", goes by itself",
            };
            writeln!(told, "{},{},{heading}{leaves}", stands.x, stands.y)?;
        }
        Ok(match told.trim_end() {
            "" => "nothing stands on the ways".into(),
            listed => listed.into(),
        })
    }

    fn must_be_simulated(&self) -> Result<()> {
        if self.running.body.service().is_none() {
            bail!("only a simulated floor can be asked for that; put it on the real one yourself");
        }
        Ok(())
    }

    /// Asks the simulated world. `nowhere` says that there is no such place.
    fn world(&self, ask: WorldAsk, nowhere: impl FnOnce() -> String) -> Result<()> {
        let hands = self.bus.client::<WorldRequest>()?;
        let answer = hands.call(ask, self.patience.left())?;
        match (answer.outcome.get(), answer.refusal.get()) {
            (Some(Outcome::Done), _) => Ok(()),
            (_, Some(WorldRefusal::NoPlace)) => bail!(nowhere()),
            (_, Some(refusal)) if refusal != WorldRefusal::None => bail!("{refusal}"),
            _ => bail!("the simulated world does not answer in time; is it very slow?"),
        }
    }
}

/// What is done to a way of the simulated floor.
#[derive(Clone, Copy, Debug)]
pub enum Obstacle {
    /// A thing is put on it.
    Put(Place),
    /// The thing on it is taken away.
    Take(Place),
}

/// A crossing and a direction: where a robot is put down, or which of the ways is meant.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Column of the crossing.
    pub x: u8,
    /// Row of the crossing.
    pub y: u8,
    /// Where it looks, or leads.
    pub heading: Heading,
}

impl Place {
    fn ask(self, kind: WorldAskKind) -> WorldAsk {
        WorldAsk {
            kind: kind.into(),
            x: self.x,
            y: self.y,
            heading: self.heading.into(),
            ..WorldAsk::default()
        }
    }

    fn input(self) -> Input {
        Input {
            kind: InputKind::Placed.into(),
            x: self.x,
            y: self.y,
            heading: self.heading.into(),
            ..Input::default()
        }
    }
}

impl std::str::FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("`{text}` is no place; write X,Y and up, down, left or right, as in 2,1,up");
        let mut parts = text.split(',').map(str::trim);
        let (Some(x), Some(y), Some(heading), None) =
            (parts.next(), parts.next(), parts.next(), parts.next())
        else {
            return Err(wrong());
        };
        Ok(Self {
            x: x.parse().map_err(|_| wrong())?,
            y: y.parse().map_err(|_| wrong())?,
            heading: match heading {
                "left" => Heading::Left,
                "up" => Heading::Up,
                "right" => Heading::Right,
                "down" => Heading::Down,
                _ => return Err(wrong()),
            },
        })
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let heading = format!("{:?}", self.heading).to_lowercase();
        write!(f, "({}, {}), looking {heading}", self.x, self.y)
    }
}
