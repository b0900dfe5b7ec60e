//! The topic tools list, info, echo, hz, bw, delay and pub. They work on any topic of any robot, by
//! its name. Also here: `lager top`, which shows all topics at once (`top`), and the table of
//! topics for Python programs (`python.rs`), which needs no robot.
//!
//! `pub` moves no robot by mistake: it holds the locks of the robot's name and of its bridge. If
//! the robot is up, it needs `--live`, and then writes only topics that several programs may write.
//!
//! Where samples come from is an [`Origin`]: the bus, or with the feature `zenoh` a robot's gateway on
//! another computer. The tools are the same.
//!
//! All tools but `pub` are observers: they poll, or are woken when everybody else has the sample
//! (`echo`, `delay`; `wakeful.rs`). They hold no listener and never slow the path. They know no topic,
//! except for the sentences of some samples (`sentence.rs`) and the head of `top`. The table leads from
//! a name to its static type. A topic that is not in the table carries its own description. Each tool writes text, or one JSON value in each line, and says how many samples it
//! lost. A watchdog guards every call into the bus, so a tool reports a bus that does not answer,
//! and does not wait for it.

mod actor;
mod block;
mod delay;
mod describe;
mod durations;
mod echo;
mod life;
mod measure;
mod origin;
mod publish;
mod python;
mod rate;
mod sentence;
mod source;
mod top;
mod wakeful;

use std::fmt;
use std::io::{self, Write};
use std::time::{Duration, Instant};

use lager_home::Shortage;
use lager_ports::{Bus, IntrospectError, Look, PortError, ReceiveError, Source};
use lager_sample::{NoField, Topic};
use lager_topics::UnknownTopic;
use lager_wake::{Shutdown, Watchdog};

pub use echo::EchoConfig;
pub use life::{Failing, Life};
pub use measure::Limits;
pub use origin::Origin;
pub use publish::{Payloads, PublishError, Publishing};
pub use python::write_python;
pub use top::{Lacking, Load, Recorded, TopConfig, leave_screen};

/// How often `top` looks, and `topic echo` where nobody wakes it.
const POLL: Duration = Duration::from_millis(5);

/// What a tool works with. Each tool is a method of it.
#[derive(Debug)]
pub struct Tools<'a, W, P = Bus> {
    /// The bus, as an observer of the robot, or another place where samples come from.
    pub place: &'a P,
    /// Guards the calls into the bus.
    pub watchdog: &'a Watchdog,
    /// The request to end.
    pub shutdown: &'a Shutdown,
    /// Whether to write JSON, one value a line, and no text for people.
    pub as_json: bool,
    /// Where to write.
    pub out: &'a mut W,
}

impl<W: Write, P: Origin> Tools<'_, W, P> {
    /// Opens a topic of the table, with the type that this program has for it; `None` if its layout
    /// is another one where the samples come from.
    fn typed<T: Topic>(&self) -> Result<Option<P::Typed<T>>, ToolError> {
        let open = || self.place.typed();
        let opened = self.watchdog.over("opening the topic", open);
        opened.map_err(Into::into)
    }

    /// Opens a topic by what it says of itself.
    fn described(&self, name: &str) -> Result<P::Found, ToolError> {
        let open = || self.place.described(name);
        let found = self.watchdog.over("opening the topic", open);
        let unknown = || ToolError::Unknown(UnknownTopic(name.to_owned()));
        found.map_err(Into::into)?.ok_or_else(unknown)
    }

    fn must_still_tell(&self) -> Result<(), ToolError> {
        match self.place.may_still_tell() {
            true => Ok(()),
            false => Err(ToolError::Cleared),
        }
    }

    fn receive<L: Look>(
        &self,
        from: &mut impl Source,
        look: L,
    ) -> Result<Option<L::Output>, ToolError> {
        let receive = || from.next(look);
        Ok(self.watchdog.over("reading the topic", receive)?)
    }

    /// Asks why nothing has come for so long. A subscriber gets no error if it cannot reach its writer,
    /// or if somebody has replaced the bus.
    fn ask_why(&self, silent_since: Instant) -> Result<(), ToolError> {
        if silent_since.elapsed() >= SILENCE {
            if let Some(shortage) = Shortage::now() {
                return Err(ToolError::Short(shortage));
            }
            self.must_still_tell()?;
        }
        Ok(())
    }
}

/// After how long a silence the tool asks why.
const SILENCE: Duration = Duration::from_secs(1);

/// Why a tool could not do its work.
#[derive(Debug, thiserror::Error)]
pub enum ToolError {
    /// No topic has that name.
    #[error(transparent)]
    Unknown(#[from] UnknownTopic),
    /// The state of the bus could not be read.
    #[error(transparent)]
    Look(#[from] IntrospectError),
    /// The topic could not be opened.
    #[error(transparent)]
    Open(#[from] PortError),
    /// The topic could not be read.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// No samples come, for this reason.
    #[error("nothing can be read: {0}")]
    Short(Shortage),
    /// The bus is another one now, so no sample will come any more.
    #[error(
        "the bus was damaged and replaced since this tool began; start it again to see the robot"
    )]
    Cleared,
    /// The output could not be written.
    #[error("cannot write the output: {0}")]
    Output(#[from] io::Error),
    /// No sample has such a field.
    #[error(transparent)]
    NoField(#[from] NoField),
    /// A robot's gateway does not tell it.
    #[cfg(feature = "zenoh")]
    #[error(transparent)]
    Remote(#[from] lager_remote::RemoteError),
    /// The times of samples are of a clock that this machine does not know.
    #[error(
        "the robot's gateway does not tell its clock, so delays on the way cannot be told; use the \
         same version on both machines, or run this tool on the robot"
    )]
    OtherClock,
    /// A sample could not be put into JSON.
    #[error("cannot put a sample into JSON: {0}")]
    Json(#[from] serde_json::Error),
}

impl ToolError {
    /// Whether only the output's reader has gone, as after `| head`.
    pub fn is_closed_output(&self) -> bool {
        matches!(self, Self::Output(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }
}

/// A number of things, in words: `1 publisher`, `2 publishers`.
struct Count(usize, &'static str);

impl fmt::Display for Count {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(number, thing) = self;
        let plural = if *number == 1 { "" } else { "s" };
        write!(formatter, "{number} {thing}{plural}")
    }
}
