//! Tests of the description in a file of its own.

use lager_wire::{JointServos, OneOrTwo, ReversedJoints};

use super::*;

/// A folder that goes with its owner.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let name = format!("lager-robot-{name}-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).expect("a folder");
        Self(folder)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A configuration whose description is this text.
fn described(text: &str, config: Config) -> Result<Config> {
    let of_test = std::thread::current().name().map(str::to_owned);
    let of_test = of_test.unwrap_or_default().replace(':', "-");
    let folder = Folder::new(&of_test);
    let path = folder.0.join("robot.toml");
    std::fs::write(&path, text).expect("a file");
    let mut config = Config {
        robot: Some(path),
        ..config
    };
    config.describe().map(|()| config)
}

fn refused(text: &str) -> String {
    let error = described(text, Config::default()).expect_err("it is wrong");
    format!("{error:#}")
}

fn other() -> Config {
    Config {
        wheels: WheelsProfile {
            swapped: true,
            left_reversed: true,
            full_turn_ms: 9_000,
            ..WheelsProfile::default()
        },
        line: LineProfile {
            dark_is_high: false,
        },
        distance: RangerProfile {
            model: IrModel::Gp2y0a41,
            ..RangerProfile::default()
        },
        battery: BatterySection {
            divider: Some(false),
        },
        arm: ArmProfile {
            squeeze_load: 250,
            servos: JointServos {
                base: 11,
                shoulder: OneOrTwo::One(2),
                ..JointServos::default()
            },
            reversed: ReversedJoints {
                elbow: true,
                ..ReversedJoints::default()
            },
            ..ArmProfile::default()
        },
        logic: LogicSection {
            cruise_mm_per_s: 60.5,
            ..LogicSection::default()
        },
        buttons: ButtonsSection {
            chip: Some("/dev/gpiochip0".into()),
            switch: Some(6),
            ..ButtonsSection::default()
        },
        ..Config::default()
    }
}

#[test]
fn what_one_machine_prints_another_reads() {
    let text = other().described();
    let there = described(&text, Config::default()).expect("valid");
    assert_eq!(there.robot(), other().robot(), "{text}");
    assert_eq!(
        (&there.logic, &there.buttons),
        (&other().logic, &other().buttons)
    );
    let same = described(&text, other()).expect("both say the same");
    assert_eq!(same.robot(), other().robot());
    for strange in ["[serial]", "name =", "[station]", "secret"] {
        assert!(!text.contains(strange), "{text}");
    }
    assert_eq!(
        there.built(),
        "motors swapped, left motor reversed, a full turn in 9000 ms, line sensors that read \
         low over tape, IR ranger GP2Y0A41, no battery divider, servos with other ids, \
         reversed joints, an arm of its own"
    );
    assert_eq!(Config::default().built(), "as the simulated robot");
}

#[test]
fn a_wrong_description_is_refused_with_its_file_and_what_to_do() {
    for (text, words) in [
        ("[wheels]\nswaped = true\n", "did you mean `swapped`?"),
        ("[wheels]\nduty = 9\n", "[wheels] duty is 9"),
        ("[line]\ndark_is_high = 1\n", "true or false"),
        ("[arm.servos]\nbase = 300\n", "line 2, base = 300"),
        ("[arm.servos]\nbase = 254\n", "[arm.servos] base has id 254"),
        (
            "[arm.servos]\nwrist = 8\n",
            "wrist and gripper have the same id 8",
        ),
        (
            "[arm.servos]\nelbow = 300\n",
            "a whole number from 0 to 255",
        ),
        ("[arm.servos]\nelbow = [4, 5, 6]\n", "the two of a pair"),
        ("[arm.servos]\nelbow = []\n", "the id of one servo"),
        ("[arm.reversed]\nbase = 1\n", "true or false"),
        ("[arm.reversed]\nclaw = true\n", "unknown field `claw`"),
        ("[distance]\nmodel = \"gp2y0a12\"\n", "gp2y0a21"),
        ("[serial]\nbaud = 9600\n", "unknown field `serial`"),
        ("wheels", "line 1"),
    ] {
        let said = refused(text);
        assert!(
            said.contains(words) && said.contains("robot.toml"),
            "{said}"
        );
    }
    let mut nowhere = Config {
        robot: Some("/nowhere/robot.toml".into()),
        ..Config::default()
    };
    let said = format!("{:#}", nowhere.describe().expect_err("no file"));
    assert!(said.contains("/nowhere/robot.toml"), "{said}");
}

#[test]
fn two_files_that_say_something_else_are_refused() {
    let config = Config {
        wheels: WheelsProfile {
            swapped: true,
            ..WheelsProfile::default()
        },
        ..Config::default()
    };
    let error = described("[wheels]\nswapped = false\n", config).expect_err("two");
    let said = format!("{error:#}");
    assert!(
        said.contains("[wheels] stands in the configuration"),
        "{said}"
    );
    assert!(said.contains("take it out of one"), "{said}");
}

#[test]
fn what_is_written_is_read_and_can_be_taken_back() {
    let folder = Folder::new("keep");
    let place = folder.0.join("robots/table.toml");
    let configured = Config {
        robot: Some(place.clone()),
        ..Config::default()
    };
    let told = configured.forget_description().expect_err("nothing");
    assert!(told.to_string().contains("nothing to go back"), "{told}");
    let read = || {
        let mut config = configured.clone();
        config.describe().map(|()| config.wheels.full_turn_ms)
    };
    for turn in [9_000, 9_500] {
        let mut new = configured.clone();
        new.wheels.full_turn_ms = turn;
        assert_eq!(
            new.keep_description(&configured, true).expect("kept"),
            place
        );
        assert_eq!(read().expect("valid"), turn);
    }
    for _ in 0..2 {
        let (_, has_calibrated) = configured.forget_description().expect("there is one");
        assert!(has_calibrated, "until that is taken back, too");
        assert_eq!(read().expect("valid"), 9_000);
    }

    configured.forget_calibration().expect("written");
    let (_, has_calibrated) = configured.forget_description().expect("there is one");
    assert!(!has_calibrated);
    assert_eq!(read().expect("valid"), 9_000);

    let contradicts = Config {
        wheels: WheelsProfile {
            duty: 90,
            ..WheelsProfile::default()
        },
        ..configured.clone()
    };
    let told = configured
        .keep_description(&contradicts, true)
        .expect_err("two");
    assert!(told.to_string().contains("take it out of one"), "{told}");
    assert_eq!(read().expect("as before"), 9_000);

    let simulated = Config::default();
    let told = simulated
        .keep_description(&simulated, false)
        .expect_err("no file");
    assert!(told.to_string().contains("robot = \"FILE\""), "{told}");
}

#[test]
fn the_first_description_leaves_none_when_it_is_taken_back() {
    let folder = Folder::new("first");
    let configured = Config {
        robot: Some(folder.0.join("robot.toml")),
        ..Config::default()
    };
    let path = configured
        .keep_description(&configured, true)
        .expect("kept");
    configured.forget_description().expect("taken back");
    assert!(!path.exists());
}

#[test]
fn only_real_boards_have_the_description_of_the_state_folder() {
    let folder = Folder::new("state");
    let mut config = Config {
        state: Some(folder.0.clone()),
        body: Body::Serial,
        ..Config::default()
    };
    config.describe().expect("there is none");
    assert!(!config.is_described(), "real boards stand");
    std::fs::create_dir(folder.0.join("r1")).expect("a folder");
    let file = folder.0.join("r1/robot.toml");
    std::fs::write(&file, "[wheels]\nswapped = true\n").expect("a file");
    assert_eq!(config.robot_file().expect("a folder"), Some(file));
    let mut simulated = Config {
        body: Body::Sim,
        ..config.clone()
    };
    config.describe().expect("valid");
    simulated.describe().expect("not read");
    assert!(config.wheels.swapped && !simulated.wheels.swapped);
    assert!(config.is_described() && simulated.is_described());
}
