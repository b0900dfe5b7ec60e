//! The baseline of Zenoh, used as in its own ping-pong examples: two peers of one machine on a Unix
//! socket, each with a publisher and a subscriber.
//!
//! ```text
//!   process ─ put ─> socket ─> Zenoh's receiving thread ─ channel ─> process, asleep in `recv`
//! ```
//!
//! The kernel wakes a thread of Zenoh, and that thread wakes the receiving process through Zenoh's
//! default channel: two wake-ups. The sending process writes to the socket in its own thread. All
//! of Zenoh's threads run on their process's core, because the process is bound to it before they
//! start.
//!
//! The second process is told the first one's socket, so the peers neither search nor announce
//! themselves. Zenoh's shared memory is not used: Zenoh uses it only for samples of some 1000
//! bytes.

use core::fmt::Display;
use std::path::Path;
use std::time::{Duration, Instant};

use lager_sample::bytes_of;
use serde_json::json;
use zenoh::qos::CongestionControl;
use zenoh::{Config, Wait};

use super::{End, LIMIT};
use crate::error::{BenchError, Fault, broken};
use crate::sample::{SIZE, Sample};

/// An end that puts to `out` and subscribes to `back`. The first end makes the socket, and the
/// other connects when it exists. Returns when the other end has subscribed to `out`, so not even
/// the first sample is lost. The socket is removed with the end.
pub(crate) fn meet(
    socket: &Path,
    is_first: bool,
    [out, back]: [&'static str; 2],
) -> Result<impl End + use<>, BenchError> {
    let session = zenoh::open(config(socket, is_first, false)?)
        .wait()
        .map_err(failed)?;
    let subscriber = session.declare_subscriber(back).wait().map_err(failed)?;
    let publisher = session
        .declare_publisher(out)
        // Neither drops nor batches a sample: only one is on its way at a time.
        .congestion_control(CongestionControl::Block)
        .express(true)
        .wait()
        .map_err(failed)?;
    let start = Instant::now();
    let is_met = || publisher.matching_status().wait().map_err(failed);
    while !is_met()?.matching() {
        if start.elapsed() > LIMIT {
            return Err(BenchError::Alone(LIMIT));
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    let send = move |sample: &Sample| publisher.put(bytes_of(sample)).wait().map_err(broken);
    let receive = move || {
        // The session must live as long as the end, which uses it.
        let _keeps = &session;
        let received = subscriber.recv_timeout(LIMIT).map_err(broken)?;
        let received = received.ok_or(Fault::Silent(LIMIT))?;
        let bytes = received.payload().to_bytes();
        match bytes.len() {
            SIZE => Ok(Sample::from_bytes(&bytes)),
            other => Err(Fault::Broken(format!(
                "{other} bytes came, and a sample has {SIZE}"
            ))),
        }
    };
    Ok((send, receive))
}

/// The configuration of a peer on `socket`, which the first one makes. `shares`: it uses Zenoh's shared
/// memory.
pub(crate) fn config(socket: &Path, is_first: bool, shares: bool) -> Result<Config, BenchError> {
    let endpoint = format!("unixsock-stream/{}", socket.display());
    let (listen, connect) = match is_first {
        true => (vec![endpoint], vec![]),
        false => (vec![], vec![endpoint]),
    };
    let config = json!({
        "mode": "peer",
        "listen": { "endpoints": listen, "exit_on_failure": true },
        "connect": {
            "endpoints": connect,
            "timeout_ms": u64::try_from(LIMIT.as_millis()).unwrap_or(u64::MAX),
            "exit_on_failure": true,
            // The socket may appear a moment later.
            "retry": { "period_init_ms": 2, "period_max_ms": 20, "period_increase_factor": 2 },
        },
        "scouting": {
            "multicast": { "enabled": false },
            "gossip": { "enabled": false },
        },
        "transport": { "shared_memory": { "enabled": shares } },
        "adminspace": { "enabled": false },
    });
    Config::from_json5(&config.to_string()).map_err(failed)
}

fn failed(error: impl Display) -> BenchError {
    BenchError::Failed {
        contender: "zenoh".to_owned(),
        sample: 0,
        fault: broken(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::tests::pass;

    #[test]
    fn samples_pass_both_ways_and_the_socket_goes_with_the_ends() {
        let folder =
            std::env::temp_dir().join(format!("lager-benches-zenoh-{}", std::process::id()));
        std::fs::create_dir(&folder).unwrap();
        let socket = folder.join("socket");
        let there = socket.clone();
        let second = std::thread::spawn(move || meet(&there, false, ["back", "there"]).unwrap());
        let first = meet(&socket, true, ["there", "back"]).unwrap();
        pass(first, second.join().unwrap());
        assert!(!socket.exists());
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_socket_that_cannot_be_made_is_said() {
        let socket = Path::new("/nowhere/at/all");
        let refused = meet(socket, true, ["there", "back"]);
        assert!(matches!(refused, Err(BenchError::Failed { .. })));
    }
}
