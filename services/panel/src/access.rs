//! Who may open the page, and what this person may do there.
//!
//! Other users of this machine can connect even to a panel on loopback. So the panel asks everybody
//! for a token. There are two: with the viewer's token a person looks and stops, with the driver's
//! token a person drives as well. The address of the page carries the token once
//! (`http://HOST/?token=...`), and a cookie carries it from then on. A browser sends a cookie to
//! every port of a host. So the port is part of the cookie's name, and two panels on one machine do
//! not take each other's cookies.
//!
//! A page of another site must not reach the panel through the browser of somebody who reads it. So
//! the panel checks the `Host` that the browser sends: it must be an address of this panel, and not
//! a name that somebody has pointed to this address. The socket's `Origin` must be the same host.

use std::io;
use std::net::{IpAddr, SocketAddr};

use lager_lines::secret::{Secret, hex, random};
use percent_encoding::percent_decode_str;

/// What somebody may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rank {
    /// Look, and stop.
    Viewer,
    /// Do everything.
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

/// The tokens that let people in: 128 bits each, in hexadecimal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tokens {
    /// A person who has it may drive.
    pub driver: String,
    /// A person who has it may look and stop.
    pub viewer: String,
}

impl Tokens {
    /// New ones, from the system's source of randomness.
    ///
    /// # Errors
    ///
    /// The system cannot give random bytes.
    pub fn random() -> io::Result<Self> {
        Ok(Self {
            driver: hex(&random::<16>()?),
            viewer: hex(&random::<16>()?),
        })
    }

    /// Tokens that are made from a secret, so each panel of the same station has the same ones.
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

    /// Whether a request to this host is for this panel.
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
        // Nobody can point a numeric address to another machine.
        ip == self.address.ip()
            || self.address.ip().is_unspecified()
            || (ip.is_loopback() && self.address.ip().is_loopback())
    }

    /// Whether a page of this origin belongs to this panel, which was asked as `host`.
    pub(crate) fn is_origin(&self, origin: &str, host: &str) -> bool {
        self.is_host(host) && origin.strip_prefix("http://") == Some(host)
    }

    /// What a person with this token, or without one, may do; `None`: nothing.
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

/// What a form or an address says in this field.
pub(crate) fn said<'f>(form: &'f str, field: &str) -> Option<&'f str> {
    let mut fields = form.split('&');
    fields.find_map(|said| said.strip_prefix(field)?.strip_prefix('='))
}

/// The name that a person has chosen, as the page says it: letters, digits and `-`, in UTF-8 with the
/// escapes of an address. `None`: none, or one that could be taken for a guest's, for a
/// part's of the robot, or for nobody's.
pub(crate) fn person(name: &str) -> Option<String> {
    let name = percent_decode_str(name).decode_utf8().ok()?;
    let is_fit = name.chars().all(|one| one.is_alphanumeric() || one == '-')
        && name.chars().any(char::is_alphabetic)
        && name.chars().count() <= 24;
    let is_taken =
        name.starts_with("panel") || ["you", "nobody", "comm", "operator"].contains(&&*name);
    (is_fit && !is_taken).then(|| name.into_owned())
}

/// `host:port`, the host without the brackets of an IPv6 address. Without a port it is 80.
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

/// Compares two texts, always in the same time, however much of them is equal.
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
    fn a_person_has_a_name_of_letters_and_nobody_elses() {
        assert_eq!(person("Anna").as_deref(), Some("Anna"));
        assert_eq!(person("%C3%85sa-2").as_deref(), Some("Åsa-2"));
        for none in ["", "panel-3", "operator", "-", "a%20b", "a%0Ab"] {
            assert_eq!(person(none), None, "{none}");
        }
        for broken in ["%", "%4", "%zz", "%C3", "a=b", "%E2%80%AE"] {
            assert_eq!(person(broken), None, "{broken}");
        }
        assert_eq!(person(&"a".repeat(25)), None);
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
