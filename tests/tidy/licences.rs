//! Test of the licences of all crates that the program is made of.

use std::process::Command;

use serde_json::Value;

use crate::root;

/// What may be linked into a program under MIT or Apache-2.0. Two of them ask for something: whoever
/// changes a file under MPL-2.0 publishes that file, and we change none; data under
/// CDLA-Permissive-2.0 is passed on with that text.
const ALLOWED: [&str; 12] = [
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "CDLA-Permissive-2.0",
    "ISC",
    "MIT",
    "MPL-2.0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// Whether one may choose allowed licences only, of an expression such as `(MIT OR EPL-2.0) AND ISC`.
fn is_allowed(expression: &str) -> bool {
    // Alternatives stand in parentheses where all of several parts are asked for.
    let mut parts = vec![String::new()];
    let mut depth = 0;
    for word in expression
        .replace('(', " ( ")
        .replace(')', " ) ")
        .split_whitespace()
    {
        match word {
            "(" => depth += 1,
            ")" => depth -= 1,
            "AND" if depth == 0 => parts.push(String::new()),
            word => {
                let part = parts.last_mut().expect("one at least");
                *part = format!("{part} {word}");
            }
        }
    }
    parts.iter().all(|part| {
        let part = part.replace(" or ", " OR ").replace('/', " OR ");
        let mut choices = part.split(" OR ");
        choices.any(|choice| ALLOWED.contains(&choice.trim()))
    })
}

#[test]
fn every_crate_may_be_linked_with_ours() {
    for (expression, expected) in [
        ("MIT OR Apache-2.0", true),
        ("MIT/Apache-2.0", true),
        (" EPL-2.0 OR Apache-2.0", true),
        ("(MIT OR Apache-2.0) AND Unicode-3.0", true),
        ("Apache-2.0 WITH LLVM-exception OR MIT", true),
        ("MIT AND GPL-3.0", false),
        ("EPL-2.0", false),
        ("", false),
    ] {
        assert_eq!(is_allowed(expression), expected, "{expression}");
    }
    all_are_allowed("", &["--features", "lager/foxglove,lager/zenoh"], "zenoh");
}

#[test]
fn every_crate_of_the_ros2_gateway_may_be_linked_with_ours() {
    all_are_allowed("services/ros2", &[], "rustdds");
}

/// Looks at the workspace in that folder, with these flags; `must_have` is a crate of it.
fn all_are_allowed(workspace: &str, flags: &[&str], must_have: &str) {
    let target = format!("{}-unknown-linux-gnu", std::env::consts::ARCH);
    let folder = root().join(workspace);
    let cargo = |command: &str, more: &[&str]| {
        Command::new(env!("CARGO"))
            .arg(command)
            .args(more)
            .current_dir(&folder)
            .output()
            .expect("cargo runs")
    };
    // Only what this machine builds has been downloaded.
    let platform = ["--filter-platform", &target];
    let told = ["--format-version", "1", "--offline", "--locked"];
    let more = [&told, &platform[..], flags].concat();
    let mut output = cargo("metadata", &more);
    if !output.status.success() {
        // A workspace that nothing else has built on this machine.
        cargo("fetch", &["--locked", "--target", &target]);
        output = cargo("metadata", &more);
    }
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "cargo metadata: {said}");
    let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let packages = told["packages"].as_array().expect("packages");
    assert!(packages.iter().any(|package| package["name"] == must_have));
    let refused: Vec<String> = packages
        .iter()
        .map(|package| {
            (
                &package["name"],
                package["license"].as_str().unwrap_or_default(),
            )
        })
        .filter(|(_, licence)| !is_allowed(licence))
        .map(|(name, licence)| format!("{name}: {licence}"))
        .collect();
    assert!(refused.is_empty(), "{}", refused.join("\n"));
}
