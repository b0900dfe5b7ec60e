//! A node of ROS 2 on a participant of DDS: publishers, readers of requests, and the graph that
//! shows them to other programs.
//!
//! ```text
//!   Node ──> ros_discovery_info: this participant is the node /r1, with these endpoints
//!    ├─ Writer<M> ──> rt/r1/range …                  a publisher
//!    ├─ Server    <── rq/r1/stopRequest              a service
//!    │            ──> rr/r1/stopReply
//!    └─ Complaints: who wanted another quality of service than is offered
//! ```
//!
//! **Nobody is waited for.** A message for which there is no room is given up and counted
//! ([`Writer::refused`]); there is none when a reliable reader has not acknowledged the last
//! [`ROOM`] messages.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use ros2_client::entities_info::{NodeEntitiesInfo, ParticipantEntitiesInfo};
use ros2_client::names::{MessageTypeName, Name, NameError, NodeName};
use ros2_client::{Gid, MessageInfo, RmwRequestId};
use rustdds::dds::{CreateError, WriteError};
use rustdds::no_key::{DataWriterCdr, SimpleDataReaderCdr};
use rustdds::policy::{Durability, History, Reliability, ResourceLimits};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, DomainParticipantStatusEvent,
    DomainParticipantStatusListener, GUID, Publisher, QosPolicies, QosPolicyBuilder, RTPSEntity,
    SampleIdentity, StatusEvented, Subscriber, Timestamp, TopicKind, WriteOptionsBuilder,
};

use crate::messages::{RosType, TRIGGER, TriggerRequest, TriggerResponse};
use crate::place::{Place, Reach};

/// How many messages may await a reliable reader's acknowledgement.
pub const ROOM: i32 = 2_048;
/// How many samples one look at the bus may bring, of which RustDDS sends each only if its history has
/// room for all.
const BURST: i32 = 1_024;
/// How often the same topic is complained of.
const COMPLAINT: Duration = Duration::from_secs(10);

/// Why there is no node.
#[derive(Debug, thiserror::Error)]
pub enum NodeError {
    /// The name is none for ROS.
    #[error("ROS 2 has no such name: {0:?}")]
    Name(NameError),
    /// DDS cannot begin.
    #[error("DDS does not begin in domain {domain}: {error}; is its port range free?")]
    Begin {
        /// The domain.
        domain: u16,
        /// Why.
        error: CreateError,
    },
    /// An endpoint cannot be made.
    #[error("{topic} cannot be offered: {error}")]
    Endpoint {
        /// Which.
        topic: String,
        /// Why.
        error: CreateError,
    },
}

/// The quality of service of a topic, as people of ROS call it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// Best effort, volatile: what comes again in a moment.
    SensorData,
    /// Reliable, volatile, with this depth.
    Reliable(i32),
    /// Reliable, transient local: whoever comes late gets the last so many.
    Lasting(i32),
}

impl Quality {
    fn policies(self) -> QosPolicies {
        let (reliability, durability, depth) = match self {
            Self::SensorData => (Reliability::BestEffort, Durability::Volatile, BURST),
            Self::Reliable(depth) => (RELIABLE, Durability::Volatile, depth),
            Self::Lasting(depth) => (RELIABLE, Durability::TransientLocal, depth),
        };
        QosPolicyBuilder::new()
            .reliability(reliability)
            .durability(durability)
            .history(History::KeepLast { depth })
            .resource_limits(ResourceLimits {
                max_samples: ROOM,
                max_instances: ROOM,
                max_samples_per_instance: ROOM,
            })
            .build()
    }
}

/// Reliable, but nobody is waited for.
const RELIABLE: Reliability = Reliability::Reliable {
    max_blocking_time: rustdds::Duration::ZERO,
};

/// The node.
pub struct Node {
    participant: DomainParticipant,
    publisher: Publisher,
    subscriber: Subscriber,
    name: NodeName,
    namespace: String,
    graph: DataWriterCdr<ParticipantEntitiesInfo>,
    readers: Vec<Gid>,
    writers: Vec<Gid>,
    topics: BTreeMap<GUID, (String, Quality)>,
    events: DomainParticipantStatusListener,
    complaints: BTreeMap<String, Instant>,
    /// Writers of answers, and the readers that each has.
    matched: BTreeSet<(GUID, GUID)>,
    /// The writers of answers.
    replies: BTreeSet<GUID>,
}

impl Node {
    /// The node `name` in the root namespace, at that place. Names of topics that do not begin with a
    /// slash are below its own name.
    ///
    /// # Errors
    /// The name is none of ROS, or DDS cannot begin.
    pub fn open(name: &str, place: &Place) -> Result<Self, NodeError> {
        let domain = place.domain;
        let begin = |error| NodeError::Begin { domain, error };
        let node = NodeName::new("/", name).map_err(NodeError::Name)?;
        let mut builder = DomainParticipantBuilder::new(domain);
        if place.reach == Reach::Localhost {
            #[cfg(feature = "patched")]
            rustdds::set_bind_device("lo");
            builder = builder.with_only_networks([std::net::Ipv4Addr::LOCALHOST]);
        }
        let participant = builder.build().map_err(begin)?;
        let plain = QosPolicies::builder().build();
        let publisher = participant.create_publisher(&plain).map_err(begin)?;
        let subscriber = participant.create_subscriber(&plain).map_err(begin)?;
        let topic = participant
            .create_topic(
                "ros_discovery_info".to_owned(),
                "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_".to_owned(),
                &Quality::Lasting(1).policies(),
                TopicKind::NoKey,
            )
            .map_err(begin)?;
        let graph = publisher
            .create_datawriter_no_key_cdr(&topic, None)
            .map_err(begin)?;
        Ok(Self {
            events: participant.status_listener(),
            participant,
            publisher,
            subscriber,
            namespace: format!("/{name}"),
            name: node,
            graph,
            readers: Vec::new(),
            writers: Vec::new(),
            topics: BTreeMap::new(),
            complaints: BTreeMap::new(),
            matched: BTreeSet::new(),
            replies: BTreeSet::new(),
        })
    }

    /// A publisher. It is shown to others by [`Node::announce`].
    ///
    /// # Errors
    /// The name is none of ROS, or DDS refuses it.
    pub fn writer<M: RosType>(
        &mut self,
        topic: &str,
        quality: Quality,
    ) -> Result<Writer<M>, NodeError> {
        let (package, message) = M::TYPE;
        let kind = MessageTypeName::new(package, message).dds_msg_type();
        announce_hash(&kind, M::HASH);
        let dds = self.dds_name("rt", topic, "")?;
        let writer = self.endpoint(&dds, &kind, quality, |node, topic| {
            node.publisher.create_datawriter_no_key_cdr(topic, None)
        })?;
        let guid = writer.guid();
        self.writers.push(guid.into());
        let shown = dds.trim_start_matches("rt").to_owned();
        self.topics.insert(guid, (shown, quality));
        Ok(Writer {
            writer,
            sent: 0,
            refused: 0,
        })
    }

    /// A service of the type `std_srvs/srv/Trigger`.
    ///
    /// # Errors
    /// The name is none of ROS, or DDS refuses it.
    pub fn server(&mut self, service: &str) -> Result<Server, NodeError> {
        let quality = Quality::Reliable(10);
        let kind = |part| format!("std_srvs::srv::dds_::Trigger_{part}_");
        let request = self.dds_name("rq", service, "Request")?;
        let reply = self.dds_name("rr", service, "Reply")?;
        announce_hash(&kind("Request"), TRIGGER);
        announce_hash(&kind("Response"), TRIGGER);
        let replies = self.endpoint(&reply, &kind("Response"), quality, |node, topic| {
            node.publisher.create_datawriter_no_key_cdr(topic, None)
        })?;
        self.topics.insert(replies.guid(), (reply, quality));
        self.replies.insert(replies.guid());
        self.writers.push(replies.guid().into());
        let requests: SimpleDataReaderCdr<TriggerRequest> =
            self.endpoint(&request, &kind("Request"), quality, |node, topic| {
                node.subscriber.create_simple_datareader_no_key(topic, None)
            })?;
        self.readers.push(requests.guid().into());
        Ok(Server { requests, replies })
    }

    /// Shows the node and all its endpoints to others.
    pub fn announce(&self) {
        let mut info = NodeEntitiesInfo::new(self.name.clone());
        self.readers.iter().for_each(|gid| info.add_reader(*gid));
        self.writers.iter().for_each(|gid| info.add_writer(*gid));
        self.tell_graph(vec![info]);
    }

    fn tell_graph(&self, nodes: Vec<NodeEntitiesInfo>) {
        let gid = Gid::from(self.participant.guid());
        let told = ParticipantEntitiesInfo::new(gid, nodes);
        let _ = self.graph.write(told, Some(Timestamp::now()));
    }

    /// Learns who has come and gone. Returns a sentence for each reader that gets nothing, because it
    /// wants more than is offered.
    pub fn look(&mut self) -> Vec<String> {
        let mut said = Vec::new();
        while let Some(event) = self.events.try_recv_status() {
            match event {
                DomainParticipantStatusEvent::RemoteReaderMatched {
                    local_writer,
                    remote_reader,
                } if self.replies.contains(&local_writer) => {
                    self.matched.insert((local_writer, remote_reader));
                }
                DomainParticipantStatusEvent::ReaderLost { guid, .. } => {
                    self.matched.retain(|(_, reader)| *reader != guid);
                }
                DomainParticipantStatusEvent::ParticipantLost { id, .. } => {
                    let gone = participant_of(GUID::new(id, self.participant.guid().entity_id));
                    self.matched
                        .retain(|(_, reader)| participant_of(*reader) != gone);
                }
                DomainParticipantStatusEvent::RemoteReaderQosIncompatible {
                    local_writer,
                    requested_qos,
                    ..
                } => said.extend(self.complaint(local_writer, &requested_qos)),
                _ => {}
            }
        }
        said
    }

    fn complaint(&mut self, writer: GUID, wanted: &QosPolicies) -> Option<String> {
        let (topic, offered) = self.topics.get(&writer)?;
        let offers = offered.policies();
        let is_reliable = |of: &QosPolicies| of.is_reliable();
        let lasts = |of: &QosPolicies| {
            of.durability()
                .is_some_and(|durability| durability != Durability::Volatile)
        };
        let policy = match () {
            () if is_reliable(wanted) && !is_reliable(&offers) => {
                "it is best effort; ask for reliability best effort"
            }
            () if lasts(wanted) && !lasts(&offers) => "it is volatile; ask for durability volatile",
            () => "it has another quality of service",
        };
        let now = Instant::now();
        let last = self.complaints.get(topic);
        if last.is_some_and(|last| now - *last < COMPLAINT) {
            return None;
        }
        self.complaints.insert(topic.clone(), now);
        Some(format!(
            "somebody who listens to {topic} gets nothing: {policy}"
        ))
    }

    /// Whether the program that sent a request hears the answers of this service.
    pub fn is_heard_by(&self, server: &Server, asker: &Asker) -> bool {
        let to = participant_of(asker.0.writer_gid.into());
        let mut matched = self.matched.iter();
        matched.any(|(writer, reader)| {
            *writer == server.replies.guid() && participant_of(*reader) == to
        })
    }

    fn dds_name(&self, prefix: &str, name: &str, suffix: &str) -> Result<String, NodeError> {
        let named = match name.starts_with('/') {
            true => Name::parse(name),
            false => Name::parse(&format!("{}/{name}", self.namespace)),
        };
        let named = named.map_err(NodeError::Name)?;
        Ok(named.to_dds_name(prefix, &self.name, suffix))
    }

    fn endpoint<E>(
        &self,
        name: &str,
        kind: &str,
        quality: Quality,
        make: impl FnOnce(&Self, &rustdds::Topic) -> Result<E, CreateError>,
    ) -> Result<E, NodeError> {
        let participant = &self.participant;
        let policies = quality.policies();
        let topic = participant.create_topic(
            name.to_owned(),
            kind.to_owned(),
            &policies,
            TopicKind::NoKey,
        );
        topic
            .and_then(|topic| make(self, &topic))
            .map_err(|error| NodeError::Endpoint {
                topic: name.to_owned(),
                error,
            })
    }
}

impl Drop for Node {
    /// The node's name goes at once; the endpoints go when they are dropped.
    fn drop(&mut self) {
        self.tell_graph(Vec::new());
    }
}

/// Every endpoint of this type of DDS tells the hash from now on.
fn announce_hash(kind: &str, hash: &str) {
    #[cfg(feature = "patched")]
    {
        let told = format!("typehash={}{hash};", crate::messages::RIHS01);
        rustdds::set_user_data_for_type(kind, told.as_bytes());
    }
    #[cfg(not(feature = "patched"))]
    let _ = (kind, hash);
}

fn participant_of(guid: GUID) -> [u8; 12] {
    let bytes = guid.to_bytes();
    std::array::from_fn(|index| bytes[index])
}

/// A publisher.
pub struct Writer<M: RosType> {
    writer: DataWriterCdr<M>,
    sent: u64,
    refused: u64,
}

impl<M: RosType> Writer<M> {
    /// Sends a message, or gives it up if there is no room.
    pub fn send(&mut self, message: M) {
        match self.writer.write(message, Some(Timestamp::now())) {
            Ok(()) => self.sent += 1,
            Err(_) => self.refused += 1,
        }
    }

    /// How many messages were sent, and how many had no room.
    pub fn counts(&self) -> (u64, u64) {
        (self.sent, self.refused)
    }
}

/// A service.
pub struct Server {
    requests: SimpleDataReaderCdr<TriggerRequest>,
    replies: DataWriterCdr<TriggerResponse>,
}

/// Whoever has sent a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Asker(RmwRequestId);

/// A request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Asked {
    /// Who has sent it.
    pub by: Asker,
    /// When, in ns since 1970 by its machine's calendar, if it says so.
    pub at_ns: Option<u64>,
}

impl Server {
    /// The next request.
    ///
    /// # Errors
    /// What came is no request.
    pub fn receive(&self) -> Result<Option<Asked>, String> {
        self.requests.drain_read_notifications();
        let came = self
            .requests
            .try_take_one()
            .map_err(|error| error.to_string())?;
        Ok(came.map(|came| {
            let info = MessageInfo::from(&came);
            // Fast DDS names its reader of answers here, but not always the number of the request.
            let own = RmwRequestId {
                writer_gid: info.publisher_gid(),
                sequence_number: info.sequence_number(),
            };
            let mut by = info.related_request_id().unwrap_or(own);
            if by.sequence_number == i64::from(rustdds::SequenceNumber::UNKNOWN) {
                by.sequence_number = own.sequence_number;
            }
            let at_ns = info.source_timestamp();
            let at_ns = at_ns.and_then(|at| u64::try_from(at.to_nanos()).ok());
            Asked {
                by: Asker(by),
                at_ns,
            }
        }))
    }

    /// Answers.
    ///
    /// # Errors
    /// There is no room for the answer.
    pub fn answer(
        &self,
        to: Asker,
        answer: TriggerResponse,
    ) -> Result<(), WriteError<TriggerResponse>> {
        let options = WriteOptionsBuilder::new()
            .source_timestamp(Timestamp::now())
            .related_sample_identity(SampleIdentity::from(to.0))
            .build();
        self.replies.write_with_options(answer, options).map(|_| ())
    }
}
