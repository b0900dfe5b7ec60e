//! The way of a frame of a running robot, from its stamps and from who woke whom.
//!
//! ```text
//!  bytes read   published                        decided            written
//!   |  reader    |  ~~wakes~~> logic ............ |  ~~wakes~~> main | sleeps again
//!   |<- stamps ->|<-------------- the kernel's events -------------->|
//! ```
//!
//! A sample's stamp says when its bytes were read and when it was published. That logic's turn is over,
//! and the bridge's, no stamp says: they sleep again. This file is pure.

use crate::event::Thread;
use crate::frame::{Frame, Mark, Who};
use crate::timeline::Timeline;
use crate::walk::Window;

/// The services of a robot's path.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Services {
    /// The threads of the one that reads frames and writes commands.
    pub bridge: Vec<Thread>,
    /// The threads of the one that decides.
    pub logic: Vec<Thread>,
}

/// How long a frame may take, in ns. One that takes longer ends here.
pub const LONGEST_NS: u64 = 1_000_000_000;

/// Most frames end within this time, in ns.
const USUAL_NS: u64 = 10_000_000;

impl Services {
    /// The way of a frame that the bridge read at `read_ns` and published at `published_ns`: to the
    /// end of logic's turn, or to the end of the bridge's turn if logic woke it. `None` if nobody of
    /// the bridge was seen then, or if it woke nobody: logic was awake.
    pub fn follow(
        &self,
        line: &Timeline,
        number: u64,
        [read_ns, published_ns]: [u64; 2],
    ) -> Option<Frame> {
        let within = |ns| self.within(line, number, [read_ns, published_ns], published_ns + ns);
        match within(USUAL_NS)? {
            (frame, true) => Some(frame),
            (_, false) => Some(within(LONGEST_NS)?.0),
        }
    }

    /// The same with the events up to `to_ns`, and whether the way ended by then.
    fn within(
        &self,
        line: &Timeline,
        number: u64,
        [read_ns, published_ns]: [u64; 2],
        to_ns: u64,
    ) -> Option<(Frame, bool)> {
        let mut window = Window::new(line, read_ns.saturating_sub(USUAL_NS), to_ns);
        let readers = window.running(&self.bridge, published_ns);
        let mut turn = |reader: &Thread| {
            Some((
                *reader,
                window.woken_by(*reader, published_ns, &self.logic)?,
            ))
        };
        let (reader, logic) = readers.iter().find_map(&mut turn)?;
        let mark = |stage, at_ns, thread| Mark {
            stage,
            at_ns,
            by: Who::Thread(thread),
        };
        let mut marks = vec![mark("bridge's reader", published_ns, reader)];
        let main = window.woken_by(logic.thread, logic.woken_ns, &self.bridge);
        let ended = logic.ended_ns;
        let main = main.filter(|main| ended.is_none_or(|ended| main.woken_ns < ended));
        let over = match main {
            Some(main) => {
                marks.push(mark("logic", main.woken_ns, logic.thread));
                marks.push(mark("bridge", main.ended_ns.unwrap_or(to_ns), main.thread));
                main.ended_ns
            }
            None => {
                marks.push(mark("logic", ended.unwrap_or(to_ns), logic.thread));
                ended
            }
        };
        let frame = Frame {
            number,
            start_ns: read_ns,
            marks,
        };
        Some((frame, over.is_some()))
    }
}
