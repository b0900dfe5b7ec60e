//! A robot's gateway as a place where samples come from, as its bus is one on its own machine.

use std::collections::BTreeMap;
use std::time::Duration;

use lager_home::UnitName;
use lager_ports::{Layout, Peer, Place, StampTime, TopicInfo, Watched};
use lager_sample::{Description, Make, Topic};
use lager_topics::LAGER;

use crate::error::RemoteError;
use crate::listener::Listening;
use crate::remote::Remote;
use crate::told::About;
use crate::typed::Typed;

impl Place for Remote {
    type Typed<T: Topic> = Typed<T>;
    type Found = Listening;
    type OpenError = RemoteError;
    type LookError = RemoteError;
    type Watch = Option<u64>;

    fn unit(&self) -> &UnitName {
        self.robot()
    }

    fn may_still_tell(&self) -> bool {
        // The link comes back by itself, and so does a gateway that is started again.
        true
    }

    fn typed<T: Topic>(&self) -> Result<Option<Typed<T>>, RemoteError> {
        Ok(self.listen_to_known(T::NAME)?.and_then(Typed::of))
    }

    fn described(&self, name: &str) -> Result<Option<Listening>, RemoteError> {
        // The error says what the gateway carries.
        self.listen(name).map(Some)
    }

    fn every_topic(&self) -> Result<Vec<TopicInfo>, RemoteError> {
        let topics = self.known_topics()?.into_iter();
        Ok(topics.map(|(name, about)| self.info(name, about)).collect())
    }

    fn watch(&self, _of: Watched) -> Option<u64> {
        None
    }

    fn has_changed(&self, watch: &mut Option<u64>) -> bool {
        let now = Some(self.changes());
        std::mem::replace(watch, now) != now
    }

    fn role_of(&self, pid: u32) -> Option<String> {
        let topics = self.known_topics().ok()?;
        topics
            .into_values()
            .find_map(|mut about| about.ends.writers.remove(&pid))
    }

    fn is_here(&self) -> bool {
        false
    }

    fn time(&self) -> StampTime {
        self.stamp_time()
    }

    fn unit_time(&self) -> Option<(u64, Duration)> {
        self.robot_time()
    }

    fn real(&self, unit: Duration) -> Duration {
        unit.div_f64(self.pace())
    }
}

impl Remote {
    fn info(&self, name: String, about: About) -> TopicInfo {
        let entry = LAGER.entry(&name);
        let ours = entry.map(|entry| Description::of_make(&Make::Record(entry.layout)));
        let description = Description::parse(&about.layout).ok();
        let layout = match &description {
            _ if ours.is_some_and(|ours| ours.text() == about.layout) => Layout::Ours,
            Some(_) => Layout::Described,
            None => Layout::Unknown,
        };
        let peers = |told: &BTreeMap<u32, String>| -> Vec<Peer> {
            let peer = |(pid, part): (&u32, &String)| Peer {
                part: Some(part.clone()),
                pid: *pid,
                observes: false,
            };
            told.iter().map(peer).collect()
        };
        let ends = about.ends;
        TopicInfo {
            unit: self.robot().clone(),
            entry: entry.filter(|_| layout == Layout::Ours),
            layout,
            description: description.filter(|_| layout == Layout::Described),
            publishers: ends.publishers,
            subscribers: ends.subscribers,
            observers: ends.observers,
            places: None,
            writers: peers(&ends.writers),
            readers: peers(&ends.readers),
            woken: peers(&ends.woken),
            name,
        }
    }
}
