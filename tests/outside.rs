//! Tests a crate outside the workspace, as a user of the bus would write it. The crate defines a
//! topic of its own, and the topic tools show its samples. Neither this crate nor the examples of
//! `lager-ports`, which it compiles as its own, need a crate of the robot.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use lager_tests::{Domain, wait_for};
use serde_json::{Value, json};

const MAIN: &str = r#"
use std::{error::Error, thread::sleep, time::Duration};

use lager_ports::{Bus, BusConfig, Cause};
use lager_sample::{Application, Part, Qos, Tag, Topic, coded, payload};

coded! {
    /// The plants in a bed.
    pub enum Plant {
        /// Red.
        Tomato = 0,
        /// Green.
        Cucumber = 4,
    }
}

payload! {
    /// A bed.
    pub struct Bed: 8 bytes {
        /// Soil temperatures in tenths of a degree.
        pub soil: [i16; 2],
        /// The plant that grows there.
        pub plant: Tag<Plant>,
        /// Fills the gap.
        pub reserved: [u8; 3],
    }
}

payload! {
    /// The measurements of a greenhouse.
    pub struct Greenhouse: 32 bytes {
        /// Humidity, from 0 to 1.
        pub humidity: f64,
        /// The number of waterings.
        pub waterings: u32,
        /// Fills the gap.
        pub reserved: [u8; 4],
        /// Two beds.
        pub beds: [Bed; 2],
    }
}

/// It can share a bus with a robot, whose names have the same prefix and whose parts are 0 to 11.
static GREENHOUSE: Application = Application::new("lager");
const GARDENER: Part = Part::new(12, "gardener");

struct Climate;

impl Topic for Climate {
    const NAME: &'static str = "greenhouse/climate";
    type Payload = Greenhouse;
    const QOS: Qos = Qos::stream(8);
    const SUMMARY: &'static str = "The climate of a greenhouse.";
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).map(Into::into);
    let bus = Bus::open(&BusConfig { folder, ..BusConfig::of(&GREENHOUSE) }, GARDENER)?;
    let climate = bus.publisher::<Climate>()?;
    let mut sample = Greenhouse { humidity: 0.75, ..Greenhouse::default() };
    sample.beds[1] = Bed { soil: [-12, 205], plant: Plant::Cucumber.into(), ..Bed::default() };
    loop {
        climate.send(Cause::OWN, sample)?;
        sample.waterings += 1;
        sleep(Duration::from_millis(20));
    }
}
"#;

fn root() -> PathBuf {
    lager_tests::in_tree("")
}

/// The crates of the bus that know no robot.
const ROBOT_FREE: [&str; 4] = ["lager-home", "lager-ports", "lager-sample", "lager-wake"];

/// Writes the crate, builds it and returns its program. The build uses the workspace's target
/// folder and lock file, so it downloads nothing and most crates are built already.
fn build(folder: &Path) -> PathBuf {
    let root = root();
    let path = |name: &str| root.join("bus").join(name).display().to_string();
    let manifest = format!(
        "[package]\nname = \"greenhouse\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n\
         [dependencies]\nlager-ports = {{ path = {:?} }}\nlager-sample = {{ path = {:?} }}\n\
         lager-wake = {{ path = {:?} }}\n\n\
         [profile.dev]\nopt-level = 1\ndebug = false\nlto = \"off\"\n\n[workspace]\n",
        path("ports"),
        path("sample"),
        path("wake"),
    );
    fs::create_dir_all(folder.join("src")).expect("a folder");
    fs::create_dir_all(folder.join("examples/weather")).expect("a folder");
    for (example, here) in EXAMPLES {
        let there = root.join("bus/ports/examples").join(example);
        fs::copy(there, folder.join("examples").join(here)).expect("an example");
    }
    fs::write(folder.join("Cargo.toml"), manifest).expect("a file");
    fs::write(folder.join("src/main.rs"), MAIN).expect("a file");
    fs::copy(root.join("Cargo.lock"), folder.join("Cargo.lock")).expect("a file");
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or(root.join("target"), PathBuf::from);
    let built = Command::new(env!("CARGO"))
        .args(["build", "--offline", "--bins", "--examples", "--target-dir"])
        .arg(&target)
        .current_dir(folder)
        .output()
        .expect("cargo runs");
    let said = String::from_utf8_lossy(&built.stderr);
    assert!(built.status.success(), "{said}");
    target.join("debug").join("greenhouse")
}

/// The examples of the bus, under names that no program of the workspace has.
const EXAMPLES: [(&str, &str); 4] = [
    ("act.rs", "outside-act.rs"),
    ("observe.rs", "outside-observe.rs"),
    ("publish.rs", "outside-publish.rs"),
    ("weather/mod.rs", "weather/mod.rs"),
];

/// This project's crates that are compiled into the crate's program.
fn crates_of_ours(folder: &Path) -> BTreeSet<String> {
    let tree = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--edges", "normal", "--prefix", "none"])
        .args(["--format", "{p}"])
        .current_dir(folder)
        .output()
        .expect("cargo runs");
    let said = String::from_utf8_lossy(&tree.stderr);
    assert!(tree.status.success(), "{said}");
    String::from_utf8_lossy(&tree.stdout)
        .lines()
        .filter_map(|line| line.split(' ').next())
        .filter(|name| name.starts_with("lager"))
        .map(str::to_owned)
        .collect()
}

/// The crate's program; dropping it kills the process.
struct Program(Child);

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn the_tools_decode_a_topic_of_a_crate_outside_the_workspace() {
    let domain = Domain::new();
    let folder = domain.folder().join("greenhouse");
    let program = build(&folder);
    let expected = ROBOT_FREE.map(str::to_owned);
    assert_eq!(crates_of_ours(&folder), BTreeSet::from(expected));
    let running = Command::new(&program)
        .arg(domain.bus_folder())
        .stdin(Stdio::null())
        .spawn();
    let running = Program(running.expect("the crate's program starts"));

    let echo = [
        "topic",
        "echo",
        "greenhouse/climate",
        "--count",
        "2",
        "--json",
    ];
    let output = wait_for("the topic", || {
        let output = domain.run(&echo);
        output.status.success().then_some(output)
    });
    let text = String::from_utf8_lossy(&output.stdout);
    let samples: Vec<Value> = text
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    assert_eq!(samples.len(), 2);
    let number = |sample: &Value| sample["sequence"].as_u64().expect("a number");
    assert_eq!(number(&samples[1]), number(&samples[0]) + 1);
    for sample in &samples {
        assert_eq!(sample["writer"], running.0.id());
        assert_eq!(sample["lost"], 0);
        let bed = |soil: [i16; 2], plant| json!({"soil": soil, "plant": plant});
        let expected = json!({
            "humidity": 0.75,
            "waterings": number(sample),
            "beds": [bed([0, 0], "Tomato"), bed([-12, 205], "Cucumber")],
        });
        assert_eq!(sample["payload"], expected);
    }

    let told = domain.run(&["topic", "list"]);
    let told = String::from_utf8_lossy(&told.stdout).into_owned();
    assert!(told.contains("lager/r1/greenhouse/climate"), "{told}");
    assert!(told.contains("1 publisher"), "{told}");
    let told = domain.run(&["topic", "info", "greenhouse/climate"]);
    let told = String::from_utf8_lossy(&told.stdout).into_owned();
    assert!(told.contains("Greenhouse, 32 bytes"), "{told}");
    let told = domain.run(&["topic", "echo", "greenhouse/climate", "--count", "1"]);
    let told = String::from_utf8_lossy(&told.stdout).into_owned();
    assert!(told.contains("by gardener"), "{told}");

    drop(running);
    // The next process on the bus removes the files that the killed one has left.
    let _ = domain.run(&["topic", "list"]);
    for (_, example) in &EXAMPLES[..3] {
        let example = Path::new(example).with_extension("");
        let _ = fs::remove_file(program.with_file_name("examples").join(example));
    }
    let _ = fs::remove_file(program);
    domain.assert_clean();
}
