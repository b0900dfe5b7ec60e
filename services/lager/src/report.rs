//! `lager report`: packs what somebody elsewhere needs to understand a fault into one file, without
//! secrets.
//!
//! It works while the robot is down or hangs. It opens nothing of the bus: whatever may hang is
//! asked of another `lager` process, with a limit. A part that cannot be had does not keep the
//! others out, and `report.txt` says why it is missing. All parts are text and go through
//! [`Scrub`]. Each part has a limit, so the whole stays small enough for a letter.
//!
//! `gather.rs` gets the parts.

mod gather;
mod scrub;

use std::fmt::Write as _;
use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use flate2::Compression;
use flate2::write::GzEncoder;
use lager_home::Clock;
use lager_recorder::utc;

use crate::cli::ReportArgs;
use crate::config::Config;
use gather::Part;
use scrub::Scrub;

/// Writes the report, and says where it is.
///
/// # Errors
/// The file exists, or the disk refuses it.
pub fn run(config: &Config, args: &ReportArgs) -> Result<String> {
    let now_ns = Clock::monotonic_ns().saturating_add_signed(Clock::unix_offset_ns());
    let name = named(&config.name, &utc(now_ns));
    let path = match &args.out {
        Some(path) => path.clone(),
        None => PathBuf::from(format!("{name}.tar.gz")),
    };
    // Before the work: nobody wants to wait and then learn that there is no room for it.
    let mut file = OpenOptions::new()
        .write(true)
        .create_new(true)
        .mode(0o600)
        .open(&path)
        .with_context(|| format!("cannot make {}; --out FILE names another", path.display()))?;
    let parts = gather::all(config, args);
    let scrub = Scrub::new(gather::secrets(config), gather::home().as_deref());
    let packed = pack(&name, now_ns, &parts, &scrub);
    let written = packed.and_then(|packed| {
        file.write_all(&packed.bytes)?;
        file.sync_all()?;
        Ok(packed)
    });
    let packed = written
        .inspect_err(|_| drop(fs::remove_file(&path)))
        .with_context(|| format!("cannot write {}", path.display()))?;
    Ok(said(&path, &packed))
}

fn said(path: &Path, packed: &Packed) -> String {
    let mut said = format!(
        "{}: {} KiB, {} parts; secrets, tokens, network names, hardware addresses and the name of \
         your home folder are left out ({} places); look into it before you hand it on",
        path.display(),
        packed.bytes.len().div_ceil(1024),
        packed.parts,
        packed.left_out
    );
    for missing in &packed.missing {
        let _ = write!(said, "\nnot in it: {missing}");
    }
    said
}

/// `lager-report-r1-20261128-204419`.
fn named(robot: &str, now: &str) -> String {
    let digits: String = now.chars().filter(char::is_ascii_digit).collect();
    let (day, time) = digits.split_at(8.min(digits.len()));
    format!("lager-report-{robot}-{day}-{}", &time[..6.min(time.len())])
}

/// The archive.
struct Packed {
    bytes: Vec<u8>,
    parts: usize,
    missing: Vec<String>,
    /// In how many places something was taken out.
    left_out: usize,
}

/// Packs the parts into a folder of this name, behind a first file that says what is there.
fn pack(name: &str, now_ns: u64, parts: &[Part], scrub: &Scrub) -> Result<Packed> {
    let now = utc(now_ns);
    let mut files = Vec::new();
    let (mut missing, mut left_out) = (Vec::new(), 0);
    let mut contents = String::new();
    for Part { name, what, got } in parts {
        match got {
            Ok(text) => {
                let (text, count) = scrub.text(text);
                left_out += count;
                let _ = writeln!(contents, "  {name:28} {what}");
                files.push((name.clone(), text));
            }
            Err(why) => {
                // A reason quotes paths, and what a program has said.
                let (why, count) = scrub.text(why);
                left_out += count;
                missing.push(format!("{name} ({what}): {why}"));
            }
        }
    }
    let first = format!(
        "A report of `lager report`, made on {now} UTC.\n\nIn it:\n{contents}\nNot in it:\n{}\n\
         Left out in {left_out} places, marked \"(left out)\": secrets, tokens, passwords, network \
         names, hardware addresses, and the name of the home folder.\n",
        match missing.as_slice() {
            [] => "  nothing is missing\n".to_owned(),
            all => all.iter().map(|one| format!("  {one}\n")).collect(),
        }
    );
    files.insert(0, ("report.txt".to_owned(), first));
    let mut archive = tar::Builder::new(GzEncoder::new(Vec::new(), Compression::default()));
    for (file, text) in &files {
        let mut header = tar::Header::new_gnu();
        header.set_size(text.len() as u64);
        header.set_mode(0o644);
        header.set_mtime(now_ns / 1_000_000_000);
        archive.append_data(&mut header, format!("{name}/{file}"), text.as_bytes())?;
    }
    Ok(Packed {
        bytes: archive.into_inner()?.finish()?,
        parts: files.len(),
        missing,
        left_out,
    })
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use super::*;

    fn unpacked(bytes: &[u8]) -> Vec<(String, String)> {
        let mut archive = tar::Archive::new(flate2::read::GzDecoder::new(bytes));
        let entries = archive.entries().expect("an archive");
        let files = entries.map(|entry| {
            let mut entry = entry.expect("whole");
            let path = entry.path().expect("a path").display().to_string();
            let mut text = String::new();
            entry.read_to_string(&mut text).expect("text");
            (path, text)
        });
        files.collect()
    }

    #[test]
    fn a_part_that_is_missing_keeps_no_other_one_out_and_is_named_first() {
        let part = |name: &str, got: Result<&str, &str>| Part {
            name: name.to_owned(),
            what: "what",
            got: got.map(str::to_owned).map_err(str::to_owned),
        };
        let parts = [
            part("config.toml", Ok("name = \"r1\"\ntoken = x y\n")),
            part("journal.txt", Err("journalctl says: password hunter two")),
        ];
        let packed = pack("top", 0, &parts, &Scrub::default()).expect("an archive");
        assert_eq!((packed.parts, packed.left_out), (2, 2));
        let files = unpacked(&packed.bytes);
        assert_eq!(files[0].0, "top/report.txt");
        assert!(
            files[0]
                .1
                .contains("journal.txt (what): journalctl says: password (left out)")
        );
        assert!(files[0].1.contains("config.toml"), "{}", files[0].1);
        let config = (
            "top/config.toml".into(),
            "name = \"r1\"\ntoken = (left out)\n".into(),
        );
        assert_eq!(files[1..], [config]);
    }

    #[test]
    fn a_report_is_named_by_its_robot_and_its_time() {
        let name = named("r1", "2026-11-28 20:44:19.123");
        assert_eq!(name, "lager-report-r1-20261128-204419");
    }
}
