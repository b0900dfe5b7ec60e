//! The arm: its servos and their joints by a person's hands, then each joint by itself, and the claw.
//!
//! ```text
//!   limp:      asks --yes--> told to be limp --> listens, 32 times --> asks for the ends of a joint
//!   taught:    asks --yes--> listens --> the next end, joint or pose
//!   by itself: asks --the button is held--> one step after the other --let go--> asks
//! ```
//!
//! **Invariant:** a servo moves by itself only in [`State::Holds`], whose lease each [`Answer::Hold`]
//! renews. When it has lapsed, the robot is told to stand, and a step that is under way is small.

use core::time::Duration;

use lager_operator::Seen;
use lager_orders::Moment;
use lager_wire::{ArmCommand, LIMP, OperatorArm, OperatorCommand};

use super::{Commissioning, State};
use crate::answer::Answer;
use crate::arm::{self, Found, Grip, Joint, PLACES, Positions};
use crate::step::{Question, Step};
use crate::words::Said;

/// A board has looked at eight servos, missing ones too, and told the Pi of them.
const LOOKED: Duration = Duration::from_millis(300);
/// A board has looked at each servo and told of it: it looks at one each 100 ms, and tells of it
/// what it saw in the round before.
const ROUND: Duration = Duration::from_millis(1_900);
/// A button counts as held for so long after the first press: a keyboard repeats a key first after
/// half a second or a little more.
const PRESSED: Duration = Duration::from_millis(700);
/// It counts as held for so long after each repetition.
const REPEATED: Duration = Duration::from_millis(300);
/// So many steps a joint goes at most, to be seen: 20 degrees.
const MOST_STEPS: u16 = 24;
/// A step follows the one before after this time at least: 15 degrees a second.
const PACE: Duration = Duration::from_millis(60);
/// So near to a limit a joint stands.
const NEAR: u16 = 3;
/// So far a joint must have gone in its way, in units of position.
const GONE: u16 = 6;

/// What the claw does while the button is held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Claw {
    #[default]
    Opens,
    Closes,
    Closed,
}

/// What the present step has found out of the arm so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Work {
    /// How many looks for ids are over, and the ids that answered.
    looks: u16,
    ids: Vec<u8>,
    /// The joint that is asked for, as an index of [`Joint::ALL`], and which of its ends or ways.
    joint: usize,
    grows: bool,
    lowest: Positions,
    joints: Vec<Found>,
    /// Where the joint stood before it moved by itself, and the steps that it has gone.
    from: u16,
    steps: u16,
    /// When the next step may be given.
    next: Duration,
    /// A command has been given and has not ended yet.
    is_commanded: bool,
    claw: Claw,
    empty: Grip,
}

impl Commissioning {
    /// The joint that the present question is about, and whether its position grows in the way that
    /// is asked for.
    pub fn joint(&self) -> Option<(Joint, bool)> {
        let asks = matches!(self.question, Question::JointEnd | Question::JointMoves);
        asks.then(|| (self.present_joint(), self.arm.grows))
    }

    fn present_joint(&self) -> Joint {
        let all = Joint::ALL;
        all[self.arm.joint.min(all.len() - 1)]
    }

    /// How long it listens to the servos.
    pub(super) fn listening(&self) -> Duration {
        match self.question {
            // These servos have just been brought into service.
            Question::Arm | Question::Poses | Question::JointMoves => LOOKED,
            _ => ROUND,
        }
    }

    /// The answer to a question about the arm.
    pub(super) fn arm_answered(&mut self, now: Moment, answer: Answer) -> Result<(), Said> {
        match (self.question, answer) {
            (Question::Arm, Answer::Yes) => self.look(now),
            (Question::Poses, Answer::Yes) => {
                self.listens = true;
                self.limp(now, self.built.robot.arm);
            }
            (
                Question::JointEnd
                | Question::PoseReach
                | Question::PoseCarry
                | Question::PoseDrop
                | Question::PoseNeutral,
                Answer::Yes,
            ) => self.state = State::Listens { since: None },
            (Question::JointMoves, Answer::Yes) => return self.has_moved(now),
            (Question::JointMoves, Answer::No) => {
                let joint = self.present_joint().name().into();
                return Err(Said::of("joint_wrong", [("joint", joint)]));
            }
            (Question::ClawEmpty | Question::ClawFull, Answer::Yes) => return self.gripped(now),
            _ => {}
        }
        Ok(())
    }

    /// Has the board look for the next eight ids.
    fn look(&mut self, now: Moment) {
        self.listens = true;
        self.limp(now, arm::limp(&arm::looked_at(self.arm.looks)));
    }

    /// Tells the board this arm without torque.
    fn limp(&mut self, now: Moment, profile: lager_wire::ArmProfile) {
        let mut trial = self.built.robot;
        trial.arm = lager_wire::ArmProfile {
            torque_limit: LIMP,
            ..profile
        };
        self.tell(now, trial);
    }

    /// The board has had the time to tell of its servos.
    pub(super) fn listened(&mut self, now: Moment) -> Result<(), Said> {
        let report = self.report.ok_or("no_values")?;
        let positions = arm::positions(&report);
        match self.question {
            Question::Arm => {
                let places = arm::ids(&arm::limp(&arm::looked_at(self.arm.looks)));
                for (place, id) in places.into_iter().enumerate() {
                    let is_silent = report.servo_errors >> place & 1 != 0;
                    let answers = id.filter(|_| !is_silent && positions[place].is_some());
                    let ids = &mut self.arm.ids;
                    ids.extend(answers.filter(|id| !ids.contains(id)));
                }
                self.arm.ids.sort_unstable();
                self.arm.looks += 1;
                if self.arm.looks < arm::LOOKS {
                    self.look(now);
                    return Ok(());
                }
                arm::enough(&self.arm.ids)?;
                self.limp(now, arm::limp(&self.arm.ids));
                self.ask_for(Question::JointEnd, false);
            }
            // Only now it is limp.
            Question::Poses => self.ask(Question::PoseReach),
            Question::JointEnd if !self.arm.grows => {
                self.arm.lowest = positions;
                self.state = State::Asks;
                self.ask_for(Question::JointEnd, true);
            }
            Question::JointEnd => {
                self.state = State::Asks;
                self.end_shown(now, positions)?;
            }
            Question::JointMoves => {
                let joint = self.present_joint();
                let from = positions[arm::place_of(joint)].ok_or("no_values")?;
                let mut limits = self.built.robot.arm.limits;
                let limits = *joint.limits(&mut limits);
                self.arm.from = from;
                self.arm.steps = 0;
                self.state = State::Asks;
                let middle = u16::midpoint(limits.lowest, limits.highest);
                self.ask_for(Question::JointMoves, from < middle);
            }
            _ => {
                self.state = State::Asks;
                self.pose_shown(now, &positions);
            }
        }
        Ok(())
    }

    /// Asks about the present joint and one of its ways.
    fn ask_for(&mut self, question: Question, grows: bool) {
        self.arm.grows = grows;
        self.question = question;
        self.said.extend(self.about());
    }

    /// What the present question is about, in words, if it alone does not say so.
    pub fn about(&self) -> Option<Said> {
        let (joint, grows) = self.joint()?;
        let values = [
            ("joint", joint.name().into()),
            ("way", joint.way(grows).into()),
        ];
        Some(Said::of("joint_way", values))
    }

    /// A person has shown both ends of a joint.
    fn end_shown(&mut self, now: Moment, highest: Positions) -> Result<(), Said> {
        let joint = self.present_joint();
        let arm = &mut self.arm;
        let places = arm::ids(&arm::limp(&arm.ids));
        let known: Vec<u8> = arm.joints.iter().flat_map(Found::ids).collect();
        let found = match arm::joint(joint, &places, &[arm.lowest, highest], &known) {
            Ok(found) => found,
            Err(why) => {
                // The joints before are known, and only this one is shown again.
                self.said.push(why);
                self.ask_for(Question::JointEnd, false);
                return Ok(());
            }
        };
        let ids: Vec<u8> = found.ids().collect();
        let plain = |value: &dyn ToString| Said::Plain(value.to_string());
        self.said.push(Said::of(
            "found_joint",
            [
                ("joint", joint.name().into()),
                ("ids", plain(&arm::list(&ids))),
                ("least", plain(&found.limits.lowest)),
                ("most", plain(&found.limits.highest)),
            ],
        ));
        self.arm.joints.push(found);
        self.arm.joint += 1;
        let Ok(joints) = <&[Found; 6]>::try_from(&self.arm.joints[..]) else {
            self.ask_for(Question::JointEnd, false);
            return Ok(());
        };
        let used: Vec<u8> = joints.iter().flat_map(Found::ids).collect();
        let unused = self.arm.ids.iter().filter(|id| !used.contains(id));
        let unused: Vec<u8> = unused.copied().collect();
        if !unused.is_empty() {
            let values: [(_, &dyn ToString); 1] = [("ids", &arm::list(&unused))];
            return Err(Said::new("servos_unused", &values));
        }
        let profile = arm::profile(&self.built.robot.arm, joints);
        profile
            .validate()
            .map_err(|why| Said::new("arm_unfit", &[("why", &why)]))?;
        self.built.robot.arm = profile;
        self.done(now, Said::new("found_arm", &[("count", &used.len())]));
        Ok(())
    }

    /// A person holds the arm in a pose.
    fn pose_shown(&mut self, now: Moment, positions: &Positions) {
        let pose = match arm::pose(&self.built.robot.arm, positions) {
            Ok(pose) => pose,
            // The poses before are known, and only this one is shown again.
            Err(why) => return self.said.push(why),
        };
        let arm = &mut self.built.robot.arm;
        self.question = match self.question {
            Question::PoseReach => {
                (self.built.reach_shoulder, self.built.reach_elbow) = (pose.shoulder, pose.elbow);
                Question::PoseCarry
            }
            Question::PoseCarry => {
                arm.carry = pose;
                Question::PoseDrop
            }
            Question::PoseDrop => {
                arm.drop = pose;
                Question::PoseNeutral
            }
            _ => {
                arm.neutral = pose;
                return self.done(now, "found_poses");
            }
        };
    }

    /// What is tried when a step about the arm begins.
    pub(super) fn arm_trial(&mut self, step: Step) -> lager_wire::ArmProfile {
        let arm = &self.built.robot.arm;
        match step {
            Step::Joints => {
                self.listens = true;
                arm::in_bases_place(arm, self.present_joint())
            }
            Step::Claw => arm::claw_trial(arm),
            _ => *arm,
        }
    }
}

/// What moves while a person holds the button.
impl Commissioning {
    /// The button is held.
    pub(super) fn hold(&mut self, now: Moment) {
        let (span, is_spent) = match self.state {
            State::Holds { is_spent, .. } => (REPEATED, is_spent),
            _ => (PRESSED, false),
        };
        self.state = State::Holds {
            until: now.robot + span,
            is_spent,
        };
        self.go_on(now);
    }

    /// Gives the next command, if the one before has ended.
    pub(super) fn go_on(&mut self, now: Moment) {
        let State::Holds { until, is_spent } = self.state else {
            return;
        };
        if now.robot >= until {
            self.let_go(now);
            return;
        }
        if self.driving.is_running() || now.robot < self.arm.next {
            return;
        }
        let ended = core::mem::take(&mut self.arm.is_commanded);
        let is_spent = is_spent || (ended && self.advances());
        self.state = State::Holds { until, is_spent };
        let Some(command) = self.commanded().filter(|_| !is_spent) else {
            return;
        };
        let Some(command) = OperatorArm::new(command).map(OperatorCommand::Arm) else {
            return;
        };
        match self.order(now, command) {
            Ok(()) => {
                self.arm.is_commanded = true;
                self.arm.next = now.robot + PACE;
            }
            Err(why) => self.fail(now, why),
        }
    }

    /// The person has let the button go.
    pub(super) fn let_go(&mut self, now: Moment) {
        self.stand(now);
        self.arm.is_commanded = false;
        self.state = State::Asks;
    }

    /// A command has ended well. Returns whether nothing more happens until the next press.
    fn advances(&mut self) -> bool {
        if self.question == Question::JointMoves {
            self.arm.steps += 1;
            return false;
        }
        self.arm.claw = match self.arm.claw {
            Claw::Opens => Claw::Closes,
            Claw::Closes | Claw::Closed => Claw::Closed,
        };
        true
    }

    /// The command to give now; `None` if the joint has gone as far as it shall.
    fn commanded(&self) -> Option<ArmCommand> {
        if self.question != Question::JointMoves {
            return match self.arm.claw {
                Claw::Opens => Some(ArmCommand::Release),
                Claw::Closes => Some(ArmCommand::Squeeze),
                Claw::Closed => None,
            };
        }
        let joint = self.present_joint();
        let position = self.position(arm::place_of(joint))?;
        let mut limits = self.built.robot.arm.limits;
        let limits = *joint.limits(&mut limits);
        let has_room = match self.arm.grows {
            true => position + NEAR < limits.highest,
            false => position > limits.lowest + NEAR,
        };
        let command = match (joint, self.arm.grows) {
            (Joint::Shoulder, true) => ArmCommand::Up,
            (Joint::Shoulder, false) => ArmCommand::Down,
            (Joint::Elbow, true) => ArmCommand::Out,
            (Joint::Elbow, false) => ArmCommand::In,
            (Joint::Rotation, true) => ArmCommand::CounterClockwise,
            (Joint::Rotation, false) => ArmCommand::Clockwise,
            // The wrist and the claw stand in the base's place.
            (_, true) => ArmCommand::Left,
            (_, false) => ArmCommand::Right,
        };
        (has_room && self.arm.steps < MOST_STEPS).then_some(command)
    }

    /// The person has seen a joint go its way.
    fn has_moved(&mut self, now: Moment) -> Result<(), Said> {
        let joint = self.present_joint();
        let at = self.position(arm::place_of(joint)).ok_or("no_values")?;
        let (low, high) = match self.arm.grows {
            true => (self.arm.from, at),
            false => (at, self.arm.from),
        };
        if high < low + GONE {
            let way = joint.way(self.arm.grows).into();
            let values = [("joint", joint.name().into()), ("way", way)];
            self.said.push(Said::of("joint_unmoved", values));
            return Ok(());
        }
        self.arm.joint += 1;
        if self.arm.joint == Joint::ALL.len() {
            self.done(now, "found_joints");
            return Ok(());
        }
        let mut trial = self.built.robot;
        trial.arm = self.arm_trial(Step::Joints);
        self.tell(now, trial);
        Ok(())
    }

    /// The person has seen the claw close.
    fn gripped(&mut self, now: Moment) -> Result<(), Said> {
        if self.arm.claw != Claw::Closed {
            self.said.push("claw_not_closed".into());
            return Ok(());
        }
        let grip = self.grip().ok_or("no_values")?;
        if self.question == Question::ClawEmpty {
            self.arm.empty = grip;
            self.arm.claw = Claw::Opens;
            self.ask(Question::ClawFull);
            return Ok(());
        }
        let profile = arm::claw(&self.built.robot.arm, self.arm.empty, grip)?;
        profile
            .validate()
            .map_err(|why| Said::new("arm_unfit", &[("why", &why)]))?;
        self.built.robot.arm = profile;
        let values: [(_, &dyn ToString); 2] = [
            ("position", &profile.gripper_closed),
            ("load", &profile.squeeze_load),
        ];
        self.done(now, Said::new("found_claw", &values));
        Ok(())
    }

    /// Gives an order to wheels or arm, if a person may.
    pub(super) fn order(&mut self, now: Moment, command: OperatorCommand) -> Result<(), Said> {
        let health = self.known(now.robot).ok_or("bridge_silent")?;
        let seen = Seen {
            health: Some(*health),
            ..Seen::default()
        };
        seen.may_move(command)?;
        self.steer(now, command);
        Ok(())
    }

    fn position(&self, place: usize) -> Option<u16> {
        arm::positions(self.report.as_ref()?)[place]
    }

    /// Position and load of the claw's servo.
    fn grip(&self) -> Option<Grip> {
        let servo = Joint::Gripper.servo();
        let load = self.report?.servo_load[servo].unsigned_abs();
        Some((self.position(servo)?, load))
    }
}

/// What a person sees of the arm.
impl Commissioning {
    pub(super) fn arm_shown(&self) -> Option<Said> {
        if self.question == Question::Arm && self.arm.looks > 0 {
            let last = arm::looked_at(self.arm.looks.saturating_sub(1))[PLACES - 1];
            let values: [(_, &dyn ToString); 2] =
                [("last", &last), ("ids", &arm::list(&self.arm.ids))];
            return Some(Said::new("live_scan", &values));
        }
        if self.step == Step::Claw {
            let (position, load) = self.grip()?;
            let values: [(_, &dyn ToString); 2] = [("position", &position), ("load", &load)];
            return Some(Said::new("live_claw", &values));
        }
        let told = self.told_arm()?;
        let at = arm::positions(self.report.as_ref()?).into_iter();
        let servos = arm::ids(&told).into_iter().zip(at);
        let servos = servos.filter_map(|(id, at)| Some(format!("{}: {}", id?, at?)));
        let positions = servos.collect::<Vec<_>>().join(", ");
        Some(Said::new("live_servos", &[("positions", &positions)]))
    }
}
