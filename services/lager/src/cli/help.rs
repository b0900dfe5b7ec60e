//! The overview of the subcommands in `lager --help`, grouped by purpose.
//!
//! clap lists the subcommands in one row. This file replaces that list by groups, with the
//! sentences of the subcommands themselves.

use std::fmt::Write;

use clap::{CommandFactory, Subcommand as _};

use super::{Cli, Ordered};

/// Every subcommand that people see, under the heading of its group; the second group also has
/// each [`Ordered`].
const GROUPS: [(&str, &[&str]); 6] = [
    ("Run a robot", &["up", "simulate"]),
    (
        "Drive it and tell it what to do",
        &["stop", "resume", "drive", "gag"],
    ),
    ("Look at it", &["top", "topic", "bag"]),
    ("Measure", &["bench"]),
    (
        "Set up and mend",
        &[
            "commission",
            "doctor",
            "board",
            "report",
            "config",
            "keys",
            "completions",
            "manual",
        ],
    ),
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

/// The names of the subcommands of each group.
fn groups() -> impl Iterator<Item = (&'static str, Vec<String>)> {
    let ordered = Ordered::augment_subcommands(clap::Command::new("ordered"));
    GROUPS
        .iter()
        .enumerate()
        .map(move |(place, (heading, names))| {
            let mut names: Vec<String> = names.iter().map(ToString::to_string).collect();
            if place == 1 {
                names.extend(
                    ordered
                        .get_subcommands()
                        .map(|one| one.get_name().to_owned()),
                );
            }
            (*heading, names)
        })
}

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
    for (heading, names) in groups() {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "\n{heading}:");
        for name in names {
            let about = command
                .find_subcommand(&name)
                .and_then(clap::Command::get_about);
            let about = about.map(ToString::to_string).unwrap_or_default();
            let _ = writeln!(text, "  {name:10} {about}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

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
        let mut listed: Vec<String> = groups().flat_map(|(_, names)| names).collect();
        let mut existing: Vec<_> = command
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

    #[test]
    fn no_help_names_a_requirement() {
        let mut left = vec![Cli::command()];
        let mut seen = 0;
        while let Some(mut command) = left.pop() {
            let help = command.render_long_help().to_string();
            for bracketed in help.split('(').skip(1) {
                let (id, _) = bracketed.split_once([')', ',']).unwrap_or((bracketed, ""));
                let digits =
                    id.trim_start_matches(|sign: char| sign.is_ascii_uppercase() || sign == '-');
                let named = id.len() > digits.len() && digits.parse::<u8>().is_ok();
                assert!(
                    !named,
                    "({id}): tests/REQUIREMENTS.md is no reading of people: {help}"
                );
            }
            seen += 1;
            left.extend(command.get_subcommands().cloned());
        }
        assert!(seen > 30, "{seen}");
    }

    /// Each line that begins with `lager` in what people read first is one that the program takes.
    #[test]
    fn the_commands_of_the_readmes_are_understood() {
        let documents = [
            include_str!("../../../../README.md"),
            include_str!("../../../../bus/README.md"),
            include_str!("../../../../firmware/README.md"),
            include_str!("../../../gateway/README.md"),
            include_str!("../../README.md"),
            include_str!("../../../recorder/README.md"),
            include_str!("../../../station/README.md"),
        ];
        let mut read = 0;
        for line in documents.iter().flat_map(|text| text.lines()) {
            let (line, _comment) = line.split_once(" #").unwrap_or((line, ""));
            let Some(words) = line.strip_prefix("lager ") else {
                continue;
            };
            // The one value in quotation marks has a blank.
            let words = words.replace("\": ", "\":").replace('\'', "");
            let words = words.split_whitespace().filter(|word| *word != "&");
            let cli = Cli::try_parse_from(std::iter::once("lager").chain(words));
            assert!(cli.is_ok(), "{line}: {}", cli.expect_err("as it says"));
            read += 1;
        }
        assert!(read > 40, "{read}");
    }
}
