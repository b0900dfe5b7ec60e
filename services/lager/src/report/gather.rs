//! Gets the parts of a report: each as a text, or the reason why it cannot be had.

use std::env;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, Read, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::time::{Duration, Instant, SystemTime};

use anyhow::{Context, Result, bail};
use lager_comm::secrets_at;
use lager_lines::Name;
use lager_panel::Tokens;
use lager_recorder::Latest;
use lager_station::files;
use lager_stop::StopWord;
use lager_supervisor::runtime_folder::RuntimeFolder;
use lager_supervisor::state_folder::StateFolder;
use lager_topics::called;

use crate::cli::ReportArgs;
use crate::config::Config;
use crate::stop;

/// How long another process may take.
const PATIENCE: Duration = Duration::from_secs(40);
/// The same for one sample of a topic.
const SAMPLE: Duration = Duration::from_secs(8);
/// The most of a log, in bytes: its end counts.
const MOST_OF_LOG: u64 = 2 << 20;
/// The most of the events of a day, and of the states of the last minutes.
const MOST_OF_EVENTS: u64 = 6 << 20;
const MOST_OF_STATES: u64 = 4 << 20;
/// The end of a recording.
const LAST_OF_RECORDING: Duration = Duration::from_secs(120);
const MOST_OF_RECORDING: usize = 12 << 20;
/// The longest recording of which a copy is made to read it.
const MOST_TO_COPY: u64 = 512 << 20;
/// The most lines of the journal.
const LINES_OF_JOURNAL: &str = "20000";
/// The units of the robot and of the station.
const UNITS: [&str; 2] = ["lager", "lager-station"];

/// A file of the report.
#[derive(Debug)]
pub struct Part {
    /// Its name in the archive.
    pub name: String,
    /// What it is, for people.
    pub what: &'static str,
    /// Its text, or why it cannot be had.
    pub got: Result<String, String>,
}

fn part(name: &str, what: &'static str, got: Result<String>) -> Part {
    let got = got.map_err(|error| format!("{error:#}"));
    let name = name.to_owned();
    Part { name, what, got }
}

/// All parts, in the order in which a person reads them.
pub fn all(config: &Config, args: &ReportArgs) -> Vec<Part> {
    let mut parts = vec![
        part(
            "versions.txt",
            "versions of programs and boards",
            Ok(versions(config)),
        ),
        part("doctor.txt", "what `lager doctor` says", doctor(config)),
        part(
            "robot.txt",
            "the processes and the stop of the robot",
            robot(config),
        ),
        part(
            "config.toml",
            "the configuration of this command",
            Ok(config.documented()),
        ),
        part(
            "running.toml",
            "the configuration of the robot that is up",
            running(config),
        ),
    ];
    for topic in ["link/health", "nav/status", "mission/queue"] {
        let name = format!("{}.json", topic.replace('/', "-"));
        parts.push(part(&name, "the robot's last state", sample(config, topic)));
    }
    parts.push(part(
        "journal.txt",
        "the services' journal of the last day",
        journal(),
    ));
    if let Some(file) = &config.log.file {
        parts.push(part(
            "log.txt",
            "the end of the log file",
            end_of(file, MOST_OF_LOG),
        ));
    }
    parts.extend(kept(config));
    parts.push(part(
        "recording.jsonl",
        "the end of a recording",
        recording(config, args),
    ));
    parts
}

/// What must not leave this machine, as far as it is known.
pub fn secrets(config: &Config) -> Vec<String> {
    let mut secrets = Vec::new();
    let running = config.of_running_robot().ok().flatten();
    let configs: Vec<&Config> = [config].into_iter().chain(&running).collect();
    let own = configs
        .iter()
        .filter_map(|config| RuntimeFolder::secret(&config.bus().ok()?).ok());
    let named = configs
        .iter()
        .filter_map(|config| config.comm.secret.clone());
    for file in own.chain(named) {
        secrets.extend(fs::read_to_string(&file).into_iter().flat_map(|text| {
            let words = text.split_whitespace().map(str::to_owned);
            words.filter(|word| word.len() >= 8).collect::<Vec<_>>()
        }));
        let Ok(known) = secrets_at(&file) else {
            continue;
        };
        let name = Name::new(config.name.clone()).ok();
        for secret in known
            .of_all()
            .into_iter()
            .chain(name.and_then(|name| known.of(&name)))
        {
            let Tokens { driver, viewer } = Tokens::of(secret);
            secrets.extend([driver, viewer]);
        }
    }
    let hides = |name: &str| {
        let name = name.to_ascii_uppercase();
        let words = [
            "TOKEN",
            "SECRET",
            "PASS",
            "PSK",
            "SSID",
            "AUTH",
            "CREDENTIAL",
            "_KEY",
        ];
        words.iter().any(|word| name.contains(word))
    };
    secrets.extend(
        env::vars_os()
            .filter(|(name, _)| hides(&name.to_string_lossy()))
            .map(|(_, value)| value.to_string_lossy().into_owned())
            // Such a value is a setting.
            .filter(|value| value.len() >= 6),
    );
    secrets.extend(wifi());
    secrets
}

/// Names and passwords of the networks that this machine knows, if this user may read them.
fn wifi() -> Vec<String> {
    let folders = [
        "/etc/wpa_supplicant",
        "/etc/NetworkManager/system-connections",
    ];
    let files = folders.iter().flat_map(|folder| listed(Path::new(folder)));
    let texts = files.filter_map(|file| files::read(&file).ok());
    let mut found = Vec::new();
    for text in texts {
        for line in text.lines() {
            let Some((key, value)) = line.trim().split_once('=') else {
                continue;
            };
            if ["ssid", "psk", "password", "wep-key0", "identity"].contains(&key.trim()) {
                found.push(value.trim().trim_matches('"').to_owned());
            }
        }
    }
    found
}

/// The user's home folder.
pub fn home() -> Option<PathBuf> {
    env::var_os("HOME")
        .map(PathBuf::from)
        .filter(|home| home.is_absolute())
}

fn versions(config: &Config) -> String {
    let kernel = rustix::system::uname();
    let said = |text: &std::ffi::CStr| text.to_string_lossy().into_owned();
    let system = fs::read_to_string("/etc/os-release").unwrap_or_default();
    let system = system
        .lines()
        .find_map(|line| line.strip_prefix("PRETTY_NAME="));
    let told = stop::path(config)
        .ok()
        .and_then(|path| StopWord::read(&path).ok().flatten());
    let board = |version: Option<u8>| match version {
        Some(version) => format!("protocol {version}"),
        None => "not told".to_owned(),
    };
    format!(
        "lager {}\n{}\n{} {} {}\nsystem {}\nsensor board {}\nsteering board {}\n",
        env!("CARGO_PKG_VERSION"),
        lager_ports::BUS_VERSION,
        said(kernel.sysname()),
        said(kernel.release()),
        said(kernel.machine()),
        system.unwrap_or("not told").trim_matches('"'),
        board(told.and_then(|told| told.sensor())),
        board(told.and_then(|told| told.steering())),
    )
}

/// The answer of `lager doctor`, whose findings are no failure here.
fn doctor(config: &Config) -> Result<String> {
    lager(config, &["doctor"], PATIENCE)
}

/// One sample of a topic, if the robot is up.
fn sample(config: &Config, topic: &str) -> Result<String> {
    let bus = config.bus()?;
    if !bus.home()?.up().contains_key(&bus.unit) {
        bail!("the robot is not up");
    }
    let text = lager(
        config,
        &["topic", "echo", topic, "--count", "1", "--json"],
        SAMPLE,
    )?;
    if text.trim().is_empty() {
        bail!("it has not come in time");
    }
    Ok(text)
}

/// Which processes of the robot are there, and whether it is stopped.
fn robot(config: &Config) -> Result<String> {
    let bus = config.bus()?;
    let mut text = String::new();
    for (unit, holders) in bus.home()?.up() {
        for holder in holders {
            let frozen = if holder.frozen { ", frozen" } else { "" };
            let what = called(&holder.what);
            let _ = writeln!(text, "{unit}: {what} is process {}{frozen}", holder.pid);
        }
    }
    if text.is_empty() {
        text.push_str("no robot is up\n");
    }
    let _ = match stop::current(config)? {
        Some(stop) => writeln!(text, "{}: stopped {stop}", bus.unit),
        None => writeln!(text, "{}: no stop is set", bus.unit),
    };
    Ok(text)
}

fn running(config: &Config) -> Result<String> {
    let file = RuntimeFolder::running(&config.bus()?)?.context("the robot is not up")?;
    files::read(&file).with_context(|| format!("cannot read {}", file.display()))
}

/// What systemd has of the services.
fn journal() -> Result<String> {
    let mut journal = Command::new("journalctl");
    journal.args(["--no-pager", "--no-hostname", "--output=short-iso-precise"]);
    journal.args(["--since=-24h", "--lines", LINES_OF_JOURNAL]);
    journal.args(UNITS.map(|unit| format!("--unit={unit}")));
    let told = told(journal, None, PATIENCE)?;
    if !told.is_success || told.text.contains("-- No entries --") {
        bail!(
            "there is none for this user; `sudo lager report` may read it: {}",
            told.text.trim()
        );
    }
    Ok(told.text)
}

/// The small files of the state folder, and the history of the stations in it.
fn kept(config: &Config) -> Vec<Part> {
    let what = "what outlives the robot";
    let root = match config.state_root() {
        Ok(root) => root,
        Err(error) => return vec![part("state", what, Err(error))],
    };
    let folders = [
        StateFolder::of_robot(&root, &config.name).path().to_owned(),
        StateFolder::path_of_station(&root),
    ];
    let mut parts = Vec::new();
    for folder in folders.iter().filter(|folder| folder.is_dir()) {
        let place = folder
            .file_name()
            .map(|name| name.to_string_lossy().into_owned());
        let place = format!(
            "state/{}",
            place.unwrap_or_default().trim_start_matches('.')
        );
        for path in listed(folder) {
            let name = path
                .file_name()
                .map(|name| name.to_string_lossy().into_owned());
            let name = format!("{place}/{}", name.unwrap_or_default());
            let ends = |end: &str| path.extension() == Some(OsStr::new(end));
            if path.is_dir() {
                let events = parts_of(&path, "events-", MOST_OF_EVENTS);
                parts.push(part(
                    &format!("{name}/events.txt"),
                    "the events of the last day",
                    events,
                ));
                let states = parts_of(&path, "fine-", MOST_OF_STATES);
                parts.push(part(
                    &format!("{name}/states.txt"),
                    "the last minutes",
                    states,
                ));
            } else if ends("toml") || ends("queue") {
                let text =
                    files::read(&path).with_context(|| format!("cannot read {}", path.display()));
                parts.push(part(&name, what, text));
            }
        }
    }
    if parts.is_empty() {
        let why = format!("there is nothing in {}", root.display());
        parts.push(part("state", what, Err(anyhow::Error::msg(why))));
    }
    parts
}

/// The newest parts of a history whose names begin like this, the oldest first.
fn parts_of(folder: &Path, beginning: &str, most: u64) -> Result<String> {
    let is_it = |path: &PathBuf| {
        let name = path
            .file_name()
            .map(|name| name.to_string_lossy().into_owned());
        name.is_some_and(|name| name.starts_with(beginning) && name.ends_with(".log"))
    };
    let mut left = most;
    let mut texts = Vec::new();
    for path in listed(folder).into_iter().filter(is_it).rev() {
        let text = end_of(&path, left)?;
        left = left.saturating_sub(text.len() as u64);
        texts.push(text);
        if left == 0 {
            break;
        }
    }
    if texts.is_empty() {
        bail!("there is no history in {}", folder.display());
    }
    texts.reverse();
    Ok(texts.concat())
}

/// The end of the newest recording of this robot, or of the one that was named.
fn recording(config: &Config, args: &ReportArgs) -> Result<String> {
    let newest = || {
        let beginning = format!("{}-", config.name);
        let is_it = |path: &PathBuf| {
            let name = path
                .file_name()
                .map(|name| name.to_string_lossy().into_owned());
            name.is_some_and(|name| name.starts_with(&beginning) && name.ends_with(".mcap"))
        };
        let changed = |path: &PathBuf| {
            let changed = path.metadata().and_then(|file| file.modified());
            changed.unwrap_or(SystemTime::UNIX_EPOCH)
        };
        listed(Path::new("."))
            .into_iter()
            .filter(is_it)
            .max_by_key(changed)
    };
    let file = match &args.recording {
        Some(file) => file.clone(),
        None => newest().context("there is none here; --recording FILE names one")?,
    };
    // A recording of a day without an index takes long to read.
    let read = move || end_of_recording(&file);
    let latest = in_time(read, PATIENCE).context("it takes too long to read")??;
    Ok(match latest.is_cut {
        true => format!(
            "{{\"cut\":\"there was no room for two minutes\"}}\n{}",
            latest.text
        ),
        false => latest.text,
    })
}

/// The end of a recording, which may still grow or be cut off: then it is that of a copy of what is
/// whole.
fn end_of_recording(file: &Path) -> Result<Latest> {
    let of = |file: &Path| lager_recorder::latest(file, LAST_OF_RECORDING, MOST_OF_RECORDING);
    let is_small = file.metadata().is_ok_and(|file| file.len() <= MOST_TO_COPY);
    match of(file) {
        Err(_) if is_small => {
            let name = format!("lager-report-{}.mcap", std::process::id());
            let copy = env::temp_dir().join(name);
            let _ = fs::remove_file(&copy);
            let whole = lager_recorder::recover(file, Some(&copy), true, &mut io::sink());
            let latest = whole.and_then(|()| of(&copy));
            let _ = fs::remove_file(&copy);
            Ok(latest?)
        }
        read => Ok(read?),
    }
}

/// Runs `lager` with this configuration, in a process that may hang.
fn lager(config: &Config, args: &[&str], patience: Duration) -> Result<String> {
    let mut lager = Command::new(env::current_exe()?);
    lager.args(["--config", "-"]).args(args);
    // `doctor` fails when it finds something, which is what it is asked for.
    Ok(told(lager, Some(toml::to_string(config)?), patience)?.text)
}

/// What a process has said on both of its outputs.
struct Told {
    text: String,
    is_success: bool,
}

/// Runs a process until its end, or ends it after a while.
fn told(mut command: Command, input: Option<String>, patience: Duration) -> Result<Told> {
    let name = command.get_program().to_string_lossy().into_owned();
    let mut child = command
        .stdin(if input.is_some() {
            Stdio::piped()
        } else {
            Stdio::null()
        })
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("cannot start {name}"))?;
    if let (Some(mut to), Some(text)) = (child.stdin.take(), input) {
        // A process that does not read has its reasons, and says them.
        std::thread::spawn(move || to.write_all(text.as_bytes()));
    }
    let out = child.stdout.take().map(read);
    let err = child.stderr.take().map(read);
    let is_success = end(&mut child, patience)?;
    let text = |of: Option<Receiver<String>>| {
        // A process of its own may still hold the pipe.
        let of = of.and_then(|of| of.recv_timeout(Duration::from_secs(2)).ok());
        of.unwrap_or_default()
    };
    let (out, err) = (text(out), text(err));
    match is_success {
        Some(is_success) => Ok(Told {
            text: out + &err,
            is_success,
        }),
        None => bail!(
            "{name} did not end within {} s; it said: {out}{err}",
            patience.as_secs()
        ),
    }
}

/// Whether the child succeeds; `None` if it does not end in this time, and is ended.
fn end(child: &mut Child, patience: Duration) -> io::Result<Option<bool>> {
    let since = Instant::now();
    while since.elapsed() < patience {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status.success()));
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    child.kill()?;
    child.wait()?;
    Ok(None)
}

/// Reads what comes, in a thread; no more than of a log.
fn read(from: impl Read + Send + 'static) -> Receiver<String> {
    let (to, text) = mpsc::channel();
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        let mut from = from;
        let _ = from.by_ref().take(MOST_OF_LOG).read_to_end(&mut bytes);
        // It must not wait for a reader.
        let _ = io::copy(&mut from, &mut io::sink());
        let _ = to.send(String::from_utf8_lossy(&bytes).into_owned());
    });
    text
}

/// The result of `work`, if it comes in this time.
fn in_time<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
    patience: Duration,
) -> Option<T> {
    let (to, done) = mpsc::channel();
    std::thread::spawn(move || to.send(work()));
    done.recv_timeout(patience).ok()
}

/// The last `most` bytes of a regular file, from the beginning of a line.
fn end_of(path: &Path, most: u64) -> Result<String> {
    let fail = || format!("cannot read {}", path.display());
    // To open a pipe or a device may hang.
    if !fs::metadata(path).with_context(fail)?.is_file() {
        bail!("{} is no file", path.display());
    }
    let mut file = File::open(path).with_context(fail)?;
    let length = file.metadata().with_context(fail)?.len();
    let from = length.saturating_sub(most);
    file.seek(SeekFrom::Start(from)).with_context(fail)?;
    let mut bytes = Vec::new();
    file.take(most).read_to_end(&mut bytes).with_context(fail)?;
    let text = String::from_utf8_lossy(&bytes);
    Ok(match from {
        0 => text.into_owned(),
        _ => text
            .split_once('\n')
            .map_or_else(String::new, |(_, whole)| whole.to_owned()),
    })
}

/// What stands in a folder, by name; nothing if it cannot be read.
fn listed(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    paths
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(script: &str) -> Command {
        let mut shell = Command::new("sh");
        shell.args(["-c", script]);
        shell
    }

    #[test]
    fn a_process_that_hangs_is_ended_and_what_it_said_is_told() {
        let hangs = told(
            shell("echo begun; exec sleep 1000"),
            None,
            Duration::from_millis(300),
        );
        let why = hangs.err().expect("it hangs").to_string();
        assert!(
            why.contains("did not end") && why.contains("begun"),
            "{why}"
        );
        // More than a pipe holds, on both outputs.
        let much = "yes | head -c 300000; yes | head -c 300000 1>&2; cat; exit 3";
        let told = told(shell(much), Some("the end".into()), PATIENCE).expect("it ends");
        assert!(!told.is_success && told.text.contains("the end"));
        assert!(told.text.len() > 300_000);
    }

    #[test]
    fn of_a_long_file_the_end_is_taken_from_the_beginning_of_a_line() {
        let path = env::temp_dir().join(format!("lager-report-{}", std::process::id()));
        fs::write(&path, "one\ntwo\nthree\n").expect("a file");
        assert_eq!(end_of(&path, 100).expect("readable"), "one\ntwo\nthree\n");
        assert_eq!(end_of(&path, 8).expect("readable"), "three\n");
        fs::remove_file(&path).expect("a file");
        assert!(end_of(&path, 8).is_err());
        assert!(end_of(Path::new("/dev/zero"), 8).is_err());
    }
}
