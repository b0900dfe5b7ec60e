//! What the boards are told of their robot: sent value by value, put in force as a whole, verified,
//! and sent again to a board that has come up.
//!
//! ```text
//!            board up            every value and the check value taken
//!   no board --------> telling ----------------------------------------> accepted
//!                       ^  |  '---> refused: the board does not take one
//!             5 seconds |  v no answer, four times
//!                    unanswered
//! ```
//!
//! One value is on its way to a board at a time: a board's queue holds five packets, and at 9600 Bd a
//! command to the wheels must not wait for thirty-three. So the steering board hears of its wheels
//! first, and of the arm when it has answered.
//!
//! Until the boards have accepted how motors and sensors are built, the arbiter keeps the wheels
//! still, because a robot with its motors swapped would drive the other way. Until the steering board
//! has accepted the arm's profile, the arbiter keeps the arm still, because the board cannot keep
//! limits that it does not know. A board that was told and has not restarted since is told again
//! while it moves.
//!
//! A request may have a part told otherwise, to try it on the robot ([`Profiles::describe`]). That
//! ends when nobody renews it ([`Profiles::lapse`]), and with this bridge: a successor tells what is
//! configured.
//!
//! It is pure. It stands apart from the other settings because it is one thing in many packets.

use core::time::Duration;

use heapless::Vec as List;
use lager_sample::hash;
use lager_topics::{Ask, Health, Part, ProfileState};
use lager_wire::link::Up;
use lager_wire::{
    ArmProfile, Callsign, LIMP, Profile, RobotProfile, SensorProfile, Setting, SettingKey,
    SettingReply, SettingStatus, SteeringProfile, Version,
};

use crate::arbiter::Gate;
use crate::settings::{RETRY, TRIES};

/// How long the bridge waits before it tries a board again that does not answer.
const PAUSE: Duration = Duration::from_secs(5);

/// More than the longest profile has values.
const MOST: usize = 40;

/// How far each part has got.
pub type States = [(Part, ProfileState); 3];

/// All parts of the description, each on its way to its board.
#[derive(Clone, Debug)]
pub struct Profiles {
    tellers: [ProfileTeller; 3],
    /// A hash of everything that is told.
    told: u32,
    /// The parts that somebody tries.
    trials: [Option<Trial>; 3],
}

/// A description that somebody tries. He may die meanwhile.
#[derive(Clone, Debug)]
struct Trial {
    /// What the board was told before.
    before: ProfileTeller,
    /// Until when it holds.
    until: Duration,
}

impl Profiles {
    /// Sends `robot`, which its owner has validated, to every board that comes up. An earlier
    /// bridge, if there was one, may have told the same.
    pub fn new(robot: &RobotProfile, kept: Option<&Health>) -> Self {
        let tellers = [
            ProfileTeller::new(&robot.steering),
            ProfileTeller::new(&robot.sensors),
            ProfileTeller::new(&robot.arm),
        ];
        let told = hash_of(&tellers);
        let mut profiles = Self {
            tellers,
            told,
            trials: Default::default(),
        };
        if let Some(kept) = kept.filter(|kept| kept.description == told) {
            let states = [kept.steering_profile, kept.sensor_profile, kept.arm_profile];
            for (teller, state) in profiles.tellers.iter_mut().zip(states) {
                teller.is_known = state == ProfileState::Accepted;
            }
        }
        profiles
    }

    /// Has the board of a part told what a request says instead of what was told before. Returns
    /// whether a board can obey that.
    pub fn describe(&mut self, now: Duration, part: Part, ask: &Ask, version: Version) -> bool {
        let Some(mut teller) = ProfileTeller::asked_for(part, ask) else {
            return false;
        };
        self.hold(now, part, ask);
        let told = &mut self.tellers[part as usize];
        // An answer to what was told before is on its way perhaps, and counts for nothing.
        teller.seq = told.seq;
        teller.board_up(now, version, true);
        *told = teller;
        self.told = hash_of(&self.tellers);
        true
    }

    /// The same where the board obeys it already. Returns whether it does.
    pub fn renew(&mut self, now: Duration, part: Part, ask: &Ask) -> bool {
        let told = &self.tellers[part as usize];
        let asked = ProfileTeller::asked_for(part, ask);
        let is_told = asked.is_some_and(|asked| asked.settings.iter().eq(told.settings.iter()));
        let is_obeyed = is_told && told.state == ProfileState::Accepted;
        if is_obeyed {
            self.hold(now, part, ask);
        }
        is_obeyed
    }

    /// Notes until when a part is tried.
    fn hold(&mut self, now: Duration, part: Part, ask: &Ask) {
        let trial = &mut self.trials[part as usize];
        let before = trial.take().map(|trial| trial.before);
        if ask.trial_ms > 0 {
            *trial = Some(Trial {
                before: before.unwrap_or_else(|| self.tellers[part as usize].clone()),
                until: now + Duration::from_millis(ask.trial_ms.into()),
            });
        }
    }

    /// Takes back what nobody tries any more. Returns those parts.
    pub fn lapse(&mut self, now: Duration) -> Vec<Part> {
        let mut over = Vec::new();
        for part in Part::ALL {
            let trial = self.trials[part as usize].take_if(|trial| trial.until <= now);
            let Some(Trial { mut before, .. }) = trial else {
                continue;
            };
            let told = &mut self.tellers[part as usize];
            before.seq = told.seq;
            match told.state {
                ProfileState::NoBoard => before.board_down(),
                // A board took it, so it takes settings.
                _ => before.board_up(now, Version::One, true),
            }
            *told = before;
            over.push(part);
        }
        if !over.is_empty() {
            self.told = hash_of(&self.tellers);
        }
        over
    }

    /// A board has come up and gets everything.
    pub fn board_up(&mut self, now: Duration, up: &Up) {
        let forgot = up.fresh || up.rebooted;
        for (part, teller) in self.parts() {
            if part.board() == up.callsign {
                teller.board_up(now, up.version, forgot);
            }
        }
    }

    /// A board is not up any more.
    pub fn board_down(&mut self, board: Callsign) {
        for (part, teller) in self.parts() {
            if part.board() == board {
                teller.board_down();
            }
        }
    }

    /// The setting to send to `board` now, if any.
    pub fn poll(&mut self, now: Duration, board: Callsign) -> Option<Setting> {
        for (part, teller) in self.parts() {
            if part.board() != board {
                continue;
            }
            let setting = teller.poll(now);
            if setting.is_some() || teller.state == ProfileState::Telling {
                return setting;
            }
        }
        None
    }

    /// When [`Profiles::poll`] next has something to do.
    pub fn next_due(&self) -> Option<Duration> {
        let [steering, sensors, arm] = &self.tellers;
        let arm = (steering.state != ProfileState::Telling).then_some(arm);
        let tellers = [Some(steering), Some(sensors), arm].into_iter().flatten();
        let trials = self.trials.iter().flatten().map(|trial| trial.until);
        tellers
            .filter_map(ProfileTeller::next_due)
            .chain(trials)
            .min()
    }

    /// A board has answered. Returns whether the bridge was waiting for this answer.
    pub fn answer(&mut self, now: Duration, reply: &SettingReply) -> bool {
        let mut tellers = self.tellers.iter_mut();
        tellers.any(|teller| teller.answer(now, reply))
    }

    /// How far a part has got.
    pub fn state(&self, part: Part) -> ProfileState {
        self.tellers[part as usize].state()
    }

    /// How far each part has got.
    pub fn states(&self) -> States {
        let [steering, sensors, arm] = self.tellers.each_ref().map(ProfileTeller::state);
        [
            (Part::Steering, steering),
            (Part::Sensors, sensors),
            (Part::Arm, arm),
        ]
    }

    /// Whether the wheels may move, by what both boards know. A limp arm hangs somewhere, and a person
    /// may have his hands at it.
    pub fn wheels(&self) -> Gate {
        if self.tellers[2].settings.first().is_some_and(is_limp) {
            return Gate::Held;
        }
        let [steering, sensors, _] = self.tellers.each_ref().map(ProfileTeller::gate);
        match (steering, sensors) {
            (Gate::Open, gate) | (gate, Gate::Open) => gate,
            (Gate::Shut, _) | (_, Gate::Shut) => Gate::Shut,
            (Gate::Held, Gate::Held) => Gate::Held,
        }
    }

    /// Whether the arm may move.
    pub fn arm(&self) -> Gate {
        self.tellers[2].gate()
    }

    /// Writes its part of `link/health`.
    pub fn fill(&self, health: &mut Health) {
        let [steering, sensors, arm] = self.tellers.each_ref().map(ProfileTeller::state);
        health.steering_profile = steering.into();
        health.sensor_profile = sensors.into();
        health.arm_profile = arm.into();
        health.description = self.told;
    }

    fn parts(&mut self) -> impl Iterator<Item = (Part, &mut ProfileTeller)> {
        Part::ALL.into_iter().zip(&mut self.tellers)
    }
}

/// Whether a setting makes the arm limp.
fn is_limp(setting: &Setting) -> bool {
    setting.key == SettingKey::ArmTorqueLimit && setting.value == LIMP.cast_signed()
}

/// A hash of all settings. It is folded, because half of one tells two descriptions apart as well.
fn hash_of(tellers: &[ProfileTeller; 3]) -> u32 {
    let settings = tellers.iter().flat_map(|teller| &teller.settings);
    let hash = settings.fold(hash::START, |hash, Setting { key, value, .. }| {
        let [low, high] = value.to_le_bytes();
        hash::bytes(hash, &[key.code(), low, high])
    });
    (hash ^ hash >> u32::BITS) as u32
}

/// One profile and how much of it the board has taken.
#[derive(Clone, Debug)]
pub struct ProfileTeller {
    /// Every value, and then the check value.
    settings: List<Setting, MOST>,
    state: ProfileState,
    /// The board that was told last has the profile in force, unless it restarts.
    is_known: bool,
    /// How many settings the board has taken.
    taken: usize,
    seq: u8,
    tries: u8,
    next_try: Option<Duration>,
}

impl ProfileTeller {
    /// Sends `profile`, which its owner has validated, to every board that comes up.
    pub fn new<P: Profile>(profile: &P) -> Self {
        Self {
            settings: profile.settings().collect(),
            state: ProfileState::NoBoard,
            is_known: false,
            taken: 0,
            seq: 0,
            tries: 0,
            next_try: None,
        }
    }

    /// Sends the part of a profile that a request describes, if a board can obey it.
    fn asked_for(part: Part, ask: &Ask) -> Option<Self> {
        match part {
            Part::Steering => ask.told::<SteeringProfile>().as_ref().map(Self::new),
            Part::Sensors => ask.told::<SensorProfile>().as_ref().map(Self::new),
            Part::Arm => ask.told::<ArmProfile>().as_ref().map(Self::new),
        }
    }

    /// The board has come up and gets everything. `forgot`: it has started since it was told. An
    /// original board knows no profile.
    pub fn board_up(&mut self, now: Duration, version: Version, forgot: bool) {
        self.is_known &= !forgot;
        self.state = ProfileState::NoBoard;
        self.next_try = None;
        if version == Version::One {
            self.state = ProfileState::Telling;
            self.taken = 0;
            self.ask_next(now);
        }
    }

    /// The board is not up any more; another one may come.
    pub fn board_down(&mut self) {
        self.is_known = false;
        self.state = ProfileState::NoBoard;
        self.next_try = None;
    }

    /// The setting to send now, if any.
    pub fn poll(&mut self, now: Duration) -> Option<Setting> {
        if self.next_try.is_none_or(|due| due > now) {
            return None;
        }
        if self.tries == TRIES {
            self.state = ProfileState::Unanswered;
            self.tries = 0;
            self.next_try = Some(now + PAUSE);
            return None;
        }
        self.tries += 1;
        self.next_try = Some(now + RETRY);
        self.asked()
    }

    /// When [`ProfileTeller::poll`] next has something to do.
    pub fn next_due(&self) -> Option<Duration> {
        self.next_try
    }

    /// The board has answered. Returns whether the bridge was waiting for this answer.
    pub fn answer(&mut self, now: Duration, reply: &SettingReply) -> bool {
        let Some(asked) = self.asked().filter(|_| self.next_try.is_some()) else {
            return false;
        };
        if reply.key != asked.key || reply.seq != asked.seq {
            return false;
        }
        if reply.status != SettingStatus::Accepted || reply.value != asked.value {
            self.state = ProfileState::Refused;
            self.is_known = false;
            self.next_try = None;
        } else if self.taken + 1 == self.settings.len() {
            self.state = ProfileState::Accepted;
            self.is_known = true;
            self.next_try = None;
        } else {
            self.state = ProfileState::Telling;
            self.taken += 1;
            self.ask_next(now);
        }
        true
    }

    /// The progress.
    pub fn state(&self) -> ProfileState {
        self.state
    }

    /// Whether what depends on the profile may move. An original board knows no profile and has a
    /// robot of its own.
    pub fn gate(&self) -> Gate {
        match self.state {
            ProfileState::NoBoard | ProfileState::Accepted => Gate::Open,
            ProfileState::Telling if self.is_known => Gate::Open,
            ProfileState::Telling => Gate::Held,
            ProfileState::Refused | ProfileState::Unanswered => Gate::Shut,
        }
    }

    fn ask_next(&mut self, now: Duration) {
        self.seq = self.seq.wrapping_add(1);
        self.tries = 0;
        self.next_try = Some(now);
    }

    fn asked(&self) -> Option<Setting> {
        let setting = self.settings.get(self.taken)?;
        let seq = self.seq;
        Some(Setting { seq, ..*setting })
    }
}

#[cfg(test)]
mod tests;
