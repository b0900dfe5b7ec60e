//! Tests of `--zenoh`: what plain listeners of Zenoh, of which nothing is ours, get of a running
//! robot. They need a program with the feature `zenoh`, which `tests/run` builds.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use lager_ports::{Bus, Subscriber};
use lager_remote::zenoh::pubsub::Subscriber as Listener;
use lager_remote::zenoh::{self, Config, Session, Wait};
use lager_remote::{About, Account, Beat, Heard, Ledger, Note};
use lager_sample::{Description, bytes_of};
use lager_tests::{Domain, free, pid, wait_for};
use lager_topics::{LineFrame, NavMap, SensorLine, TOPICS};
use rustix::process::{Signal, kill_process};
use serde_json::json;

/// A session as a listener of somebody else opens one, with nothing but the endpoint.
fn session(mode: &str, endpoint: &str) -> Option<Session> {
    let config = json!({
        "mode": mode,
        "connect": { "endpoints": [endpoint] },
        "listen": { "endpoints": [] },
        "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
    });
    let config = Config::from_json5(&config.to_string()).expect("a configuration");
    let opened = zenoh::open(config).wait().ok()?;
    // A peer's session is open before it is connected.
    let peers = || opened.info().peers_zid().wait().count();
    wait_for_or("a connection", || (peers() > 0).then_some(()))?;
    Some(opened)
}

fn wait_for_or<T>(_what: &str, mut done: impl FnMut() -> Option<T>) -> Option<T> {
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(5) {
        if let Some(it) = done() {
            return Some(it);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    None
}

/// A message as it came.
struct Message {
    key: String,
    payload: Vec<u8>,
    attachment: Option<Vec<u8>>,
}

impl Message {
    fn note(&self) -> Note {
        let attachment = self.attachment.as_deref().expect("an attachment");
        Note::from_bytes(attachment).expect("a note")
    }
}

/// Listens to a key.
fn listen(session: &Session, key: &str) -> (Listener<()>, Receiver<Message>) {
    let (to, from) = channel();
    let callback = move |sample: zenoh::sample::Sample| {
        let message = Message {
            key: sample.key_expr().to_string(),
            payload: sample.payload().to_bytes().into_owned(),
            attachment: sample
                .attachment()
                .map(|bytes| bytes.to_bytes().into_owned()),
        };
        let _ = to.send(message);
    };
    let subscriber = session.declare_subscriber(key.to_owned());
    (
        subscriber.callback(callback).wait().expect("a subscriber"),
        from,
    )
}

/// What answers a query, by key.
fn asked(session: &Session, key: &str) -> BTreeMap<String, Message> {
    let replies = session.get(key.to_owned()).timeout(Duration::from_secs(5));
    let replies = replies.wait().expect("a query");
    let read = replies.into_iter().filter_map(|reply| {
        let sample = reply.into_result().ok()?;
        let key = sample.key_expr().to_string();
        let message = Message {
            key: key.clone(),
            payload: sample.payload().to_bytes().into_owned(),
            attachment: sample
                .attachment()
                .map(|bytes| bytes.to_bytes().into_owned()),
        };
        Some((key, message))
    });
    read.collect()
}

/// What the bus has of the line, by the samples' numbers; from one writer.
fn on_the_bus(bus: &mut Subscriber<SensorLine>, lines: &mut BTreeMap<u64, LineFrame>) {
    while let Some(sample) = bus.receive().expect("the bus") {
        lines.insert(sample.stamp().sequence, *sample);
    }
    assert_eq!(bus.lost(), 0, "the test's own reader is too slow");
}

const LINE: &str = "lager/r1/sensor/line";

fn endpoint() -> String {
    format!("tcp/{}", free())
}

fn reader(domain: &Domain) -> (Bus, Subscriber<SensorLine>) {
    let bus = domain.observe("r1", 1.0);
    let subscriber = bus.subscriber().expect("a topic");
    (bus, subscriber)
}

#[test]
fn a_plain_listener_gets_every_sample_as_it_lies_on_the_bus() {
    let domain = Domain::new();
    let endpoint = endpoint();
    let up = domain.start(&["up", "--headless", "--no-station", "--zenoh", &endpoint]);
    let (bus, mut line) = wait_for("the robot", || {
        up.service("gateway").map(|_| reader(&domain))
    });
    for mode in ["client", "peer"] {
        let session = wait_for("the gateway", || session(mode, &endpoint));
        let (_subscriber, messages) = listen(&session, "lager/r1/**");
        let mut lines = BTreeMap::new();
        let (mut seen, mut others) = (Vec::new(), BTreeMap::new());
        while seen.len() < 300 {
            on_the_bus(&mut line, &mut lines);
            let Ok(message) = messages.recv_timeout(Duration::from_millis(20)) else {
                continue;
            };
            match message.key == LINE {
                true => seen.push((message.note(), message.payload)),
                false => *others.entry(message.key).or_insert(0) += 1,
            }
        }
        on_the_bus(&mut line, &mut lines);
        let first = seen[0].0;
        for (place, (note, payload)) in (0..).zip(&seen) {
            assert_eq!(
                note.stamp.sequence,
                first.stamp.sequence + place,
                "as {mode}"
            );
            assert_eq!(note.number(), first.number() + place);
            assert!(!note.is_answer && !note.is_limited);
            if let Some(frame) = lines.get(&note.stamp.sequence) {
                assert_eq!(payload, bytes_of(frame));
            }
        }
        let both = seen
            .iter()
            .filter(|(note, _)| lines.contains_key(&note.stamp.sequence));
        assert!(both.count() > 250, "the bus was read meanwhile");
        for topic in [
            "steering/state",
            "link/health",
            "nav/status",
            "sensor/distance",
        ] {
            assert!(
                others.contains_key(&format!("lager/r1/{topic}")),
                "{others:?}"
            );
        }
        assert!(!others.keys().any(|key| key.contains('@')), "{others:?}");
    }

    // Layouts, the last states and the token answer whoever comes late.
    let session = session("client", &endpoint).expect("the gateway");
    let layouts = asked(&session, "lager/r1/@layout/**");
    for entry in TOPICS {
        let about = &layouts[&format!("lager/r1/@layout/{}", entry.name)].payload;
        let about: About = serde_json::from_slice(about).expect("JSON");
        let layout = Description::parse(&about.layout).expect("a layout");
        assert_eq!(layout.size(), entry.layout.size, "{}", entry.name);
        assert_eq!(about.state, entry.qos.history > 0, "{}", entry.name);
    }
    let mut maps = bus.subscriber::<NavMap>().expect("a topic");
    let map = wait_for("the map", || maps.latest().expect("the bus"));
    for _ in 0..20 {
        let answers = asked(&session, "lager/r1/nav/map");
        let answer = &answers["lager/r1/nav/map"];
        assert_eq!(answers.len(), 1);
        assert_eq!(answer.payload, bytes_of(&*map));
        assert!(answer.note().is_answer);
        assert_eq!(answer.note().stamp.sequence, map.stamp().sequence);
    }
    // A stream has no last value.
    assert_eq!(asked(&session, LINE).len(), 0);
    let token = session.liveliness().get("lager/*/@alive");
    let tokens: Vec<_> = token.wait().expect("a query").into_iter().collect();
    assert_eq!(tokens.len(), 1);
    let key = tokens[0].result().expect("a token").key_expr().to_string();
    assert_eq!(key, "lager/r1/@alive");
    drop((map, maps, line, bus, session, up));
    domain.assert_clean();
}

/// The account of one topic, and the truth by the bus's numbers: from the first sample that came
/// to the last one.
struct Watched {
    ledger: Ledger,
    first: Option<Note>,
    last: Option<Note>,
}

impl Watched {
    fn new() -> Self {
        Self {
            ledger: Ledger::new(),
            first: None,
            last: None,
        }
    }

    fn hear(&mut self, message: &Message) {
        let note = message.note();
        if self.ledger.hear(&note) == Heard::New {
            self.first.get_or_insert(note);
            self.last = Some(note);
        }
    }

    fn account(&self) -> (Account, u64) {
        let (first, last) = (self.first.expect("a sample"), self.last.expect("a sample"));
        assert_eq!(first.stamp.epoch, last.stamp.epoch, "one writer");
        let truth = last.stamp.sequence + 1 - first.stamp.sequence;
        (self.ledger.account(), truth)
    }
}

#[test]
fn what_a_limit_leaves_out_is_counted_and_topics_that_are_not_listed_stay() {
    let domain = Domain::new();
    let endpoint = endpoint();
    let config = domain.folder().join("lager.toml");
    let text = format!(
        "[gateway.zenoh]\nendpoint = \"{endpoint}\"\ntopics = [\"sensor/*\", \"nav/status\"]\n\
         [gateway.zenoh.rates]\n\"sensor/line\" = 10\n\"nav/status\" = 2\n"
    );
    fs::write(&config, text).expect("a file");
    let up = domain.start(&["up", "--headless", "--no-station"]);
    let session = wait_for("the gateway", || session("client", &endpoint));
    let (_subscriber, messages) = listen(&session, "lager/**");
    let mut watched: BTreeMap<String, Watched> = BTreeMap::new();
    wait_for("50 lines", || {
        let message = messages.recv_timeout(Duration::from_secs(1)).ok()?;
        let of = watched
            .entry(message.key.clone())
            .or_insert_with(Watched::new);
        of.hear(&message);
        (watched.get(LINE)?.ledger.account().received >= 50).then_some(())
    });
    let keys: Vec<&str> = watched.keys().map(String::as_str).collect();
    let expected = ["nav/status", "sensor/distance", "sensor/line"];
    assert_eq!(keys, expected.map(|topic| format!("lager/r1/{topic}")));
    let (account, truth) = watched[LINE].account();
    assert!(account.left_out > 300, "{account:?}");
    assert_eq!(account.received + account.missing(), truth, "{account:?}");
    assert_eq!((account.dropped, account.unserved), (0, 0), "{account:?}");
    let (account, truth) = watched["lager/r1/sensor/distance"].account();
    assert_eq!(account.received + account.missing(), truth, "{account:?}");
    assert_eq!(account.left_out, 0);
    let note = watched["lager/r1/nav/status"].last.expect("a sample");
    assert!(note.is_limited);
    let rate = watched["lager/r1/nav/status"].ledger.account();
    assert!(rate.left_out > rate.received, "{rate:?}");
    drop((session, up));
    domain.assert_clean();
}

#[test]
fn a_killed_gateway_is_replaced_and_the_gap_has_its_length() {
    let domain = Domain::new();
    let endpoint = endpoint();
    let up = domain.start(&["up", "--headless", "--no-station", "--zenoh", &endpoint]);
    let session = wait_for("the gateway", || session("client", &endpoint));
    let (_lines, lines) = listen(&session, LINE);
    let (_beats, beats) = listen(&session, "lager/r1/@counts");
    let mut watched = Watched::new();
    let hear = |watched: &mut Watched, more: u64| {
        let goal = watched.ledger.account().received + more;
        wait_for("samples", || {
            let line = lines.recv_timeout(Duration::from_secs(1)).ok()?;
            watched.hear(&line);
            for beat in beats.try_iter() {
                let beat: Beat = serde_json::from_slice(&beat.payload).expect("a beat");
                watched
                    .ledger
                    .tell(&beat.counts("sensor/line").expect("it is carried"));
            }
            (watched.ledger.account().received >= goal).then_some(())
        });
    };
    hear(&mut watched, 200);
    let first = watched.last.expect("a sample").counts.run;
    for _ in 0..2 {
        let killed = up.service("gateway").expect("a gateway");
        kill_process(pid(killed), Signal::KILL).expect("a living process");
        // The listener does nothing for it.
        let of = |watched: &Watched| watched.last.expect("a sample").counts.run;
        let before = of(&watched);
        while of(&watched) == before {
            hear(&mut watched, 1);
        }
        hear(&mut watched, 100);
    }
    let (account, truth) = watched.account();
    assert_ne!(watched.last.expect("a sample").counts.run, first);
    assert!(account.unserved > 0, "{account:?}");
    assert_eq!(account.received + account.missing(), truth, "{account:?}");
    drop((session, up));
    domain.assert_clean();
}

#[test]
fn a_listener_that_publishes_reaches_nobody_and_a_gateway_opens_one_port() {
    let domain = Domain::new();
    let endpoint = endpoint();
    let up = domain.start(&["up", "--headless", "--no-station", "--zenoh", &endpoint]);
    let liar = wait_for("the gateway", || session("client", &endpoint));
    let honest = session("client", &endpoint).expect("the gateway");
    let (_subscriber, messages) = listen(&honest, "**");
    let (_alive, alive) = {
        let (to, from) = channel();
        let tokens = honest.liveliness().declare_subscriber("**/@alive");
        let told =
            move |sample: zenoh::sample::Sample| drop(to.send(sample.key_expr().to_string()));
        (tokens.callback(told).wait().expect("a subscriber"), from)
    };
    let (bus, mut line) = reader(&domain);
    // What a listener could send: samples, deletions, a token, answers to others' questions.
    let _token = liar.liveliness().declare_token("lager/r9/@alive").wait();
    let _answers = liar
        .declare_queryable("lager/r1/nav/map")
        .callback(|query| drop(query.reply("lager/r1/nav/map", "a lie").wait()))
        .wait();
    for _ in 0..50 {
        for key in [
            LINE,
            "lager/r1/steering/command",
            "lager/r9/sensor/line",
            "lie",
        ] {
            let _ = liar.put(key, "a lie").wait();
            let _ = liar.delete(key).wait();
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    let mut heard = 0;
    while let Ok(message) = messages.try_recv() {
        heard += 1;
        assert!(message.key.starts_with("lager/r1/"), "{}", message.key);
        assert_ne!(message.payload, b"a lie");
        message.note();
    }
    assert!(heard > 100, "the robot itself was heard");
    for key in alive.try_iter() {
        assert_eq!(key, "lager/r1/@alive");
    }
    for message in asked(&honest, "lager/r1/nav/map").values() {
        assert_ne!(message.payload, b"a lie");
    }
    // The bus has its own samples alone, each of the right size, from one writer.
    let mut writers = std::collections::BTreeSet::new();
    while let Some(sample) = line.receive().expect("the bus") {
        writers.insert(sample.stamp().writer);
    }
    assert_eq!(writers.len(), 1);

    let gateway = up.service("gateway").expect("a gateway");
    let port = endpoint.rsplit_once(':').expect("a port").1.parse::<u16>();
    let sockets = sockets_of(gateway);
    assert_eq!(sockets.listening, [port.expect("a number")]);
    assert_eq!(sockets.datagram, 0, "it looks for nobody");
    drop((liar, honest, line, bus, up));
    domain.assert_clean();
}

/// The sockets of a process to the network.
struct Sockets {
    /// Ports at which it listens with TCP.
    listening: Vec<u16>,
    /// How many UDP sockets it has.
    datagram: usize,
}

fn sockets_of(process: u32) -> Sockets {
    let fds = fs::read_dir(format!("/proc/{process}/fd")).expect("it lives");
    let links = fds.filter_map(|fd| fs::read_link(fd.ok()?.path()).ok());
    let own: Vec<String> = links
        .filter_map(|link| {
            let link = link.to_str()?;
            let inode = link.strip_prefix("socket:[")?.strip_suffix(']')?;
            Some(inode.to_owned())
        })
        .collect();
    let table = |name: &str| fs::read_to_string(format!("/proc/{process}/net/{name}"));
    // sl, local address, remote address, state, ...; the tenth is the inode.
    let rows = |name: &str| -> Vec<Vec<String>> {
        let text = table(name).unwrap_or_default();
        let rows = text.lines().skip(1);
        rows.map(|row| row.split_whitespace().map(str::to_owned).collect())
            .filter(|row: &Vec<String>| row.get(9).is_some_and(|inode| own.contains(inode)))
            .collect()
    };
    let tcp = rows("tcp").into_iter().chain(rows("tcp6"));
    let listening = tcp.filter(|row| row[3] == "0A").map(|row| {
        let port = row[1].rsplit_once(':').expect("a port").1;
        u16::from_str_radix(port, 16).expect("a number")
    });
    Sockets {
        listening: listening.collect(),
        datagram: rows("udp").len() + rows("udp6").len(),
    }
}

#[test]
fn a_unix_socket_is_for_its_group_and_no_other_file_is_touched() {
    let domain = Domain::new();
    let file = domain.folder().join("zenoh");
    let endpoint = format!("unixsock-stream/{}", file.display());
    let up = domain.start(&["up", "--headless", "--no-station", "--zenoh", &endpoint]);
    let session = wait_for("the gateway", || session("client", &endpoint));
    let (_subscriber, messages) = listen(&session, LINE);
    let line = messages
        .recv_timeout(lager_tests::WATCHDOG)
        .expect("a sample");
    assert_eq!(line.payload.len(), size_of::<LineFrame>());
    let found = fs::metadata(&file).expect("a socket");
    assert!(found.file_type().is_socket());
    assert_eq!(found.permissions().mode() & 0o777, 0o660);
    let gateway = up.service("gateway").expect("a gateway");
    assert!(sockets_of(gateway).listening.is_empty());

    // A killed gateway leaves the socket, and its successor has it again.
    let killed = up.service("gateway").expect("a gateway");
    let run = line.note().counts.run;
    kill_process(pid(killed), Signal::KILL).expect("a living process");
    wait_for("the next gateway", || {
        let line = messages.recv_timeout(Duration::from_secs(1)).ok()?;
        (line.note().counts.run != run).then_some(())
    });

    let kept = domain.folder().join("kept");
    fs::write(&kept, "mine").expect("a file");
    let refused = domain.run(&[
        "gateway",
        "--zenoh",
        &format!("unixsock-stream/{}", kept.display()),
    ]);
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(
        !refused.status.success() && said.contains("is no socket"),
        "{said}"
    );
    assert_eq!(fs::read_to_string(&kept).expect("it is there"), "mine");
    drop((session, up));
    domain.assert_clean();
}

#[test]
fn what_would_be_open_to_the_network_or_is_taken_is_refused_before_anything_runs() {
    let domain = Domain::among_others();
    let holder = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = holder.local_addr().expect("an address");
    let said = |endpoint: &str| {
        let refused = domain.run(&["up", "--headless", "--zenoh", endpoint]);
        assert!(!refused.status.success());
        String::from_utf8_lossy(&refused.stderr).into_owned()
    };
    let open = said("tcp/0.0.0.0:7447");
    assert!(open.contains("`lager keys`"), "{open}");
    let bare = said("tls/0.0.0.0:7447");
    assert!(bare.contains("needs certificates"), "{bare}");
    let nowhere = said("unixsock-stream//nowhere/at/all");
    assert!(nowhere.contains("cannot be had"), "{nowhere}");
    let taken = said(&format!("tcp/{address}"));
    assert!(taken.contains("choose another with --zenoh"), "{taken}");
    drop(holder);
    domain.assert_clean();
}

#[test]
#[ignore = "needs LAGER_PYTHON, a Python with eclipse-zenoh; tests/run makes one"]
fn a_listener_in_python_counts_as_the_bus_does() {
    let domain = Domain::new();
    let endpoint = endpoint();
    let up = domain.start(&["up", "--headless", "--no-station", "--zenoh", &endpoint]);
    wait_for("the gateway", || session("client", &endpoint));
    let (bus, mut line) = reader(&domain);
    let mut lines = BTreeMap::new();
    let mut python =
        std::process::Command::new(std::env::var_os("LAGER_PYTHON").expect("it names a Python"))
            .arg(lager_tests::in_tree("tests/gateway/listener.py"))
            .args([&endpoint, "r1", "sensor/line", "300"])
            .stdout(fs::File::create(domain.folder().join("told")).expect("a file"))
            .spawn()
            .expect("Python starts");
    let ended = wait_for("the listener's end", || {
        on_the_bus(&mut line, &mut lines);
        python.try_wait().expect("a child")
    });
    assert!(ended.success());
    let told = fs::read_to_string(domain.folder().join("told")).expect("a file");
    let told: serde_json::Value = serde_json::from_str(&told).expect("JSON");
    let samples = told["samples"].as_array().expect("a list");
    assert_eq!(samples.len(), 300);
    let number = |sample: &serde_json::Value, key: &str| sample[key].as_u64().expect("a number");
    for (place, sample) in (0..).zip(samples) {
        let sequence = number(&samples[0], "sequence") + place;
        assert_eq!(number(sample, "sequence"), sequence);
        assert_eq!(
            number(sample, "number"),
            number(&samples[0], "number") + place
        );
        assert_eq!(
            (number(sample, "left_out"), number(sample, "version")),
            (0, 1)
        );
        let frame = lines.get(&sequence).expect("the bus had it");
        let hex: String = bytes_of(frame)
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        assert_eq!(sample["payload"], hex.as_str());
    }
    assert_eq!(told["alive"], json!(["lager/r1/@alive"]));
    let layouts = told["layouts"].as_object().expect("an object");
    assert_eq!(layouts.len(), TOPICS.len());
    drop((line, bus, up));
    domain.assert_clean();
}
