//! Tests of `--remote` over links that are slow, lose packets or are dead for a while. A part of the
//! program `vanished`, which has the networks.

use std::fs;
use std::process::Command;
use std::time::{Duration, Instant};

use lager_tests::{Domain, Running, wait_for};
use rustix::process::Signal;
use serde_json::Value;

use crate::{Network, OURS, apart, runs};

/// The other end of the robot's link, with a listener's certificate.
struct Afar<'a> {
    domain: &'a Domain,
    network: &'a Network,
    config: String,
    endpoint: String,
}

impl<'a> Afar<'a> {
    /// A robot with a gateway at this end of the link, which sends each of `rates`' topics at most so
    /// often, and a listener at the other one.
    fn new(domain: &'a Domain, network: &'a Network, rates: &[(&str, u32)]) -> (Self, Running) {
        domain.done(&["keys", "authority"]);
        domain.done(&["keys", "robot", "r1", "--address", OURS]);
        domain.done(&["keys", "listener", "dash"]);
        let keys = domain.folder().join("keys");
        let of = |name: &str| {
            let file = domain.folder().join(format!("{name}.toml"));
            let keys = keys.display();
            let text = format!(
                "[gateway.zenoh]\nauthority = \"{keys}/authority.pem\"\ncertificate = \
                 \"{keys}/{name}.pem\"\nkey = \"{keys}/{name}.key\"\n"
            );
            fs::write(&file, text).expect("a file");
            file.display().to_string()
        };
        let endpoint = format!("tls/{OURS}:7447");
        let of_robot = of("r1");
        let mut text = fs::read_to_string(&of_robot).expect("the file");
        text += "[gateway.zenoh.rates]\n";
        for (topic, hz) in rates {
            text += &format!("\"{topic}\" = {hz}\n");
        }
        fs::write(&of_robot, text).expect("the file");
        let up = domain.start(&[
            "--config",
            &of_robot,
            "up",
            "--headless",
            "--no-station",
            "--zenoh",
            &endpoint,
        ]);
        let config = of("dash");
        let afar = Self {
            domain,
            network,
            config,
            endpoint,
        };
        wait_for("the gateway", || {
            let listed = afar
                .command(&["topic", "list"])
                .output()
                .expect("a program");
            listed.status.success().then_some(())
        });
        (afar, up)
    }

    fn command(&self, args: &[&str]) -> Command {
        let args = [
            &["--config", &self.config],
            args,
            &["--remote", &self.endpoint],
        ]
        .concat();
        let lager = self.domain.lager(&args);
        let mut command = Command::new("nsenter");
        command
            .args([format!("--net={}", self.network.path()), "--".to_owned()])
            .arg(lager.get_program())
            .args(lager.get_args());
        if let Some(folder) = lager.get_current_dir() {
            command.current_dir(folder);
        }
        for (name, value) in lager.get_envs() {
            if let Some(value) = value {
                command.env(name, value);
            }
        }
        command
    }

    fn start(&self, args: &[&str]) -> Running {
        self.domain.launch(self.command(args))
    }

    fn echo(&self, topic: &str) -> Running {
        self.start(&["topic", "echo", topic, "--json"])
    }
}

/// The whole JSON lines so far.
fn told(of: &Running) -> Vec<Value> {
    let output = of.output();
    let whole = output.rsplit_once('\n').map_or("", |(whole, _)| whole);
    let lines = whole.lines();
    lines
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

/// Ends a listener and compares what came and what it counts as lost with the numbers of the bus.
fn must_know_all_losses(mut listener: Running) -> u64 {
    listener.signal(Signal::INT);
    listener.wait();
    let samples = told(&listener);
    let number = |line: &Value, key: &str| line[key].as_u64().expect("a number");
    let (first, last) = (&samples[0], &samples[samples.len() - 1]);
    assert_eq!(first["epoch"], last["epoch"], "one writer");
    let truth = number(last, "sequence") + 1 - number(first, "sequence");
    let lost = number(last, "lost");
    assert_eq!(samples.len() as u64 + lost, truth);
    lost
}

fn row(picture: &Value, name: &str) -> Value {
    let rows = picture["topics"].as_array().expect("a list").iter();
    let mut found = rows.filter(|row| row["topic"] == name);
    found.next().expect("a row").clone()
}

#[test]
#[ignore = "needs networks of its own; `tests/run` runs it where they can be had"]
fn a_slow_link_and_one_that_loses_packets_lose_nothing_silently() {
    let name = "bad_link::a_slow_link_and_one_that_loses_packets_lose_nothing_silently";
    let Some(network) = apart(name) else {
        return;
    };
    let domain = Domain::new();
    // All streams of three listeners would need some 8 Mbit/s, and the first that waits comes first: what
    // is sent over a slow link has its rates, and what they leave out is counted.
    let rates = [
        ("sensor/line", 10),
        ("sensor/distance", 10),
        ("steering/state", 10),
        ("nav/status", 5),
        ("nav/inputs", 1),
        ("truth/pose", 1),
    ];
    let (afar, up) = Afar::new(&domain, &network, &rates);
    let slow = ["tc", "qdisc", "add", "dev", "lager0", "root", "tbf"];
    runs(
        &[
            &slow[..],
            &["rate", "1mbit", "burst", "4kb", "latency", "100ms"],
        ]
        .concat(),
    );
    for percent in ["0", "2", "10"] {
        if percent != "0" {
            let table = format!(
                "table inet lager {{ chain out {{ type filter hook output priority 0; oifname \
                 \"lager0\" numgen random mod 100 < {percent} drop; }}; }}"
            );
            runs(&["nft", "flush", "ruleset"]);
            runs(&["nft", &table]);
        }
        let file = format!("lossy{percent}.mcap");
        let mut record = afar.start(&["bag", "--json", "record", &file]);
        let [line, events] = ["sensor/line", "log/thought"].map(|topic| afar.echo(topic));
        let picture = afar
            .command(&["top", "--once", "--json", "--duration", "6"])
            .output();
        let picture = picture.expect("a program").stdout;
        let picture: Value = serde_json::from_slice(&picture).expect("a picture");
        assert!(
            picture["mode"].is_string() && picture["mode"] != "no bridge",
            "{picture}"
        );
        assert!(
            row(&picture, "sensor/line")["samples"].as_u64() > Some(0),
            "{picture}"
        );
        wait_for("enough of the line", || {
            (told(&line).len() > 50).then_some(())
        });
        let lost = must_know_all_losses(line);
        if !told(&events).is_empty() {
            assert_eq!(
                must_know_all_losses(events),
                0,
                "events go before all other samples"
            );
        }
        record.signal(Signal::INT);
        assert_eq!(record.wait(), Some(0), "{}", record.log());
        domain.done(&["bag", "check", &file]);
        println!("{percent} % of packets dropped at 1 Mbit/s: {lost} lines lost, all counted");
    }
    drop(up);
    domain.assert_clean();
}

#[test]
#[ignore = "needs networks of its own; `tests/run` runs it where they can be had"]
fn after_a_black_out_states_come_soon_and_meanwhile_top_says_what_is_old() {
    let name = "bad_link::after_a_black_out_states_come_soon_and_meanwhile_top_says_what_is_old";
    let Some(network) = apart(name) else {
        return;
    };
    let domain = Domain::new();
    let (afar, up) = Afar::new(&domain, &network, &[]);
    let [state, line] = ["link/health", "sensor/line"].map(|topic| afar.echo(topic));
    let mut record = afar.start(&["bag", "--json", "record", "dark.mcap"]);
    wait_for("both", || {
        (told(&state).len() > 2 && told(&line).len() > 50).then_some(())
    });
    for _ in 0..3 {
        let mut top = afar.start(&["top", "--once", "--json", "--duration", "7"]);
        std::thread::sleep(Duration::from_secs(2));
        network.vanishes();
        std::thread::sleep(Duration::from_secs(5));
        assert_eq!(top.wait(), Some(0), "{}", top.log());
        let picture = top.json();
        for topic in ["link/health", "sensor/line"] {
            let age_ns = row(&picture, topic)["age_ns"].as_u64().expect("an age");
            assert!(age_ns > 3_000_000_000, "{topic}: {picture}");
        }
        assert_eq!(picture["failing"][0]["service"], "gateway", "{picture}");
        let before = told(&state).len();
        network.comes_back();
        let back = Instant::now();
        wait_for("a state", || (told(&state).len() > before).then_some(()));
        println!(
            "a state came {} ms after the black-out",
            back.elapsed().as_millis()
        );
        let before = told(&line).len();
        wait_for("the line", || {
            (told(&line).len() > before + 50).then_some(())
        });
    }
    let lost = [state, line].map(must_know_all_losses);
    println!("lost over three black-outs, all counted: {lost:?}");
    record.signal(Signal::INT);
    assert_eq!(record.wait(), Some(0), "{}", record.log());
    domain.done(&["bag", "check", "dark.mcap"]);
    drop(up);
    domain.assert_clean();
}
