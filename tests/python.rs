//! Tests of the Python package `bus/python`, in the environment into which `tests/run` installs it.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use lager_ports::{BUS_VERSION, Bus, BusConfig, Cause, Publisher, Subscriber};
use lager_sample::{Make, Qos, Stamp, StructInfo, Tag, Topic, coded, payload};
use lager_tests::{Domain, in_tree};
use lager_topics::{
    LAGER, LineFrame, NavMap, Role, SensorDistance, SensorLine, TOPICS, WarehouseMap,
};
use lager_wire::LineState;
use serde_json::{Value, json};

coded! {
    /// The state of the sky.
    pub enum Sky {
        /// No clouds.
        Clear = 0,
        /// The sky cannot be seen.
        Fog = 7,
    }
}

payload! {
    /// The measurements of a weather station.
    pub struct Weather: 24 bytes {
        /// Wind in mm/s.
        pub wind: u32,
        /// The direction from which the wind blows, in degrees.
        pub from: u16,
        /// The sky.
        pub sky: Tag<Sky>,
        /// Always 0.
        pub reserved: u8,
        /// The last gusts in mm/s.
        pub gusts: [u32; 4],
    }
}

/// A topic that the robot's table does not have.
#[derive(Clone, Copy, Debug)]
struct WeatherNow;

impl Topic for WeatherNow {
    const NAME: &'static str = "weather/now";
    type Payload = Weather;
    const QOS: Qos = Qos::stream(64);
    const SUMMARY: &'static str = "The weather.";
}

/// The number of frames of the paced stream, at 1000 a second: 60_000 is a minute.
const FRAMES: &str = "LAGER_SOAK_FRAMES";

fn frames() -> u64 {
    std::env::var(FRAMES).map_or(2_000, |text| {
        text.replace('_', "").parse().expect("a number of frames")
    })
}

fn python() -> Command {
    let python = std::env::var_os("LAGER_PYTHON").expect("LAGER_PYTHON names a Python");
    let mut command = Command::new(python);
    command.env("PYTHONDONTWRITEBYTECODE", "1");
    command
}

fn program(name: &str) -> PathBuf {
    in_tree("bus/python/tests").join(name)
}

/// A Python program that the test controls line by line; dropping it kills the process.
struct Led {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
}

impl Led {
    fn start(domain: &Domain, name: &str, frames: u64) -> Self {
        let mut child = python()
            .arg(program(name))
            .arg(domain.bus_folder())
            .arg(frames.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("Python starts");
        Self {
            to: child.stdin.take().expect("it is piped"),
            from: BufReader::new(child.stdout.take().expect("it is piped")),
            child,
        }
    }

    fn tell(&mut self, line: &str) {
        writeln!(self.to, "{line}").expect("it reads");
    }

    /// The program's next line. If it fails, its standard error has the reason.
    fn says(&mut self) -> Value {
        let mut line = String::new();
        self.from.read_line(&mut line).expect("it speaks UTF-8");
        serde_json::from_str(&line).unwrap_or_else(|_| panic!("it said `{line}`"))
    }
}

impl Drop for Led {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Adds a struct of the table and all structs inside it to `found`.
fn structs(info: StructInfo, found: &mut Vec<StructInfo>) {
    for field in info.fields {
        let mut make = field.make;
        while let Make::List(of, _) = make {
            make = *of;
        }
        if let Make::Record(inner) = make {
            structs(inner, found);
        }
    }
    if !found.contains(&info) {
        found.push(info);
    }
}

#[test]
#[ignore = "needs LAGER_PYTHON, a Python with the package bus/python; tests/run makes one"]
fn python_has_rusts_sizes_and_offsets_and_finds_the_same_bus() {
    let domain = Domain::new();
    let place = domain.bus("r1", 1.0).home().expect("the bus's folder");
    // The second round is on a cleared bus, which gives its files other names.
    for cleared in [false, true] {
        if cleared {
            let robot = "r1".parse().expect("a name");
            std::fs::create_dir_all(place.transport_folder()).expect("a folder");
            assert!(place.clear(&robot));
        }
        let place = domain.bus("r1", 1.0).home().expect("the bus's folder");
        let output = python()
            .arg(program("layouts.py"))
            .arg(domain.bus_folder())
            .output()
            .expect("Python starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        let theirs: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(theirs["prefix"], place.prefix());
        assert_eq!(
            Path::new(theirs["root"].as_str().unwrap()),
            place.transport_folder()
        );
        assert_eq!(
            format!("iceoryx2 {}", theirs["iceoryx2"].as_str().unwrap()),
            BUS_VERSION
        );
        assert_eq!(theirs["observers"], SensorLine::QOS.observers);

        let mut ours = Vec::new();
        structs(StructInfo::of::<Stamp>(), &mut ours);
        for entry in TOPICS {
            structs(entry.layout, &mut ours);
        }
        assert_eq!(theirs["ctypes"].as_object().unwrap().len(), ours.len());
        for info in ours {
            let fields: Value = info
                .fields
                .iter()
                .map(|field| (field.name.to_owned(), json!([field.offset, field.size])))
                .collect::<serde_json::Map<_, _>>()
                .into();
            let name = info.type_name;
            let by_numpy = json!({"size": info.size, "fields": fields});
            assert_eq!(theirs["numpy"][name], by_numpy, "{name}");
            let by_ctypes = json!({"size": info.size, "align": info.align, "fields": fields});
            assert_eq!(theirs["ctypes"][name], by_ctypes, "{name}");
            assert_eq!(
                theirs["hashes"][name],
                format!("{:016x}", info.hash),
                "{name}"
            );
        }
    }
}

fn send(publisher: &Publisher<SensorLine>, number: u64) {
    let mut frame = LineFrame {
        link_epoch: u32::try_from(number).expect("a small number"),
        state: LineState::FourWay.into(),
        ..LineFrame::default()
    };
    frame.bits = (number & 0x7FF) as u16;
    publisher.send(Cause::OWN, frame).expect("it is sent");
}

/// Publishes 1000 frames a second, and receives them here as well.
fn stream(publisher: &Publisher<SensorLine>, beside: &mut Subscriber<SensorLine>, frames: u64) {
    let start = Instant::now();
    for number in 0..frames {
        send(publisher, number);
        while beside.receive().expect("it is read").is_some() {}
        let due = start + Duration::from_millis(number + 1);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
    }
}

fn bridge(domain: &Domain) -> Bus {
    Bus::open(&domain.bus("r1", 1.0), Role::Bridge).expect("the bus opens")
}

#[test]
#[ignore = "needs LAGER_PYTHON, a Python with the package bus/python; tests/run makes one"]
fn python_reads_what_rust_reads_and_counts_what_it_missed() {
    let domain = Domain::new();
    let frames = frames();
    let bus = bridge(&domain);
    let mut reader = Led::start(&domain, "reading.py", frames);
    assert_eq!(reader.says()["ready"], true);
    let mut beside = domain
        .observe("r1", 1.0)
        .subscriber::<SensorLine>()
        .unwrap();
    let publisher = bus.publisher::<SensorLine>().expect("a publisher");
    let distances = bus.publisher::<SensorDistance>().expect("a publisher");

    stream(&publisher, &mut beside, frames);
    let read = reader.says();
    println!("of {frames}: Rust {}, Python {read}", beside.received());
    let [received, lost] = ["received", "lost"].map(|key| read[key].as_u64().unwrap());
    assert_eq!(beside.received() + beside.lost(), frames);
    assert_eq!(received + lost, frames);
    if std::env::var_os(FRAMES).is_some() {
        // On a machine that does nothing else, both receivers get every frame.
        assert_eq!((received, beside.received()), (frames, frames));
    }

    // 256 of them fit into its queue.
    (frames..frames + 1000).for_each(|number| send(&publisher, number));
    reader.tell("burst");
    let burst = json!({"received": received + 256, "lost": lost + 744, "last": frames + 999});
    assert_eq!(reader.says(), burst);

    (frames + 1000..frames + 1004).for_each(|number| send(&publisher, number));
    let maps = bus.publisher::<NavMap>().expect("a publisher");
    let mut map = WarehouseMap::default();
    map.products[1].id = 7;
    maps.send(Cause::OWN, map).expect("it is sent");
    reader.tell("four more");
    assert_eq!(reader.says()["late"], true);
    maps.tick();
    reader.tell("map");
    assert_eq!(reader.says()["done"], true);
    assert!(reader.child.wait().expect("a child").success());
    drop((publisher, distances, maps, beside, bus));
    domain.assert_clean();
}

#[test]
#[ignore = "needs LAGER_PYTHON, a Python with the package bus/python; tests/run makes one"]
fn python_reads_a_topic_that_is_in_no_table() {
    let domain = Domain::new();
    let bus = Bus::open(&domain.bus("r1", 1.0), Role::Guest).expect("the bus opens");
    let publisher = bus.publisher::<WeatherNow>().expect("a publisher");
    let mut reader = Led::start(&domain, "own.py", 0);
    assert_eq!(reader.says()["ready"], true);
    for number in 0..10 {
        let wind = number * 100;
        let weather = Weather {
            wind,
            from: 90,
            sky: Sky::Fog.into(),
            gusts: [0, wind + 1, 0, 0],
            ..Weather::default()
        };
        publisher.send(Cause::OWN, weather).expect("it is sent");
    }
    assert_eq!(reader.says(), json!({"received": 10, "lost": 0}));
    assert!(reader.child.wait().expect("a child").success());
    drop((publisher, bus));
    domain.assert_clean();
}

#[test]
#[ignore = "needs LAGER_PYTHON, a Python with bus/python[remote]; tests/run makes one"]
#[cfg(feature = "zenoh")]
fn python_reads_a_robot_elsewhere_by_its_gateway_as_it_reads_the_bus() {
    let domain = Domain::new();
    for args in [
        ["keys", "authority"].as_slice(),
        &["keys", "robot", "r1"],
        &["keys", "listener", "py"],
    ] {
        domain.done(args);
    }
    let keys = domain.folder().join("keys");
    let file = |name: &str| keys.join(name).display().to_string();
    let tls = format!("tls/{}", lager_tests::free());
    let config = domain.folder().join("robot.toml");
    let text = format!(
        "[gateway.zenoh]\nauthority = {:?}\ncertificate = {:?}\nkey = {:?}\n",
        file("authority.pem"),
        file("r1.pem"),
        file("r1.key")
    );
    std::fs::write(&config, text).expect("a file");
    let proof = [file("authority.pem"), file("py.pem"), file("py.key")];
    let up = domain.start(&["up", "--headless", "--no-station"]);
    let bus = Bus::open(&domain.bus("r1", 1.0), Role::Guest).expect("the bus opens");
    let publisher = bus.publisher::<WeatherNow>().expect("a publisher");
    let config = config.display().to_string();
    for (endpoint, proof) in [
        (format!("tcp/{}", lager_tests::free()), &[][..]),
        (tls, &proof[..]),
    ] {
        let gateway = domain.start(&["--config", &config, "gateway", "--zenoh", &endpoint]);
        lager_tests::wait_for("the gateway", || {
            let listed = ["--config", &config, "topic", "list", "--remote", &endpoint];
            let listed = domain.run(&listed);
            let text = String::from_utf8_lossy(&listed.stdout).into_owned();
            text.contains("weather/now").then_some(())
        });
        let mut reader = python()
            .arg(program("remote.py"))
            .arg(&endpoint)
            .args(proof)
            .stdout(Stdio::piped())
            .spawn()
            .expect("Python starts");
        let mut told = BufReader::new(reader.stdout.take().expect("it is piped")).lines();
        let ready = told.next().expect("a line").expect("it speaks UTF-8");
        assert_eq!(ready, r#"{"ready": true}"#);
        let mut wind = 0;
        let ended = lager_tests::wait_for("the program's end", || {
            let weather = Weather {
                wind,
                from: 90,
                sky: Sky::Fog.into(),
                gusts: [0, wind + 1, 0, 0],
                ..Weather::default()
            };
            publisher.send(Cause::OWN, weather).expect("it is sent");
            wind += 1;
            std::thread::sleep(Duration::from_millis(5));
            reader.try_wait().expect("a child")
        });
        assert!(ended.success(), "at {endpoint}");
        let said = told.next().expect("a line").expect("it speaks UTF-8");
        assert!(said.contains("\"map\": ["), "{said}");
        drop(gateway);
    }
    drop((publisher, bus, up));
    domain.assert_clean();
}

#[test]
#[ignore = "needs LAGER_PYTHON, a Python with the package bus/python; tests/run makes one"]
fn without_a_folder_python_finds_the_bus_that_lager_would() {
    let usual = BusConfig::of(&LAGER).home().expect("this user's folder");
    let code = "from lagerrobot import _place; place = _place.find(None); \
                print(place.folder, place.prefix, place.root, sep=chr(10))";
    let output = python().args(["-c", code]).output().expect("Python starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let found = String::from_utf8_lossy(&output.stdout);
    let root = usual.transport_folder();
    let wanted = [
        &usual.folder().to_string_lossy(),
        usual.prefix(),
        &*root.to_string_lossy(),
    ];
    assert_eq!(found.lines().collect::<Vec<_>>(), wanted);
    // This fails, and the folder stays, if there is a file in it.
    let _ = std::fs::remove_dir(usual.folder());
}

#[test]
#[ignore = "needs LAGER_PYTHON, a Python with the package bus/python; tests/run makes one"]
fn only_an_operator_gives_commands_and_lager_gives_them_for_him() {
    let domain = Domain::new();
    let up = domain.start(&["up", "--headless", "--no-station"]);
    domain.done(&["topic", "echo", "link/health", "--count", "1", "--wait"]);
    let output = python()
        .arg(program("orders.py"))
        .arg(domain.bus_folder())
        .arg(lager_tests::lager())
        .output()
        .expect("Python starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    drop(up);
    domain.assert_clean();
}

#[test]
#[ignore = "needs LAGER_PYTHON, a Python with the package bus/python; tests/run makes one"]
fn python_counts_losses_by_rusts_laws() {
    let output = python().arg(program("streams.py")).output();
    let output = output.expect("Python starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}

#[test]
#[ignore = "needs LAGER_PYTHON, a Python with the package bus/python; tests/run makes one"]
fn the_package_is_typed_and_a_wrong_field_is_found() {
    let domain = Domain::new();
    let wrong = domain.folder().join("wrong.py");
    let right = std::fs::read_to_string(program("typed.py")).expect("a program");
    std::fs::write(&wrong, right.replace("data.bits", "data.bite")).expect("a file");
    let mypy = |file: &Path| {
        let mut command = python();
        command.args(["-m", "mypy", "--strict", "--cache-dir"]);
        command.arg(domain.folder().join("mypy"));
        command
            .current_dir(in_tree("bus/python"))
            .arg("lagerrobot")
            .arg(file);
        let output = command.output().expect("mypy starts");
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        (output.status.success(), said)
    };
    let (accepted, said) = mypy(&program("typed.py"));
    assert!(accepted, "{said}");
    let (accepted, said) = mypy(&wrong);
    assert!(
        !accepted && said.contains("\"LineFrame\" has no attribute \"bite\""),
        "{said}"
    );
}

#[test]
#[ignore = "needs LAGER_PYTHON, a Python with matplotlib; tests/run makes one"]
fn what_was_measured_is_drawn() {
    let domain = Domain::new();
    let row = json!({"name": "lager", "mode": "block", "regime": "plain", "what": "hop", "n": 2_000,
        "p50_ns": 4_100, "p90_ns": 5_000, "p99_ns": 9_300, "p999_ns": null, "p9999_ns": null,
        "p99999_ns": null, "max_ns": 20_000});
    let report = json!({"machine": "two cores", "rows": [row.clone()]});
    let saved = json!({"layout": 1, "machine": {"processor": "two cores"}, "rows": [row]});
    for (name, measured, words) in [
        ("bars", report, "median"),
        ("curves", saved, "one sample in so many"),
    ] {
        let [file, picture] =
            ["json", "svg"].map(|end| domain.folder().join(name).with_extension(end));
        std::fs::write(&file, measured.to_string()).expect("a file");
        let mut plot = python();
        // Text stays text in the picture.
        plot.env("MPLCONFIGDIR", domain.folder());
        std::fs::write(domain.folder().join("matplotlibrc"), "svg.fonttype: none\n")
            .expect("a file");
        plot.arg(in_tree("benches/plot"));
        let said = plot.args([&file, &picture]).output().expect("it starts");
        let said = String::from_utf8_lossy(&said.stderr);
        let drawn = std::fs::read_to_string(picture).unwrap_or_else(|_| panic!("{said}"));
        assert!(
            drawn.contains("</svg>") && drawn.contains(words),
            "{name}: {said}"
        );
    }
}
