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
use crate::key::Keys;
use crate::settings::{Proof, Settings};

/// How many listeners one gateway serves at a time.
const LISTENERS: usize = 64;
/// How many robots and listeners one router serves at a time.
const AT_A_ROUTER: usize = 4_096;
/// What a router's certificate names. No robot can have this name.
pub(crate) const ROUTER: &str = "@router";

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
fn keys_of_all() -> Vec<String> {
    let mut keys = vec!["**".to_owned()];
    let ours = ["@layout/**", "@counts", "@alive", "@time"];
    keys.extend(ours.map(|key| format!("lager/*/{key}")));
    keys
}

/// The robot's end.
pub(crate) fn of_robot(settings: &Settings) -> Value {
    let mut config = common();
    // A peer is there at once, also if its router is not yet.
    config["mode"] = json!("peer");
    let listens: Vec<String> = settings.endpoint.iter().map(Endpoint::to_string).collect();
    config["listen"] = json!({ "endpoints": listens, "exit_on_failure": true });
    let calls: Vec<String> = settings.router.iter().map(Endpoint::to_string).collect();
    config["connect"] = json!({
        "endpoints": calls, "timeout_ms": -1, "exit_on_failure": false, "retry": RETRY.json(),
    });
    config["transport"]["unicast"] = json!({ "max_sessions": LISTENERS });
    // A listener is let in to listen. What else it sends is refused, and goes to no other one.
    config["access_control"] = access(&[Subject {
        name: "anybody",
        names: None,
        ingress: &[&ASKS],
        egress: &[&TELLS],
        keys: keys_of_all(),
    }]);
    if let Some(proof) = &settings.proof {
        config["transport"]["link"]["tls"] = tls(proof);
    }
    config
}

/// A router's end. Over TLS only `robots` may tell, each of itself, and whoever else has a certificate
/// listens. Otherwise it serves programs of its own machine, which all may do both.
pub(crate) fn of_router(endpoint: &Endpoint, robots: &[UnitName], proof: Option<&Proof>) -> Value {
    let mut config = common();
    config["mode"] = json!("router");
    config["listen"] = json!({ "endpoints": [endpoint.to_string()], "exit_on_failure": true });
    config["connect"] = json!({ "endpoints": [] });
    config["transport"]["unicast"] = json!({ "max_sessions": AT_A_ROUTER });
    let is_proved = matches!(endpoint, Endpoint::Tls(_));
    let anybody = Subject {
        name: "anybody",
        names: None,
        ingress: if is_proved {
            &[&ASKS]
        } else {
            &[&ASKS, &TELLS]
        },
        egress: &[&ASKS, &TELLS],
        keys: keys_of_all(),
    };
    let of_robot = |robot| Subject {
        name: UnitName::as_str(robot),
        names: Some(vec![robot.as_str()]),
        ingress: &[&TELLS],
        egress: &[],
        keys: Keys::of(robot).all().to_vec(),
    };
    let robots = robots.iter().filter(|_| is_proved).map(of_robot);
    let subjects: Vec<Subject<'_>> = robots.chain([anybody]).collect();
    config["access_control"] = access(&subjects);
    if let Some(proof) = proof {
        config["transport"]["link"]["tls"] = tls(proof);
    }
    config
}

/// A listener's end, which calls the gateway of `robot`, or a router.
pub(crate) fn of_listener(
    endpoint: &Endpoint,
    robot: Option<&UnitName>,
    proof: Option<&Proof>,
) -> Value {
    let mut config = common();
    config["mode"] = json!("client");
    config["listen"] = json!({ "endpoints": [] });
    config["connect"] = json!({
        "endpoints": [endpoint.to_string()], "timeout_ms": 0, "exit_on_failure": true,
        "retry": RETRY.json(),
    });
    if let (Endpoint::Tls(_), Some(proof)) = (endpoint, proof) {
        config["transport"]["link"]["tls"] = tls(proof);
        let named = robot.map(UnitName::as_str).into_iter().chain([ROUTER]);
        config["access_control"] = access(&[Subject {
            name: "robot",
            names: Some(named.collect()),
            ingress: &[&TELLS],
            egress: &[&ASKS],
            keys: keys_of_all(),
        }]);
    }
    config
}

/// How soon the other end is called again: it is found soon after it was replaced.
struct Retry {
    first_ms: u32,
    longest_ms: u32,
}

const RETRY: Retry = Retry {
    first_ms: 100,
    longest_ms: 1_000,
};

impl Retry {
    fn json(&self) -> Value {
        json!({
            "period_init_ms": self.first_ms, "period_max_ms": self.longest_ms,
            "period_increase_factor": 2,
        })
    }
}

/// How much of what was sent waits in the kernel, in bytes, which doubles it. What waits there cannot be
/// overtaken, so on a slow link states would come after seconds of streams. It is far more than a local
/// network has on its way.
const KERNEL_QUEUE: u32 = 32 << 10;

fn common() -> Value {
    json!({
        "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
        "adminspace": { "enabled": false },
        "transport": { "link": { "tcp": { "so_sndbuf": KERNEL_QUEUE }, "tx": { "queue": { "congestion_control": { "drop": {
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
        "so_sndbuf": KERNEL_QUEUE,
        "listen_certificate": proof.certificate,
        "listen_private_key": proof.key,
        "connect_certificate": proof.certificate,
        "connect_private_key": proof.key,
    })
}

/// Whoever is at the other end, and what passes from there and to there.
struct Subject<'a> {
    name: &'a str,
    /// The names in certificates; `None` for everybody.
    names: Option<Vec<&'a str>>,
    ingress: &'a [&'a [&'a str]],
    egress: &'a [&'a [&'a str]],
    keys: Vec<String>,
}

/// Rules by which nothing passes but this.
fn access(subjects: &[Subject<'_>]) -> Value {
    let (mut rules, mut policies) = (Vec::new(), Vec::new());
    for subject in subjects {
        let mut own = Vec::new();
        for (flow, messages) in [("ingress", subject.ingress), ("egress", subject.egress)] {
            let messages = messages.concat();
            if messages.is_empty() {
                continue;
            }
            let id = format!("{flow}-{}", subject.name);
            rules.push(json!({
                "id": id, "permission": "allow", "messages": messages, "flows": [flow],
                "key_exprs": subject.keys,
            }));
            own.push(id);
        }
        policies.push(json!({ "rules": own, "subjects": [subject.name] }));
    }
    let subjects = subjects.iter().map(|subject| match &subject.names {
        Some(names) => json!({ "id": subject.name, "cert_common_names": names }),
        None => json!({ "id": subject.name }),
    });
    json!({
        "enabled": true,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects.collect::<Vec<_>>(),
        "policies": policies,
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
