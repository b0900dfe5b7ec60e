//! Who may open the page, and what he may do there.
//!
//! Other users of this machine can connect even to a panel on loopback, so everybody is asked for a
//! token, one of two: a viewer's looks and stops, a driver's drives as well. The page's address
//! carries it once (`http://HOST/?token=...`); from then on a cookie does. Cookies do not tell ports
//! apart, so the cookie's name does, and two panels of one machine do not take each other's.
//!
//! A page of somebody else must not reach the panel through its reader's browser. So the `Host`
//! that a browser sends must be an address of this panel and not a name that somebody has pointed
//! here, and the socket's `Origin` must be that host.

use std::io;
use std::net::{IpAddr, SocketAddr};

use lager_lines::secret::{Secret, hex, random};

/// What somebody may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rank {
    /// Look, and stop.
    Viewer,
    /// All there is.
    Driver,
}

impl Rank {
    pub(crate) const fn as_str(self) -> &'static str {
        match self {
            Self::Viewer => "viewer",
            Self::Driver => "driver",
        }
    }
}

/// The words that let people in: 128 bits each, in hexadecimal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tokens {
    /// Whoever has it may drive.
    pub driver: String,
    /// Whoever has it may look and stop.
    pub viewer: String,
}

impl Tokens {
    /// New ones, from the system's source of randomness.
    ///
    /// # Errors
    ///
    /// When the system has none to give.
    pub fn random() -> io::Result<Self> {
        Ok(Self {
            driver: hex(&random::<16>()?),
            viewer: hex(&random::<16>()?),
        })
    }

    /// Those that follow from a secret: the same for each panel of the same station.
    pub fn of(secret: &Secret) -> Self {
        Self {
            driver: secret.word("panel driver"),
            viewer: secret.word("panel viewer"),
        }
    }
}

/// The rules of one panel.
#[derive(Clone, Debug)]
pub(crate) struct Access {
    address: SocketAddr,
    tokens: Tokens,
}

impl Access {
    /// The rules of a panel that listens at `address`.
    pub(crate) fn new(address: SocketAddr, tokens: Tokens) -> Self {
        Self { address, tokens }
    }

    /// The name of the cookie that carries a token.
    pub(crate) fn cookie(&self) -> String {
        format!("lager-token-{}", self.address.port())
    }

    /// Whether a browser that asks this host asks this panel.
    pub(crate) fn is_host(&self, host: &str) -> bool {
        let Some((name, port)) = split_port(host) else {
            return false;
        };
        if port != self.address.port() {
            return false;
        }
        if name == "localhost" {
            return self.address.ip().is_loopback() || self.address.ip().is_unspecified();
        }
        let Ok(ip) = name.parse::<IpAddr>() else {
            return false;
        };
        // A number cannot be pointed anywhere else.
        ip == self.address.ip()
            || self.address.ip().is_unspecified()
            || (ip.is_loopback() && self.address.ip().is_loopback())
    }

    /// Whether a page of this origin is one of this panel's, which was asked as `host`.
    pub(crate) fn is_origin(&self, origin: &str, host: &str) -> bool {
        self.is_host(host) && origin.strip_prefix("http://") == Some(host)
    }

    /// What somebody with this token, or none, may do; `None`: nothing.
    pub(crate) fn rank(&self, token: Option<&str>) -> Option<Rank> {
        let token = token?;
        if is_same(token, &self.tokens.driver) {
            Some(Rank::Driver)
        } else if is_same(token, &self.tokens.viewer) {
            Some(Rank::Viewer)
        } else {
            None
        }
    }
}

/// `host:port`, the host without the brackets of an IPv6 address; 80 where no port stands.
fn split_port(host: &str) -> Option<(&str, u16)> {
    if let Some(rest) = host.strip_prefix('[') {
        let (name, port) = rest.split_once(']')?;
        return match port.strip_prefix(':') {
            Some(port) => Some((name, port.parse().ok()?)),
            None => port.is_empty().then_some((name, 80)),
        };
    }
    match host.split_once(':') {
        Some((name, port)) => Some((name, port.parse().ok()?)),
        None => Some((host, 80)),
    }
}

/// Compares in a time that does not tell how much is right.
fn is_same(given: &str, wanted: &str) -> bool {
    given.len() == wanted.len()
        && given
            .bytes()
            .zip(wanted.bytes())
            .fold(0, |sum, (a, b)| sum | (a ^ b))
            == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loopback() -> Access {
        let tokens = Tokens::random().unwrap();
        Access::new("127.0.0.1:7410".parse().unwrap(), tokens)
    }

    #[test]
    fn a_name_that_somebody_has_pointed_here_is_no_host() {
        for host in ["127.0.0.1:7410", "localhost:7410", "[::1]:7410"] {
            assert!(loopback().is_host(host), "{host}");
        }
        for host in [
            "evil.example:7410",
            "127.0.0.1:7411",
            "127.0.0.1",
            "localhost.evil.example:7410",
            "10.0.0.1:7410",
            "",
            "[::1",
            "127.0.0.1:7410:7410",
        ] {
            assert!(!loopback().is_host(host), "{host}");
        }
    }

    #[test]
    fn everywhere_means_by_number() {
        let access = Access::new("0.0.0.0:80".parse().unwrap(), Tokens::random().unwrap());
        for host in ["192.168.1.4", "192.168.1.4:80", "localhost", "[::1]"] {
            assert!(access.is_host(host), "{host}");
        }
        for host in ["robot.lan", "192.168.1.4:81"] {
            assert!(!access.is_host(host), "{host}");
        }
    }

    #[test]
    fn only_the_panels_own_page_may_open_its_socket() {
        let access = loopback();
        assert!(access.is_origin("http://127.0.0.1:7410", "127.0.0.1:7410"));
        for origin in [
            "http://evil.example",
            "https://127.0.0.1:7410",
            "http://localhost:7410",
            "null",
            "",
        ] {
            assert!(!access.is_origin(origin, "127.0.0.1:7410"), "{origin}");
        }
        assert!(!access.is_origin("http://evil.example:7410", "evil.example:7410"));
    }

    #[test]
    fn a_token_has_a_rank() {
        let tokens = Tokens::random().unwrap();
        assert_eq!(tokens.driver.len(), 32);
        assert_ne!(tokens.driver, tokens.viewer);
        let access = Access::new("127.0.0.1:7410".parse().unwrap(), tokens.clone());
        assert_eq!(access.rank(Some(&tokens.driver)), Some(Rank::Driver));
        assert_eq!(access.rank(Some(&tokens.viewer)), Some(Rank::Viewer));
        assert_eq!(access.rank(Some("")), None);
        assert_eq!(access.rank(Some(&tokens.driver[1..])), None);
        assert_eq!(access.rank(None), None);
        assert_eq!(loopback().rank(Some(&tokens.driver)), None);
        assert_eq!(access.cookie(), "lager-token-7410");
    }

    #[test]
    fn tokens_that_follow_from_a_secret_stay_the_same_and_are_not_the_secret() {
        let [secret, other] = [(); 2].map(|()| Secret::random().unwrap());
        let tokens = Tokens::of(&secret);
        assert_eq!(tokens, Tokens::of(&secret));
        assert_ne!(tokens, Tokens::of(&other));
        assert_eq!((tokens.driver.len(), tokens.viewer.len()), (32, 32));
        assert_ne!(tokens.driver, tokens.viewer);
        assert!(!secret.as_str().contains(&tokens.driver));
    }
}
