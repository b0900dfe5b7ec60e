//! Every sample as it is, for listeners on other computers ([`lager_remote::Carrier`]).

use lager_ports::TopicInfo;
use lager_remote::{Carrier, Kind};
use lager_sample::{Description, Stamp};

use crate::listener::Outlet;

impl Outlet for Carrier {
    fn open(&mut self, topic: &str, description: &Description, kind: Kind) {
        self.open_topic(topic, description, kind);
    }

    fn look_at_ends(&mut self, topics: &[TopicInfo]) {
        for topic in topics {
            let ends = [topic.publishers, topic.subscribers, topic.observers];
            let writers = topic.writers.iter();
            let writers = writers.filter_map(|peer| Some((peer.pid, peer.part.clone()?)));
            self.tell_of(&topic.name, ends, writers.collect());
        }
    }

    fn take(&mut self, topic: &str, stamp: &Stamp, lost: u64, payload: &[u8]) {
        Carrier::take(self, topic, stamp, lost, payload);
    }

    fn tick(&mut self) {
        Carrier::tick(self);
    }
}
