//! How a Zenoh session of either end is set up: it speaks to nobody that was not named.
//!
//! Zenoh's own defaults search for others by multicast and gossip, and a peer listens at every
//! address of the machine. All of that is off here. The public certificate authorities, which
//! Zenoh's TLS client trusts beside its own one, prove no robot: a robot's end lets nobody in
//! without a certificate of its own authority, and a listener's end takes messages only from a
//! certificate with the robot's name.

use std::fmt;

use lager_home::UnitName;
use serde_json::{Value, json};
use zenoh::{Config, Session, Wait};

use crate::endpoint::Endpoint;
use crate::settings::Proof;

/// How many listeners one gateway serves at a time.
const LISTENERS: usize = 64;

/// What a listener may ask of a gateway.
const ASKS: [&str; 4] = [
    "declare_subscriber",
    "query",
    "declare_liveliness_subscriber",
    "liveliness_query",
];
/// What a gateway tells a listener.
const TELLS: [&str; 4] = ["put", "reply", "liveliness_token", "declare_queryable"];

/// The keys of all robots, and everything beside them that has no `@`.
const KEYS: [&str; 4] = [
    "**",
    "lager/*/@layout/**",
    "lager/*/@counts",
    "lager/*/@alive",
];

/// The robot's end.
pub(crate) fn of_robot(endpoint: &Endpoint, proof: Option<&Proof>) -> Value {
    let mut config = common();
    config["mode"] = json!("peer");
    config["listen"] = json!({ "endpoints": [endpoint.to_string()], "exit_on_failure": true });
    config["connect"] = json!({ "endpoints": [] });
    config["transport"]["unicast"] = json!({ "max_sessions": LISTENERS });
    // A listener is let in to listen. What else it sends is refused, and goes to no other one.
    config["access_control"] = access(json!({ "id": "anybody" }), ("ingress", "egress"));
    if let Some(proof) = proof {
        config["transport"]["link"]["tls"] = tls(proof);
        let of_listener = &mut config["transport"]["link"]["tls"];
        of_listener["listen_certificate"] = json!(proof.certificate);
        of_listener["listen_private_key"] = json!(proof.key);
    }
    config
}

/// A listener's end, which calls the gateway of `robot`.
pub(crate) fn of_listener(endpoint: &Endpoint, robot: &UnitName, proof: Option<&Proof>) -> Value {
    let mut config = common();
    config["mode"] = json!("client");
    config["listen"] = json!({ "endpoints": [] });
    config["connect"] = json!({
        "endpoints": [endpoint.to_string()],
        "timeout_ms": 0,
        "exit_on_failure": true,
        // After a gateway was replaced it is found again soon.
        "retry": { "period_init_ms": 100, "period_max_ms": 1_000, "period_increase_factor": 2 },
    });
    if let (Endpoint::Tls(_), Some(proof)) = (endpoint, proof) {
        config["transport"]["link"]["tls"] = tls(proof);
        let of_caller = &mut config["transport"]["link"]["tls"];
        of_caller["connect_certificate"] = json!(proof.certificate);
        of_caller["connect_private_key"] = json!(proof.key);
        let subject = json!({ "id": "robot", "cert_common_names": [robot.as_str()] });
        config["access_control"] = access(subject, ("egress", "ingress"));
    }
    config
}

fn common() -> Value {
    json!({
        "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
        "adminspace": { "enabled": false },
        "transport": { "link": { "tx": { "queue": { "congestion_control": { "drop": {
            // Whoever is slow loses messages at once: waiting for him would hold up all others.
            "wait_before_drop": 0, "max_wait_before_drop_fragments": 0,
        } } } } } },
    })
}

fn tls(proof: &Proof) -> Value {
    json!({
        "root_ca_certificate": proof.authority,
        "enable_mtls": true,
        "verify_name_on_connect": true,
        "close_link_on_expiration": true,
    })
}

/// Rules by which one end only asks and the other one only tells.
fn access(subject: Value, (asks, tells): (&str, &str)) -> Value {
    let rule = |id: &str, messages: [&str; 4], flow: &str| {
        json!({
            "id": id, "permission": "allow", "messages": messages, "flows": [flow],
            "key_exprs": KEYS,
        })
    };
    let name = subject["id"].clone();
    json!({
        "enabled": true,
        "default_permission": "deny",
        "rules": [rule("asks", ASKS, asks), rule("tells", TELLS, tells)],
        "subjects": [subject],
        "policies": [{ "rules": ["asks", "tells"], "subjects": [name] }],
    })
}

/// Zenoh could not do it. Its own words.
#[derive(Debug)]
pub struct ZenohError(String);

impl ZenohError {
    pub(crate) fn of(error: impl fmt::Display) -> Self {
        // The rest is about Zenoh's sources.
        let said = error.to_string();
        let said = said.lines().next().unwrap_or_default();
        let said = said.split_once(" at /").map_or(said, |(said, _)| said);
        Self(said.trim_end().to_owned())
    }
}

impl fmt::Display for ZenohError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

impl std::error::Error for ZenohError {}

pub(crate) fn open(config: &Value) -> Result<Session, ZenohError> {
    let config = Config::from_json5(&config.to_string()).map_err(ZenohError::of)?;
    zenoh::open(config).wait().map_err(ZenohError::of)
}
