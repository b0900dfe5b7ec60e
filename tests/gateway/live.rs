//! Tests of `--foxglove`: what a viewer sees of a running robot. They need a program with the
//! feature `foxglove`, which `tests/run` builds.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::net::TcpStream;
use std::process::Command;
use std::time::Duration;

use lager_journal::View;
use lager_ports::{Bus, Cause, Publisher};
use lager_sample::{Qos, Topic, payload};
use lager_tests::{Domain, free, wait_for};
use lager_topics::{Role, TOPICS};
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest as _;
use tungstenite::{Error, Message, WebSocket};

payload! {
    /// A large payload, so that few samples fill a connection.
    pub struct Much: 1032 bytes {
        /// Counts from 0.
        pub number: u64,
        /// Long numbers.
        pub words: [[u64; 32]; 4],
    }
}

/// A topic that the robot's table does not have.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MuchNow;

impl Topic for MuchNow {
    const NAME: &'static str = "much/now";
    type Payload = Much;
    const QOS: Qos = Qos::stream(64);
    const SUMMARY: &'static str = "Much.";
}

/// A viewer that subscribes to everything.
pub(crate) struct Viewer {
    socket: WebSocket<TcpStream>,
    /// The topic of each channel number.
    topics: BTreeMap<u64, String>,
}

impl Viewer {
    /// Subscribes to everything when the gateway has `topic`; `None` while nobody listens.
    pub(crate) fn connect(address: &str, topic: &str) -> Option<Self> {
        let stream = TcpStream::connect(address).ok()?;
        let mut request = format!("ws://{address}")
            .into_client_request()
            .expect("an address");
        let protocol = "foxglove.sdk.v1".parse().expect("a header");
        let headers = request.headers_mut();
        headers.insert("sec-websocket-protocol", protocol);
        let (mut socket, _) = tungstenite::client(request, stream).ok()?;
        let mut topics = BTreeMap::new();
        while !topics.values().any(|name| name == topic) {
            let said = said(&mut socket);
            for channel in said["channels"].as_array().into_iter().flatten() {
                let id = channel["id"].as_u64().expect("a number");
                topics.insert(id, channel["topic"].as_str().expect("a name").to_owned());
            }
        }
        let all = topics.keys();
        let all: Vec<Value> = all.map(|id| json!({"id": id, "channelId": id})).collect();
        let wish = json!({"op": "subscribe", "subscriptions": all}).to_string();
        // When the second request is answered, the gateway has handled the first one.
        for _ in 0..2 {
            socket.send(wish.clone().into()).expect("it is heard");
        }
        while said(&mut socket)["op"] != "status" {}
        let patience = Some(Duration::from_millis(20));
        socket
            .get_ref()
            .set_read_timeout(patience)
            .expect("a socket");
        Some(Self { socket, topics })
    }

    /// The number in the next message of [`MuchNow`], and the message's length in bytes; `None` if
    /// none has come.
    pub(crate) fn number(&mut self) -> Option<(u64, usize)> {
        loop {
            let bytes = match self.socket.read() {
                // Opcode, subscription, time, message.
                Ok(Message::Binary(bytes)) => bytes,
                Ok(_) => continue,
                Err(Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => return None,
                Err(error) => panic!("{error}"),
            };
            let id = u32::from_le_bytes(bytes[1..5].try_into().expect("four"));
            if self.topics[&id.into()] == MuchNow::NAME {
                let message: Value = serde_json::from_slice(&bytes[13..]).expect("JSON");
                let number = message["payload"]["number"].as_u64().expect("a number");
                return Some((number, bytes.len()));
            }
        }
    }
}

/// The server's next message about itself.
fn said(socket: &mut WebSocket<TcpStream>) -> Value {
    loop {
        if let Message::Text(text) = socket.read().expect("it goes on") {
            return serde_json::from_str(&text).expect("JSON");
        }
    }
}

pub(crate) fn send(publisher: &Publisher<MuchNow>, number: u64) {
    let words = [[u64::MAX - number; 32]; 4];
    let much = Much { number, words };
    publisher.send(Cause::OWN, much).expect("a sample");
}

/// More bytes than wait for a viewer that reads nothing, in its queue and in its connection.
const MUCH: usize = 8 << 20;

#[test]
#[cfg_attr(not(feature = "foxglove"), ignore = "needs --features lager/foxglove")]
fn who_reads_nothing_loses_messages_and_holds_nobody_up() {
    let domain = Domain::new();
    let address = free();
    let bus = Bus::open(&domain.bus("r1", 1.0), Role::Guest).expect("the bus opens");
    let publisher = bus.publisher::<MuchNow>().expect("a topic");
    let gateway = domain.start(&["gateway", "--foxglove", &address]);
    let connect = || Viewer::connect(&address, MuchNow::NAME);
    let mut asleep = wait_for("the gateway", connect);
    let mut awake = wait_for("the gateway", connect);

    // A subscriber finds its publisher only when it looks.
    let mut sent = 0;
    let mut heard = wait_for("the first message", || {
        send(&publisher, sent);
        sent += 1;
        Some(awake.number()?.0)
    });
    while heard < sent - 1 {
        (heard, _) = wait_for("the last one so far", || awake.number());
    }
    let mut read = 0;
    while read < MUCH {
        let next = sent;
        for _ in 0..8 {
            send(&publisher, sent);
            sent += 1;
        }
        for expected in next..sent {
            let (number, bytes) = wait_for("a message", || awake.number());
            assert_eq!(number, expected, "after {read} bytes");
            read += bytes;
        }
    }

    // The viewer that slept reads again, and continues with new samples.
    let (mut before, _) = wait_for("an old message", || asleep.number());
    let mut missed = 0;
    while before < sent - 1 {
        let (number, _) = wait_for("a message", || asleep.number());
        missed += number - before - 1;
        before = number;
    }
    assert!(missed > 0, "all {read} bytes waited for him");
    // Viewers that come and go are not logged at the robot.
    drop((asleep, awake));
    assert!(connect().is_some());
    assert_eq!(gateway.log(), "");
    drop((gateway, publisher, bus));
    domain.assert_clean();
}

#[test]
#[ignore = "needs LAGER_PYTHON, a Python with robo-ws-bridge and jsonschema; tests/run makes one"]
fn a_client_by_others_gets_channels_schemas_and_messages() {
    let domain = Domain::new();
    let address = free();
    let up = domain.start(&["up", "--headless", "--foxglove", &address, "--mission", "1"]);
    // The gateway starts late: the map and everything in it were published before.
    domain.done(&["topic", "echo", "nav/map", "--count", "1", "--wait"]);
    let views = View::ALL.map(View::topic);
    // Nothing is in the robot's way, so there are no blocks.
    let views = views.iter().filter(|view| **view != View::Blocks.topic());
    let topics = ["sensor/line", "steering/state", "nav/map", "nav/status"];
    let output = Command::new(std::env::var_os("LAGER_PYTHON").expect("it names a Python"))
        .arg(lager_tests::in_tree("tests/gateway/foxglove.py"))
        .arg(format!("ws://{address}"))
        .args(views.chain(&topics))
        .output()
        .expect("Python starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(told["server"], "Lagerrobot r1");
    assert_eq!(told["capabilities"], json!([]), "a viewer can only look");
    for entry in TOPICS {
        let name = entry.layout.name();
        assert_eq!(told["schemas"][entry.name], name, "{}", entry.name);
    }
    for view in View::ALL {
        let name = view.kind().name();
        assert_eq!(told["schemas"][view.topic()], name, "{}", view.topic());
    }
    let products = &told["last"]["nav/map"]["payload"]["products"];
    assert_eq!(
        products.as_array().map(|products| products.len() > 1),
        Some(true)
    );
    let drawn = &told["last"]["foxglove/map"]["entities"][0];
    assert_eq!(
        (&drawn["frame_id"], &drawn["id"]),
        (&json!("map"), &json!("map"))
    );
    drop(up);
    domain.assert_clean();
}
