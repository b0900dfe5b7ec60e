//! The thin shell: an instance of our own in the kernel's tracefs, and its events.
//!
//! An instance has switches and a ring of its own, so nobody else's tracing is touched. It is removed
//! when this value is dropped. If this process is killed, the kernel itself ends the tracing (the
//! open `free_buffer` does that), and the next start removes the empty folder. The folder's name says
//! whose it is: namespace of processes, process and its start.
//!
//! The instance uses the clock of our stamps, `CLOCK_MONOTONIC`. A marker with our time proves it at
//! each start: in a time namespace, or if the kernel has no such clock, nothing is explained.

use core::sync::atomic::{AtomicU32, Ordering};
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Read as _, Write as _};
use std::os::fd::{AsRawFd as _, OwnedFd};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use lager_home::Clock;

use crate::event::{Decoder, Event, WANTED, What};
use crate::format::Format;
use crate::page;
use crate::timeline::Timeline;

/// Where tracefs may be mounted.
const PLACES: [&str; 2] = ["/sys/kernel/tracing", "/sys/kernel/debug/tracing"];

/// The beginning of our folders' names.
const OURS: &str = "lager-";

/// The longest time between a marker's own text and its stamp, in ns, beside the time of writing it.
const APART_NS: u64 = 50_000;

/// Why nothing can be traced.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoTracing {
    /// A file of tracefs is missing or may not be used.
    #[error(
        "the kernel's events are not available: {path}: {reason}; they need root, or a user who may \
         write there, and a kernel with tracefs (`mount -t tracefs nodev /sys/kernel/tracing`)"
    )]
    File {
        /// The file.
        path: String,
        /// The kernel's reason.
        reason: String,
    },
    /// The events' clock is not that of the stamps.
    #[error("the kernel's events are not available: {0}, so they cannot be laid beside our stamps")]
    Clock(String),
}

fn refused(path: &Path) -> impl FnOnce(std::io::Error) -> NoTracing {
    |error| NoTracing::File {
        path: path.display().to_string(),
        reason: error.to_string(),
    }
}

/// The kernel's events, from an instance of our own.
#[derive(Debug)]
pub struct Tracer {
    pipes: Vec<(usize, File)>,
    decoder: Decoder,
    page: Vec<u8>,
    missing: Vec<String>,
    // While it is open, the kernel ends the tracing if this process dies.
    ends_with_us: Option<File>,
    folder: Folder,
}

/// Our folder in tracefs, removed when it is dropped.
#[derive(Debug)]
struct Folder {
    path: PathBuf,
    // Dropped last: the folder is in it.
    _mount: Option<OwnedFd>,
}

impl Drop for Folder {
    fn drop(&mut self) {
        // It stays for the next start to remove only if somebody else reads in it.
        let _ = fs::remove_dir(&self.path);
    }
}

impl Tracer {
    /// Switches the events on, with a ring of so many KiB for each core. Removes what killed ones
    /// have left.
    ///
    /// # Errors
    /// This user may not, or the clock is another one.
    pub fn start(ring_kib: u32) -> Result<Self, NoTracing> {
        let (instances, root, mount) = instances()?;
        remove_the_dead(&instances);
        let path = instances.join(name().map_err(refused(Path::new("/proc/self/stat")))?);
        fs::create_dir(&path).map_err(refused(&path))?;
        let folder = Folder {
            path,
            _mount: mount,
        };
        let within = |name: &str| folder.path.join(name);
        put(&within("tracing_on"), "0")?;
        put(&within("trace_clock"), "mono")?;
        let clock = text(&within("trace_clock"))?;
        if !clock.contains("[mono]") {
            let said = format!(
                "their clock is not CLOCK_MONOTONIC but one of {}",
                clock.trim()
            );
            return Err(NoTracing::Clock(said));
        }
        put(&within("buffer_size_kb"), &ring_kib.to_string())?;
        // Older kernels have neither; then the next start removes what a killed one left.
        let _ = put(&within("options/disable_on_free"), "1");
        let free = OpenOptions::new().write(true).open(within("free_buffer"));
        let mut decoder = Decoder::default();
        let mut missing = Vec::new();
        let print = root.join("events/ftrace/print/format");
        learn(&mut decoder, &print).map_err(NoTracing::Clock)?;
        for (group, name) in WANTED {
            let event = within(&format!("events/{group}/{name}"));
            let learnt = learn(&mut decoder, &event.join("format"));
            let on = learnt
                .and_then(|()| put(&event.join("enable"), "1").map_err(|error| error.to_string()));
            if on.is_err() {
                missing.push(format!("{group}/{name}"));
            }
        }
        let pipes = pipes(&within("per_cpu"))?;
        let size = text(&within("buffer_subbuf_size_kb")).ok();
        let size = size.and_then(|size| size.trim().parse::<usize>().ok());
        let mut tracer = Self {
            pipes,
            decoder,
            page: vec![0; size.map_or(rustix::param::page_size(), |kib| kib * 1024)],
            missing,
            ends_with_us: free.ok(),
            folder,
        };
        tracer.put_on("1")?;
        tracer.prove_the_clock()?;
        Ok(tracer)
    }

    fn put_on(&self, on: &str) -> Result<(), NoTracing> {
        put(&self.folder.path.join("tracing_on"), on)
    }

    /// Writes our time as a marker, and looks when it came.
    fn prove_the_clock(&mut self) -> Result<(), NoTracing> {
        let path = self.folder.path.join("trace_marker");
        let before = Clock::monotonic_ns();
        put(&path, &before.to_string())?;
        let after = Clock::monotonic_ns();
        let mut came = None;
        self.each(|found| {
            if let Found::Event(event) = found
                && event.what == What::Marker(before)
            {
                came = Some(event.at_ns);
            }
        })?;
        let Some(came) = came else {
            let said = "a marker that was written did not come";
            return Err(NoTracing::Clock(said.to_owned()));
        };
        if came + APART_NS < before || came > after + APART_NS {
            let said = format!("their clock says {came} ns where ours says {before} ns");
            return Err(NoTracing::Clock(said));
        }
        Ok(())
    }

    /// Moves all events that are there into `line`. Returns up to when it is whole, in ns.
    ///
    /// # Errors
    /// The kernel gives out no more.
    pub fn read(&mut self, line: &mut Timeline) -> Result<u64, NoTracing> {
        let whole = Clock::monotonic_ns();
        self.each(|found| match found {
            Found::Hole(core, to_ns) => line.hole(core, to_ns),
            Found::Event(event) => line.push(event),
        })?;
        line.lines.clone_from(&self.decoder.lines);
        Ok(whole)
    }

    fn each(&mut self, mut each: impl FnMut(Found)) -> Result<(), NoTracing> {
        let mut events = Vec::new();
        for (core, pipe) in &mut self.pipes {
            loop {
                let length = match pipe.read(&mut self.page) {
                    Ok(0) => break,
                    Ok(length) => length,
                    Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                    Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                    Err(error) => return Err(refused(&self.folder.path)(error)),
                };
                events.clear();
                let (decoder, mut last) = (&mut self.decoder, 0);
                let read = page::read(&self.page[..length], |at, bytes| {
                    events.extend(decoder.event(at, *core, bytes));
                    last = at;
                });
                if let Ok(page) = &read
                    && page.missed
                {
                    each(Found::Hole(*core, page.first_ns));
                }
                events
                    .iter()
                    .copied()
                    .for_each(|event| each(Found::Event(event)));
                if read.is_err() {
                    each(Found::Hole(*core, last));
                }
            }
        }
        Ok(())
    }

    /// The events that this kernel does not have.
    pub fn missing(&self) -> &[String] {
        &self.missing
    }

    /// How many events the kernel left out so far because the ring was full.
    pub fn lost(&self) -> u64 {
        let each = self.pipes.iter().filter_map(|(core, _)| {
            let stats = format!("per_cpu/cpu{core}/stats");
            fs::read_to_string(self.folder.path.join(stats)).ok()
        });
        each.map(|stats| lost_of(&stats)).sum()
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder.path
    }
}

impl Drop for Tracer {
    fn drop(&mut self) {
        let _ = self.put_on("0");
        // An open file would keep the folder.
        self.pipes.clear();
        self.ends_with_us = None;
    }
}

enum Found {
    Hole(usize, u64),
    Event(Event),
}

/// Overrun and dropped events of one core.
fn lost_of(stats: &str) -> u64 {
    let number = |line: &str| {
        let (name, number) = line.split_once(':')?;
        let counts = ["overrun", "dropped events"].contains(&name.trim());
        counts.then(|| number.trim().parse::<u64>().ok())?
    };
    stats.lines().filter_map(number).sum()
}

/// Names the functions that timers called, if this user may see the kernel's addresses.
pub fn name_functions(line: &mut Timeline) {
    let symbols = fs::read_to_string("/proc/kallsyms").unwrap_or_default();
    let called: std::collections::HashSet<u64> = line.called().collect();
    for symbol in symbols.lines() {
        let mut words = symbol.split_whitespace();
        let address = words
            .next()
            .and_then(|word| u64::from_str_radix(word, 16).ok());
        let address = address.filter(|address| *address != 0 && called.contains(address));
        if let (Some(address), Some(name)) = (address, words.nth(1)) {
            line.functions.insert(address, name.to_owned());
        }
    }
}

/// The folder of instances, that of the whole tracefs, and our own mount of it.
fn instances() -> Result<(PathBuf, PathBuf, Option<OwnedFd>), NoTracing> {
    for place in PLACES.map(Path::new) {
        let instances = place.join("instances");
        match fs::metadata(&instances) {
            Ok(_) => return Ok((instances, place.to_owned(), None)),
            Err(error) if error.kind() == ErrorKind::PermissionDenied => {
                return Err(refused(&instances)(error));
            }
            Err(_) => {}
        }
    }
    let mount = crate::mount::tracefs().map_err(refused(Path::new(PLACES[0])))?;
    let root = PathBuf::from(format!("/proc/self/fd/{}", mount.as_raw_fd()));
    let instances = root.join("instances");
    fs::metadata(&instances).map_err(refused(Path::new("tracefs/instances")))?;
    Ok((instances, root, Some(mount)))
}

/// Removes the folders of our processes that have ended. Another namespace's cannot be judged.
fn remove_the_dead(instances: &Path) {
    let own = namespace();
    for entry in fs::read_dir(instances).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let Some(owner) = name.to_str().and_then(owner) else {
            continue;
        };
        let lives = start_of(owner.1) == Some(owner.2);
        if Some(owner.0) == own && !lives {
            let _ = fs::remove_dir(entry.path());
        }
    }
}

/// Namespace, process and its start, from a folder's name.
fn owner(name: &str) -> Option<(u64, u32, u64)> {
    let mut parts = name.strip_prefix(OURS)?.split('-');
    let owner = (
        parts.next()?.parse().ok()?,
        parts.next()?.parse().ok()?,
        parts.next()?.parse().ok()?,
    );
    parts.next()?.parse::<u32>().ok()?;
    parts.next().is_none().then_some(owner)
}

/// The name of this process's next folder.
fn name() -> std::io::Result<String> {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    let process = std::process::id();
    let start = start_of(process).ok_or(ErrorKind::InvalidData)?;
    let space = namespace().unwrap_or(0);
    let number = NEXT.fetch_add(1, Ordering::Relaxed);
    Ok(format!("{OURS}{space}-{process}-{start}-{number}"))
}

/// The number of this process's namespace of processes: `pid:[4026531836]`.
fn namespace() -> Option<u64> {
    let link = fs::read_link("/proc/self/ns/pid").ok()?;
    let link = link.to_str()?.strip_prefix("pid:[")?;
    link.strip_suffix(']')?.parse().ok()
}

/// When a process began, in the kernel's ticks.
fn start_of(process: u32) -> Option<u64> {
    crate::proc::fields(process)?.get(19)?.parse().ok()
}

fn pipes(per_core: &Path) -> Result<Vec<(usize, File)>, NoTracing> {
    let mut pipes = Vec::new();
    let folders = fs::read_dir(per_core).map_err(refused(per_core))?;
    for folder in folders.flatten() {
        let name = folder.file_name();
        let core = name.to_str().and_then(|name| name.strip_prefix("cpu"));
        let Some(core) = core.and_then(|core| core.parse().ok()) else {
            continue;
        };
        let path = folder.path().join("trace_pipe_raw");
        let flags = rustix::fs::OFlags::NONBLOCK.bits().cast_signed();
        let pipe = OpenOptions::new()
            .read(true)
            .custom_flags(flags)
            .open(&path);
        pipes.push((core, pipe.map_err(refused(&path))?));
    }
    Ok(pipes)
}

/// Reads an event's description; the sentence says what is wrong.
fn learn(decoder: &mut Decoder, path: &Path) -> Result<(), String> {
    let text = text(path).map_err(|error| error.to_string())?;
    let format = Format::parse(&text).map_err(|error| error.to_string())?;
    decoder.learn(&format).map_err(|error| error.to_string())
}

fn text(path: &Path) -> Result<String, NoTracing> {
    fs::read_to_string(path).map_err(refused(path))
}

fn put(path: &Path, what: &str) -> Result<(), NoTracing> {
    let file = OpenOptions::new().write(true).open(path);
    let written = file.and_then(|mut file| file.write_all(what.as_bytes()));
    written.map_err(refused(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_says_whose_it_is() {
        let name = name().expect("this process");
        let (space, process, start) = owner(&name).expect("ours");
        assert_eq!(process, std::process::id());
        assert_eq!((Some(space), Some(start)), (namespace(), start_of(process)));
        for other in [
            "lager-1-2-3",
            "lager-1-2-3-4-5",
            "bcc_1-2-3-4",
            "lager-a-2-3-4",
        ] {
            assert_eq!(owner(other), None, "{other}");
        }
    }

    #[test]
    fn lost_is_what_was_overrun_and_what_was_dropped() {
        let stats =
            "entries: 3\noverrun: 40\ncommit overrun: 0\ndropped events: 2\nread events: 9\n";
        assert_eq!(lost_of(stats), 42);
    }
}
