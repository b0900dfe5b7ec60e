//! The secret of a link: what is said to prove it, and lists of secrets.

use lager_lines::Name;
use lager_lines::extension::Proof;
use lager_lines::secret::{Meeting, Nonce, Secret, SecretError, Secrets, Side};

const WORDS: &str = "correct-horse-battery-staple";
const STATIONS: &str = "00112233445566778899aabbccddeeff";
const ROBOTS: &str = "ffeeddccbbaa99887766554433221100";
/// As another implementation (Python's hmac) makes them.
const OF_ROBOT: &str = "aeb592396e1101590cabe658990a325f4a7f3cfab8663c3c5264a74c92f302c5";
const OF_STATION: &str = "813f2b80c5887191c6de8fed823294385ea178dbc3914a96881bed56dcc8c639";

fn secret(text: &str) -> Secret {
    let secrets = Secrets::read(text).expect("a secret");
    secrets.of_all().expect("one of all").clone()
}

fn name(name: &str) -> Name {
    Name::new(name).expect("a name")
}

fn nonce(digits: &str) -> Nonce {
    match Proof::read(&format!("prove {digits}")) {
        Some(Ok(Proof::Asked(nonce))) => nonce,
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_is_said_is_as_another_implementation_says_it() {
    let robot = name("r1");
    let meeting = Meeting {
        robot: &robot,
        stations: nonce(STATIONS),
        robots: nonce(ROBOTS),
    };
    let secret = secret(WORDS);
    let said = Proof::Robot(meeting.robots, secret.code(Side::Robot, &meeting));
    assert_eq!(said.to_string(), format!("proof {ROBOTS} {OF_ROBOT}"));
    let said = Proof::Station(secret.code(Side::Station, &meeting));
    assert_eq!(said.to_string(), format!("proved {OF_STATION}"));
    assert_eq!(secret.word("panel"), "8686c11b9e5ae866d8cac2f453f4131f");
}

#[test]
fn nothing_else_proves_it() {
    let (robot, other) = (name("r1"), name("r2"));
    let meeting = Meeting {
        robot: &robot,
        stations: nonce(STATIONS),
        robots: nonce(ROBOTS),
    };
    let secret = secret(WORDS);
    let code = secret.code(Side::Robot, &meeting);
    assert!(secret.is_proved(Side::Robot, &meeting, &code));
    // What was heard of one side, or of another connection, or for another robot.
    assert!(!secret.is_proved(Side::Station, &meeting, &code));
    for meeting in [
        Meeting {
            stations: nonce(ROBOTS),
            ..meeting
        },
        Meeting {
            robots: nonce(STATIONS),
            ..meeting
        },
        Meeting {
            robot: &other,
            ..meeting
        },
    ] {
        assert!(
            !secret.is_proved(Side::Robot, &meeting, &code),
            "{meeting:?}"
        );
    }
    let wrong = self::secret("correct-horse-battery-stapler");
    assert!(!wrong.is_proved(Side::Robot, &meeting, &code));
    // Nor does a part of it.
    for line in [
        format!("proof {ROBOTS}"),
        format!("proof {ROBOTS} {}", &OF_ROBOT[2..]),
        format!("proof {ROBOTS} {}", OF_ROBOT.to_uppercase()),
        format!("proved {OF_STATION} {OF_STATION}"),
        "prove".to_owned(),
    ] {
        assert!(Proof::read(&line).expect("of this kind").is_err(), "{line}");
    }
    assert_eq!(Proof::read("lager 1 r1"), None);
}

#[test]
fn no_two_are_alike_and_none_is_shown() {
    let [one, two] = [(); 2].map(|()| Secret::random().expect("random bytes"));
    assert_eq!(one.as_str().len(), 64);
    assert_ne!(one, two);
    assert!(Secrets::read(one.as_str()).is_ok());
    assert!(!format!("{one:?} {:?}", Secrets::from(one.clone())).contains(one.as_str()));
    let [one, two] = [(); 2].map(|()| Nonce::random().expect("random bytes"));
    assert_ne!(one, two);
}

#[test]
fn a_list_has_one_of_each_robot_or_one_of_all() {
    let list = "# of the hall\n\nr1 correct-horse-battery-staple\r\n 0123456789abcdef \n";
    let list = Secrets::read(list).expect("a list");
    assert_eq!(list.of(&name("r1")).expect("its own").as_str(), WORDS);
    let of_all = list.of(&name("r2")).expect("that of all");
    assert_eq!(of_all.as_str(), "0123456789abcdef");
    let list = Secrets::read("r1 correct-horse-battery-staple").expect("a list");
    assert_eq!(list.of(&name("r2")), None);

    for (text, line, why) in [
        ("", 0, "there is no secret in it"),
        ("# nothing", 0, "there is no secret in it"),
        ("r1", 1, "not 2"),
        ("\nr1 short", 2, "16 to 256 characters, not 5"),
        ("r1 smörgåsbord-smörgåsbord", 1, "visible ASCII"),
        ("R1 correct-horse-battery-staple", 1, "'R' stands here"),
        (
            "r1 correct horse battery staple",
            1,
            "write `<name> <secret>`",
        ),
        ("0123456789abcdef\n0123456789abcdeg", 2, "already"),
        ("r1 0123456789abcdef\nr1 0123456789abcdef", 2, "already"),
    ] {
        let error = Secrets::read(text).expect_err(text);
        let said = error.to_string();
        assert!(said.contains(why), "{text:?}: {said}");
        let is_empty = error == SecretError::Empty;
        assert!(
            is_empty || said.contains(&format!("line {line}: ")),
            "{said}"
        );
    }
}
