//! The log's sentences for the events of the core.
//!
//! It is apart because the sentences are for people, and tell them what to do.

use lager_topics::ArmProfileState;
use lager_wire::Callsign;

use super::Service;
use crate::machine::Notice;

impl Service<'_> {
    pub(super) fn say(&self, news: &Notice) {
        let port = |place: usize| self.config.ports[place].display();
        match *news {
            Notice::Up { place, board } => tracing::info!(
                port = %port(place),
                version = ?board.up.version,
                epoch = board.link_epoch,
                reset = ?board.up.reset,
                "the {} board {}",
                name(board.up.callsign),
                if board.up.rebooted { "has restarted" } else { "is up" },
            ),
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
                name(board)
            ),
            Notice::Profile(state) => say_profile(state),
            Notice::Pressed(mode) => tracing::info!(?mode, "the switch was pressed"),
            Notice::ModeSet(mode) => tracing::info!(?mode, "the mode is set"),
            Notice::Late(kind) => {
                tracing::warn!(?kind, "a request came too late and is not carried out");
            }
        }
    }
}

fn name(board: Callsign) -> &'static str {
    match board {
        Callsign::Steering => "steering",
        _ => "sensor",
    }
}

fn say_profile(state: ArmProfileState) {
    match state {
        ArmProfileState::NoBoard | ArmProfileState::Telling => {}
        ArmProfileState::Accepted => tracing::info!("the steering board obeys [arm]"),
        ArmProfileState::Refused => tracing::error!(
            "the steering board does not take [arm] and keeps the limits it had, so the arm is \
             not moved; flash the board with the image of this program's source"
        ),
        ArmProfileState::Unanswered => tracing::warn!(
            "the steering board does not answer to [arm], so the arm is not moved; it is told \
             again every five seconds"
        ),
    }
}
