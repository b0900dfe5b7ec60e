//! Tests of `--remote` against what users of other bridges have met: listeners that come and go,
//! gateways and routers that are replaced, names with several addresses, ends that do not end, and
//! other users of the machine.

use std::fs;
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use lager_tests::{Domain, Running, free, pid, wait_for};
use rustix::process::{Signal, kill_process};
use serde_json::Value;

use crate::elsewhere::{gateway, told};
use crate::relay::Relay;
use crate::remote::{configuration, lines, robot, said};

/// Far more than any of these takes, so that a busy machine fails no test.
const SOON: Duration = Duration::from_secs(20);

fn samples(of: &Running) -> usize {
    of.output().lines().count()
}

fn echo(domain: &Domain, endpoint: &str) -> Running {
    domain.start(&[
        "topic",
        "echo",
        "sensor/line",
        "--json",
        "--remote",
        endpoint,
    ])
}

#[test]
fn a_listener_that_comes_back_at_once_is_served_each_time() {
    let domain = Domain::new();
    let endpoint = format!("tcp/{}", free());
    let up = robot(&domain, &endpoint);
    let mut other = None;
    for round in 0..20 {
        other = (round % 2 == 0).then(|| other.take().unwrap_or_else(|| echo(&domain, &endpoint)));
        let mut listener = echo(&domain, &endpoint);
        wait_for("three samples", || (samples(&listener) >= 3).then_some(()));
        match round % 4 < 2 {
            true => {
                listener.signal(Signal::INT);
                listener.wait();
            }
            false => drop(listener),
        }
    }
    drop((other, up));
    domain.assert_clean();
}

#[test]
fn every_tool_goes_on_by_itself_when_the_gateway_was_replaced() {
    let domain = Domain::new();
    let endpoint = format!("tcp/{}", free());
    let up = domain.start(&["up", "--headless", "--no-station"]);
    let mut listens = gateway(&domain, &endpoint);
    let line = echo(&domain, &endpoint);
    let map = ["topic", "echo", "nav/map", "--json", "--remote", &endpoint];
    let map = domain.start(&map);
    let hz = [
        "topic",
        "hz",
        "sensor/line",
        "--json",
        "--remote",
        &endpoint,
    ];
    let hz = domain.start(&hz);
    let mut record = domain.start(&[
        "bag",
        "--json",
        "record",
        "tour.mcap",
        "--topic",
        "sensor/line",
        "--remote",
        &endpoint,
    ]);
    let mut top = [
        "top",
        "--once",
        "--json",
        "--duration",
        "3600",
        "--remote",
        &endpoint,
    ]
    .to_vec();
    let top = domain.start(&std::mem::take(&mut top));
    let received = |of: &Running| -> u64 {
        let last = told(of).pop();
        last.map_or(0, |last| {
            last["topics"][0]["received"].as_u64().unwrap_or(0)
        })
    };
    wait_for("all of them", || {
        let is_all = samples(&line) > 5 && samples(&map) == 1 && samples(&hz) > 1;
        (is_all && received(&record) > 5).then_some(())
    });
    for rounds in 1..=2 {
        kill_process(pid(listens.pid()), Signal::KILL).expect("a living process");
        drop(listens);
        std::thread::sleep(Duration::from_secs(2));
        listens = gateway(&domain, &endpoint);
        let before = (samples(&line), received(&record), samples(&hz));
        wait_for("all of them again", || {
            let is_all = samples(&line) > before.0 + 20 && received(&record) > before.1 + 20;
            (is_all && samples(&hz) > before.2 + 2).then_some(())
        });
        // One line for lost and one for back, each time.
        wait_for("both lines", || {
            let log = line.log();
            let count = |what: &str| log.matches(what).count();
            let is_it = (count("not heard any more"), count("is heard again"));
            assert!(is_it.0 <= rounds && is_it.1 <= rounds, "{log}");
            (is_it == (rounds, rounds)).then_some(())
        });
    }
    let lines = told(&line);
    let [first, last] = [&lines[0], &lines[lines.len() - 1]]
        .map(|line| ["sequence", "lost"].map(|key| line[key].as_u64().expect("a number")));
    assert!(last[1] > 0, "the gap counts");
    assert_eq!(first[0] + lines.len() as u64 - 1 + last[1], last[0]);
    record.signal(Signal::INT);
    assert_eq!(record.wait(), Some(0), "{}", record.log());
    domain.done(&["bag", "check", "tour.mcap"]);
    assert!(received(&record) > 40);
    drop((top, hz, map, line, listens, up));
    domain.assert_clean();
}

#[test]
fn an_address_of_either_kind_and_localhost_lead_to_the_gateway() {
    let domain = Domain::new();
    for args in [
        ["keys", "authority"].as_slice(),
        &["keys", "robot", "r1"],
        &["keys", "listener", "dash"],
    ] {
        domain.done(args);
    }
    let of = |name: &str| {
        let files = ["keys/authority.pem", &format!("keys/{name}")].map(str::to_owned);
        configuration(&domain, name, [&files[0], &files[1]], "")
    };
    let (of_robot, of_listener) = (of("r1"), of("dash"));
    let up = domain.start(&["up", "--headless", "--no-station"]);
    let call = |listens: &str, called: &str| {
        let port = free().rsplit(':').next().expect("a port").to_owned();
        let endpoint = format!("{listens}:{port}");
        let gateway = domain.start(&["--config", &of_robot, "gateway", "--zenoh", &endpoint]);
        wait_for("it listens", || {
            gateway.output().contains("connect to").then_some(())
        });
        let at = format!("{called}:{port}");
        let listed = ["--config", &of_listener, "topic", "list", "--remote", &at];
        wait_for("an answer", || {
            let listed = domain.run(&listed);
            let is_told = said(&listed).contains("IPv6 address in digits");
            (listed.status.success() || is_told).then_some(listed.status.success())
        })
    };
    for (listens, called) in [
        ("tls/127.0.0.1", "tls/localhost"),
        ("tls/localhost", "tls/127.0.0.1"),
        ("tcp/127.0.0.1", "tcp/localhost"),
    ] {
        assert!(call(listens, called), "{called}");
    }
    if TcpListener::bind("[::1]:0").is_ok() {
        assert!(call("tcp/[::1]", "tcp/[::1]"));
        // Zenoh cannot, and the tool says what to write.
        assert!(!call("tls/[::1]", "tls/[::1]"));
    }
    // An address that the robot's certificate does not have.
    let port = free().rsplit(':').next().expect("a port").to_owned();
    let endpoint = format!("tls/127.0.0.2:{port}");
    let gateway = domain.start(&["--config", &of_robot, "gateway", "--zenoh", &endpoint]);
    let listed = [
        "--config",
        &of_listener,
        "topic",
        "list",
        "--remote",
        &endpoint,
    ];
    wait_for("the gateway", || {
        let refused = said(&domain.run(&listed));
        assert!(!refused.contains("sensor/line"), "{refused}");
        refused
            .contains("`lager keys robot --address`")
            .then_some(())
    });
    drop((gateway, up));
    domain.assert_clean();
}

#[test]
fn a_tool_that_waits_for_a_connection_ends_when_it_is_asked() {
    let domain = Domain::new();
    let silent = TcpListener::bind("127.0.0.1:0").expect("a port");
    let endpoint = format!("tcp/{}", silent.local_addr().expect("an address"));
    let metrics = free();
    let tools: [&[&str]; 6] = [
        &["topic", "echo", "sensor/line"],
        &["topic", "hz", "sensor/line"],
        &["topic", "delay", "sensor/line"],
        &["top", "--once"],
        &["bag", "record", "tour.mcap"],
        &["gateway", "--metrics", &metrics],
    ];
    for tool in tools {
        for signal in [Signal::INT, Signal::TERM] {
            let mut waits = domain.start(&[tool, &["--remote", &endpoint]].concat());
            std::thread::sleep(Duration::from_secs(1));
            assert!(waits.is_running(), "{tool:?} {}", waits.log());
            waits.signal(signal);
            let asked = Instant::now();
            assert_eq!(waits.wait(), Some(130), "{tool:?} {}", waits.log());
            assert!(asked.elapsed() < SOON, "{tool:?}");
        }
        // If nobody ends it, it says what is wrong.
        let gave_up = domain.run(&[tool, &["--remote", &endpoint]].concat());
        assert_eq!(gave_up.status.code(), Some(1));
        assert!(
            said(&gave_up).contains("does not answer"),
            "{}",
            said(&gave_up)
        );
    }
    drop(silent);
    domain.assert_clean();
}

#[test]
fn a_gateway_and_a_recording_end_although_nobody_reads_what_they_send() {
    let domain = Domain::new();
    let address = free();
    let up = domain.start(&["up", "--headless", "--no-station"]);
    let mut listens = gateway(&domain, &format!("tcp/{address}"));
    let relay = Relay::to(&address);
    let asleep = echo(&domain, &relay.endpoint());
    let mut record = domain.start(&[
        "bag",
        "record",
        "tour.mcap",
        "--topic",
        "sensor/line",
        "--remote",
        &relay.endpoint(),
    ]);
    wait_for("samples", || (samples(&asleep) > 10).then_some(()));
    kill_process(pid(asleep.pid()), Signal::STOP).expect("a living process");
    relay.pause();
    std::thread::sleep(Duration::from_secs(2));
    record.signal(Signal::INT);
    let asked = Instant::now();
    assert_eq!(record.wait(), Some(0), "{}", record.log());
    domain.done(&["bag", "check", "tour.mcap"]);
    listens.signal(Signal::INT);
    listens.wait();
    assert!(asked.elapsed() < SOON);
    // The address can be had again at once.
    let next = gateway(&domain, &format!("tcp/{address}"));
    kill_process(pid(asleep.pid()), Signal::CONT).expect("a living process");
    drop((next, asleep, up));
    domain.assert_clean();
}

/// A folder that every user of the machine can enter, with the program in it.
struct Open(PathBuf);

impl Open {
    fn new() -> Self {
        let folder = std::env::temp_dir().join(format!("lager-open-{}", std::process::id()));
        fs::create_dir(&folder).expect("a folder");
        fs::set_permissions(&folder, fs::Permissions::from_mode(0o755)).expect("its mode");
        fs::copy(lager_tests::lager(), folder.join("lager")).expect("the program");
        Self(folder)
    }
}

impl Drop for Open {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A user who exists nowhere else, and a group.
const STRANGER: &str = "61234";
const GROUP: u32 = 61_235;

#[test]
#[ignore = "needs the right to be another user; `tests/run` runs it where that can be had"]
fn another_user_of_the_machine_listens_through_a_socket_of_his_group_and_has_no_bus() {
    let (domain, open) = (Domain::new(), Open::new());
    let socket = open.0.join("zenoh");
    let endpoint = format!("unixsock-stream/{}", socket.display());
    let up = robot(&domain, &endpoint);
    std::os::unix::fs::chown(&socket, None, Some(GROUP)).expect("the right to do so");
    let as_stranger = |groups: &[&str], args: &[&str]| -> Output {
        let mut command = Command::new("setpriv");
        command
            .args(["--reuid", STRANGER, "--regid", STRANGER])
            .args(groups);
        command
            .arg(open.0.join("lager"))
            .args(args)
            .current_dir(&open.0);
        command.output().expect("`setpriv` is there")
    };
    let groups = format!("--groups={GROUP}");
    let echo = [
        "topic",
        "echo",
        "sensor/line",
        "--json",
        "--count",
        "20",
        "--remote",
        &endpoint,
    ];
    assert_eq!(lines(&as_stranger(&[&groups], &echo)).len(), 20);
    let refused = as_stranger(&["--clear-groups"], &echo);
    assert!(
        !refused.status.success() && refused.stdout.is_empty(),
        "{}",
        said(&refused)
    );
    // Nothing of the bus is his, in whatever group he is.
    let bus = domain.bus_folder().display().to_string();
    for args in [
        ["--bus", &bus, "topic", "list"].as_slice(),
        &["--bus", &bus, "stop"],
        &[
            "--bus",
            &bus,
            "topic",
            "echo",
            "sensor/line",
            "--count",
            "1",
        ],
    ] {
        let refused = as_stranger(&[&groups], args);
        assert!(
            !refused.status.success() && refused.stdout.is_empty(),
            "{args:?}"
        );
    }
    drop(up);
    drop(open);
    domain.assert_clean();
}

#[test]
fn a_router_brings_many_robots_to_one_collector_and_nothing_is_lost_that_is_not_counted() {
    let domain = Domain::new();
    let hub = free();
    let endpoint = format!("tcp/{hub}");
    let start_router = || {
        let router = domain.start(&["gateway", "--router", &endpoint]);
        wait_for("the router", || {
            router
                .output()
                .contains("connect to tcp/")
                .then_some(router.pid())
        });
        router
    };
    let mut router = start_router();
    // The second robot's way to it can be cut.
    let relay = Relay::to(&hub);
    let ways = [endpoint.clone(), relay.endpoint()];
    let names = ["r1", "r2"];
    let up = names.map(|name| domain.start(&["--name", name, "up", "--headless", "--no-station"]));
    let bring =
        |place: usize| domain.start(&["--name", names[place], "gateway", "--via", &ways[place]]);
    let mut gateways = vec![bring(0), bring(1)];
    let mut collects = domain.start(&[
        "bag",
        "--json",
        "record",
        "tours",
        "--topic",
        "sensor/line",
        "--remote",
        &endpoint,
        "--every-robot",
    ]);
    let listens = |place: usize| {
        let name = names[place];
        domain.start(&[
            "--name",
            name,
            "topic",
            "echo",
            "sensor/line",
            "--json",
            "--remote",
            &endpoint,
        ])
    };
    let sees = |of: &Running| samples(of);
    wait_for("both robots", || {
        let log = collects.log();
        (log.contains("records r1") && log.contains("records r2")).then_some(())
    });
    let mut watching = [listens(0), listens(1)];
    let go_on = |what: &str, watching: &[Running; 2]| {
        let before = [sees(&watching[0]), sees(&watching[1])];
        wait_for(what, || {
            let go_on = (0..2).all(|place| sees(&watching[place]) > before[place] + 20);
            go_on.then_some(())
        });
    };
    go_on("samples of both", &watching);

    // A robot's gateway begins anew: the other robot is not touched, and both go on.
    kill_process(pid(gateways[0].pid()), Signal::KILL).expect("a living process");
    let before = sees(&watching[1]);
    wait_for("the other one", || {
        (sees(&watching[1]) > before + 50).then_some(())
    });
    gateways[0] = bring(0);
    go_on("both after a gateway's restart", &watching);

    // The router begins anew.
    kill_process(pid(router.pid()), Signal::KILL).expect("a living process");
    drop(router);
    std::thread::sleep(Duration::from_secs(1));
    router = start_router();
    go_on("both after the router's restart", &watching);

    // A partition: one robot goes on, the other one is silent until it heals.
    relay.pause();
    let before = sees(&watching[0]);
    wait_for("the robot on this side", || {
        (sees(&watching[0]) > before + 300).then_some(())
    });
    relay.free();
    go_on("both after the partition", &watching);

    for listener in &mut watching {
        listener.signal(Signal::INT);
        listener.wait();
        let samples = told(listener);
        let number = |line: &Value, key: &str| line[key].as_u64().expect("a number");
        let (first, last) = (&samples[0], &samples[samples.len() - 1]);
        assert_eq!(first["epoch"], last["epoch"], "one writer");
        let truth = number(last, "sequence") + 1 - number(first, "sequence");
        assert_eq!(samples.len() as u64 + number(last, "lost"), truth);
        assert!(number(last, "lost") > 0);
    }
    collects.signal(Signal::INT);
    assert_eq!(collects.wait(), Some(0), "{}", collects.log());
    let summaries = told(&collects);
    assert_eq!(summaries.len(), 2, "{summaries:?}");
    for summary in summaries {
        let file = summary["files"][0].as_str().expect("a file").to_owned();
        let robot = summary["robot"].as_str().expect("a robot");
        assert!(file.contains(&format!("tours/{robot}-")), "{file}");
        domain.done(&["bag", "check", &file]);
        let info = lines(&domain.run(&["bag", "info", &file, "--json"])).remove(0);
        assert_eq!(info["robot"], robot);
        let topic = &info["topics"][0];
        assert_eq!(topic["topic"], "sensor/line");
        assert_eq!(topic["lost"], summary["topics"][0]["lost"]);
        assert!(topic["lost"].as_u64().expect("a number") > 0);
    }
    drop((watching, gateways, up, router));
    domain.assert_clean();
}

#[test]
fn a_router_believes_of_each_robot_only_what_that_robot_tells() {
    let domain = Domain::new();
    for args in [
        ["keys", "authority"].as_slice(),
        &["keys", "router"],
        &["keys", "robot", "r1"],
        &["keys", "robot", "r2"],
        &["keys", "listener", "dash"],
    ] {
        domain.done(args);
    }
    let of = |name: &str| {
        configuration(
            &domain,
            name,
            ["keys/authority.pem", &format!("keys/{name}")],
            "",
        )
    };
    let [router_keys, r1, r2, dash] = ["router", "r1", "r2", "dash"].map(of);
    let endpoint = format!("tls/{}", free());
    let router = domain.start(&[
        "--config",
        &router_keys,
        "gateway",
        "--router",
        &endpoint,
        "--robots",
        "r1",
    ]);
    let up = ["r1", "r2"]
        .map(|name| domain.start(&["--name", name, "up", "--headless", "--no-station"]));
    let bring = |name: &str, config: &str| {
        domain.start(&[
            "--name", name, "--config", config, "gateway", "--via", &endpoint,
        ])
    };
    let list = |name: &str| {
        domain.run(&[
            "--name", name, "--config", &dash, "topic", "list", "--remote", &endpoint,
        ])
    };
    let gateways = [bring("r1", &r1), bring("r2", &r2)];
    wait_for("the robot that may tell", || {
        list("r1").status.success().then_some(())
    });
    // The other one is no robot of this router.
    let other = list("r2");
    assert!(
        said(&other).contains("no gateway of the robot `r2`"),
        "{}",
        said(&other)
    );
    // A certificate of a listener makes no router.
    let refused = domain.run(&[
        "--config",
        &dash,
        "gateway",
        "--router",
        &format!("tls/{}", free()),
    ]);
    assert!(
        said(&refused).contains("no router's certificate"),
        "{}",
        said(&refused)
    );
    drop((gateways, up, router));
    domain.assert_clean();
}
