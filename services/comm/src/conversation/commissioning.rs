//! The commissioning of the robot: what a person says to it, and what it tells.
//!
//! A process of its own does it. Here is decided who may say what to it: one is at work at a time,
//! and an answer counts only for what is asked at this moment.

use core::time::Duration;

use lager_lines::extension::Report;
use lager_orders::{Code, Commission, Moment, Reason};

use super::Conversation;
use crate::effect::Effect;
use crate::known::Commissioned;

impl Conversation {
    /// Takes what a person says so `late`. `Err` is the reason of a refusal.
    pub(super) fn commission(
        &mut self,
        now: Moment,
        late: Duration,
        said: Commission,
    ) -> Result<(), Reason> {
        let known = &mut self.known.commission;
        match said {
            Commission::Begin | Commission::Undo | Commission::Restart if known.is_at_work => {
                return Err(Code::TooMuchAsked.into());
            }
            Commission::Begin | Commission::Undo | Commission::Restart => {
                *known = Commissioned {
                    is_at_work: true,
                    ..Commissioned::default()
                };
            }
            _ if !known.is_at_work => return Err(not_running()),
            Commission::Answer { asked, .. } if known.how.asked != Some(asked) => {
                return Err(Code::AskedAnew.into());
            }
            _ => {}
        }
        let given_ns = now.given_ns(late);
        self.effects.push(Effect::Commission { given_ns, said });
        Ok(())
    }

    /// The commissioning tells this.
    pub fn commission_told(&mut self, told: Report) {
        let known = &mut self.known.commission;
        match told {
            Report::Commission(how) => known.how = how,
            Report::Found(found) => known.found = found,
            Report::Kept(line) => known.kept.push(line),
            _ => {}
        }
    }

    /// The process that commissions has ended, or could not be started because of `why`. What it has
    /// said itself of its end counts.
    pub fn commission_over(&mut self, why: Option<Reason>) {
        let known = &mut self.known.commission;
        known.is_at_work = false;
        let ended = known.how.ended.take().or(why).unwrap_or_else(not_running);
        *known.how = lager_lines::extension::Commissioning {
            ended: Some(ended),
            ..Default::default()
        };
    }

    /// Nobody is connected any more: what moves by a commissioning stands.
    pub(super) fn stand_commissioned(&mut self, now: Moment) {
        if self.known.commission.is_at_work {
            self.effects.push(Effect::Commission {
                given_ns: now.ns,
                said: Commission::Stand,
            });
        }
    }

    /// Whether the robot moves by a commissioning.
    pub(super) fn moves_commissioned(&self) -> bool {
        self.known.commission.how.moves == Some(true)
    }
}

/// Nobody commissions the robot.
fn not_running() -> Reason {
    Reason::new(Code::NotRunning, &[&"commission"])
}
