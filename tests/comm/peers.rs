//! Tests with peers that were written from the document's grammar alone, in another language: a
//! stranger's GaG, robot and Robert (`peers.py`). The transcripts beside it have what they say and
//! must hear.

use std::fs::{self, File};
use std::io::Write;
use std::process::{Child, Command, Stdio};

use lager_tests::{Domain, Running, wait_for};

use crate::WAREHOUSE;
use crate::scene::Scene;

/// A process that plays a transcript.
struct Played {
    child: Child,
    folder: std::path::PathBuf,
}

impl Played {
    fn new(domain: &Domain, transcript: &str, flags: &[&str]) -> Self {
        let here = lager_tests::in_tree("tests/comm");
        let folder = domain.folder().to_owned();
        let output = |name: &str| File::create(folder.join(name)).expect("a file");
        let child = Command::new("python3")
            .arg(here.join("peers.py"))
            .arg(here.join(transcript))
            .args(flags)
            .stdin(Stdio::piped())
            .stdout(output("peers.out"))
            .stderr(output("peers.err"))
            .spawn()
            .expect("there is a python3; tests/run installs it");
        Self { child, folder }
    }

    /// A Robert, and the address to which a robot connects.
    fn robert(domain: &Domain, transcript: &str) -> (Self, String) {
        let played = Self::new(domain, transcript, &["--robert"]);
        let address = wait_for("it to listen", || {
            let said = played.said();
            let address = said.strip_prefix("listens at ")?.lines().next()?;
            said.contains('\n').then(|| address.to_owned())
        });
        (played, address)
    }

    fn begin(&mut self) {
        let to = self.child.stdin.as_mut().expect("a pipe");
        to.write_all(b"begin\n").expect("it waits for that");
    }

    fn said(&self) -> String {
        let read = |name| fs::read_to_string(self.folder.join(name)).unwrap_or_default();
        read("peers.out") + &read("peers.err")
    }

    fn ends_well(mut self) {
        let ended = wait_for("the transcript to be played", || {
            self.child.try_wait().expect("a child")
        });
        assert!(ended.success(), "{}", self.said());
        assert!(self.said().ends_with("the transcript is played\n"));
    }
}

impl Drop for Played {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        if std::thread::panicking() {
            eprintln!("{}", self.said());
        }
    }
}

#[test]
fn a_robot_and_a_gag_of_strangers_hold_a_whole_session_at_a_station() {
    let domain = Domain::among_others();
    let gag = domain.folder().join("gag");
    let gag = gag.to_str().expect("UTF-8");
    let file = domain.folder().join("warehouse.toml");
    fs::write(&file, WAREHOUSE).expect("a file");
    let warehouse = file.to_str().expect("UTF-8");
    let station = domain.start(&[
        "station",
        "--listen",
        "127.0.0.1:0",
        "--gag",
        gag,
        "--warehouse",
        warehouse,
        "--no-panel",
    ]);
    let address = listens_at(&station);
    Played::new(&domain, "station.txt", &["--robot", &address, "--gag", gag]).ends_well();
    // The warehouse that the GaG has described outlives the station.
    drop(station);
    let saved = fs::read_to_string(&file).expect("a file");
    assert!(saved.contains("side_length_cm = 45"), "{saved}");
    assert!(
        saved.contains("id = 7") && !saved.contains("id = 1"),
        "{saved}"
    );
}

fn listens_at(station: &Running) -> String {
    wait_for("the station", || {
        let said = station.output();
        let address = said.strip_prefix("robots connect to ")?.split(',').next()?;
        said.contains('\n').then(|| address.to_owned())
    })
}

#[test]
fn a_robert_of_strangers_drives_a_robot_by_hand() {
    let domain = Domain::among_others();
    let (mut robert, address) = Played::robert(&domain, "by_hand.txt");
    let mut scene = Scene::at(domain, &address);
    let before = scene.place();
    robert.begin();
    robert.ends_well();
    scene.wait_until_it_stands();
    let after = scene.place();
    let moved = (after.0 - before.0).hypot(after.1 - before.1);
    assert!(moved > 5.0, "it has moved by {moved} mm");
}

#[test]
fn a_robert_of_strangers_has_goods_fetched() {
    let domain = Domain::among_others();
    let file = domain.folder().join("warehouse.toml");
    fs::write(&file, WAREHOUSE).expect("a file");
    let warehouse = file.to_str().expect("UTF-8");
    let (mut robert, address) = Played::robert(&domain, "by_itself.txt");
    robert.begin();
    let up = domain.start(&[
        "up",
        "--headless",
        "--speed",
        "4",
        "--warehouse",
        warehouse,
        "--station",
        &address,
    ]);
    robert.ends_well();
    for product in [2, 3] {
        let told = format!("DELIVERED goods {product}");
        wait_for(&told, || up.output().contains(&told).then_some(()));
    }
    assert_eq!(up.output().matches("DELIVERED").count(), 2);
}
