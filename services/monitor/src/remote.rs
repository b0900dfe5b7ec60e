//! The tools over a robot's gateway, on this computer or another one.

use std::io::Write;
use std::marker::PhantomData;

use lager_home::Clock;
use lager_ports::{Look, ReceiveError, Source};
use lager_remote::{Listening, Remote};
use lager_sample::{Description, Topic, from_bytes};
use lager_topics::{TOPICS, TopicVisitor, visit};
use serde_json::json;

use crate::block::Blocks;
use crate::describe::listed;
use crate::echo::{EchoConfig, must_have};
use crate::measure::{Gauge, Plan};
use crate::place::Place;
use crate::tells::Tells;
use crate::{ToolError, Tools};

impl Place for Remote {
    fn may_still_tell(&self) -> Result<(), ToolError> {
        // The link comes back by itself, and so does a gateway that is started again.
        Ok(())
    }

    fn role_of(&self, pid: u32) -> Option<String> {
        Remote::role_of(self, pid)
    }

    fn now_ns(&self) -> Option<u64> {
        self.has_this_clock().then(Clock::monotonic_ns)
    }
}

impl Tells for Remote {
    fn echo<W: Write>(
        tools: &mut Tools<'_, W, Self>,
        name: &str,
        config: &EchoConfig,
    ) -> Result<(), ToolError> {
        let heard = tools.place.listen(name)?;
        must_have(heard.description(), config)?;
        // A topic of the table is shown as on the bus, if the robot has the same layout.
        let heard = match TOPICS.iter().any(|entry| entry.name == name) {
            true => {
                let echo = Echo {
                    tools,
                    config,
                    heard,
                };
                match visit(name, echo)? {
                    Echoed::All(echoed) => return echoed,
                    Echoed::NotOurs(heard) => *heard,
                }
            }
            false => heard,
        };
        let blocks = Blocks::of_found(name, heard.description())?;
        tools.echo_from(name, heard, blocks, config)
    }

    #[allow(
        private_interfaces,
        private_bounds,
        reason = "only this crate's tools call it"
    )]
    fn measure<W: Write, G: Gauge, F: Fn(usize) -> G>(
        tools: &mut Tools<'_, W, Self>,
        name: &str,
        plan: Plan<F>,
    ) -> Result<(), ToolError> {
        let heard = tools.place.listen(name)?;
        let size = heard.description().size();
        tools.measure_from(name, size, heard, &plan)
    }
}

struct Echo<'a, 'b, W> {
    tools: &'a mut Tools<'b, W, Remote>,
    config: &'a EchoConfig,
    heard: Listening,
}

enum Echoed {
    All(Result<(), ToolError>),
    /// The robot is of another build.
    NotOurs(Box<Listening>),
}

impl<W: Write> TopicVisitor for Echo<'_, '_, W> {
    type Output = Echoed;

    fn visit<T: Topic>(self) -> Echoed {
        if self.heard.description().text() != Description::of::<T::Payload>().text() {
            return Echoed::NotOurs(Box::new(self.heard));
        }
        let heard = Typed::<T> {
            heard: self.heard,
            topic: PhantomData,
        };
        let (tools, config) = (self.tools, self.config);
        let blocks = Blocks::new::<T>();
        Echoed::All(blocks.and_then(|blocks| tools.echo_from(T::NAME, heard, blocks, config)))
    }
}

/// A topic of the table that is heard from afar.
struct Typed<T> {
    heard: Listening,
    topic: PhantomData<T>,
}

impl<T: Topic> Source for Typed<T> {
    fn next<L: Look>(&mut self, look: L) -> Result<Option<L::Output>, ReceiveError> {
        let Some((note, payload)) = self.heard.receive() else {
            return Ok(None);
        };
        let payload: Option<T::Payload> = from_bytes(&payload);
        let payload = payload.expect("the layouts are the same");
        Ok(Some(look.look(&note.stamp, self.lost(), &payload)))
    }

    fn lost(&self) -> u64 {
        self.heard.lost()
    }

    fn holds(&self) -> bool {
        self.heard.holds()
    }

    fn queue(&self) -> usize {
        self.heard.queue()
    }
}

impl<W: Write> Tools<'_, W, Remote> {
    /// `topic list`: every topic that the gateway carries.
    ///
    /// # Errors
    /// The gateway does not answer, or the output cannot be written.
    pub fn list_carried(&mut self) -> Result<(), ToolError> {
        let robot = self.place.robot().clone();
        for (topic, about) in self.place.topics()? {
            let ends = [about.publishers, about.subscribers, about.observers];
            if self.as_json {
                let value = json!({
                    "robot": robot.as_str(), "topic": topic, "publishers": ends[0],
                    "subscribers": ends[1], "observers": ends[2],
                    "ours": TOPICS.iter().any(|entry| entry.name == topic),
                });
                writeln!(self.out, "{value}")?;
                continue;
            }
            writeln!(
                self.out,
                "{}",
                listed(&format!("lager/{robot}/{topic}"), ends)
            )?;
        }
        Ok(())
    }
}
