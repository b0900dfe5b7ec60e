//! [`Endpoint`]: where a gateway listens and a listener calls, in Zenoh's spelling.

use std::fmt;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Where a gateway is found by default: by programs of its own machine.
pub const USUAL_ZENOH: &str = "tcp/127.0.0.1:7447";

/// A way to a gateway.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Endpoint {
    /// Plain TCP.
    Tcp(HostPort),
    /// TCP in which both ends prove by certificates who they are.
    Tls(HostPort),
    /// A socket in the file system.
    Unix(PathBuf),
}

/// A host and a port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HostPort {
    /// A name or an address; an IPv6 address in brackets.
    pub host: String,
    /// The port.
    pub port: u16,
}

impl HostPort {
    /// The address, if the host is given as one.
    pub fn address(&self) -> Option<IpAddr> {
        let bare = self
            .host
            .strip_prefix('[')
            .and_then(|host| host.strip_suffix(']'));
        match &*self.host {
            "localhost" => Some(IpAddr::from([127, 0, 0, 1])),
            host => bare.unwrap_or(host).parse().ok(),
        }
    }
}

/// Why there can be no such way.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EndpointError {
    /// The text is none.
    Text(String),
    /// A gateway would be open to everybody.
    Open(String),
    /// A gateway listens at addresses of its own machine.
    Name(String),
}

impl fmt::Display for EndpointError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => write!(
                formatter,
                "`{text}` is no way to a gateway; write tcp/127.0.0.1:7447 for this machine alone, \
                 tls/192.168.1.4:7447 for the network, or unixsock-stream/FILE"
            ),
            Self::Open(text) => write!(
                formatter,
                "`{text}` would let everybody on the network listen; for the network write \
                 tls/ADDRESS:PORT, with certificates that `lager keys` makes, and for this machine \
                 alone tcp/127.0.0.1:PORT"
            ),
            Self::Name(text) => write!(
                formatter,
                "`{text}` has no address of this machine; write one in digits, as in \
                 tls/192.168.1.4:7447, or tls/0.0.0.0:7447 for all of them"
            ),
        }
    }
}

impl std::error::Error for EndpointError {}

impl Endpoint {
    /// Whether a gateway may listen there. Without certificates it listens only where programs of
    /// its own machine can reach it.
    ///
    /// # Errors
    /// Others could reach it, or it is no address of a machine.
    pub fn may_listen(&self) -> Result<(), EndpointError> {
        let text = || self.to_string();
        match self {
            Self::Unix(_) => Ok(()),
            Self::Tls(at) => match at.address() {
                Some(_) => Ok(()),
                None => Err(EndpointError::Name(text())),
            },
            Self::Tcp(at) => match at.address() {
                Some(address) if address.is_loopback() => Ok(()),
                _ => Err(EndpointError::Open(text())),
            },
        }
    }

    /// The socket's file, if there is one.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Unix(file) => Some(file),
            Self::Tcp(_) | Self::Tls(_) => None,
        }
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp(HostPort { host, port }) => write!(formatter, "tcp/{host}:{port}"),
            Self::Tls(HostPort { host, port }) => write!(formatter, "tls/{host}:{port}"),
            Self::Unix(file) => write!(formatter, "unixsock-stream/{}", file.display()),
        }
    }
}

impl From<Endpoint> for String {
    fn from(endpoint: Endpoint) -> Self {
        endpoint.to_string()
    }
}

impl TryFrom<String> for Endpoint {
    type Error = EndpointError;

    fn try_from(text: String) -> Result<Self, EndpointError> {
        text.parse()
    }
}

impl FromStr for Endpoint {
    type Err = EndpointError;

    fn from_str(text: &str) -> Result<Self, EndpointError> {
        let wrong = || EndpointError::Text(text.to_owned());
        // Behind these marks Zenoh reads settings, which could take the protection away.
        if text.contains(['?', '#', ';', ',']) || text.chars().any(char::is_whitespace) {
            return Err(wrong());
        }
        let (protocol, place) = text.split_once('/').ok_or_else(wrong)?;
        if protocol == "unixsock-stream" {
            return match place {
                "" => Err(wrong()),
                file => Ok(Self::Unix(file.into())),
            };
        }
        let (host, port) = place.rsplit_once(':').ok_or_else(wrong)?;
        let number: u16 = port.parse().map_err(|_| wrong())?;
        // One spelling of each, without a sign or zeros before it.
        if number.to_string() != port {
            return Err(wrong());
        }
        let port = number;
        let at = HostPort {
            host: host.to_owned(),
            port,
        };
        let is_name = |c: char| c.is_ascii_alphanumeric() || "-.".contains(c);
        let is_host = !host.is_empty() && host.chars().all(is_name);
        if port == 0 || !(is_host || at.address().is_some()) {
            return Err(wrong());
        }
        match protocol {
            "tcp" => Ok(Self::Tcp(at)),
            "tls" => Ok(Self::Tls(at)),
            _ => Err(wrong()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn endpoint(text: &str) -> Endpoint {
        text.parse().expect(text)
    }

    #[test]
    fn without_certificates_a_gateway_is_open_to_its_own_machine_only() {
        for text in [
            USUAL_ZENOH,
            "tcp/localhost:7447",
            "tcp/[::1]:7447",
            "unixsock-stream//run/lager/zenoh",
            "tls/0.0.0.0:7447",
            "tls/192.168.1.4:7447",
            "tls/[::]:7447",
        ] {
            assert_eq!(endpoint(text).may_listen(), Ok(()), "{text}");
            assert_eq!(endpoint(text).to_string(), text);
        }
        for text in [
            "tcp/0.0.0.0:7447",
            "tcp/192.168.1.4:7447",
            "tcp/[::]:7447",
            "tcp/robot:7447",
        ] {
            let refused = endpoint(text).may_listen().expect_err(text).to_string();
            assert!(refused.contains("`lager keys`"), "{refused}");
        }
        let refused = endpoint("tls/robot:7447").may_listen().expect_err("a name");
        assert!(refused.to_string().contains("in digits"), "{refused}");
    }

    #[test]
    fn what_is_no_endpoint_is_refused_with_how_one_is_written() {
        for text in [
            "",
            "7447",
            "127.0.0.1:7447",
            "udp/127.0.0.1:7447",
            "quic/127.0.0.1:7447",
            "tcp/127.0.0.1",
            "tcp/:7447",
            "tcp/127.0.0.1:0",
            "tcp/127.0.0.1:70000",
            "tcp/[::1:7447",
            "unixsock-stream/",
            "tls/robot:7447#enable_mtls=false",
            "tcp/127.0.0.1:7447?rel=0",
            "unixsock-stream//tmp/a;b",
            "tcp/a b:1",
        ] {
            let refused = text.parse::<Endpoint>().expect_err(text).to_string();
            assert!(refused.contains("tcp/127.0.0.1:7447"), "{refused}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_an_endpoint_or_refused_and_an_endpoint_reads_back(text in "(tcp/|tls/|unixsock-stream/)?.{0,30}") {
            if let Ok(endpoint) = text.parse::<Endpoint>() {
                prop_assert_eq!(endpoint.to_string(), text);
                let _ = endpoint.may_listen();
            }
        }
    }
}
