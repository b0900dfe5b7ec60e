//! The rules of the house, held by reading the workspace itself: which crate may use which, how
//! crates are named, how deep folders go, and that versions and lints live in one place.

mod imports;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// The floor table: a crate, and the crates of the house that it may use. A crate that is not
/// listed here is refused, so a new one has to find its floor first.
///
/// Services meet on the bus and never import each other; only `lager`, `benches` and `tests` see
/// several of them.
const MAY_USE: &[(&str, &[&str])] = &[
    // floor 0
    ("lager-wire", &[]),
    // An operator's commands and their codes are the wire's.
    ("lager-lines", &["lager-wire"]),
    ("lager-ax12", &[]),
    ("lager-exde", &[]),
    ("lager-plant", &["lager-ax12"]),
    ("lager-pty", &[]),
    // floor 1
    ("lager-control", &["lager-wire", "lager-ax12", "lager-exde"]),
    ("lager-topics", &["lager-wire"]),
    // floor 2
    ("lager-ports", &["lager-topics"]),
    // What a message is: a stamp and a payload, as the table describes them.
    ("lager-journal", &["lager-topics"]),
    // floor 3
    (
        "lager-bridge",
        &["lager-ports", "lager-topics", "lager-wire"],
    ),
    // The navigator speaks the wire's line states and command codes, which topics carry.
    (
        "lager-logic",
        &["lager-ports", "lager-topics", "lager-wire"],
    ),
    ("lager-monitor", &["lager-ports", "lager-topics"]),
    (
        "lager-gateway",
        &["lager-journal", "lager-ports", "lager-topics"],
    ),
    (
        "lager-recorder",
        &["lager-journal", "lager-ports", "lager-topics"],
    ),
    // The robot's side of the lines, between the network and the bus.
    (
        "lager-comm",
        &["lager-lines", "lager-ports", "lager-topics", "lager-wire"],
    ),
    // The external computer is on no bus. It shares the warehouse's file with the simulated world.
    (
        "lager-station",
        &["lager-lines", "lager-plant", "lager-wire"],
    ),
    // It shows the station in a browser, so it is on no bus either.
    ("lager-panel", &["lager-lines", "lager-station"]),
    (
        "lager-simulator",
        &[
            "lager-ports",
            "lager-topics",
            "lager-control",
            "lager-wire",
            "lager-ax12",
            "lager-exde",
            "lager-plant",
            "lager-pty",
        ],
    ),
    // What tests and benches stand on.
    ("lager-rig", &["lager-ports", "lager-topics", "lager-wire"]),
    // floor 4
    (
        "lager-benches",
        &[
            "lager-rig",
            "lager-wire",
            "lager-topics",
            "lager-ports",
            "lager-bridge",
            "lager-logic",
        ],
    ),
    // floor 5
    (
        "lager",
        &[
            "lager-lines",
            "lager-comm",
            "lager-station",
            "lager-panel",
            "lager-ports",
            "lager-topics",
            "lager-wire",
            "lager-plant",
            "lager-bridge",
            "lager-logic",
            "lager-gateway",
            "lager-monitor",
            "lager-recorder",
            "lager-simulator",
            "lager-benches",
        ],
    ),
    ("lager-tests", &["*"]),
];

/// The crates that may name iceoryx2's ports and services: the one that opens the robot's bus, and
/// the one that measures it beside bare iceoryx2.
const OPEN_ICEORYX2: &[&str] = &["lager-ports", "lager-benches"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("tests is below the root")
        .to_owned()
}

fn metadata() -> Value {
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--format-version",
            "1",
            "--no-deps",
            "--offline",
        ])
        .current_dir(root())
        .output()
        .expect("cargo runs");
    assert!(
        output.status.success(),
        "cargo metadata: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).expect("cargo metadata prints JSON")
}

fn packages(metadata: &Value) -> Vec<&Value> {
    metadata["packages"]
        .as_array()
        .expect("packages")
        .iter()
        .collect()
}

fn name(package: &Value) -> &str {
    package["name"].as_str().expect("a package has a name")
}

fn folder(package: &Value) -> PathBuf {
    let manifest = Path::new(package["manifest_path"].as_str().expect("a manifest"));
    manifest
        .parent()
        .expect("a folder")
        .strip_prefix(root())
        .expect("inside the root")
        .to_owned()
}

/// Every Rust file that git would see below `folder`.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a readable folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() && !path.ends_with("target") {
                folders.push(path);
            } else if path.extension().is_some_and(|end| end == "rs") {
                files.push(path);
            }
        }
    }
    files
}

#[test]
fn every_crate_keeps_to_its_floor() {
    let metadata = metadata();
    let house: BTreeSet<&str> = packages(&metadata).into_iter().map(name).collect();
    let table: BTreeMap<&str, &[&str]> = MAY_USE.iter().copied().collect();
    let mut complaints = Vec::new();
    for package in packages(&metadata) {
        let Some(allowed) = table.get(name(package)) else {
            complaints.push(format!("{} has no floor in MAY_USE", name(package)));
            continue;
        };
        for dependency in package["dependencies"].as_array().expect("dependencies") {
            let used = dependency["name"].as_str().expect("a name");
            // What only a crate's own tests use does not reach those who use the crate.
            let for_tests = dependency["kind"].as_str() == Some("dev");
            let permitted = allowed.contains(&"*") || allowed.contains(&used);
            if house.contains(used) && !permitted && !for_tests {
                complaints.push(format!("{} may not use {used}", name(package)));
            }
        }
    }
    for (listed, _) in MAY_USE {
        if !house.contains(listed) {
            complaints.push(format!("{listed} is in MAY_USE but not in the workspace"));
        }
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

#[test]
fn only_ports_and_its_baseline_open_iceoryx2() {
    for package in packages(&metadata()) {
        // Topics names the marker trait and the containers of shared memory, nothing that opens.
        if OPEN_ICEORYX2.contains(&name(package)) || name(package) == "lager-topics" {
            continue;
        }
        let uses = package["dependencies"]
            .as_array()
            .expect("dependencies")
            .iter()
            .any(|dependency| {
                dependency["kind"].as_str() != Some("dev")
                    && dependency["name"]
                        .as_str()
                        .is_some_and(|name| name.starts_with("iceoryx2"))
            });
        assert!(!uses, "{} uses iceoryx2 past lager-ports", name(package));
    }
    for file in rust_files(Path::new("bus/topics/src")) {
        let text = std::fs::read_to_string(&file).expect("a readable file");
        for port in [
            "NodeBuilder",
            "PortFactory",
            "iceoryx2::port",
            "ServiceName",
        ] {
            assert!(!text.contains(port), "{} names {port}", file.display());
        }
    }
}

#[test]
fn crates_are_named_after_their_folders_two_levels_deep() {
    for package in packages(&metadata()) {
        let folder = folder(package);
        let last = folder
            .file_name()
            .and_then(|name| name.to_str())
            .expect("a folder's name");
        let expected = if last == "lager" {
            "lager".to_owned()
        } else {
            format!("lager-{last}")
        };
        assert_eq!(name(package), expected, "in {}", folder.display());
        assert!(
            folder.components().count() <= 2,
            "{} is too deep",
            folder.display()
        );
        for vague in ["common", "utils", "util", "core", "misc", "helpers"] {
            assert_ne!(last, vague, "name a folder for what lives in it");
        }
    }
}

#[test]
fn no_modules_import_each_other_in_a_circle() {
    let mut found = BTreeSet::new();
    let mut crates: Vec<PathBuf> = packages(&metadata()).into_iter().map(folder).collect();
    // Workspaces of their own.
    crates.extend(["firmware/avr", "firmware/emulator"].map(PathBuf::from));
    for folder in &crates {
        let source = root().join(folder).join("src");
        if source.is_dir() {
            let files = rust_files(&folder.join("src"));
            let circles = imports::Crate::read(&source, files).circles();
            let name = folder.display().to_string();
            found.extend(circles.into_iter().map(|circle| (name.clone(), circle)));
        }
    }
    assert!(
        found.is_empty(),
        "move what both need down, or the wiring up: {found:#?}"
    );
}

#[test]
fn versions_and_lints_live_in_the_workspace() {
    for package in packages(&metadata()) {
        let manifest = package["manifest_path"].as_str().expect("a manifest");
        let text = std::fs::read_to_string(manifest).expect("a readable manifest");
        assert!(
            text.contains("[lints]\nworkspace = true"),
            "{manifest} does not take the workspace's lints"
        );
        for line in text.lines() {
            let versioned = line.contains("version = \"") || line.contains("path = \"../");
            assert!(
                !versioned,
                "{manifest}: `{line}`: name versions and paths in [workspace.dependencies]"
            );
        }
    }
}

#[test]
fn every_file_opens_with_what_it_is() {
    for folder in ["bus", "services", "firmware", "benches", "tests"] {
        for file in rust_files(Path::new(folder)) {
            let text = std::fs::read_to_string(&file).expect("a readable file");
            assert!(
                text.starts_with("//!") || text.starts_with("#!["),
                "{} does not open with `//!`",
                file.display()
            );
            for mark in ["TODO", "FIXME", "XXX", "todo!(", "unimplemented!("] {
                let own = file.ends_with("tests/tidy/main.rs");
                assert!(own || !text.contains(mark), "{}: {mark}", file.display());
            }
        }
    }
}

#[test]
fn the_documents_are_finished_and_name_files_that_exist() {
    for document in ["README.md", "ARCHITECTURE.md"] {
        let text = std::fs::read_to_string(root().join(document)).expect("a document");
        for mark in ["TODO", "FIXME", "UP_SAMPLE", "MEASURED", "TBD"] {
            assert!(!text.contains(mark), "{document}: {mark}");
        }
        // Whatever stands in backticks and looks like a path of ours is one.
        for quoted in text.split('`').skip(1).step_by(2) {
            let ours = ["bus/", "services/", "firmware/", "tests/", "benches/"]
                .iter()
                .any(|top| quoted.starts_with(top));
            if ours && !quoted.contains(char::is_whitespace) {
                assert!(
                    root().join(quoted).exists(),
                    "{document}: there is no {quoted}"
                );
            }
        }
    }
}

#[test]
fn the_readme_shows_lines_of_the_examples() {
    let readme = std::fs::read_to_string(root().join("README.md")).expect("the README");
    let examples: BTreeSet<String> = rust_files(&root().join("bus/ports/examples"))
        .iter()
        .flat_map(|file| {
            let text = std::fs::read_to_string(file).expect("an example");
            let lines: Vec<_> = text.lines().map(|line| line.trim().to_owned()).collect();
            lines
        })
        .collect();
    let mut shown = 0;
    for block in readme.split("```rust\n").skip(1) {
        let (block, _) = block.split_once("```").expect("the block's end");
        for line in block.lines().map(str::trim) {
            let says = line.starts_with("//") && !line.starts_with("///");
            assert!(says || examples.contains(line), "README shows {line:?}");
            shown += 1;
        }
    }
    assert!(shown > 0, "the README shows no example");
}

#[test]
fn the_lower_floors_forbid_unsafe_code() {
    for folder in [
        "bus/wire",
        "bus/lines",
        "bus/journal",
        "firmware/control",
        "firmware/ax12",
        "firmware/exde",
        "firmware/plant",
    ] {
        let lib = root().join(folder).join("src/lib.rs");
        let text = std::fs::read_to_string(&lib).expect("a readable file");
        assert!(
            text.contains("#![forbid(unsafe_code)]"),
            "{} does not forbid unsafe code",
            lib.display()
        );
    }
}
