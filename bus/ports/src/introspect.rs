//! Lists the processes and the topics on the bus, for tools. It creates no topic.

use iceoryx2::config::Config;
use iceoryx2::node::NodeView;
use iceoryx2::prelude::{
    CallbackProgression, Node, NodeState as IpcNodeState, PortFactory, Service,
};
use iceoryx2::service::static_config::messaging_pattern::MessagingPattern;
use lager_home::{Descriptions, UnitName};
use lager_sample::{Application, Description, TopicEntry};

use crate::bus::Bus;
use crate::config::BusConfig;
use crate::error::IntrospectError;
use crate::fault::TransportFault;
use crate::kind::{Kind, Side};
use crate::name;
use crate::service::{self, TopicService};
use crate::sweep;
use crate::transport::Ipc;

/// How a topic in use compares with this build's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// No process uses it.
    Unused,
    /// The layout is that of the table.
    Ours,
    /// The name is in the table, but the processes that use it are of another build.
    Other,
    /// The name is not in the table, and the topic describes its samples itself.
    Described,
    /// The name is not in the table, and the topic has no description of its samples.
    Unknown,
}

/// A process that has a port on a topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Peer {
    /// The part that its process plays; `None` if it is not a process of the application.
    pub part: Option<String>,
    /// The process id; 0 if it is not a process of the application.
    pub pid: u32,
    /// Whether its process is an observer.
    pub observes: bool,
}

impl Peer {
    /// The part that its process plays, or `a stranger` for any other process.
    pub fn who(&self) -> &str {
        self.part.as_deref().unwrap_or("a stranger")
    }

    fn of(port_name: &str) -> Self {
        let named = name::parse_port(port_name);
        Self {
            part: named.map(|(part, ..)| part.to_owned()),
            pid: named.map_or(0, |(_, pid, _)| pid),
            observes: named.is_some_and(|(.., observes)| observes),
        }
    }
}

/// A topic that is in use on one unit.
#[derive(Clone, Debug)]
pub struct TopicInfo {
    /// The unit.
    pub unit: UnitName,
    /// The name behind `<family>/<unit>/`.
    pub name: String,
    /// The topic's line in this build's table; `None` if it has none.
    pub entry: Option<&'static TopicEntry>,
    /// How the topic in use compares with the table. Writers and readers are only known if this is
    /// [`Layout::Ours`] or [`Layout::Described`].
    pub layout: Layout,
    /// The topic's own description of its samples, if the topic is not in the table.
    pub description: Option<Description>,
    /// Number of writers. A killed writer counts until a sweep removes it.
    pub publishers: usize,
    /// Number of readers. A killed reader counts until a sweep removes it.
    pub subscribers: usize,
    /// Number of readers that are observers.
    pub observers: usize,
    /// How many readers the topic's public service admits; known only if the table lacks the topic.
    pub places: Option<usize>,
    /// The writers.
    pub writers: Vec<Peer>,
    /// The readers.
    pub readers: Vec<Peer>,
    /// The waiters that each sample wakes, one entry for each waiter. A killed waiter is not
    /// listed. Known for topics of the table only.
    pub woken: Vec<Peer>,
}

impl TopicInfo {
    fn without_ends(bus: &Bus, unit: &UnitName, name: &str, layout: Layout) -> Self {
        Self {
            unit: unit.clone(),
            name: name.to_owned(),
            entry: bus.application().entry(name),
            layout,
            description: None,
            publishers: 0,
            subscribers: 0,
            observers: 0,
            places: None,
            writers: Vec::new(),
            readers: Vec::new(),
            woken: Vec::new(),
        }
    }
}

impl TopicInfo {
    /// Lists writers and readers at all services of a topic. A reader has a port at one of the
    /// services. A writer has one at each, so a process has as many as its highest count.
    fn look_at_ends<'a>(&mut self, services: impl IntoIterator<Item = &'a TopicService>) {
        let mut writers: Vec<(u128, Peer)> = Vec::new();
        for service in services {
            let ends = service.dynamic_config();
            let mut counted = writers.clone();
            ends.list_publishers(|details| {
                let peer = Peer::of(details.publisher_name.as_str());
                let writer = (details.node_id.value(), peer);
                match counted.iter().position(|known| *known == writer) {
                    Some(known) => drop(counted.swap_remove(known)),
                    None => writers.push(writer),
                }
                CallbackProgression::Continue
            });
            ends.list_subscribers(|details| {
                self.readers
                    .push(Peer::of(details.subscriber_name.as_str()));
                CallbackProgression::Continue
            });
        }
        self.writers = writers.into_iter().map(|(_, peer)| peer).collect();
        self.publishers = self.writers.len();
        self.subscribers = self.readers.len();
        self.observers = self.readers.iter().filter(|peer| peer.observes).count();
    }
}

/// Whether the process of a node lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeState {
    /// It lives.
    Alive,
    /// It was killed, and no sweep has removed its files yet.
    Stale,
    /// Not known: its files belong to another user or are damaged.
    Unknown,
}

/// A process on the bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeInfo {
    /// The node's name; `<family>/<unit>/<part>/<pid>` for the application; empty if unknown.
    pub name: String,
    /// The executable's file name, empty if unknown.
    pub executable: String,
    /// The unit, if the process is one of the application.
    pub unit: Option<UnitName>,
    /// The part that the process plays, if it is one of the application.
    pub part: Option<String>,
    /// The process id; 0 if unknown.
    pub pid: u32,
    /// Whether the process lives.
    pub state: NodeState,
}

impl Bus {
    /// Every topic in use on this bus, of every unit.
    ///
    /// # Errors
    /// The bus's files cannot be listed.
    pub fn topics(&self) -> Result<Vec<TopicInfo>, IntrospectError> {
        topics(self)
    }

    /// Every topic of the table as one unit uses it; a topic that is not in use has no ports.
    pub fn topics_of(&self, unit: &UnitName) -> Vec<TopicInfo> {
        let table = self.application().topics.iter();
        table.map(|entry| look_at(self, unit, entry)).collect()
    }

    /// Every process on this bus, living or dead.
    ///
    /// # Errors
    /// The bus's files cannot be listed.
    pub fn nodes(&self) -> Result<Vec<NodeInfo>, IntrospectError> {
        list(self.application(), self.transport())
    }
}

/// Every process on a bus, living or dead, without joining it (joining sweeps).
///
/// # Errors
/// The configuration is not usable, or the bus's files cannot be listed.
pub fn nodes(config: &BusConfig) -> Result<Vec<NodeInfo>, IntrospectError> {
    list(config.application, &config.transport(&config.home()?)?)
}

/// Removes what killed processes left behind, without joining the bus; returns their number.
///
/// # Errors
/// The configuration is not usable, or the bus's files cannot be listed.
pub fn remove_stale_nodes(config: &BusConfig) -> Result<usize, IntrospectError> {
    let home = config.home()?;
    let config = config.transport(&home)?;
    lager_home::unfinished(&home, &mut Descriptions::default());
    let removed = sweep::dead_nodes(&config).map_err(TransportFault::from)?;
    lager_wake::sweep_all(&home);
    home.sweep_locks();
    Ok(removed)
}

fn list(application: &Application, config: &Config) -> Result<Vec<NodeInfo>, IntrospectError> {
    let mut found = Vec::new();
    Node::<Ipc>::list(config, |state| {
        let (details, state) = match &state {
            IpcNodeState::Alive(view) => (view.details().as_ref(), NodeState::Alive),
            IpcNodeState::Dead(view) => (view.details().as_ref(), NodeState::Stale),
            IpcNodeState::Inaccessible(_) | IpcNodeState::Undefined(_) => {
                (None, NodeState::Unknown)
            }
        };
        let name = details.map_or_else(String::new, |details| details.name().to_string());
        let ours =
            name::parse_node(application, &name).map(|(unit, part, _)| (unit, part.to_owned()));
        found.push(NodeInfo {
            executable: details
                .map_or_else(String::new, |details| details.executable().to_string()),
            unit: ours.as_ref().map(|(unit, _)| unit.clone()),
            part: ours.map(|(_, part)| part),
            // Process ids are positive.
            pid: details.map_or(0, |details| details.process_id().value() as u32),
            name,
            state,
        });
        CallbackProgression::Continue
    })
    .map_err(TransportFault::from)?;
    found.sort_by(|a, b| (&a.name, a.pid).cmp(&(&b.name, b.pid)));
    Ok(found)
}

fn topics(bus: &Bus) -> Result<Vec<TopicInfo>, IntrospectError> {
    let mut in_use = Vec::new();
    Ipc::list(bus.transport(), |details| {
        let details = details.static_details;
        if matches!(
            details.messaging_pattern(),
            MessagingPattern::PublishSubscribe(_)
        ) && let Some((unit, service)) =
            name::parse_service(bus.application(), details.name().as_str())
        {
            let topic = name::topic_of(service);
            in_use.push((unit, place(bus, topic), topic.to_owned()));
        }
        CallbackProgression::Continue
    })
    .map_err(TransportFault::from)?;
    in_use.sort();
    in_use.dedup();
    Ok(in_use
        .iter()
        .map(|(unit, _, topic)| look(bus, unit, topic))
        .collect())
}

/// The position in the list: topics in the table's order, other topics after them.
fn place(bus: &Bus, topic: &str) -> usize {
    let table = bus.application().topics;
    let place = table.iter().position(|entry| entry.name == topic);
    place.unwrap_or(table.len())
}

fn look(bus: &Bus, unit: &UnitName, topic: &str) -> TopicInfo {
    match bus.application().entry(topic) {
        Some(entry) => look_at(bus, unit, entry),
        None => look_at_other(bus, unit, topic),
    }
}

fn look_at_other(bus: &Bus, unit: &UnitName, topic: &str) -> TopicInfo {
    let Ok(Some((public, description))) = service::found(bus, unit, topic, Side::Public) else {
        return TopicInfo::without_ends(bus, unit, topic, Layout::Unknown);
    };
    let actors = service::found(bus, unit, topic, Side::Actors);
    let actors = actors.ok().flatten().map(|(service, _)| service);
    let mut info = TopicInfo::without_ends(bus, unit, topic, Layout::Described);
    info.description = Some(description);
    info.places = Some(public.static_config().max_subscribers());
    info.look_at_ends([&public].into_iter().chain(&actors));
    info
}

fn look_at(bus: &Bus, unit: &UnitName, entry: &TopicEntry) -> TopicInfo {
    let without_ends = |layout| TopicInfo::without_ends(bus, unit, entry.name, layout);
    let sides: &[Side] = match entry.qos.serves_actors_first() {
        true => &[Side::Public, Side::Actors],
        false => &[Side::Public],
    };
    let kind = Kind::of_entry(entry);
    let open = |side: &Side| service::existing_topic(bus, unit, &kind, *side).transpose();
    let services: Vec<TopicService> = match sides.iter().filter_map(open).collect() {
        Ok(services) => services,
        Err(_) => return without_ends(Layout::Other),
    };
    if services.is_empty() {
        return without_ends(Layout::Unused);
    }
    let mut info = without_ends(Layout::Ours);
    info.look_at_ends(&services);
    for actor in entry.qos.actors {
        let pids = lager_wake::woken(bus.home(), unit, *actor);
        info.woken.extend(pids.into_iter().map(|pid| Peer {
            part: Some(actor.name().to_owned()),
            pid,
            observes: false,
        }));
    }
    info
}
