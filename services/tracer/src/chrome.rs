//! Late frames with the kernel's events around them, in the format of Chrome's traces, which
//! Perfetto's page (ui.perfetto.dev) opens.
//!
//! There are three groups of tracks: what each core ran and its interrupts, the stages of each late
//! frame, and whom it waited for.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::event::{Event, What};
use crate::frame::{Frame, Staged};
use crate::report::Report;
use crate::timeline::Timeline;
use crate::walk::Piece;

/// A late frame to draw.
#[derive(Debug)]
pub(crate) struct Picture {
    pub(crate) frame: Frame,
    pub(crate) took_ns: u64,
    pub(crate) events: Vec<Event>,
    pub(crate) pieces: Vec<Staged>,
}

const CORES: u32 = 1;
const FRAMES: u32 = 2;
const WAY: u32 = 3;

/// The text of the file. `says` names a piece.
pub(crate) fn draw(
    line: &Timeline,
    pictures: &[Picture],
    report: &Report,
    says: impl Fn(&Piece) -> String,
) -> String {
    let mut all = Vec::new();
    for (group, name) in [
        (CORES, "cores"),
        (FRAMES, "late frames"),
        (WAY, "their way"),
    ] {
        all.push(json!({"ph": "M", "pid": group, "name": "process_name", "args": {"name": name}}));
    }
    let mut events: Vec<Event> = Vec::new();
    for picture in pictures {
        let frame = &picture.frame;
        let verdict = report
            .late
            .iter()
            .find(|late| late.number == frame.number && late.start_ns == frame.start_ns);
        let verdict = verdict.map_or(Value::Null, |verdict| json!(verdict));
        let name = format!("frame {}", frame.number);
        let start = frame.start_ns;
        all.push(slice(
            FRAMES,
            0,
            &name,
            start,
            start + picture.took_ns,
            &verdict,
        ));
        let mut from = start;
        for mark in &frame.marks {
            all.push(slice(FRAMES, 0, mark.stage, from, mark.at_ns, &Value::Null));
            from = mark.at_ns.max(from);
        }
        for staged in &picture.pieces {
            let piece = &staged.piece;
            let who = json!({"thread": line.name(piece.thread), "core": piece.core});
            all.push(slice(
                WAY,
                0,
                &says(piece),
                piece.from_ns,
                piece.to_ns,
                &who,
            ));
        }
        events.extend(&picture.events);
    }
    // Frames that follow each other have the same events around them.
    events.sort_by_key(|event| (event.core, event.at_ns));
    events.dedup();
    all.extend(cores(line, &events));
    json!({"traceEvents": all, "displayTimeUnit": "ns"}).to_string()
}

/// What the cores did.
fn cores(line: &Timeline, events: &[Event]) -> Vec<Value> {
    let mut all = Vec::new();
    // Since when each core has run its thread, and its interrupts.
    let mut since: BTreeMap<usize, u64> = BTreeMap::new();
    let mut begun: BTreeMap<usize, Vec<(u64, String)>> = BTreeMap::new();
    for event in events {
        let (core, at) = (event.core, event.at_ns);
        let track = core as u32;
        let begun = begun.entry(core).or_default();
        match event.what {
            What::Switch { .. } => {
                let from = since
                    .insert(core, at)
                    .filter(|from| at - from < 1_000_000_000);
                if let Some(from) = from.filter(|_| event.thread != 0) {
                    let name = line.name(event.thread);
                    let who = json!({"thread": event.thread});
                    all.push(slice(CORES, track, &name, from, at, &who));
                }
                begun.clear();
            }
            What::Enter(source) => begun.push((at, line.source(source))),
            What::Exit(_) => {
                if let Some((from, name)) = begun.pop() {
                    all.push(slice(CORES, track, &name, from, at, &Value::Null));
                }
            }
            What::Fault => all.push(instant(track, "page fault", at)),
            What::Waking(thread) => {
                all.push(instant(track, &format!("wakes {}", line.name(thread)), at));
            }
            What::Idle(Some(state)) => {
                all.push(instant(track, &format!("sleeps in idle state {state}"), at));
            }
            What::Idle(None) => all.push(instant(track, "leaves its sleep", at)),
            What::Set { .. } | What::Expired { .. } | What::Marker(_) => {}
        }
    }
    all
}

fn slice(group: u32, track: u32, name: &str, from_ns: u64, to_ns: u64, args: &Value) -> Value {
    let took = to_ns.saturating_sub(from_ns);
    let mut slice = json!({
        "ph": "X", "pid": group, "tid": track, "name": name, "cat": "lager",
        "ts": from_ns as f64 / 1e3, "dur": took as f64 / 1e3,
    });
    if !args.is_null() {
        slice["args"] = args.clone();
    }
    slice
}

fn instant(track: u32, name: &str, at_ns: u64) -> Value {
    json!({
        "ph": "i", "s": "t", "pid": CORES, "tid": track, "name": name, "ts": at_ns as f64 / 1e3,
    })
}
