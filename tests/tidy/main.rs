//! Tests of the workspace's own rules, by reading it: which crate may use which, the names of
//! crates, the depth of folders, and that versions and lints are declared in one place.

mod floors;
mod imports;
mod licences;
mod requirements;
mod traps;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use floors::{MARKER, MAY_USE, OPEN_ICEORYX2};
use serde_json::Value;

fn root() -> PathBuf {
    lager_tests::in_tree("")
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

/// Every Rust file below `folder` that git would see.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    files(folder, &["rs"])
}

/// Every file below `folder` that git would see and whose name ends so.
fn files(folder: &Path, ends: &[&str]) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a readable folder") {
            let path = entry.expect("an entry").path();
            let is_made = ["target", "node_modules"]
                .iter()
                .any(|made| path.ends_with(made));
            if path.is_dir() && !is_made {
                folders.push(path);
            } else if path
                .extension()
                .is_some_and(|end| ends.iter().any(|one| end == *one))
            {
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
            // What only a crate's tests use does not reach the crate's users.
            let for_tests = dependency["kind"].as_str() == Some("dev");
            // Cargo builds the program only with `lager`'s own tests; others would start an old
            // one.
            let for_tests = for_tests && (used != "lager-tests" || name(package) == "lager");
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
fn the_program_that_tests_start_is_the_one_that_cargo_built_with_them() {
    assert_eq!(lager_tests::lager(), Path::new(env!("CARGO_BIN_EXE_lager")));
}

#[test]
fn the_map_has_every_crate_below_those_that_it_uses() {
    let map = document("ARCHITECTURE.md");
    let rows = map.lines().filter_map(|line| line.strip_prefix("| "));
    let order: Vec<&str> = rows
        .filter_map(|row| row.split('|').nth(1))
        .flat_map(|folders| folders.split('`').skip(1).step_by(2))
        .collect();
    let metadata = metadata();
    let house: BTreeMap<&str, String> = packages(&metadata)
        .into_iter()
        .map(|package| (name(package), folder(package).display().to_string()))
        .collect();
    let at = |folder: &str| order.iter().position(|row| *row == folder);
    let mut complaints = Vec::new();
    for package in packages(&metadata) {
        let folder = &house[name(package)];
        let Some(row) = at(folder) else {
            complaints.push(format!("ARCHITECTURE.md's table has no row for {folder}"));
            continue;
        };
        for dependency in package["dependencies"].as_array().expect("dependencies") {
            let used = house.get(dependency["name"].as_str().expect("a name"));
            let for_tests = dependency["kind"].as_str() == Some("dev");
            if let Some(used) = used.filter(|_| !for_tests)
                && at(used).is_some_and(|below| below > row)
            {
                complaints.push(format!("{folder} uses {used}, which stands below it"));
            }
        }
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

#[test]
fn only_ports_and_its_baseline_open_iceoryx2() {
    for package in packages(&metadata()) {
        if OPEN_ICEORYX2.contains(&name(package)) {
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
                        .is_some_and(|name| name.starts_with("iceoryx2") && name != MARKER)
            });
        assert!(!uses, "{} uses iceoryx2 past lager-ports", name(package));
    }
}

#[test]
fn what_shows_the_robot_outside_has_nothing_that_writes_to_the_bus() {
    // What they read is a `Place`, which has no writers; only a `Bus` has, and the stop word.
    const WRITES: [&str; 3] = ["Bus::", "Bus,", "StopWord::set"];
    let writes = |folder: &Path| -> Vec<String> {
        let mut found = Vec::new();
        for file in rust_files(folder) {
            let text = std::fs::read_to_string(&file).expect("a source");
            let words = WRITES.iter().filter(|word| text.contains(**word));
            found.extend(words.map(|word| format!("{}: {word}", file.display())));
        }
        found
    };
    let mut complaints = writes(Path::new("services/gateway/src"));
    complaints.extend(writes(Path::new("services/remote/src")));
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
    let writer = root().join("services/logic/src");
    assert!(
        !writes(&writer).is_empty(),
        "logic has a bus, and not by any of these words"
    );
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
    // These are workspaces of their own.
    crates.extend(["firmware/avr", "firmware/emulator", "services/ros2"].map(PathBuf::from));
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
            let versioned = line.contains("version = \"") || line.contains("{ path = ");
            assert!(
                !versioned,
                "{manifest}: `{line}`: name versions and paths in [workspace.dependencies]"
            );
        }
    }
}

#[test]
fn every_file_opens_with_what_it_is_and_is_short() {
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
            let lines = text.lines().count();
            assert!(lines <= 600, "{} has {lines} lines", file.display());
        }
    }
}

/// The documents for people, as paths from the root.
const DOCUMENTS: &[&str] = &[
    "README.md",
    "ARCHITECTURE.md",
    "bus/README.md",
    "services/gateway/README.md",
    "services/lager/README.md",
    "services/lager/RASPBERRY-PI.md",
    "services/recorder/README.md",
    "services/remote/README.md",
    "services/ros2/README.md",
    "services/station/README.md",
    "firmware/README.md",
    "firmware/WIRING.md",
    "firmware/avr/README.md",
    "firmware/emulator/README.md",
    "benches/README.md",
    "benches/RESULTS.md",
];

fn document(name: &str) -> String {
    std::fs::read_to_string(root().join(name)).expect("a document")
}

#[test]
fn the_documents_are_finished_and_name_files_that_exist() {
    for name in DOCUMENTS {
        let text = document(name);
        for mark in ["TODO", "FIXME", "UP_SAMPLE", "MEASURED", "TBD"] {
            assert!(!text.contains(mark), "{name}: {mark}");
        }
        // Text in backticks that looks like a path of this project must be one.
        for quoted in text.split('`').skip(1).step_by(2) {
            let ours = ["bus/", "services/", "firmware/", "tests/", "benches/"]
                .iter()
                .any(|top| quoted.starts_with(top));
            // A build has to make it first.
            let is_made = quoted.contains("/target/");
            let is_path = ours && !is_made && !quoted.contains(char::is_whitespace);
            let (path, _test) = quoted.split_once("::").unwrap_or((quoted, ""));
            assert!(
                !is_path || root().join(path).exists(),
                "{name}: there is no {quoted}"
            );
        }
        // A link starts in the document's own folder.
        let folder = root().join(name).parent().expect("a folder").to_owned();
        for link in text.split("](").skip(1) {
            let (link, _) = link.split_once(')').expect("the link's end");
            let elsewhere = link.starts_with("http") || folder.join(link).exists();
            assert!(elsewhere, "{name}: there is no {link}");
        }
    }
}

#[test]
fn the_readme_and_the_map_are_short() {
    for (name, most) in [("README.md", 228), ("ARCHITECTURE.md", 150)] {
        let lines = document(name).lines().count();
        assert!(lines <= most, "{name} has {lines} lines, more than {most}");
    }
}

#[test]
fn the_readmes_show_lines_of_the_examples() {
    let examples: BTreeSet<String> = rust_files(&root().join("bus/ports/examples"))
        .iter()
        .flat_map(|file| {
            let text = std::fs::read_to_string(file).expect("an example");
            let lines: Vec<_> = text.lines().map(|line| line.trim().to_owned()).collect();
            lines
        })
        .collect();
    for name in ["README.md", "bus/README.md"] {
        let mut shown = 0;
        for block in document(name).split("```rust\n").skip(1) {
            let (block, _) = block.split_once("```").expect("the block's end");
            for line in block.lines().map(str::trim) {
                let says = line.starts_with("//") && !line.starts_with("///");
                assert!(says || examples.contains(line), "{name} shows {line:?}");
                shown += 1;
            }
        }
        assert!(shown > 0, "{name} shows no example");
    }
}

#[test]
fn the_lower_floors_forbid_unsafe_code() {
    for folder in [
        "bus/wire",
        "bus/floor",
        "bus/orders",
        "bus/lines",
        "bus/journal",
        "firmware/control",
        "firmware/ax12",
        "firmware/exde",
        "firmware/loader",
        "firmware/pins",
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
