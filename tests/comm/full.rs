//! Tests a station whose disk is full: it still answers, says that nothing is saved, keeps the file
//! as it was, and saves when there is room again. Its history does the same.

use std::fs;
use std::io::{BufReader, Write as _};
use std::net::TcpStream;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use lager_tests::{Domain, lager, wait_for};

use crate::WAREHOUSE;
use crate::scene::{Peer, WATCHDOG};

/// A process that is killed when the test ends.
struct Ends(Child);

impl Drop for Ends {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn a_station_on_a_full_disk_goes_on_and_saves_when_there_is_room() {
    let domain = Domain::among_others();
    let here = domain.folder();
    fs::write(here.join("warehouse.toml"), WAREHOUSE).expect("a file");
    fs::create_dir(here.join("disk")).expect("a folder");
    // A separate disk. A large file fills it, except for the room of the warehouse's file.
    let script = "mount -t tmpfs -o size=64k none disk && cp warehouse.toml disk/ || exit 99; \
                  cat /dev/zero >disk/in-the-way 2>/dev/null; exec \"$@\"";
    let out = |name: &str| fs::File::create(here.join(name)).expect("a file");
    let station = Command::new("unshare")
        .args(["--map-root-user", "--mount", "sh", "-c", script, "sh"])
        .arg(lager())
        .args(["station", "--listen", "127.0.0.1:0", "--gag", "gag"])
        .args(["--warehouse", "disk/warehouse.toml", "--no-panel"])
        .current_dir(here)
        .stdin(Stdio::null())
        .stdout(out("out"))
        .stderr(out("err"))
        .spawn()
        .expect("`unshare` is there");
    let mut station = Ends(station);
    let said = |name: &str| fs::read_to_string(here.join(name)).expect("a file");
    let address = wait_for("the station", || {
        let ended = station.0.try_wait().expect("a child");
        assert!(ended.is_none(), "{ended:?}: {}", said("err"));
        let said = said("out");
        let address = said.strip_prefix("robots connect to ")?.split(',').next()?;
        said.contains('\n').then(|| address.to_owned())
    });
    // GaG first: without one the station would answer the robot from its file.
    let gag = UnixStream::connect(here.join("gag")).expect("it listens");
    let robot = TcpStream::connect(&address).expect("it listens");
    robot.set_read_timeout(Some(WATCHDOG)).expect("a socket");
    gag.set_read_timeout(Some(WATCHDOG)).expect("a socket");
    let (mut robot, mut gag) = (Peer(BufReader::new(robot)), Peer(BufReader::new(gag)));
    let mut describes = |answer: &str| {
        let question = answer.split(' ').next().expect("a word");
        robot.says(question);
        assert_eq!(gag.waits_for(&[question]), question);
        gag.says(answer);
        assert_eq!(robot.waits_for(&[question]), answer);
    };
    // The station uses a warehouse when it has heard all parts of it.
    for answer in ["karta 2 2 0 0", "prodlis 1 7 0 0 left", "sidelength 45"] {
        describes(answer);
    }
    let told = wait_for("it to say that nothing is saved", || {
        let told = said("err");
        told.contains("No space left").then_some(told)
    });
    assert!(told.contains("disk/warehouse.toml"), "{told}");
    // The disk by its path in that process, which alone can see it.
    let disk = format!(
        "/proc/{}/root{}",
        station.0.id(),
        here.join("disk").display()
    );
    let disk = Path::new(&disk);
    let saved = || fs::read_to_string(disk.join("warehouse.toml")).expect("a file");
    assert_eq!(saved(), WAREHOUSE);
    // The same disk takes no history, which harms nothing and is said once.
    let mut other = TcpStream::connect(&address).expect("it listens");
    other.write_all(b"lager 1 r2\n").expect("it hears");
    let no_history = || said("err").matches("no history is kept in").count();
    wait_for("it to say that no history is kept", || {
        other.write_all(b"thought hej\n").expect("it hears");
        (no_history() > 0).then_some(())
    });

    fs::remove_file(disk.join("in-the-way")).expect("a file");
    wait_for("the warehouse to be saved", || {
        saved().contains("side_length_cm = 45").then_some(())
    });
    describes("sidelength 46");
    wait_for("the next one to be saved", || {
        saved().contains("side_length_cm = 46").then_some(())
    });
    // The station tries again by itself.
    let kept = || {
        other.write_all(b"thought it goes on\n").expect("it hears");
        let parts = fs::read_dir(disk.join("warehouse.toml.history")).ok()?;
        let mut texts = parts
            .flatten()
            .filter_map(|part| fs::read_to_string(part.path()).ok());
        texts
            .find(|text| text.contains("thought it goes on\n"))
            .map(drop)
    };
    wait_for("the history to go on", kept);
    assert_eq!(no_history(), 1, "{}", said("err"));
    let left = fs::read_dir(disk).expect("a folder").flatten();
    let left: Vec<_> = left.map(|entry| entry.file_name()).collect();
    let history = |name: &std::ffi::OsString| name.to_string_lossy().contains(".history");
    assert!(
        left.iter().filter(|name| !history(name)).count() <= 2,
        "{left:?}"
    );
}
