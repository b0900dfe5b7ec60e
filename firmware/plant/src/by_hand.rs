//! What a person can do in the world by hand, and what a process that runs a world reports.

use lager_floor::Edge;
use serde::{Deserialize, Serialize};

use crate::arm::SERVOS;
use crate::body::Pose;
use crate::obstacles::HandsOff;
use crate::world::{Snapshot, World};

/// Something that a person does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Hand {
    /// Lifts the robot and puts it here, at rest.
    Place(Pose),
    /// Lifts the robot and holds it, until it is put somewhere.
    Lift,
    /// Holds something wide so many cm in front of the ranger, until the robot is put somewhere.
    Hold(u8),
    /// Puts the robot down so many mm to the left of where it stands.
    Shift(i16),
    /// Brings a joint of the arm, by its first servo's number - 1, to this position as drawn and
    /// holds it there, as far as it goes; it stays where its servos hold it.
    Bring(u8, u16),
    /// Holds a piece of goods between the jaws, or takes it away.
    Fill(bool),
    /// Closes or opens the contact of reset (0) or mode (1).
    Press(u8, bool),
    /// Puts a thing on this edge.
    Put(Edge),
    /// Takes the thing on this edge away.
    Take(Edge),
}

impl Hand {
    /// Does it in `world`.
    ///
    /// # Errors
    /// The reason why nothing was put or taken.
    pub fn act(self, world: &mut World) -> Result<(), HandsOff> {
        match self {
            Self::Place(pose) => {
                world.place(pose);
                Ok(())
            }
            Self::Lift => {
                world.lift();
                Ok(())
            }
            Self::Hold(cm) => {
                world.hold_before_ranger(f64::from(cm) * 10.0);
                Ok(())
            }
            Self::Shift(left) => {
                let pose = world.pose();
                let (x, y) = pose.point(0.0, left.into());
                world.place(Pose { x, y, ..pose });
                Ok(())
            }
            Self::Bring(joint, position) => {
                if usize::from(joint) < SERVOS {
                    let servos = world.servos();
                    servos.bring(joint.into(), f64::from(position));
                }
                Ok(())
            }
            Self::Fill(is_there) => {
                world.fill_claw(is_there);
                Ok(())
            }
            Self::Press(button, is_closed) => {
                world.press(button.into(), is_closed);
                Ok(())
            }
            Self::Put(edge) => world.put_obstacle(edge),
            Self::Take(edge) => world.take_obstacle(edge),
        }
    }
}

/// A report from a process that runs a world to the process that started it; a line of JSON each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Report {
    /// The true state of the world.
    Truth(Snapshot),
    /// The result of a person's action, one for each line that was read.
    Hand(Result<(), HandsOff>),
}
