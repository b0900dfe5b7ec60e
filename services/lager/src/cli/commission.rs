//! `lager commission`.

use clap::Args;

/// `lager commission`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  lager mode manual              the robot must be in manual mode, and not stopped
  lager commission               asks one thing after the other, and saves at the end
  lager commission --restart     starts the robot again, so that all of it uses the description
  lager commission --undo        the description of before the last commissioning

It asks for what only a person at the robot can see, and shows what the sensors read meanwhile. Have a
meter, something wide and light, a ruler, a piece of your goods, and room for the robot to turn. Each
answer is a line:

  yes, no, a number, or two letters for the wheels, as the question says
  Enter    while you hold it, the joint moves that the question names; let go, and it stands
  again    this step from its beginning, with what held before it
  back     the step before, with what held before that
  skip     the next step; what is configured stays
  quit     ends it; the boards are told what they were told before

The robot moves only after an answer to the question that announces this very movement, and stands at
the next line that you type. Before the arm loses its strength, you are asked to hold it. A line that
was typed before its question counts for nothing. Nothing is written before the last question is
answered with yes. Then robot.toml has the new description, and logic and the buttons use it from the
robot's next start on. Where LANG is Swedish, so are the questions. In the panel, *Set up a robot* asks
the same.")]
pub struct CommissionArgs {
    /// Put back the description from before the last commissioning; needs no robot
    #[arg(long)]
    pub undo: bool,
    /// Stop the robot, and start it again with the description that is saved
    #[arg(long, conflicts_with = "undo")]
    pub restart: bool,
    /// Talk in the lines of a station, for comm
    #[arg(long, hide = true)]
    pub lines: bool,
}
