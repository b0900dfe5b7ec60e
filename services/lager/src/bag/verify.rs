//! `lager bag play --verify`: connects recorder and navigator, and writes sentences for people.
//! Only this file knows both.

use std::path::Path;
use std::process::ExitCode;

use anyhow::Result;
use lager_logic::{Replay, ReplayError, Replayed};
use lager_recorder::{
    Did, Difference, Gap, OfTopic, Rerun, Verified, VerifyError, Why, verify as verify_file,
};
use lager_supervisor::console;
use lager_topics::{Beside, NavigatorInput, NavigatorInputKind};
use lager_wire::Command;
use serde_json::{Value, json};

use crate::exit;

/// The navigator of this build, as the recorder sees it.
struct Again {
    changes: Vec<(String, String)>,
    replay: Option<Replay>,
    /// The kind of processor on which the recorded navigator ran.
    processor: String,
    /// The navigator refused a change, which is the user's fault.
    is_usage: bool,
}

impl Rerun for Again {
    fn begin(&mut self, text: &[u8]) -> Result<(), String> {
        let begun = Replay::begin(text, &self.changes);
        let replay = begun.map_err(|error| {
            self.is_usage = matches!(error, ReplayError::Constant { .. });
            error.to_string()
        })?;
        replay.processor().clone_into(&mut self.processor);
        self.replay = Some(replay);
        Ok(())
    }

    fn take_map(&mut self, text: &[u8]) -> Result<(), String> {
        self.begun()?
            .take_map(text)
            .map_err(|error| error.to_string())
    }

    fn handle(&mut self, entry: &NavigatorInput, beside: Beside<'_>) -> Result<Did, String> {
        let answer = self.begun()?.handle(entry, beside);
        let Replayed {
            entry,
            command,
            status,
            events,
        } = answer.map_err(|error| error.to_string())?;
        Ok(Did {
            entry,
            command,
            status,
            events: events.to_vec(),
        })
    }
}

impl Again {
    fn begun(&mut self) -> Result<&mut Replay, String> {
        self.replay
            .as_mut()
            .ok_or_else(|| "an input comes before its navigator".to_owned())
    }
}

/// Verifies `file` with other values for the constants in `changes`, and prints the result.
pub fn verify(file: &Path, changes: Vec<(String, String)>, as_json: bool) -> Result<ExitCode> {
    let mut again = Again {
        changes,
        replay: None,
        processor: String::new(),
        is_usage: false,
    };
    let verified = verify_file(file, &mut again).map_err(|error| match error {
        VerifyError::Bag(error) => super::refused(error),
        VerifyError::Rerun(why) if again.is_usage => exit::Usage(why).into(),
        other => anyhow::anyhow!("{}: {other}", file.display()),
    })?;
    if as_json {
        console::print(&to_json(file, &verified, &again.processor).to_string())?;
    } else {
        for line in lines(&verified, &again.processor) {
            console::print(&format!("{}: {line}", file.display()))?;
        }
    }
    match verified.is_identical() {
        true => Ok(ExitCode::SUCCESS),
        false => Ok(exit::FAILED),
    }
}

/// The result for people.
fn lines(verified: &Verified, processor: &str) -> Vec<String> {
    let mut lines = Vec::new();
    let Verified {
        navigators,
        inputs,
        compared,
        ..
    } = verified;
    let again = match navigators {
        1 => format!("a navigator was told its {inputs} inputs again"),
        _ => format!("{navigators} navigators were told their {inputs} inputs again"),
    };
    match (&verified.first, navigators) {
        (None, 0) => lines.push("nothing in it can be verified".to_owned()),
        (None, _) if verified.gaps.is_empty() => lines.push(format!("identical: {again}")),
        (None, _) => lines.push(format!("identical as far as it can be verified: {again}")),
        (Some(first), _) => {
            let command = verified.first_command.as_ref();
            lines.extend(differs(first, command, processor));
        }
    }
    if *navigators > 0 && verified.first.is_none() {
        lines.push(format!(
            "compared byte by byte: {}, {}, {}",
            of_topic(compared.commands, "commands"),
            of_topic(compared.statuses, "statuses"),
            of_topic(compared.events, "events")
        ));
    }
    lines.extend(verified.gaps.iter().map(gap));
    let unexplained = [compared.commands, compared.statuses, compared.events];
    let unexplained: u64 = unexplained.iter().map(|of| of.unexplained).sum();
    if unexplained > 0 && verified.first.is_none() {
        lines.push(format!(
            "not compared: {unexplained} samples of navigators that follow from no input in the \
             recording: the last ones before a kill or the recording's end, or where inputs are \
             missing"
        ));
    }
    lines
}

fn of_topic(of: OfTopic, name: &str) -> String {
    format!("{} of {} {name}", of.same, of.sent)
}

fn gap(gap: &Gap) -> String {
    let at = seconds(gap.at_ns);
    let inputs = gap.inputs;
    match gap.why {
        Why::BegunBefore => format!(
            "not verified: {inputs} inputs from the begin on. The navigator had begun before the \
             recording, and only at its begin is all told that it knows: start `lager bag record \
             --wait` before `lager up`"
        ),
        Why::Missing(samples) => format!(
            "not verified: {inputs} inputs from {at} s on, since {samples} samples of nav/inputs are \
             missing there; what follows is verified from where the next navigator begins"
        ),
        Why::Unpublished => format!(
            "not verified: {inputs} inputs from {at} s on, since logic could not publish all of \
             nav/inputs; what follows is verified from where the next navigator begins"
        ),
    }
}

fn differs(first: &Difference, command: Option<&Difference>, processor: &str) -> Vec<String> {
    let mut lines = Vec::new();
    match command {
        Some(differs) => {
            let (expected, got) = commands(differs);
            lines.push(format!(
                "the first command that differs is at {}: expected {expected}, got {got}",
                place(differs)
            ));
        }
        None => lines.push("it differs, though no command does".to_owned()),
    }
    if command != Some(first) {
        lines.push(match &first.sample {
            Some(sample) => format!(
                "the first difference is in {} {} at {}: expected {}, got {}",
                sample.topic,
                sample.number,
                place(first),
                sample.recorded,
                sample.now
            ),
            None => format!(
                "the first difference is in the status, an event, a thought, the route, the blocked \
                 ways or the queue after {}",
                place(first)
            ),
        });
    }
    if processor != std::env::consts::ARCH {
        lines.push(format!(
            "it was recorded on {processor}, and this is {}: fractions need not be rounded alike, so \
             verify it on the same kind of processor",
            std::env::consts::ARCH
        ));
    }
    lines
}

/// Both orders, as people read them.
fn commands(difference: &Difference) -> (String, String) {
    match &difference.sample {
        Some(sample) => (sample.recorded.clone(), sample.now.clone()),
        None => (order(&difference.recorded), order(&difference.now)),
    }
}

fn order(entry: &NavigatorInput) -> String {
    let granted = match entry.arm_granted {
        0 => "",
        _ => ", with the arm left to the operator",
    };
    match Command::from_code(entry.code) {
        Some(command) => format!("order {}, {command:?}{granted}", entry.command_id),
        None if entry.code == 0 => "no order".to_owned(),
        None => format!("order {}, code {}", entry.command_id, entry.code),
    }
}

fn place(difference: &Difference) -> String {
    let entry = &difference.recorded;
    let kind = entry.kind.get().unwrap_or(NavigatorInputKind::None);
    format!(
        "{} s (input {}, {kind:?}, at {} s of robot time)",
        seconds(difference.at_ns),
        difference.number,
        seconds(entry.time_ns)
    )
}

fn seconds(ns: u64) -> String {
    format!("{}.{:03}", ns / 1_000_000_000, ns / 1_000_000 % 1_000)
}

fn to_json(file: &Path, verified: &Verified, processor: &str) -> Value {
    let of_topic =
        |of: OfTopic| json!({"sent": of.sent, "same": of.same, "unexplained": of.unexplained});
    let gaps = verified.gaps.iter().map(|gap| {
        let (why, samples) = match gap.why {
            Why::BegunBefore => ("begun before", None),
            Why::Missing(samples) => ("missing", Some(samples)),
            Why::Unpublished => ("unpublished", None),
        };
        json!({"at_ns": gap.at_ns, "why": why, "samples": samples, "inputs": gap.inputs})
    });
    let gaps: Vec<Value> = gaps.collect();
    let difference = |difference: &Option<Difference>| {
        difference.as_ref().map(|difference| {
            let (expected, got) = commands(difference);
            json!({
                "at_ns": difference.at_ns, "input": difference.number,
                "robot_time_ns": difference.recorded.time_ns,
                "recorded": difference.recorded, "now": difference.now,
                "topic": difference.sample.as_ref().map(|sample| sample.topic),
                "expected": expected, "got": got,
            })
        })
    };
    json!({
        "file": file.display().to_string(), "identical": verified.is_identical(),
        "processor": processor, "navigators": verified.navigators, "inputs": verified.inputs,
        "commands": of_topic(verified.compared.commands),
        "statuses": of_topic(verified.compared.statuses),
        "events": of_topic(verified.compared.events),
        "gaps": gaps, "first": difference(&verified.first),
        "first_command": difference(&verified.first_command),
    })
}
