//! Addresses as people write them, on the command line and in the configuration.

use std::fmt;
use std::net::SocketAddr;

use serde::de::{Deserializer, Error, Visitor};

/// The address at which only this machine reaches itself.
const THIS_MACHINE: &str = "127.0.0.1";

/// The address of another computer: a host and a port, or a port of this machine.
///
/// # Errors
/// The text is not an address. The sentence says how to write one.
pub fn calls(text: &str) -> Result<String, String> {
    let (host, port) = text.rsplit_once(':').unwrap_or((THIS_MACHINE, text));
    match !host.is_empty() && port.parse::<u16>().is_ok_and(|port| port > 0) {
        true => Ok(format!("{host}:{port}")),
        false => Err(format!(
            "`{text}` is not an address; write a host and a port, as in 192.168.1.5:7420, or only a port of this machine, as in 7420"
        )),
    }
}

/// An address at which this machine listens: one of its own and a port, or only a port, which only
/// this machine can reach.
///
/// # Errors
/// The text is not an address. The sentence says how to write one.
pub fn listens(text: &str) -> Result<SocketAddr, String> {
    let (host, port) = text.rsplit_once(':').unwrap_or((THIS_MACHINE, text));
    let host = match host {
        "localhost" => THIS_MACHINE,
        host => host,
    };
    format!("{host}:{port}").parse().map_err(|_| {
        format!(
            "`{text}` is not an address to listen at; write an address of this machine and a port, as in 192.168.1.5:7410 (0.0.0.0 for all of them), or only a port, as in 7410, for this machine alone"
        )
    })
}

/// The same in the configuration. A port may be a number there.
pub fn in_config<'de, D: Deserializer<'de>>(value: D) -> Result<Option<SocketAddr>, D::Error> {
    struct Listens;

    impl Visitor<'_> for Listens {
        type Value = Option<SocketAddr>;

        fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
            formatter.write_str("an address, as in \"127.0.0.1:7410\", or a port")
        }

        fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
            listens(text).map(Some).map_err(E::custom)
        }

        fn visit_i64<E: Error>(self, port: i64) -> Result<Self::Value, E> {
            self.visit_str(&port.to_string())
        }
    }

    value.deserialize_any(Listens)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_alone_is_one_of_this_machine() {
        let at = |text: &str| text.parse::<SocketAddr>().expect("an address");
        for (text, meant) in [
            ("7410", "127.0.0.1:7410"),
            ("0", "127.0.0.1:0"),
            ("localhost:7410", "127.0.0.1:7410"),
            ("0.0.0.0:7410", "0.0.0.0:7410"),
            ("[::1]:7410", "[::1]:7410"),
        ] {
            assert_eq!(listens(text), Ok(at(meant)), "{text}");
        }
        for (text, meant) in [
            ("7420", "127.0.0.1:7420"),
            ("hall:7420", "hall:7420"),
            ("[::1]:7420", "[::1]:7420"),
        ] {
            assert_eq!(calls(text), Ok(meant.to_owned()), "{text}");
        }
    }

    #[test]
    fn what_is_no_address_is_refused_with_how_one_is_written() {
        for text in [
            "",
            "70000",
            "hall",
            "hall:7410",
            ":7410",
            "127.0.0.1",
            "127.0.0.1:",
        ] {
            let refused = listens(text).expect_err(text);
            assert!(refused.contains("as in 7410"), "{refused}");
        }
        for text in ["", "70000", "hall", ":7420", "hall:0", "hall:x", "0"] {
            let refused = calls(text).expect_err(text);
            assert!(refused.contains("as in 7420"), "{refused}");
        }
    }
}
