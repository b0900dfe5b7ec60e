//! The log's sentences for the events of the core.
//!
//! It is apart because the sentences are for people, and tell them what to do.

use lager_ports::Cause;
use lager_topics::{Misfit, Part, ProfileState, Role, Thought, ThoughtKind};

use super::Service;
use crate::events::BoardUp;
use crate::machine::Notice;

impl Service<'_> {
    pub(super) fn say(&mut self, news: &Notice) {
        let port = |place: usize| {
            let device = self.ports[place].device.as_ref();
            device.map_or_else(String::new, |port| port.path().display().to_string())
        };
        match *news {
            Notice::Up { place, board } => {
                let BoardUp { up, link_epoch } = board;
                let who = up.callsign;
                tracing::info!(
                    port = %port(place),
                    version = ?up.version,
                    build = up.build,
                    epoch = link_epoch,
                    reset = ?up.reset,
                    "the {who} board {}",
                    if up.rebooted { "has restarted" } else { "is up" },
                );
                if let Some(misfit) = Misfit::of(up.version as u8, up.build) {
                    tracing::warn!("the {who} board does not fit: {misfit}");
                }
            }
            Notice::Silent { place } => {
                tracing::info!("the board on {} has fallen silent", port(place));
            }
            Notice::OriginalBoard { place } => tracing::warn!(
                "the steering board on {} is an original one, whose commands have no age \
                 limit: if this machine dies, it drives on; it is told standby only, unless \
                 `[serial] original_boards = true` accepts that",
                port(place)
            ),
            Notice::KeepsResetting(board) => tracing::error!(
                "the {} board keeps resetting; the robot is stopped: look at its power and cables",
                board
            ),
            Notice::Lent(true) => tracing::info!(
                "`lager board` has the boards' ports; the robot stands, and takes them back when it ends"
            ),
            Notice::Lent(false) => tracing::info!(
                "the boards' ports are back; the robot stands until somebody resumes"
            ),
            Notice::Profile(part, state) => say_profile(part, state),
            Notice::Pressed(mode) => tracing::info!(?mode, "the switch was pressed"),
            Notice::Reset(what) => self.think(what),
            Notice::ModeSet(mode) => tracing::info!(?mode, "the mode is set"),
            Notice::LateTouch(touch, late_ms) => {
                tracing::warn!(?touch, "a press came {late_ms} ms late and is not taken");
            }
            Notice::Listened(true) => tracing::info!(
                "the robot's buttons do nothing while somebody finds out how they are connected"
            ),
            Notice::Listened(false) => tracing::info!("the robot's buttons count again"),
            Notice::Late(kind) => {
                tracing::warn!(?kind, "a request came too late and is not carried out");
            }
        }
    }

    /// Tells people at the panel and in the log what has come of a press of a button.
    fn think(&mut self, what: ThoughtKind) {
        let thought = Thought {
            from: Role::Bridge.into(),
            ..what.into()
        };
        tracing::info!("{thought}");
        let sent = self.buttons.as_ref();
        let sent = sent.map(|buttons| buttons.thoughts.send(Cause::OWN, thought));
        if let Some(Err(error)) = sent {
            self.complain(&error);
        }
    }
}

fn say_profile(part: Part, state: ProfileState) {
    let (board, sections) = (part.board(), part.sections());
    let still = match part {
        Part::Arm => "the arm",
        Part::Steering | Part::Sensors => "the robot",
    };
    match state {
        ProfileState::NoBoard | ProfileState::Telling => {}
        ProfileState::Accepted => tracing::info!("the {board} board obeys {sections}"),
        ProfileState::Refused => tracing::error!(
            "the {board} board does not take {sections} and keeps what it had, so {still} is not \
             moved; `lager board update` gives the board the image that fits"
        ),
        ProfileState::Unanswered => tracing::warn!(
            "the {board} board does not answer to {sections}, so {still} is not moved; it is told \
             again every five seconds"
        ),
    }
}
