//! The gate in front of the station. If the station has secrets, a robot must prove its name before
//! the station listens to it. Pure: lines in, verdicts out.
//!
//! ```text
//!   fresh ── lager 1 r1 ──> asked ── proof, right ──> open
//!     │                       └───── anything else ──> refused
//!     └── a line of the document ──> plain: a robot without a name, which may not take one later
//! ```
//! A station without secrets leaves the gate open and believes every robot.

use std::io;

use lager_lines::Name;
use lager_lines::extension::{Hello, Proof};
use lager_lines::secret::{Meeting, Nonce, Secrets, Side};

/// The gate of one connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Gate {
    /// The gate lets every line pass.
    Open,
    /// The peer has said nothing. If it says a name, it must prove it.
    Fresh,
    /// The robot must prove its name; with its first line and the gate's question.
    Asked(Hello, Nonce),
    /// The robot speaks the document's language and has no name of its own.
    Plain,
}

/// The gate's verdict on a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// The station gets the line.
    Pass,
    /// The gate asks the peer for a proof. The station does not get the line.
    Ask(Proof),
    /// The peer has proved its name. It gets the station's own proof, and the station gets the
    /// robot's first line.
    Proved(Proof, Hello),
    /// The connection ends, and the peer is told why.
    Refuse(String),
}

impl Gate {
    /// The gate of a new connection.
    pub(crate) fn new(secrets: &Secrets) -> Self {
        match secrets.is_empty() {
            true => Self::Open,
            false => Self::Fresh,
        }
    }

    /// Judges a line. Takes a `nonce` for the question when the peer must prove its name.
    pub(crate) fn judge(
        &mut self,
        secrets: &Secrets,
        line: &str,
        nonce: impl FnOnce() -> io::Result<Nonce>,
    ) -> Verdict {
        let hello = Hello::read(line);
        match (&*self, hello) {
            (Self::Open, _) | (Self::Plain, None) => Verdict::Pass,
            // The station itself says what is wrong with it.
            (Self::Fresh, Some(Err(_))) => Verdict::Pass,
            (Self::Fresh, None) => {
                *self = Self::Plain;
                Verdict::Pass
            }
            (Self::Fresh, Some(Ok(hello))) => match (secrets.of(&hello.name), nonce()) {
                (Some(_), Ok(nonce)) => {
                    *self = Self::Asked(hello, nonce);
                    Verdict::Ask(Proof::Asked(nonce))
                }
                (None, _) => Verdict::Refuse(format!(
                    "this station knows no secret of robot {}; write `{0} <secret>` into the file \
                     of its --robots-secret",
                    hello.name
                )),
                (Some(_), Err(error)) => {
                    Verdict::Refuse(format!("robot {} cannot be asked: {error}", hello.name))
                }
            },
            (Self::Asked(asked, stations), _) => {
                let proved = prove(secrets, &asked.name, *stations, line);
                let verdict = match proved {
                    Some(proof) => Verdict::Proved(proof, asked.clone()),
                    None => Verdict::Refuse(unproved(&asked.name)),
                };
                *self = Self::Open;
                verdict
            }
            (Self::Plain, Some(_)) => Verdict::Refuse(
                "a robot says its name in the first line of a connection".to_owned(),
            ),
        }
    }
}

/// The station's own proof, if `line` is a right proof of the robot.
fn prove(secrets: &Secrets, robot: &Name, stations: Nonce, line: &str) -> Option<Proof> {
    let Some(Ok(Proof::Robot(robots, code))) = Proof::read(line) else {
        return None;
    };
    let secret = secrets.of(robot)?;
    let meeting = Meeting {
        robot,
        stations,
        robots,
    };
    let is_proved = secret.is_proved(Side::Robot, &meeting, &code);
    is_proved.then(|| Proof::Station(secret.code(Side::Station, &meeting)))
}

fn unproved(robot: &Name) -> String {
    format!(
        "somebody says that he is robot {robot} and does not prove it; the robot needs the secret \
         that this station knows: `lager up --secret FILE`"
    )
}

#[cfg(test)]
mod tests {
    use lager_lines::secret::Secret;

    use super::*;

    fn name(name: &str) -> Name {
        Name::new(name).expect("a name")
    }

    fn secrets() -> Secrets {
        Secrets::read("r1 0123456789abcdef\nr2 fedcba9876543210").expect("secrets")
    }

    fn secret_of(robot: &str) -> Secret {
        secrets().of(&name(robot)).expect("it has one").clone()
    }

    /// One by one, with what came of each.
    fn judged(gate: &mut Gate, lines: &[&str]) -> Vec<Verdict> {
        let judge = |line: &&str| gate.judge(&secrets(), line, || Ok(Nonce::new([9; 16])));
        lines.iter().map(judge).collect()
    }

    /// What the robot by this name says to the nonce of these tests.
    fn proof(robot: &str, secret: &Secret) -> Proof {
        let robot = name(robot);
        let meeting = Meeting {
            robot: &robot,
            stations: Nonce::new([9; 16]),
            robots: Nonce::new([7; 16]),
        };
        Proof::Robot(meeting.robots, secret.code(Side::Robot, &meeting))
    }

    #[test]
    fn who_knows_the_secret_passes_and_learns_that_the_station_knows_it() {
        let mut gate = Gate::new(&secrets());
        let proof = proof("r1", &secret_of("r1"));
        let all = judged(&mut gate, &["lager 1 r1", &proof.to_string(), "sidelength"]);
        let [
            Verdict::Ask(Proof::Asked(_)),
            Verdict::Proved(Proof::Station(code), hello),
            Verdict::Pass,
        ] = &all[..]
        else {
            panic!("{all:?}");
        };
        assert_eq!(hello.name, name("r1"));
        let robot = name("r1");
        let meeting = Meeting {
            robot: &robot,
            stations: Nonce::new([9; 16]),
            robots: Nonce::new([7; 16]),
        };
        assert!(secret_of("r1").is_proved(Side::Station, &meeting, code));
        assert_eq!(gate, Gate::Open);
    }

    #[test]
    fn an_impostor_is_refused_whatever_he_says_and_the_station_hears_nothing() {
        let of_another = proof("r1", &secret_of("r2")).to_string();
        let by_another = proof("r2", &secret_of("r2")).to_string();
        for second in [
            "sidelength",
            "lager 1 r1",
            "stopped 1 3",
            "proof",
            of_another.as_str(),
            by_another.as_str(),
        ] {
            let mut gate = Gate::new(&secrets());
            let all = judged(&mut gate, &["lager 1 r1", second]);
            let [Verdict::Ask(_), Verdict::Refuse(why)] = &all[..] else {
                panic!("{second}: {all:?}");
            };
            assert!(why.contains("robot r1 and does not prove it"), "{why}");
        }
        let all = judged(&mut Gate::new(&secrets()), &["lager 1 r3"]);
        let [Verdict::Refuse(why)] = &all[..] else {
            panic!("{all:?}");
        };
        assert!(why.contains("`r3 <secret>`"), "{why}");
    }

    #[test]
    fn a_robot_of_the_document_needs_no_secret_and_gets_no_name_by_that() {
        let mut gate = Gate::new(&secrets());
        let all = judged(&mut gate, &["sidelength", "karta", "lager 1 r1"]);
        let [Verdict::Pass, Verdict::Pass, Verdict::Refuse(why)] = &all[..] else {
            panic!("{all:?}");
        };
        assert!(why.contains("the first line"), "{why}");
    }

    #[test]
    fn without_secrets_everybody_is_taken_at_his_word() {
        let mut gate = Gate::new(&Secrets::default());
        let all = judged(&mut gate, &["lager 1 r1", "sidelength"]);
        assert_eq!(all, [Verdict::Pass, Verdict::Pass]);
    }
}
