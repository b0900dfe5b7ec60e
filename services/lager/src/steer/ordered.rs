//! The subcommands that order something: each becomes an [`Action`], with what a person calls by
//! its name or leaves out, and each end of it has its sentence.

use anyhow::{Result, bail};
use lager_floor::{Heading, Node, Place, ProductId};
use lager_home::Clock;
use lager_operator::{Ids, Seen};
use lager_orders::{Action, Mode, Put, Reason};
use lager_supervisor::console;

use super::{Operator, first};
use crate::cli::{Button, MapChange, ObstacleChange, Ordered, Plain, QueueChange};
use crate::goods;
use crate::hint::hinted;

impl Operator {
    /// Carries a subcommand out, and says what came of it.
    ///
    /// # Errors
    /// It makes no sense for this robot, the robot refuses it, or nobody answers.
    pub fn order(&mut self, ordered: &Ordered) -> Result<String> {
        let action = match ordered {
            Ordered::Map { change: None } => return self.map(),
            Ordered::Queue { change: None } => return self.orders(),
            Ordered::Obstacle { change: None } => return self.obstacles(),
            Ordered::Arm { command } => return self.steer(*command, None),
            Ordered::Fetch { product } => {
                // The order would wait, and the robot would drive off when somebody changes the
                // mode later.
                if self.health()?.mode != Mode::Autonomous {
                    bail!(
                        "the robot is in manual mode and fetches nothing; `lager mode autonomous` changes that, and `lager queue add` orders for later"
                    );
                }
                self.add(goods::number(&self.running, product)?)
            }
            Ordered::Queue {
                change: Some(QueueChange::Add { product }),
            } => self.add(goods::number(&self.running, product)?),
            Ordered::Cancel { id: order }
            | Ordered::Queue {
                change: Some(QueueChange::Cancel { id: order }),
            } => Action::Cancel { order: *order },
            Ordered::Queue {
                change: Some(QueueChange::Up { id: order }),
            } => Action::Up { order: *order },
            Ordered::Queue {
                change: Some(QueueChange::Clear),
            } => Action::Clear,
            Ordered::Map {
                change: Some(MapChange::Back { product: called }),
            } => {
                let number = |called| goods::number(&self.running, called);
                let product = called.as_ref().map(number).transpose()?;
                Action::Back { product }
            }
            Ordered::Obstacle {
                change: Some(ObstacleChange::Put { way }),
            } => self.obstacle(Put::Put, *way)?,
            Ordered::Obstacle {
                change: Some(ObstacleChange::Take { way }),
            } => self.obstacle(Put::Take, *way)?,
            Ordered::Place { place: Some(on) } => Action::Place(*on),
            Ordered::Place { place: None } => Action::Place(self.delivery()?),
            Ordered::Press { button } => return self.press(*button),
            Ordered::Plain(plain) => return self.plain(plain),
        };
        let seen = self.seen(action)?;
        if let Action::Back { product } = action
            && seen.queue.is_some_and(|queue| queue.is_gone(product))
        {
            self.must_be_there(product.map(ProductId::get))?;
        }
        match self.give(action, &seen)? {
            None => self.done(action, &seen),
            Some(why) => bail!(self.refused(action, why)?),
        }
    }

    /// An order whose words are all of the action.
    fn plain(&mut self, plain: &Plain) -> Result<String> {
        let action = plain.action();
        if action == Action::Calibrate {
            console::print("calibrating for five seconds: move the robot over tape and floor")?;
        }
        let seen = self.seen(action)?;
        match self.give(action, &seen)? {
            None => Ok(plain.done()),
            Some(why) => bail!(self.refused(action, why)?),
        }
    }

    /// A button does what one of those orders does.
    fn press(&mut self, button: Button) -> Result<String> {
        let soon = self.soon();
        let plain = match button {
            Button::Reset => Plain::Reset,
            Button::Switch => match first(&mut self.health, &self.bus, &soon)?.mode.get() {
                Some(Mode::Manual) => Plain::Mode {
                    mode: Mode::Autonomous,
                },
                _ => Plain::Mode { mode: Mode::Manual },
            },
        };
        self.plain(&plain)
    }

    fn add(&self, product: ProductId) -> Action {
        let order = Ids::default().fresh(Clock::monotonic_ns());
        Action::Add { order, product }
    }

    fn obstacle(&self, put: Put, way: Place) -> Result<Action> {
        self.must_be_simulated()?;
        Ok(Action::Obstacle { put, way })
    }

    /// Where a simulated robot begins.
    fn delivery(&self) -> Result<Place> {
        if self.running.body.service().is_none() {
            bail!(
                "put the robot on a crossing and name it, as in `lager place 2,1,up`; `lager reset` says that it stands on the delivery node"
            );
        }
        let warehouse = self.running.warehouse()?;
        Ok(Place {
            node: warehouse.delivery,
            heading: match warehouse.starts_towards_plus_x() {
                true => Heading::Right,
                false => Heading::Left,
            },
        })
    }

    /// What there is to say when it is done; `seen` was before it.
    pub(super) fn done(&self, action: Action, seen: &Seen) -> Result<String> {
        let queue = seen.queue.unwrap_or_default();
        Ok(match action {
            Action::Add { order, product } => match self.queue()?.before(order) {
                Ok(0) => format!("logic fetches goods {product} next"),
                Ok(before) => {
                    format!("logic fetches goods {product}; waiting before it: {before}")
                }
                Err(_) => format!("logic fetches goods {product}"),
            },
            Action::Cancel { order } => format!("order {order} is taken back"),
            Action::Up { order } if queue.before(order) == Ok(0) => {
                format!("order {order} is the next one already")
            }
            Action::First { order } | Action::Up { order } => {
                format!("order {order} is carried out earlier")
            }
            Action::Clear if queue.orders().is_empty() => "no order waits".into(),
            Action::Clear => "all waiting orders are taken back".into(),
            Action::Back { product } => match (product, queue.is_gone(product)) {
                (Some(product), true) => format!("goods {product} are in their place again"),
                (Some(product), false) => format!("nobody has missed goods {product}"),
                (None, true) => "all goods are in their places again".into(),
                (None, false) => "no goods are missed".into(),
            },
            Action::Resume { stop: 0 } => "the robot was not stopped".into(),
            Action::Resume { .. } => "the stop is released".into(),
            Action::Place(on) => format!("the robot stands on crossing {on}"),
            Action::Obstacle { put, way } => match put {
                Put::Put => format!("a thing stands on the {}", name(way)),
                Put::Take => format!("a thing is gone from the {}", name(way)),
            },
            // Plain orders and those that move it say it themselves.
            _ => "the robot has done it".into(),
        })
    }

    /// What there is to say when it is refused.
    fn refused(&self, action: Action, why: Reason) -> Result<String> {
        let last = || {
            let Node { x, y } = self.running.warehouse()?.size;
            anyhow::Ok(format!("0,0 to {x},{y}"))
        };
        Ok(match (action, why.code()) {
            (Action::Add { product, .. }, _) => {
                format!("logic refuses to fetch goods {product}: {}", hinted(why))
            }
            (Action::Picked { .. }, code) if code.starts_with("failure_") => {
                format!("logic refuses to leave: {why}; `lager picked --force` overrules it")
            }
            (Action::Place(on), "world_no_place") => {
                format!("there is no crossing {on}: they go from {}", last()?)
            }
            (Action::Obstacle { way, .. }, "world_no_place") => {
                let way = name(way);
                format!("there is no {way}: crossings go from {}", last()?)
            }
            _ => hinted(why),
        })
    }
}

/// A way as a person calls it.
fn name(way: Place) -> String {
    format!("way from {} {}", way.node, way.heading)
}
