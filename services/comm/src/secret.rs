//! Reads the file of secrets. Only its owner may read it.

use std::fs::{File, OpenOptions};
use std::io::{self, Read as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use lager_lines::secret::{SecretError, Secrets};
use rustix::fs::OFlags;
use thiserror::Error;

/// The longest file, in bytes; no list of secrets is longer.
const LONGEST: u64 = 64 * 1024;
/// The mode of a file of secrets: only its owner may read and write.
const RIGHTS: u32 = 0o600;

/// Why a file gives no secrets.
#[derive(Debug, Error)]
pub enum SecretsError {
    /// It cannot be read.
    #[error("the secrets in {} cannot be read: {error}", .path.display())]
    Read {
        /// Which.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// It is not a file.
    #[error("{} is not a file, so it holds no secrets", .path.display())]
    NoFile {
        /// Which.
        path: PathBuf,
    },
    /// Others may read or change it.
    #[error(
        "{} has mode {mode:04o}; a file of secrets has {RIGHTS:04o}, so that only its owner reads \
         it: `chmod 600 {}`, and new secrets in it if somebody else may have read them",
        .path.display(), .path.display()
    )]
    Rights {
        /// Which.
        path: PathBuf,
        /// Its mode.
        mode: u32,
    },
    /// It belongs to somebody else.
    #[error("{} belongs to another user, who could put other secrets in it", .path.display())]
    Owner {
        /// Which.
        path: PathBuf,
    },
    /// It does not hold secrets.
    #[error("{}: {error}", .path.display())]
    Misread {
        /// Which.
        path: PathBuf,
        /// What.
        error: SecretError,
    },
}

/// The secrets in the file at `path`.
///
/// # Errors
///
/// It cannot be read, belongs to another user, others may read it, or it does not hold secrets.
pub fn secrets_at(path: &Path) -> Result<Secrets, SecretsError> {
    let at = || path.to_owned();
    let failed = |error| SecretsError::Read { path: at(), error };
    // Do not wait for a pipe to which nobody writes.
    let flags = OFlags::NONBLOCK.bits().cast_signed();
    let open = OpenOptions::new().read(true).custom_flags(flags).open(path);
    let file: File = open.map_err(failed)?;
    let found = file.metadata().map_err(failed)?;
    if !found.is_file() {
        return Err(SecretsError::NoFile { path: at() });
    }
    let mode = found.mode() & 0o7777;
    if mode != RIGHTS {
        return Err(SecretsError::Rights { path: at(), mode });
    }
    if found.uid() != rustix::process::geteuid().as_raw() {
        return Err(SecretsError::Owner { path: at() });
    }
    let mut text = String::new();
    file.take(LONGEST)
        .read_to_string(&mut text)
        .map_err(failed)?;
    Secrets::read(&text).map_err(|error| SecretsError::Misread { path: at(), error })
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    #[test]
    fn only_a_file_that_nobody_else_reads_gives_secrets() {
        let folder = std::env::temp_dir().join(format!("lager-secret-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let file = folder.join("secret");
        fs::write(&file, "0123456789abcdef\n").expect("a file");
        let with = |mode| {
            fs::set_permissions(&file, fs::Permissions::from_mode(mode)).expect("it is ours");
            secrets_at(&file).map_err(|error| error.to_string())
        };
        assert!(with(0o600).is_ok());
        for mode in [0o644, 0o640, 0o602, 0o4600, 0o700] {
            let why = with(mode).expect_err("others may use it");
            assert!(why.contains("chmod 600"), "{why}");
        }
        let none = secrets_at(&folder).expect_err("a folder");
        assert!(matches!(none, SecretsError::NoFile { .. }), "{none}");
        let pipe = folder.join("pipe");
        let mode = rustix::fs::Mode::from_raw_mode(0o600);
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, mode).expect("a pipe");
        let none = secrets_at(&pipe).expect_err("a pipe");
        assert!(matches!(none, SecretsError::NoFile { .. }), "{none}");
        fs::write(&file, "short").expect("a file");
        let why = with(0o600).expect_err("no secret");
        assert!(
            why.contains("line 1: ") && why.contains("secret: "),
            "{why}"
        );
        fs::remove_dir_all(&folder).expect("it is ours");
    }
}
