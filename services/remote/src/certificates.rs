//! [`make`]: certificates by which a robot and its listeners prove who they are, as `lager keys`
//! writes them.
//!
//! ```text
//!   authority.pem, authority.key      signs the others; its key stays where it was made
//!     ├─ r1.pem, r1.key               a robot: proves its name and addresses to those who call it
//!     ├─ router.pem, router.key       a router, to which robots bring what they send
//!     └─ dash.pem, dash.key           a listener: proves itself to a robot that it calls
//! ```
//!
//! Whoever has a key of the authority's listeners may listen to all of its robots.

use std::fs::{self, DirBuilder, OpenOptions};
use std::io::{self, Write as _};
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use rcgen::{
    BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, IsCa,
    Issuer, KeyPair, KeyUsagePurpose,
};
use time::{Duration, OffsetDateTime};

use crate::session;

/// The file name of the authority, without its ending.
pub const AUTHORITY: &str = "authority";
/// The same of a router.
const ROUTER: &str = "router";

/// Whom a certificate is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holder<'a> {
    /// The authority itself.
    Authority,
    /// A robot of this name, which is called at these addresses or host names.
    Robot(&'a str, &'a [String]),
    /// A listener of this name.
    Listener(&'a str),
    /// A router, which robots and listeners call at these addresses or host names.
    Router(&'a [String]),
}

/// Why there is no certificate.
#[derive(Debug, thiserror::Error)]
pub enum CertificateError {
    /// A file is there already.
    #[error(
        "{0} is there already, and nothing is overwritten; choose another name or folder, or remove it"
    )]
    Exists(PathBuf),
    /// There is no authority that could sign it.
    #[error("{0} is not there; `lager keys authority` makes it")]
    NoAuthority(PathBuf),
    /// The name cannot be a file's.
    #[error("`{0}` is no name; use 1 to 24 of a-z, 0-9 and -, and not `{AUTHORITY}`")]
    Name(String),
    /// A file cannot be read or written.
    #[error("{file}: {error}")]
    File {
        /// Which.
        file: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// The cryptography refused.
    #[error("no certificate can be made: {0}")]
    Refused(#[from] rcgen::Error),
}

/// The two files of a certificate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Made {
    /// The certificate, which everybody may read.
    pub certificate: PathBuf,
    /// Its private key, which only its owner may read.
    pub key: PathBuf,
}

impl Made {
    fn at(folder: &Path, name: &str) -> Self {
        Self {
            certificate: folder.join(format!("{name}.pem")),
            key: folder.join(format!("{name}.key")),
        }
    }
}

/// Makes a certificate and its key in `folder`, which holds for so many days from now on.
///
/// # Errors
/// There is one of that name, there is no authority to sign it, or a file cannot be written.
pub fn make(folder: &Path, holder: Holder<'_>, days: i64) -> Result<Made, CertificateError> {
    let name = match holder {
        Holder::Authority => AUTHORITY,
        Holder::Robot(name, _) | Holder::Listener(name) => name,
        Holder::Router(_) => ROUTER,
    };
    let is_free = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    let is_name = (1..=24).contains(&name.len()) && name.chars().all(is_free);
    if !is_name || (name == AUTHORITY && holder != Holder::Authority) {
        return Err(CertificateError::Name(name.to_owned()));
    }
    let made = Made::at(folder, name);
    for file in [&made.certificate, &made.key] {
        if fs::symlink_metadata(file).is_ok() {
            return Err(CertificateError::Exists(file.clone()));
        }
    }
    let pair = KeyPair::generate()?;
    let mut wanted = match holder {
        Holder::Authority => authority(),
        Holder::Robot(_, addresses) => called_at(name, name, addresses)?,
        Holder::Router(addresses) => called_at(session::ROUTER, name, addresses)?,
        Holder::Listener(_) => leaf(
            name,
            vec![name.to_owned()],
            vec![ExtendedKeyUsagePurpose::ClientAuth],
        )?,
    };
    let now = OffsetDateTime::now_utc();
    // Clocks differ a little.
    wanted.not_before = now - Duration::days(1) + Duration::days(days.min(0));
    wanted.not_after = now + Duration::days(days);
    let certificate = match holder {
        Holder::Authority => wanted.self_signed(&pair)?,
        Holder::Robot(..) | Holder::Listener(_) | Holder::Router(_) => {
            let key = Made::at(folder, AUTHORITY).key;
            let text = fs::read_to_string(&key).map_err(|error| match error.kind() {
                io::ErrorKind::NotFound => CertificateError::NoAuthority(key.clone()),
                _ => CertificateError::File {
                    file: key.clone(),
                    error,
                },
            })?;
            let signer = Issuer::new(authority(), KeyPair::from_pem(&text)?);
            wanted.signed_by(&pair, &signer)?
        }
    };
    let made_folder = DirBuilder::new().recursive(true).mode(0o700).create(folder);
    made_folder.map_err(|error| CertificateError::File {
        file: folder.to_owned(),
        error,
    })?;
    write(&made.key, &pair.serialize_pem(), 0o600)?;
    write(&made.certificate, &certificate.pem(), 0o644)?;
    Ok(made)
}

/// Whom a certificate names, and whether it holds now.
pub(crate) struct Named {
    pub(crate) name: String,
    pub(crate) holds: bool,
}

/// Reads the first certificate of a file; `None` if there is none in it.
pub(crate) fn named(pem: &[u8]) -> Option<Named> {
    let (_, pem) = x509_parser::pem::parse_x509_pem(pem).ok()?;
    let certificate = pem.parse_x509().ok()?;
    let mut names = certificate.subject().iter_common_name();
    Some(Named {
        name: names.next()?.as_str().ok()?.to_owned(),
        holds: certificate.validity().is_valid(),
    })
}

fn write(file: &Path, text: &str, mode: u32) -> Result<(), CertificateError> {
    // Never what is there, also if it came this moment.
    let opened = OpenOptions::new()
        .write(true)
        .create_new(true)
        .mode(mode)
        .open(file);
    let written = opened.and_then(|mut opened| opened.write_all(text.as_bytes()));
    written.map_err(|error| CertificateError::File {
        file: file.to_owned(),
        error,
    })
}

fn called(name: &str) -> DistinguishedName {
    let mut called = DistinguishedName::new();
    called.push(DnType::CommonName, name);
    called
}

/// The authority without its key, always the same, so that its key alone can sign.
fn authority() -> CertificateParams {
    let mut params = CertificateParams::default();
    params.distinguished_name = called("Lagerrobot authority");
    params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
    params
}

/// For an end that is called, at its own machine and at these addresses. A robot also calls a router.
fn called_at(
    name: &str,
    host: &str,
    addresses: &[String],
) -> Result<CertificateParams, CertificateError> {
    let mut names = [host, "localhost", "127.0.0.1", "::1"]
        .map(str::to_owned)
        .to_vec();
    for address in addresses {
        if !names.contains(address) {
            names.push(address.clone());
        }
    }
    let usages = vec![
        ExtendedKeyUsagePurpose::ServerAuth,
        ExtendedKeyUsagePurpose::ClientAuth,
    ];
    leaf(name, names, usages)
}

fn leaf(
    name: &str,
    names: Vec<String>,
    usages: Vec<ExtendedKeyUsagePurpose>,
) -> Result<CertificateParams, CertificateError> {
    let mut params = CertificateParams::new(names)?;
    params.distinguished_name = called(name);
    params.extended_key_usages = usages;
    params.use_authority_key_identifier_extension = true;
    Ok(params)
}
