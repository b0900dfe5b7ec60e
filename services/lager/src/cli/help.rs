//! The overview of the subcommands in `lager --help`, grouped by what one wants to do.
//!
//! clap lists them in one row; the groups are put in its place, with the sentences that the
//! subcommands have anyway.

use std::fmt::Write;

use clap::CommandFactory;

use super::Cli;

/// Every subcommand that people see, under the heading of its group.
const GROUPS: [(&str, &[&str]); 6] = [
    ("Run a robot", &["up", "simulate"]),
    (
        "Drive it and tell it what to do",
        &[
            "stop",
            "resume",
            "mode",
            "fetch",
            "cancel",
            "queue",
            "pick",
            "picked",
            "reset",
            "press",
            "place",
            "obstacle",
            "drive",
            "arm",
            "gains",
            "calibrate",
            "gag",
        ],
    ),
    ("Look at it", &["map", "top", "topic", "bag"]),
    ("Measure", &["bench"]),
    ("Set up and mend", &["doctor", "config", "completions"]),
    (
        "The services, as `up` or systemd starts them",
        &[
            "bridge",
            "logic",
            "comm",
            "simulator",
            "emulator",
            "station",
            "gateway",
        ],
    ),
];

/// The command line with its subcommands in groups.
pub fn command() -> clap::Command {
    let command = Cli::command();
    let template = format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n{}\nOptions:\n{{options}}{{after-help}}",
        overview(&command)
    );
    command.help_template(template)
}

fn overview(command: &clap::Command) -> String {
    let mut text = String::new();
    for (heading, names) in GROUPS {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "\n{heading}:");
        for name in names {
            let about = command
                .find_subcommand(name)
                .and_then(clap::Command::get_about);
            let about = about.map(ToString::to_string).unwrap_or_default();
            let _ = writeln!(text, "  {name:10} {about}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flag_of_up_stands_under_a_heading() {
        let mut command = Cli::command();
        // Puts the flags of all subcommands with its own.
        command.build();
        let up = command.find_subcommand("up").expect("a subcommand");
        let mut headings = std::collections::BTreeSet::new();
        for flag in up.get_arguments().filter(|flag| !flag.is_hide_set()) {
            let id = flag.get_id().as_str();
            match flag.get_help_heading() {
                Some(heading) => drop(headings.insert(heading)),
                None => assert_eq!(id, "help", "--{id} stands under no heading"),
            }
        }
        for heading in ["Robot", "Body", "Mission", "Output", "Real time", "Bus"] {
            assert!(headings.contains(heading), "{heading}: {headings:?}");
        }
    }

    #[test]
    fn every_subcommand_stands_in_one_group_with_its_sentence() {
        let command = Cli::command();
        let mut listed: Vec<&str> = GROUPS
            .iter()
            .flat_map(|(_, names)| *names)
            .copied()
            .collect();
        let mut existing: Vec<&str> = command
            .get_subcommands()
            .filter(|subcommand| !subcommand.is_hide_set())
            .map(clap::Command::get_name)
            .collect();
        listed.sort_unstable();
        existing.sort_unstable();
        assert_eq!(listed, existing);
        for line in overview(&command)
            .lines()
            .filter(|line| line.starts_with("  "))
        {
            assert!(line.len() > 20, "no sentence: {line}");
        }
    }
}
