//! Zenoh, as its own examples play ping-pong: two peers of one machine on a Unix socket, each with
//! a publisher and a subscriber, nothing between.
//!
//! ```text
//!   process ─ put ─> socket ─> Zenoh's receiving thread ─ channel ─> process, asleep in `recv`
//! ```
//!
//! A receiver is woken twice: the kernel wakes a thread of Zenoh's, which hands the sample to the
//! process through the channel that is Zenoh's default. Sending is the process's own thread's work
//! down to the socket. All of Zenoh's threads stay on the core of the process they belong to,
//! because the process is bound to it before there are any.
//!
//! Nobody is looked for and nothing is announced: the second process is told the socket of the
//! first, and neither listens anywhere else. Zenoh's shared memory has no part in it, because Zenoh
//! itself uses it only for samples of some thousand bytes.

use core::fmt::Display;
use std::path::Path;
use std::time::{Duration, Instant};

use lager_topics::bytes_of;
use serde_json::json;
use zenoh::handlers::FifoChannelHandler;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::CongestionControl;
use zenoh::sample::Sample as Received;
use zenoh::{Config, Session, Wait};

use super::{End, Fault, LIMIT, broken};
use crate::error::BenchError;
use crate::sample::{SIZE, Sample};

/// Which side of the socket an end is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// It makes the socket.
    Listens,
    /// It connects, as soon as the socket is there.
    Connects,
}

/// An end that puts to one key and subscribes to another.
pub(crate) struct Peer {
    publisher: Publisher<'static>,
    subscriber: Subscriber<FifoChannelHandler<Received>>,
    // Dropped last: it closes what the others need.
    _session: Session,
}

impl Peer {
    /// Puts to `out` and subscribes to `back`. Returns when the other end subscribes to `out`, so
    /// that not even the first sample is lost. The socket is gone when the end is.
    pub(crate) fn meet(
        socket: &Path,
        side: Side,
        (out, back): (&'static str, &'static str),
    ) -> Result<Self, BenchError> {
        let session = zenoh::open(config(socket, side)?).wait().map_err(failed)?;
        let subscriber = session.declare_subscriber(back).wait().map_err(failed)?;
        let publisher = session
            .declare_publisher(out)
            // Neither dropped nor gathered into batches: one sample is on its way at a time.
            .congestion_control(CongestionControl::Block)
            .express(true)
            .wait()
            .map_err(failed)?;
        let start = Instant::now();
        while !publisher
            .matching_status()
            .wait()
            .map_err(failed)?
            .matching()
        {
            if start.elapsed() > LIMIT {
                return Err(BenchError::Alone { limit: LIMIT });
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(Self {
            publisher,
            subscriber,
            _session: session,
        })
    }
}

impl End for Peer {
    fn send(&mut self, sample: &Sample) -> Result<(), Fault> {
        let bytes = bytes_of(sample);
        self.publisher.put(bytes).wait().map_err(broken)
    }

    fn receive(&mut self) -> Result<Sample, Fault> {
        let received = self.subscriber.recv_timeout(LIMIT).map_err(broken)?;
        let received = received.ok_or(Fault::Silent)?;
        let bytes = received.payload().to_bytes();
        match bytes.len() {
            SIZE => Ok(Sample::from_bytes(&bytes)),
            other => Err(Fault::Broken(format!(
                "{other} bytes came, and a sample has {SIZE}"
            ))),
        }
    }
}

fn config(socket: &Path, side: Side) -> Result<Config, BenchError> {
    let endpoint = format!("unixsock-stream/{}", socket.display());
    let (listen, connect) = match side {
        Side::Listens => (vec![endpoint], vec![]),
        Side::Connects => (vec![], vec![endpoint]),
    };
    let config = json!({
        "mode": "peer",
        "listen": { "endpoints": listen, "exit_on_failure": true },
        "connect": {
            "endpoints": connect,
            "timeout_ms": u64::try_from(LIMIT.as_millis()).unwrap_or(u64::MAX),
            "exit_on_failure": true,
            // The socket may come a moment later.
            "retry": { "period_init_ms": 2, "period_max_ms": 20, "period_increase_factor": 2 },
        },
        "scouting": {
            "multicast": { "enabled": false },
            "gossip": { "enabled": false },
        },
        "adminspace": { "enabled": false },
    });
    Config::from_json5(&config.to_string()).map_err(failed)
}

fn failed(error: impl Display) -> BenchError {
    BenchError::Carrier {
        contender: "zenoh".to_owned(),
        detail: error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_pass_both_ways_and_the_socket_goes_with_the_ends() {
        let folder =
            std::env::temp_dir().join(format!("lager-benches-zenoh-{}", std::process::id()));
        std::fs::create_dir(&folder).unwrap();
        let socket = folder.join("socket");
        let there = socket.clone();
        let second = std::thread::spawn(move || {
            let mut end = Peer::meet(&there, Side::Connects, ("back", "there")).unwrap();
            for _ in 0..3 {
                let sample = end.receive().unwrap();
                end.send(&sample).unwrap();
            }
            // Whoever closes first might take the last sample with it.
            end
        });
        let mut first = Peer::meet(&socket, Side::Listens, ("there", "back")).unwrap();
        for number in 1..=3 {
            first.send(&Sample::new(number)).unwrap();
            assert_eq!(first.receive().unwrap(), Sample::new(number));
        }
        drop(second.join().unwrap());
        drop(first);
        assert!(!socket.exists());
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_socket_that_cannot_be_made_is_said() {
        let socket = Path::new("/nowhere/at/all");
        let refused = Peer::meet(socket, Side::Listens, ("there", "back"));
        assert!(matches!(refused, Err(BenchError::Carrier { .. })));
    }
}
