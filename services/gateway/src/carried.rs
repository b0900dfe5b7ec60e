//! Every sample as it is, for listeners on other computers ([`lager_remote::Carrier`]).

use std::collections::BTreeMap;
use std::time::Duration;

use lager_ports::{Peer, TopicInfo};
use lager_remote::{Carrier, Ends, Kind};
use lager_sample::{Description, Stamp};

use crate::listener::Outlet;

impl Outlet for Carrier {
    fn open(&mut self, topic: &str, description: &Description, kind: Kind) {
        self.open_topic(topic, description, kind);
    }

    fn look_at_ends(&mut self, topics: &[TopicInfo]) {
        for topic in topics {
            let ends = Ends {
                publishers: topic.publishers,
                subscribers: topic.subscribers,
                observers: topic.observers,
                writers: parts(&topic.writers),
                readers: parts(&topic.readers),
                woken: parts(&topic.woken),
            };
            self.tell_of(&topic.name, ends);
        }
    }

    fn take(&mut self, topic: &str, stamp: &Stamp, lost: u64, payload: &[u8]) {
        Carrier::take(self, topic, stamp, lost, payload);
    }

    fn tick(&mut self, robot: Duration) {
        Carrier::tick(self, robot);
    }
}

/// The parts of those processes that are the application's.
fn parts(peers: &[Peer]) -> BTreeMap<u32, String> {
    let known = peers.iter();
    let known = known.filter_map(|peer| Some((peer.pid, peer.part.clone()?)));
    known.collect()
}
