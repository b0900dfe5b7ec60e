//! `[gateway]`: where programs outside the robot may look at it.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::PathBuf;

use lager_gateway::Addresses;
use lager_remote::{Allowed, Endpoint, Proof, Settings, SettingsError};

use super::section::section;
use crate::address::in_config;

section! {
    "gateway"
    /// What the robot shows to programs outside.
    pub struct GatewaySection {
        /// Where Prometheus reads the robot's figures, such as 127.0.0.1:7430. Everybody who can
        /// reach that address may read them. Unset, nowhere.
        #[serde(deserialize_with = "in_config")]
        pub metrics: Option<SocketAddr> = None,
        /// Where Foxglove connects, such as 127.0.0.1:8765. Everybody who can reach that address
        /// may look, and so may every page in a browser of that machine. The program must be built
        /// with the feature foxglove.
        #[serde(deserialize_with = "in_config")]
        pub foxglove: Option<SocketAddr> = None,
        /// Listeners that get the samples themselves, over Zenoh; services/remote/README.md says
        /// how. The program must be built with the feature zenoh.
        pub zenoh: ZenohSection = ZenohSection::default(),
    }
}

section! {
    "gateway.zenoh"
    pub struct ZenohSection {
        /// Where listeners connect: "tcp/127.0.0.1:7447" for programs of this machine,
        /// "unixsock-stream//run/lager/zenoh" for its users in the group of that file, or
        /// "tls/0.0.0.0:7447" for the network, with the three files below. Unset, nowhere.
        pub endpoint: Option<Endpoint> = None,
        /// The `lager gateway --router` to which the samples are brought as well, such as
        /// "tls/192.168.1.9:7447". Unset, none.
        pub router: Option<Endpoint> = None,
        /// Which topics are sent: names, all below a name as in "sensor/*", or "*" for every topic.
        pub topics: Vec<String> = vec!["*".into()],
        /// For TLS: the certificate of the authority whose listeners are let in. `lager keys` makes
        /// all three files.
        pub authority: Option<PathBuf> = None,
        /// The robot's certificate, which names the robot.
        pub certificate: Option<PathBuf> = None,
        /// The private key of that certificate.
        pub key: Option<PathBuf> = None,
        /// How many samples a second of a topic are sent at most, as in "sensor/line" = 10. Of a
        /// state, the newest one is always sent when it is due. What is left out is counted.
        pub rates: BTreeMap<String, f64> = BTreeMap::new(),
    }
}

impl GatewaySection {
    /// Whether `up` starts a gateway.
    pub fn is_wanted(&self) -> bool {
        let ZenohSection {
            endpoint, router, ..
        } = &self.zenoh;
        let has_zenoh = endpoint.is_some() || router.is_some();
        self.metrics.is_some() || self.foxglove.is_some() || has_zenoh
    }

    /// The section in the form of the gateway.
    ///
    /// # Errors
    /// No listener could be served so.
    pub fn addresses(&self) -> Result<Addresses, SettingsError> {
        Ok(Addresses {
            metrics: self.metrics,
            foxglove: self.foxglove,
            zenoh: self.zenoh.settings(None, None)?,
        })
    }
}

impl ZenohSection {
    /// The section in the form of the gateway, with another endpoint and another router if they are
    /// given; `None` if it names neither.
    ///
    /// # Errors
    /// No listener could be served so.
    pub fn settings(
        &self,
        endpoint: Option<Endpoint>,
        router: Option<Endpoint>,
    ) -> Result<Option<Settings>, SettingsError> {
        let allowed = Allowed::new(&self.topics, &self.rates)?;
        let proof = self.proof()?;
        let endpoint = endpoint.or_else(|| self.endpoint.clone());
        let router = router.or_else(|| self.router.clone());
        if endpoint.is_none() && router.is_none() {
            return Ok(None);
        }
        Settings::new(endpoint, router, allowed, proof).map(Some)
    }

    /// The files by which this end proves who it is, if they are named.
    ///
    /// # Errors
    /// Only some of them are named.
    pub fn proof(&self) -> Result<Option<Proof>, SettingsError> {
        let files = [&self.authority, &self.certificate, &self.key];
        let [authority, certificate, key] = files.map(Clone::clone);
        Proof::of(authority, certificate, key)
    }
}
