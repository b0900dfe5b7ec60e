//! Live views for Foxglove, by the server of Foxglove's own crate. Each topic is a channel. Beside
//! them are the same views as in a recording ([`Scene`]).
//!
//! ```text
//!   listener ──JSON──> Live ──> channels ──queue──> client
//!                       └─> LastMessages: the last message of what lasts ──> who subscribes later
//! ```
//!
//! **The gateway waits for no client.** Each client has a queue of its own. When it is full, a new
//! message pushes the oldest one out. So a client that is slow or reads nothing loses messages and
//! holds nobody up.
//!
//! **A client can only look.** It can write nothing and call nothing on this server.

use std::collections::{BTreeMap, HashMap};
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use foxglove::websocket::{ChannelView, Client, ServerListener};
use foxglove::{ChannelId, Context, FoxgloveError, PartialMetadata, RawChannel, Schema};
use lager_journal::{EnvelopeSchema, Scene, View};
use tokio::runtime::Runtime;

use crate::GatewayError;
use crate::listener::Viewer;

/// What clients are shown.
pub(crate) struct Live {
    /// The server knows it only weakly.
    context: Arc<Context>,
    address: SocketAddr,
    scene: Scene,
    topics: BTreeMap<String, Outlet>,
    views: BTreeMap<View, Outlet>,
    kept: Arc<LastMessages>,
}

/// A channel.
struct Outlet {
    channel: Arc<RawChannel>,
    /// Whether a later subscriber gets the last message.
    lasts: bool,
}

impl Live {
    /// Listens at `address`. Connections are served while `runtime` runs.
    pub(crate) fn open(
        address: SocketAddr,
        robot: &str,
        runtime: &Runtime,
    ) -> Result<Self, GatewayError> {
        let (context, kept) = (Context::new(), Arc::new(LastMessages::default()));
        let host = match address {
            SocketAddr::V4(address) => address.ip().to_string(),
            SocketAddr::V6(address) => format!("[{}]", address.ip()),
        };
        let server = context
            .websocket_server()
            .name(format!("Lagerrobot {robot}"))
            .bind(host, address.port())
            .listener(Arc::clone(&kept) as Arc<dyn ServerListener>);
        let started = runtime.block_on(server.start());
        let server = started.map_err(|error| match error {
            FoxgloveError::Bind(error) => GatewayError::listen("--foxglove", address, error),
            other => GatewayError::Run(std::io::Error::other(other)),
        })?;
        let views = View::ALL.map(|view| {
            let outlet = outlet(&context, view.topic(), &view.schema(), view.is_lasting());
            (view, outlet)
        });
        Ok(Self {
            address: SocketAddr::new(address.ip(), server.port()),
            context,
            scene: Scene::default(),
            topics: BTreeMap::new(),
            views: views.into(),
            kept,
        })
    }

    /// Where clients connect.
    pub(crate) fn address(&self) -> SocketAddr {
        self.address
    }
}

fn outlet(context: &Arc<Context>, name: &str, schema: &EnvelopeSchema, lasts: bool) -> Outlet {
    let EnvelopeSchema { name: title, text } = schema.clone();
    let channel = context
        .channel_builder(name)
        .message_encoding("json")
        .schema(Schema::new(title, "jsonschema", text.to_vec()))
        .build_raw()
        .expect("its encoding is told");
    Outlet { channel, lasts }
}

impl Viewer for Live {
    fn open(&mut self, topic: &str, schema: &EnvelopeSchema, is_state: bool) {
        let outlet = outlet(&self.context, topic, schema, is_state);
        self.topics.insert(topic.to_owned(), outlet);
    }

    fn wants(&self, topic: &str) -> bool {
        let is_watched = |outlet: &Outlet| outlet.lasts || outlet.channel.has_sinks();
        self.topics.get(topic).is_some_and(is_watched) || Scene::looks_at(topic)
    }

    fn take(&mut self, topic: &str, unix_ns: u64, message: &[u8]) {
        if let Some(outlet) = self.topics.get(topic) {
            self.kept.send(outlet, unix_ns, message);
        }
        for shown in self.scene.take(topic, unix_ns, message) {
            let outlet = &self.views[&shown.view];
            self.kept.send(outlet, unix_ns, &shown.message);
        }
    }
}

/// The last message of each channel that carries a state.
#[derive(Default)]
struct LastMessages(Mutex<HashMap<ChannelId, Last>>);

struct Last {
    channel: Arc<RawChannel>,
    unix_ns: u64,
    message: Vec<u8>,
}

impl LastMessages {
    fn lock(&self) -> MutexGuard<'_, HashMap<ChannelId, Last>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends a message to all who have subscribed.
    fn send(&self, outlet: &Outlet, unix_ns: u64, message: &[u8]) {
        let channel = &outlet.channel;
        let time = PartialMetadata::with_log_time(unix_ns);
        if !outlet.lasts {
            return channel.log_with_meta(message, time);
        }
        // Held until it is sent, so that nobody who subscribes now gets an older one after it.
        let mut kept = self.lock();
        channel.log_with_meta(message, time);
        let last = kept.entry(channel.id()).or_insert_with(|| Last {
            channel: Arc::clone(channel),
            unix_ns,
            message: Vec::new(),
        });
        last.unix_ns = unix_ns;
        last.message.clear();
        last.message.extend_from_slice(message);
    }
}

impl ServerListener for LastMessages {
    fn on_subscribe(&self, client: Client, channel: ChannelView<'_>) {
        let kept = self.lock();
        if let Some(last) = kept.get(&channel.id()) {
            let time = PartialMetadata::with_log_time(last.unix_ns);
            let (channel, to) = (&last.channel, client.sink_id());
            channel.log_with_meta_to_sink(&last.message, time, to);
        }
    }
}
