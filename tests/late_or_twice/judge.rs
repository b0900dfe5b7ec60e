//! The two laws, and a judge that names each break of a law.
//!
//! 1. **Nothing moves late.** The robot moves at most 200 ms after a giver (a person or a program)
//!    has sent a command. Each command moves it once, and a command that needs renewal ends soon
//!    after its giver is gone.
//! 2. **Nothing moves after a newer stop** until a person who has seen that stop ends it.
//!
//! The judge sees what the people do and what the motors and the arm do, and nothing between.

use lager_wire::Command;

/// How old a command may be when the robot begins to move, in ms.
const LATEST: u64 = 200;
/// The time from giver to board without any delay: a turn of each process and a packet, in ms.
const WAY: u64 = 40;
/// After this time of standing, a motion counts as a new one, in ms. A board that gets no commands
/// stands after 150 ms.
const REST: u64 = 200;
/// The longest time that motion may go on after its giver is gone, in ms, with the longest allowed
/// delay in each hop: 200 on the way, the page's 150, the bridge's lease of 120, the board's 150.
const GONE: u64 = 200 + 150 + 120 + 150;
/// The longest time from a stop until the robot stands, in ms. The bridge sends standby at once; if
/// the bridge is frozen, the board ends its command by itself.
const STOPS: u64 = 200;
/// The longest turn, in ms.
const TURN: u64 = 4_000;

/// A given command.
#[derive(Clone, Copy, Debug)]
struct Given {
    at: u64,
    is_one_shot: bool,
    is_used: bool,
}

#[derive(Debug, Default)]
pub(crate) struct Judge {
    given: Vec<Given>,
    /// When the giver of a setpoint was last there.
    there: Option<u64>,
    /// The stop in force and when it was set.
    stop: Option<(u64, u64)>,
    moved: Option<u64>,
    /// Code and number of the board's last command.
    told: Option<(u8, u8)>,
    /// The time of all motion, in ms, and the number of one-shots that began.
    pub(crate) motion: u64,
    pub(crate) one_shots: u32,
    /// When the last one-shot began, and how long the longest was in force, in ms.
    began: Option<u64>,
    pub(crate) longest: u64,
    pub(crate) faults: Vec<String>,
}

impl Judge {
    /// A giver gives a command to move.
    pub(crate) fn gives(&mut self, at: u64, command: Command) {
        let is_one_shot = command.is_one_shot();
        self.given.push(Given {
            at,
            is_one_shot,
            is_used: false,
        });
        self.is_there(at);
    }

    /// The giver of the setpoint in force is still there.
    pub(crate) fn is_there(&mut self, at: u64) {
        self.there = Some(at);
    }

    pub(crate) fn stops(&mut self, at: u64, word: u64) {
        self.stop = Some((at, word));
    }

    /// A person asks to end the stop with this word.
    pub(crate) fn resumes(&mut self, word: u64) {
        self.stop = self.stop.filter(|(_, stop)| *stop != word);
    }

    /// The board gets a command.
    pub(crate) fn told(&mut self, now: u64, code: u8, seq: u8) {
        let before = self.told.replace((code, seq));
        let Some(command) = Command::from_code(code).filter(|_| before != Some((code, seq))) else {
            return;
        };
        if let Some(began) = self.began.take() {
            self.longest = self.longest.max(now - began);
        }
        if code == STANDBY {
            return;
        }
        let is_same = before.is_some_and(|(before, _)| before == code);
        if command.is_one_shot() {
            self.one_shots += 1;
            self.began = Some(now);
            self.begins(now, true, &format!("{command:?}"));
        } else if !is_same {
            self.begins(now, false, &format!("{command:?}"));
        }
        if let Some((at, _)) = self.stop.filter(|(at, _)| now > at + WAY) {
            self.fault(now, &format!("{command:?} is told after a stop at {at} ms"));
        }
    }

    /// The duties of the motors at this moment.
    pub(crate) fn sees(&mut self, now: u64, duties: [i16; 2]) {
        if duties == [0, 0] {
            return;
        }
        self.motion += 1;
        let stood = self.moved.is_none_or(|moved| now > moved + REST);
        self.moved = Some(now);
        if stood && !self.may_begin(now, None) {
            self.fault(now, "motion begins that nobody has just asked for");
        }
        let runs = |given: &Given| given.is_one_shot && now <= given.at + LATEST + TURN;
        let is_there = self.there.is_some_and(|there| now <= there + GONE + WAY);
        if !is_there && !self.given.iter().any(runs) {
            self.fault(now, "motion goes on though its giver has gone");
        }
        if let Some((at, _)) = self.stop.filter(|(at, _)| now > at + STOPS + WAY) {
            self.fault(now, &format!("motion after a stop at {at} ms"));
        }
    }

    fn begins(&mut self, now: u64, is_one_shot: bool, what: &str) {
        if !self.may_begin(now, Some(is_one_shot)) {
            self.fault(now, &format!("{what} is told late, or twice"));
            return;
        }
        let mut given = self.given.iter_mut().rev();
        let used = given.find(|given| given.is_one_shot && !given.is_used);
        if let Some(given) = used.filter(|_| is_one_shot) {
            given.is_used = true;
        }
    }

    fn may_begin(&self, now: u64, is_one_shot: Option<bool>) -> bool {
        self.given.iter().any(|given| {
            let is_it = is_one_shot.is_none_or(|is| given.is_one_shot == is && !given.is_used);
            is_it && now <= given.at + LATEST + WAY
        })
    }

    fn fault(&mut self, now: u64, what: &str) {
        if self.faults.len() < 8 {
            self.faults.push(format!("at {now} ms: {what}"));
        }
    }
}

const STANDBY: u8 = 1;
