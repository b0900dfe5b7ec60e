//! `bag recover`: copies the undamaged parts of a file into a new one.

use std::io::Write;
use std::path::{Path, PathBuf};

use lager_journal::{Check, Learnt, Recovery};
use serde_json::json;

use crate::bag::{Bag, BagError};
use crate::disk::Disk;
use crate::look::report;

/// Copies every undamaged chunk of `file` to `copy`, reads the copy again, and prints its content.
/// Without `copy` it writes `NAME.recovered.mcap` beside the file. The file itself does not change.
///
/// # Errors
/// The file cannot be read or has nothing to recover, the copy exists already or cannot be written,
/// or the output cannot be written.
pub fn recover(
    file: &Path,
    copy: Option<&Path>,
    as_json: bool,
    out: &mut impl Write,
) -> Result<(), BagError> {
    let bag = Bag::open(file)?;
    let path = file.to_owned();
    let mut check = Check::default();
    let learnt = bag.walk(Learnt::default(), &mut check)?;
    let found = check.finish();
    // Messages outside of chunks are undamaged, but cannot be played or exported from there.
    if found.faults.is_empty() && !(found.is_ours && found.has_loose) {
        if !found.is_ours {
            return Err(BagError::Foreign { path });
        }
        let name = file.display();
        if as_json {
            let value = json!({"file": name.to_string(), "whole": true, "copy": null});
            writeln!(out, "{value}")?;
        } else {
            writeln!(out, "{name} is whole; there is nothing to recover")?;
        }
        return Ok(());
    }
    if (found.chunks == 0 && !found.has_loose) || !found.is_ours {
        let why = found.faults.first().map(ToString::to_string);
        let why = why.unwrap_or_default();
        return Err(BagError::Nothing { path, why });
    }
    let copy = copy.map_or_else(|| beside(file), Path::to_owned);
    let failed = |error| BagError::Write {
        path: copy.clone(),
        error,
    };
    let mut disk = Disk::create(&copy).map_err(failed)?;
    match write(&bag, learnt, &mut disk).and_then(|told| Ok((told, again(&bag, &disk)?))) {
        Ok((messages, chunks)) => {
            disk.finish().map_err(failed)?;
            let (name, copy) = (file.display(), copy.display());
            if as_json {
                let faults: Vec<String> = found.faults.iter().map(ToString::to_string).collect();
                let value = json!({
                    "file": name.to_string(), "whole": false, "faults": faults,
                    "copy": copy.to_string(), "messages": messages, "chunks": chunks,
                });
                writeln!(out, "{value}")?;
                return Ok(());
            }
            for fault in &found.faults {
                writeln!(out, "{name}: {fault}")?;
            }
            writeln!(
                out,
                "{copy}: {messages} messages in {chunks} chunks are saved, and were read again"
            )?;
            Ok(())
        }
        Err(error) => {
            disk.remove();
            Err(error)
        }
    }
}

/// Writes the copy, and returns how many messages it has.
fn write(bag: &Bag, learnt: Learnt, disk: &mut Disk) -> Result<u64, BagError> {
    let path = disk.path().to_owned();
    let failed = |error| BagError::Write {
        path: path.clone(),
        error,
    };
    let mut recovery = Recovery::default();
    let mut bytes = Vec::new();
    bag.walk_and(learnt, &mut recovery, |recovery| {
        bytes.clear();
        recovery.take(&mut bytes);
        disk.write(&bytes).map_err(failed)
    })?;
    bytes.clear();
    recovery.take(&mut bytes);
    let (mut last, recovered) = recovery.finish()?;
    bytes.append(&mut last);
    disk.write(&bytes).map_err(failed)?;
    disk.sync().map_err(failed)?;
    Ok(recovered.messages)
}

/// Reads the copy again, and returns how many chunks it has.
fn again(bag: &Bag, disk: &Disk) -> Result<u64, BagError> {
    let copy = report(&Bag::open(disk.path())?)?;
    match copy.faults.first() {
        None => Ok(copy.chunks),
        Some(fault) => Err(BagError::Nothing {
            path: bag.path().to_owned(),
            why: format!("the copy would be damaged as well: {fault}"),
        }),
    }
}

fn beside(file: &Path) -> PathBuf {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    file.with_file_name(format!("{stem}.recovered.mcap"))
}
