//! Tests of `--remote`: the topic tools over a robot's gateway, and the certificates by which both
//! ends know each other.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::Output;
use std::time::Duration;

use lager_ports::{Bus, Publisher};
use lager_remote::zenoh::{self, Config, Wait};
use lager_remote::{Holder, Remote, make};
use lager_tests::{Domain, Running, free, pid, wait_for};
use lager_topics::{Role, TOPICS};
use lager_wake::Shutdown;
use rustix::process::{Signal, kill_process};
use serde_json::{Value, json};

use crate::live::{Much, MuchNow, send};

pub(crate) fn said(of: &Output) -> String {
    String::from_utf8_lossy(&of.stderr).into_owned()
}

/// The JSON lines of a tool that has ended well.
pub(crate) fn lines(of: &Output) -> Vec<Value> {
    assert!(of.status.success(), "{}", said(of));
    let text = String::from_utf8_lossy(&of.stdout);
    let read = text
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"));
    read.collect()
}

/// A robot with a gateway, when it answers.
pub(crate) fn robot(domain: &Domain, endpoint: &str) -> Running {
    let up = domain.start(&["up", "--headless", "--no-station", "--zenoh", endpoint]);
    wait_for("the gateway", || {
        let listed = domain.run(&["topic", "list", "--remote", endpoint]);
        listed.status.success().then_some(())
    });
    up
}

#[test]
fn the_tools_say_the_same_from_afar_as_on_the_bus() {
    let domain = Domain::new();
    let endpoint = format!("tcp/{}", free());
    let up = robot(&domain, &endpoint);
    let topics = |args: &[&str]| -> Vec<String> {
        let listed = lines(&domain.run(args));
        let name = |line: &Value| line["topic"].as_str().expect("a name").to_owned();
        let mut names: Vec<String> = listed.iter().map(name).collect();
        names.sort();
        names
    };
    let near = topics(&["topic", "list", "--json"]);
    let far = topics(&["topic", "list", "--json", "--remote", &endpoint]);
    assert_eq!(far, near);
    assert_eq!(far.len(), TOPICS.len());

    for topic in ["sensor/line", "nav/map", "link/health"] {
        let echo = ["topic", "echo", topic, "--json", "--count", "1"];
        let near = &lines(&domain.run(&echo))[0];
        let far = &lines(&domain.run(&[&echo[..], &["--remote", &endpoint]].concat()))[0];
        let keys = |of: &Value| -> Vec<String> {
            let members = of.as_object().expect("an object");
            members.keys().cloned().collect()
        };
        assert_eq!(keys(far), keys(near), "{topic}");
        assert_eq!(keys(&far["payload"]), keys(&near["payload"]), "{topic}");
        assert_eq!(far["writer"], near["writer"], "{topic}");
        assert_eq!(far["epoch"], near["epoch"], "{topic}");
    }
    // A state's last value comes although nothing is sent, and is the one of the bus.
    let map = ["topic", "echo", "nav/map", "--json", "--count", "1"];
    let near = lines(&domain.run(&map));
    assert_eq!(
        lines(&domain.run(&[&map[..], &["--remote", &endpoint]].concat())),
        near
    );
    // The text names the writer's part, and the age, as the clock is this machine's.
    let echo = [
        "topic",
        "echo",
        "sensor/line",
        "--count",
        "3",
        "--remote",
        &endpoint,
    ];
    wait_for("the writer's part", || {
        let shown = domain.run(&echo);
        let text = String::from_utf8_lossy(&shown.stdout).into_owned();
        (text.trim_start().starts_with("at s ") && text.contains("bridge (")).then_some(())
    });
    let rate = [
        "topic",
        "hz",
        "sensor/line",
        "--duration",
        "3",
        "--json",
        "--remote",
        &endpoint,
    ];
    let rates = lines(&domain.run(&rate));
    let hz = rates[1]["hz"].as_f64().expect("a number");
    assert!(hz > 50.0, "{rates:?}");
    assert!(rates.iter().all(|rate| rate["lost"] == 0), "{rates:?}");

    let unknown = domain.run(&["topic", "hz", "no/topic", "--remote", &endpoint]);
    assert!(said(&unknown).contains("it sends"), "{}", said(&unknown));
    let other = domain.run(&["--name", "r2", "topic", "list", "--remote", &endpoint]);
    assert!(said(&other).contains("the robot `r2`"), "{}", said(&other));
    let info = ["topic", "info", "sensor/line", "--json"];
    wait_for("the same properties", || {
        let near = lines(&domain.run(&info));
        let far = lines(&domain.run(&[&info[..], &["--remote", &endpoint]].concat()));
        (far == near).then_some(())
    });
    let publishes = ["topic", "pub", "nav/map", "{}", "--remote", &endpoint];
    let publishes = domain.run(&publishes);
    assert_eq!(publishes.status.code(), Some(2), "{}", said(&publishes));
    let nobody = format!("tcp/{}", free());
    let nobody = domain.run(&["topic", "list", "--remote", &nobody]);
    assert!(
        said(&nobody).contains("nothing listens there"),
        "{}",
        said(&nobody)
    );
    assert_eq!(nobody.status.code(), Some(1));
    drop(up);
    domain.assert_clean();
}

/// More than fits between a gateway and a listener that reads nothing: queues and both sockets.
const MUCH: u64 = 24 << 20;
/// The most that a gateway may keep for such a listener.
const KEPT: u64 = MUCH / 3;

/// The memory of a process, in bytes.
fn memory(of: &Running) -> u64 {
    let status = fs::read_to_string(format!("/proc/{}/status", of.pid())).expect("a process");
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kib = line.and_then(|line| line.trim().strip_suffix(" kB"));
    1_024 * kib.expect("memory").parse::<u64>().expect("a number")
}

#[test]
fn a_listener_that_sleeps_slows_nobody_and_knows_afterwards_what_it_missed() {
    let domain = Domain::new();
    let endpoint = format!("tcp/{}", free());
    let bus = Bus::open(&domain.bus("r1", 1.0), Role::Guest).expect("the bus opens");
    let publisher: Publisher<MuchNow> = bus.publisher().expect("a topic");
    let gateway = domain.start(&["gateway", "--zenoh", &endpoint]);
    let r1 = "r1".parse().expect("a name");
    let at = endpoint.parse().expect("an endpoint");
    let remote = wait_for("the gateway", || {
        let remote = Remote::open(&at, &r1, None, &Shutdown::new()).ok()?;
        remote
            .topics()
            .ok()?
            .contains_key("much/now")
            .then_some(remote)
    });
    let mut awake = remote.listen("much/now").expect("a topic");
    let asleep = domain.start(&[
        "topic", "echo", "much/now", "--json", "--field", "number", "--remote", &endpoint,
    ]);
    let mut sent = 0;
    wait_for("the first sample of both", || {
        send(&publisher, sent);
        sent += 1;
        let heard = numbers(&mut awake);
        std::thread::sleep(Duration::from_millis(5));
        (!heard.is_empty() && asleep.output().contains("much/now")).then_some(())
    });
    wait_for("the last one so far", || {
        numbers(&mut awake).contains(&(sent - 1)).then_some(())
    });
    kill_process(pid(asleep.pid()), Signal::STOP).expect("a living process");
    let before = memory(&gateway);
    let (mut bytes, mut most) = (0, before);
    while bytes < MUCH {
        let next = sent;
        for _ in 0..32 {
            send(&publisher, sent);
            sent += 1;
        }
        let mut expected = next..sent;
        wait_for("all of them", || {
            for number in numbers(&mut awake) {
                assert_eq!(Some(number), expected.next());
            }
            expected.is_empty().then_some(())
        });
        bytes += 32 * size_of::<Much>() as u64;
        most = most.max(memory(&gateway));
    }
    let kept = most - before;
    println!("the gateway kept {} KiB for it", kept >> 10);
    assert!(kept < KEPT, "{kept} of {bytes} bytes wait for the sleeper");
    let account = awake.account();
    assert_eq!(account.missing(), 0, "{account:?}");
    kill_process(pid(asleep.pid()), Signal::CONT).expect("a living process");
    let told = wait_for("the sleeper's last sample", || {
        send(&publisher, sent);
        sent += 1;
        std::thread::sleep(Duration::from_millis(50));
        let output = asleep.output();
        let whole = output.rsplit_once('\n')?.0;
        let told: Vec<Value> = whole
            .lines()
            .map(|line| serde_json::from_str(line).expect("JSON"))
            .collect();
        let last = told.last()?["sequence"].as_u64()?;
        (last + 20 > sent && last > next_of(&told[0]) + 1_000).then_some(told)
    });
    let number = |line: &Value, key: &str| line[key].as_u64().expect("a number");
    let (first, last) = (&told[0], &told[told.len() - 1]);
    let truth = number(last, "sequence") + 1 - number(first, "sequence");
    let lost = number(last, "lost") - number(first, "lost");
    assert!(lost > 0, "all {bytes} bytes waited for it");
    assert_eq!(told.len() as u64 + lost, truth);
    drop((awake, remote, asleep, gateway, publisher, bus));
    domain.assert_clean();
}

fn next_of(line: &Value) -> u64 {
    line["sequence"].as_u64().expect("a number") + 1
}

/// The numbers of the samples that have come.
pub(crate) fn numbers(listening: &mut lager_remote::Listening) -> Vec<u64> {
    use lager_ports::{Look, Source as _};
    use lager_sample::Stamp;

    struct Sequence;

    impl Look for Sequence {
        type Output = u64;

        fn look<P: serde::Serialize>(self, stamp: &Stamp, _lost: u64, _payload: &P) -> u64 {
            stamp.sequence
        }
    }

    let mut found = Vec::new();
    while let Some(number) = listening.next(Sequence).expect("it goes on") {
        found.push(number);
    }
    found
}

/// A configuration with these files of a folder of keys.
pub(crate) fn configuration(
    domain: &Domain,
    name: &str,
    [authority, certificate]: [&str; 2],
    more: &str,
) -> String {
    let file = domain.folder().join(format!("{name}.toml"));
    let keys = domain.folder();
    let text = format!(
        "[gateway.zenoh]\nauthority = \"{keys}/{authority}\"\ncertificate = \
         \"{keys}/{certificate}.pem\"\nkey = \"{keys}/{certificate}.key\"\n{more}",
        keys = keys.display()
    );
    fs::write(&file, text).expect("a file");
    file.display().to_string()
}

fn mode(file: &Path) -> u32 {
    fs::metadata(file).expect("a file").permissions().mode() & 0o777
}

#[test]
fn over_the_network_only_those_who_prove_who_they_are_hear_the_robot() {
    let domain = Domain::new();
    for folder in ["keys", "others"] {
        domain.done(&["keys", "authority", "--folder", folder]);
        domain.done(&["keys", "robot", "r1", "--folder", folder]);
        domain.done(&["keys", "listener", "dash", "--folder", folder]);
    }
    let keys = domain.folder().join("keys");
    assert_eq!(mode(&keys), 0o700);
    for (file, expected) in [
        ("authority.key", 0o600),
        ("r1.key", 0o600),
        ("r1.pem", 0o644),
    ] {
        assert_eq!(mode(&keys.join(file)), expected, "{file}");
    }
    let before = fs::read(keys.join("r1.key")).expect("a key");
    let again = domain.run(&["keys", "robot", "r1", "--folder", "keys"]);
    assert!(
        said(&again).contains("nothing is overwritten"),
        "{}",
        said(&again)
    );
    assert_eq!(fs::read(keys.join("r1.key")).expect("a key"), before);
    let alone = domain.run(&["keys", "listener", "dash", "--folder", "empty"]);
    assert!(
        said(&alone).contains("`lager keys authority`"),
        "{}",
        said(&alone)
    );
    make(&keys, Holder::Listener("old"), -1).expect("a certificate");
    make(&keys, Holder::Robot("r2", &[]), 1).expect("a certificate");

    let port = free();
    let endpoint = format!("tls/{port}");
    let of_robot = configuration(
        &domain,
        "robot",
        ["keys/authority.pem", "keys/r1"],
        &format!("endpoint = \"{endpoint}\"\n"),
    );
    let up = domain.start(&["--config", &of_robot, "up", "--headless", "--no-station"]);
    let list = |config: &str, endpoint: &str| {
        domain.run(&["--config", config, "topic", "list", "--remote", endpoint])
    };
    let good = configuration(&domain, "dash", ["keys/authority.pem", "keys/dash"], "");
    wait_for("the gateway", || {
        list(&good, &endpoint).status.success().then_some(())
    });
    let echo = [
        "--config",
        &good,
        "topic",
        "echo",
        "sensor/line",
        "--count",
        "20",
        "--json",
        "--remote",
        &endpoint,
    ];
    assert_eq!(lines(&domain.run(&echo)).len(), 20);

    let mut causes = Vec::new();
    let mut refused =
        |name: &str, [authority, certificate]: [&str; 2], endpoint: &str, cause: &str| {
            let config = configuration(&domain, name, [authority, certificate], "");
            let heard = list(&config, endpoint);
            let said = said(&heard);
            assert_eq!(heard.status.code(), Some(1), "{name}: {said}");
            assert!(heard.stdout.is_empty(), "{name}");
            assert!(said.contains(cause), "{name}: {said}");
            causes.push(said);
        };
    refused(
        "stranger",
        ["keys/authority.pem", "others/dash"],
        &endpoint,
        "does not trust the certificate of this listener",
    );
    refused(
        "doubter",
        ["others/authority.pem", "keys/dash"],
        &endpoint,
        "not of the authority that this listener trusts",
    );
    refused(
        "late",
        ["keys/authority.pem", "keys/old"],
        &endpoint,
        "of this listener has expired",
    );
    let nobody = format!("tls/{}", free());
    refused(
        "nobody",
        ["keys/authority.pem", "keys/dash"],
        &nobody,
        "nothing listens there",
    );
    let bare = domain.folder().join("bare.toml");
    fs::write(&bare, "").expect("a file");
    let bare = bare.display().to_string();
    let none = list(&bare, &endpoint);
    assert!(
        said(&none).contains("needs certificates"),
        "{}",
        said(&none)
    );
    // Without TLS nobody gets in either.
    let plain = list(&bare, &format!("tcp/{port}"));
    assert!(!plain.status.success() && plain.stdout.is_empty());
    for (place, cause) in causes.iter().enumerate() {
        assert!(!causes[..place].contains(cause), "{cause}");
    }
    drop(up);

    // Another robot's certificate is refused by the gateway itself, and an expired one.
    make(&keys, Holder::Robot("r3", &[]), -1).expect("a certificate");
    for (name, certificate, cause) in [
        ("r1", "keys/r2", "names `r2`, and this robot is `r1`"),
        ("r3", "keys/r3", "has expired"),
    ] {
        let more = format!("endpoint = \"{endpoint}\"\n");
        let other = configuration(&domain, "other", ["keys/authority.pem", certificate], &more);
        let refused = domain.run(&["--name", name, "--config", &other, "up", "--headless"]);
        assert!(
            !refused.status.success() && said(&refused).contains(cause),
            "{}",
            said(&refused)
        );
    }

    // Where somebody answers all the same, a listener believes him only with the robot's certificate.
    let about = json!({
        "layout": "A{a:u8}", "state": false, "rate": null, "ends": {
            "publishers": 1, "subscribers": 1, "observers": 1, "writers": {}, "readers": {},
            "woken": {},
        },
    });
    for (certificate, is_believed) in [("r2", false), ("r1", true)] {
        let listened = json!({
            "mode": "router",
            "listen": { "endpoints": [endpoint] },
            "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
            "transport": { "link": { "tls": {
                "root_ca_certificate": keys.join("authority.pem"), "enable_mtls": true,
                "listen_certificate": keys.join(format!("{certificate}.pem")),
                "listen_private_key": keys.join(format!("{certificate}.key")),
            } } },
        });
        let listened = Config::from_json5(&listened.to_string()).expect("a configuration");
        let somebody = zenoh::open(listened).wait().expect("a session");
        let about = about.to_string();
        let answer = move |query: zenoh::query::Query| {
            drop(query.reply("lager/r1/@layout/told", about.clone()).wait());
        };
        let answers = somebody.declare_queryable("lager/r1/@layout/**");
        let answers = answers.callback(answer).wait().expect("a queryable");
        let heard = list(&good, &endpoint);
        let (out, told) = (
            String::from_utf8_lossy(&heard.stdout).into_owned(),
            said(&heard),
        );
        assert_eq!(heard.status.success(), is_believed, "{told}");
        assert_eq!(out.contains("lager/r1/told"), is_believed, "{out}");
        let is_doubted = told.contains("its certificate is not that of `r1`");
        assert_eq!(is_doubted, !is_believed, "{told}");
        drop((answers, somebody));
    }
    domain.assert_clean();
}
