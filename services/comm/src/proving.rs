//! How a connection begins for a robot that has a secret: it says and carries out nothing before
//! robot and station have proved to each other that they know it. Pure: lines in, lines out.
//!
//! ```text
//!   > lager 1 r1 ──> waits ──< prove ──> > proof ──> waits ──< proved ──> proved
//!                      │                              │
//!                      └── a thought, another line, a wrong code ──> refused
//! ```

use lager_lines::Name;
use lager_lines::conversation::RobotLine;
use lager_lines::extension::{Hello, Proof};
use lager_lines::secret::{Meeting, Nonce, Secret, Side};
use thiserror::Error;

/// Every sentence of a station begins with this.
pub(crate) const THOUGHT: &str = "thought ";

/// Why the robot does not accept the peer as its station.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub(crate) enum Unproved {
    /// It does not ask for a proof.
    #[error(
        "it does not ask the robot for a proof, so it knows no secret, and anybody may stand \
         there; `lager station --robots-secret FILE` knows one"
    )]
    Unasked,
    /// It knows another secret.
    #[error("its proof is wrong: it knows another secret than the robot")]
    Wrong,
    /// It says nothing about a proof.
    #[error(
        "it has not proved in 5 s that it knows the robot's secret, as an external computer does \
         that speaks the document's language alone; a robot without a secret talks to one"
    )]
    Silent,
    /// It refuses the robot, for this reason.
    #[error("it refuses the robot: {0}")]
    Told(String),
}

/// What to do after a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// Nothing.
    Wait,
    /// Send this line.
    Say(String),
    /// The peer is the robot's station.
    Proved,
}

/// The beginning of one connection.
#[derive(Debug)]
pub(crate) struct Proving {
    robot: Name,
    secret: Secret,
    robots: Nonce,
    stations: Option<Nonce>,
}

impl Proving {
    /// For the robot of this name. `robots` is the robot's nonce, chosen for this connection alone.
    pub(crate) fn new(robot: Name, secret: Secret, robots: Nonce) -> Self {
        Self {
            robot,
            secret,
            robots,
            stations: None,
        }
    }

    /// The first line.
    pub(crate) fn first(&self) -> String {
        let hello = Hello {
            version: Hello::VERSION,
            name: self.robot.clone(),
            clock_ms: None,
        };
        line(&RobotLine::Hello(hello))
    }

    /// The peer has sent a line.
    ///
    /// # Errors
    ///
    /// The peer is not the robot's station.
    pub(crate) fn heard(&mut self, said: &str) -> Result<Step, Unproved> {
        if let Some(why) = said.strip_prefix(THOUGHT) {
            return Err(Unproved::Told(shown(why)));
        }
        match (Proof::read(said), self.stations) {
            (Some(Ok(Proof::Asked(stations))), None) => {
                self.stations = Some(stations);
                let code = self.secret.code(Side::Robot, &self.meeting(stations));
                Ok(Step::Say(line(&Proof::Robot(self.robots, code))))
            }
            (Some(Ok(Proof::Station(code))), Some(stations)) => {
                let meeting = self.meeting(stations);
                match self.secret.is_proved(Side::Station, &meeting, &code) {
                    true => Ok(Step::Proved),
                    false => Err(Unproved::Wrong),
                }
            }
            (Some(_), _) => Err(Unproved::Wrong),
            (None, None) if Hello::read(said).is_none() => Ok(Step::Wait),
            (None, _) => Err(Unproved::Unasked),
        }
    }

    fn meeting(&self, stations: Nonce) -> Meeting<'_> {
        Meeting {
            robot: &self.robot,
            stations,
            robots: self.robots,
        }
    }
}

/// A line with its end.
fn line(line: &impl core::fmt::Display) -> String {
    format!("{line}\n")
}

/// A peer's text in a form that a terminal may show.
pub(crate) fn shown(text: &str) -> String {
    text.replace(char::is_control, " ")
}

#[cfg(test)]
mod tests {
    use lager_lines::secret::Secrets;

    use super::*;

    const STATIONS: &str = "00112233445566778899aabbccddeeff";

    fn secret(text: &str) -> Secret {
        let secrets = Secrets::read(text).expect("a secret");
        secrets.of_all().expect("one of all").clone()
    }

    fn robot() -> Proving {
        let name = Name::new("r1").expect("a name");
        Proving::new(name, secret("0123456789abcdef"), Nonce::new([7; 16]))
    }

    /// What a station with this secret says to what the robot has said.
    fn answered(said: &str, with: &str) -> String {
        let Some(Ok(Proof::Robot(robots, code))) = Proof::read(said.trim_end()) else {
            panic!("{said:?}");
        };
        let Some(Ok(Proof::Asked(stations))) = Proof::read(&format!("prove {STATIONS}")) else {
            panic!("a nonce");
        };
        let robot = Name::new("r1").expect("a name");
        let meeting = Meeting {
            robot: &robot,
            stations,
            robots,
        };
        let own = secret("0123456789abcdef");
        assert!(own.is_proved(Side::Robot, &meeting, &code));
        Proof::Station(secret(with).code(Side::Station, &meeting)).to_string()
    }

    fn asked(robot: &mut Proving) -> String {
        assert_eq!(robot.first(), "lager 1 r1\n");
        match robot.heard(&format!("prove {STATIONS}")) {
            Ok(Step::Say(said)) => said,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_station_with_the_same_secret_is_taken_and_one_with_another_is_not() {
        let mut one = robot();
        let said = asked(&mut one);
        assert_eq!(
            one.heard(&answered(&said, "0123456789abcdef")),
            Ok(Step::Proved)
        );
        let mut other = robot();
        let said = asked(&mut other);
        let wrong = answered(&said, "0123456789abcdeg");
        assert_eq!(other.heard(&wrong), Err(Unproved::Wrong));
    }

    #[test]
    fn who_does_not_prove_it_is_not_taken_whatever_he_says() {
        // What our station says that knows no secret, and what an impostor would say.
        assert_eq!(robot().heard("lager 1 station"), Err(Unproved::Unasked));
        for line in ["do 1 drive 2 200", "styrcomm 2", "stop 1"] {
            assert_eq!(robot().heard(line), Ok(Step::Wait), "{line}");
        }
        let mut echo = robot();
        let said = asked(&mut echo);
        let (_, code) = said.trim_end().rsplit_once(' ').expect("a code");
        assert_eq!(
            echo.heard(&format!("proved {code}")),
            Err(Unproved::Wrong),
            "what the robot has said itself is no proof"
        );
        let mut early = robot();
        let zeros = "0".repeat(64);
        assert_eq!(
            early.heard(&format!("proved {zeros}")),
            Err(Unproved::Wrong)
        );
        let mut twice = robot();
        asked(&mut twice);
        assert_eq!(
            twice.heard(&format!("prove {STATIONS}")),
            Err(Unproved::Wrong)
        );
        let mut silent = robot();
        asked(&mut silent);
        assert_eq!(silent.heard("lager 1 station"), Err(Unproved::Unasked));
    }

    #[test]
    fn a_station_that_refuses_says_why() {
        let why = robot()
            .heard("thought no secret\u{1b}[2J of r1")
            .expect_err("refused");
        assert_eq!(why, Unproved::Told("no secret [2J of r1".into()));
    }
}
