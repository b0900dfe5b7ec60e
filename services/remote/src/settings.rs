//! [`Settings`]: how a gateway sends to listeners.

use std::fmt;
use std::path::PathBuf;

use crate::allowed::{Allowed, AllowedError};
use crate::endpoint::{Endpoint, EndpointError};

/// The files by which one end proves to the other who it is; `lager keys` makes them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Proof {
    /// The certificate of the authority that both ends trust, in PEM.
    pub authority: PathBuf,
    /// This end's certificate, in PEM.
    pub certificate: PathBuf,
    /// Its private key, in PEM.
    pub key: PathBuf,
}

/// What a gateway does for listeners.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Where it listens.
    pub endpoint: Option<Endpoint>,
    /// The router that it calls; listeners may be there.
    pub router: Option<Endpoint>,
    /// Which topics it carries, and how often.
    pub allowed: Allowed,
    /// Its certificate, for TLS.
    pub proof: Option<Proof>,
}

/// Why a gateway cannot work so.
#[derive(Clone, Debug, PartialEq)]
pub enum SettingsError {
    /// It may not listen there.
    Endpoint(EndpointError),
    /// The topics or their rates make no sense.
    Allowed(AllowedError),
    /// TLS without certificates.
    NoProof,
    /// Some of the three files are not named.
    HalfProof,
}

impl fmt::Display for SettingsError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Endpoint(error) => write!(formatter, "{error}"),
            Self::Allowed(error) => write!(formatter, "{error}"),
            Self::NoProof => formatter.write_str(
                "TLS needs certificates; make them with `lager keys` and name authority, certificate \
                 and key in [gateway.zenoh]",
            ),
            Self::HalfProof => formatter.write_str(
                "authority, certificate and key belong together; name all three in [gateway.zenoh], or \
                 none",
            ),
        }
    }
}

impl std::error::Error for SettingsError {}

impl From<EndpointError> for SettingsError {
    fn from(error: EndpointError) -> Self {
        Self::Endpoint(error)
    }
}

impl From<AllowedError> for SettingsError {
    fn from(error: AllowedError) -> Self {
        Self::Allowed(error)
    }
}

impl Proof {
    /// The proof of these files, if they are named.
    ///
    /// # Errors
    /// Only some of them are named.
    pub fn of(
        authority: Option<PathBuf>,
        certificate: Option<PathBuf>,
        key: Option<PathBuf>,
    ) -> Result<Option<Self>, SettingsError> {
        match (authority, certificate, key) {
            (Some(authority), Some(certificate), Some(key)) => Ok(Some(Self {
                authority,
                certificate,
                key,
            })),
            (None, None, None) => Ok(None),
            _ => Err(SettingsError::HalfProof),
        }
    }
}

impl Settings {
    /// A gateway that listens at `endpoint` and calls `router`, or does one of both.
    ///
    /// # Errors
    /// It may not listen there, or it would need certificates.
    pub fn new(
        endpoint: Option<Endpoint>,
        router: Option<Endpoint>,
        allowed: Allowed,
        proof: Option<Proof>,
    ) -> Result<Self, SettingsError> {
        if let Some(endpoint) = &endpoint {
            endpoint.may_listen()?;
        }
        let is_tls = |way: &Option<Endpoint>| matches!(way, Some(Endpoint::Tls(_)));
        if (is_tls(&endpoint) || is_tls(&router)) && proof.is_none() {
            return Err(SettingsError::NoProof);
        }
        Ok(Self {
            endpoint,
            router,
            allowed,
            proof,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn tls_needs_all_three_files() {
        let file = || Some(PathBuf::from("a.pem"));
        let settings = |endpoint: &str, proof| {
            let allowed = Allowed::new(&["*".to_owned()], &BTreeMap::new()).expect("a list");
            let endpoint = Some(endpoint.parse().expect("an endpoint"));
            Settings::new(endpoint, None, allowed, proof)
        };
        let proof = Proof::of(file(), file(), file()).expect("all three");
        assert!(settings("tls/0.0.0.0:7447", proof).is_ok());
        assert_eq!(
            settings("tls/0.0.0.0:7447", None),
            Err(SettingsError::NoProof)
        );
        assert!(settings("tcp/127.0.0.1:7447", None).is_ok());
        for halves in [(file(), None, None), (None, file(), file())] {
            let refused = Proof::of(halves.0, halves.1, halves.2);
            assert_eq!(refused, Err(SettingsError::HalfProof));
        }
        let refused = settings("tcp/0.0.0.0:7447", None).expect_err("it is open");
        assert!(refused.to_string().contains("`lager keys`"), "{refused}");
    }
}
