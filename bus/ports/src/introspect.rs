//! Who is on the bus and what is in use there. Only looks; nothing here creates a topic.

use iceoryx2::config::Config;
use iceoryx2::node::NodeView;
use iceoryx2::prelude::{
    CallbackProgression, Node, NodeState as IpcNodeState, PortFactory, Service,
};
use iceoryx2::service::static_config::messaging_pattern::MessagingPattern;
use lager_topics::{Description, Role, TOPICS, Topic, TopicEntry, TopicVisitor, visit};

use crate::bus::Bus;
use crate::config::BusConfig;
use crate::descriptions::Descriptions;
use crate::doorbell;
use crate::error::IntrospectError;
use crate::fault::TransportFault;
use crate::kind::{Kind, Side};
use crate::mend;
use crate::name::{self, RobotName};
use crate::service::{self, TopicService};
use crate::sweep;
use crate::transport::Ipc;

/// How a topic in use compares with this build's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// No process uses it.
    Unused,
    /// As in the table.
    Ours,
    /// The name is in the table, but the processes that use it are of another build.
    Other,
    /// The name is not in the table, and the topic describes its samples itself.
    Described,
    /// The name is not in the table, and nobody says what its samples are.
    Unknown,
}

/// One end of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Peer {
    /// What the process is; `None` if it is not one of ours.
    pub role: Option<Role>,
    /// Its process id; 0 if it is not one of ours.
    pub pid: u32,
}

impl Peer {
    fn of(port_name: &str) -> Self {
        match name::parse_port(port_name) {
            Some((role, pid)) => Self {
                role: Some(role),
                pid,
            },
            None => Self { role: None, pid: 0 },
        }
    }
}

/// A topic of one robot, as it is in use.
#[derive(Clone, Debug)]
pub struct TopicInfo {
    /// The robot.
    pub robot: RobotName,
    /// The name behind `lager/<robot>/`.
    pub name: String,
    /// The line of this build's table.
    pub entry: Option<&'static TopicEntry>,
    /// How the topic in use compares with it. Ends are only known if it is [`Layout::Ours`] or
    /// [`Layout::Described`].
    pub layout: Layout,
    /// What a topic says of itself that is not in the table.
    pub description: Option<Description>,
    /// Number of writers. A killed one counts until it is swept.
    pub publishers: usize,
    /// Number of readers. A killed one counts until it is swept.
    pub subscribers: usize,
    /// Number of readers that are observers.
    pub observers: usize,
    /// How many may read under its public name; known of topics that are not in the table only.
    pub places: Option<usize>,
    /// The writers.
    pub writers: Vec<Peer>,
    /// The readers.
    pub readers: Vec<Peer>,
    /// The waiters that each sample wakes, once for each; a killed one is not among them. Known of
    /// topics of the table only.
    pub woken: Vec<Peer>,
}

impl TopicInfo {
    fn without_ends(robot: &RobotName, name: &str, layout: Layout) -> Self {
        Self {
            robot: robot.clone(),
            name: name.to_owned(),
            entry: TOPICS.iter().find(|entry| entry.name == name),
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
    /// Counts the ends at all services of a topic. A reader
    /// reads one of them; a writer writes to all, so what one process has there is the most that it
    /// has at any of them.
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
        let observes = |peer: &&Peer| peer.role.is_some_and(Role::is_observer);
        self.observers = self.readers.iter().filter(observes).count();
    }
}

/// Whether a process lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeState {
    /// It does.
    Alive,
    /// It was killed, and what it left is not swept yet.
    Stale,
    /// Not known: its files belong to another user or are damaged.
    Unknown,
}

/// A process on the bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeInfo {
    /// The node's name; `lager/<robot>/<role>/<pid>` for one of ours, empty if unknown.
    pub name: String,
    /// The executable's file name, empty if unknown.
    pub executable: String,
    /// The robot, if the process is one of ours.
    pub robot: Option<RobotName>,
    /// The role, if the process is one of ours.
    pub role: Option<Role>,
    /// The process id; 0 if unknown.
    pub pid: u32,
    /// Whether it lives.
    pub state: NodeState,
}

impl Bus {
    /// Every topic in use on this bus, of every robot.
    ///
    /// # Errors
    /// The bus's files cannot be listed.
    pub fn topics(&self) -> Result<Vec<TopicInfo>, IntrospectError> {
        topics(self)
    }

    /// Every topic of the table as one robot uses it; those not in use have no ports.
    pub fn topics_of(&self, robot: &RobotName) -> Vec<TopicInfo> {
        TOPICS
            .iter()
            .map(|entry| look(self, robot, entry.name))
            .collect()
    }

    /// Every process on this bus, living or dead.
    ///
    /// # Errors
    /// The bus's files cannot be listed.
    pub fn nodes(&self) -> Result<Vec<NodeInfo>, IntrospectError> {
        list(self.transport())
    }
}

/// Every process on a bus, living or dead, without joining it (joining sweeps).
///
/// # Errors
/// The configuration is not usable, or the bus's files cannot be listed.
pub fn nodes(config: &BusConfig) -> Result<Vec<NodeInfo>, IntrospectError> {
    list(&config.transport(&config.place()?)?)
}

/// Removes what killed processes left behind, without joining the bus; returns how many of them
/// there were.
///
/// # Errors
/// The configuration is not usable, or the bus's files cannot be listed.
pub fn remove_stale_nodes(config: &BusConfig) -> Result<usize, IntrospectError> {
    let place = config.place()?;
    let config = config.transport(&place)?;
    mend::unfinished(&place, &mut Descriptions::default());
    let removed = sweep::dead_nodes(&config).map_err(TransportFault::from)?;
    doorbell::sweep_all(&place);
    place.sweep_locks();
    Ok(removed)
}

fn list(config: &Config) -> Result<Vec<NodeInfo>, IntrospectError> {
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
        let ours = name::parse_node(&name);
        found.push(NodeInfo {
            executable: details
                .map_or_else(String::new, |details| details.executable().to_string()),
            robot: ours.as_ref().map(|(robot, _, _)| robot.clone()),
            role: ours.as_ref().map(|(_, role, _)| *role),
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
        ) && let Some((robot, service)) = name::parse_service(details.name().as_str())
        {
            let topic = name::topic_of(service);
            in_use.push((robot, place(topic), topic.to_owned()));
        }
        CallbackProgression::Continue
    })
    .map_err(TransportFault::from)?;
    in_use.sort();
    in_use.dedup();
    Ok(in_use
        .iter()
        .map(|(robot, _, topic)| look(bus, robot, topic))
        .collect())
}

/// Topics are listed in the table's order, others behind them.
fn place(topic: &str) -> usize {
    TOPICS
        .iter()
        .position(|entry| entry.name == topic)
        .unwrap_or(TOPICS.len())
}

fn look(bus: &Bus, robot: &RobotName, topic: &str) -> TopicInfo {
    visit(topic, Look { bus, robot }).unwrap_or_else(|_| look_at_other(bus, robot, topic))
}

fn look_at_other(bus: &Bus, robot: &RobotName, topic: &str) -> TopicInfo {
    let Ok(Some((public, description))) = service::found(bus, robot, topic, Side::Public) else {
        return TopicInfo::without_ends(robot, topic, Layout::Unknown);
    };
    let actors = service::found(bus, robot, topic, Side::Actors);
    let actors = actors.ok().flatten().map(|(service, _)| service);
    let mut info = TopicInfo::without_ends(robot, topic, Layout::Described);
    info.description = Some(description);
    info.places = Some(public.static_config().max_subscribers());
    info.look_at_ends([&public].into_iter().chain(&actors));
    info
}

struct Look<'a> {
    bus: &'a Bus,
    robot: &'a RobotName,
}

impl TopicVisitor for Look<'_> {
    type Output = TopicInfo;

    fn visit<T: Topic>(self) -> TopicInfo {
        let without_ends = |layout| TopicInfo::without_ends(self.robot, T::NAME, layout);
        let sides: &[Side] = match T::QOS.serves_actors_first() {
            true => &[Side::Public, Side::Actors],
            false => &[Side::Public],
        };
        let open = |side: &Side| {
            service::existing_topic(self.bus, self.robot, &Kind::of::<T>(), *side).transpose()
        };
        let services: Vec<TopicService> = match sides.iter().filter_map(open).collect() {
            Ok(services) => services,
            Err(_) => return without_ends(Layout::Other),
        };
        if services.is_empty() {
            return without_ends(Layout::Unused);
        }
        let mut info = without_ends(Layout::Ours);
        info.look_at_ends(&services);
        for actor in T::QOS.actors {
            let pids = doorbell::woken(self.bus.place(), self.robot, *actor);
            info.woken.extend(pids.into_iter().map(|pid| Peer {
                role: Some(*actor),
                pid,
            }));
        }
        info
    }
}
