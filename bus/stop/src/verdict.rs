//! [`judge`]: whether a robot stands after a stop, from the file of the stop word and what the kernel
//! says of the bridge. For all who stop a robot and wait for the effect.

use core::time::Duration;
use std::fs;

use crate::StopTold;

/// A bridge turns at least every 20 ms.
const SILENT: Duration = Duration::from_millis(200);

/// What is known after a stop.
#[derive(Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The wheels stand.
    Stands(String),
    /// They do not stand yet, for this reason.
    NotYet(String),
    /// Nobody can know whether they stand.
    Never(String),
}

/// Judges, from the file at `now_ns`, a stop that was ordered at `ordered_ns`. `bridge` is the last
/// bridge's process with its state, as the kernel says.
pub fn judge(
    told: &StopTold,
    ordered_ns: u64,
    now_ns: u64,
    bridge: Option<(u32, Option<char>)>,
) -> Verdict {
    let Some(stop) = told.stop() else {
        return Verdict::Never("somebody has released the stop meanwhile (`lager resume`)".into());
    };
    let age = |then_ns| span(StopTold::age(now_ns, then_ns));
    if let Some((of, at_ns)) = told.rested()
        && of == stop
        && at_ns >= ordered_ns
    {
        let sensor = match told.sensor() {
            Some(_) => "",
            None => " (the sensor board is not connected)",
        };
        return Verdict::Stands(format!(
            "stopped: the wheels stand, {} after the order{sensor}; `lager resume` lets it go on",
            span(StopTold::age(at_ns, ordered_ns))
        ));
    }
    let last = match told.report() {
        Some((at_ns, [left, right])) => format!(
            "its last report, {} ago, showed duty {left} and {right}",
            age(at_ns)
        ),
        None => "it has not reported".into(),
    };
    const BY_ITSELF: &str =
        "a steering board of ours stops by itself 150 ms after the last command it was given";
    let obeyed = told.obeyed().filter(|(of, _)| *of == stop);
    match (bridge, obeyed) {
        (None, _) => Verdict::NotYet(format!(
            "no bridge has answered here, so it was never up or its folder was emptied; {BY_ITSELF}"
        )),
        (Some((process, None | Some('Z'))), _) => Verdict::NotYet(format!(
            "no bridge runs (it was process {process}); {BY_ITSELF}"
        )),
        (Some((process, Some('T' | 't'))), _) => Verdict::NotYet(format!(
            "the bridge (process {process}) is frozen by a signal and obeys as soon as it goes on (kill -CONT {process}); {BY_ITSELF}"
        )),
        (Some((process, _)), None) => Verdict::NotYet(format!(
            "the bridge (process {process}) does not answer; its main loop last turned {} ago",
            age(told.turned_ns())
        )),
        (Some((process, _)), _) if StopTold::age(now_ns, told.turned_ns()) > SILENT => {
            Verdict::NotYet(format!(
                "the bridge (process {process}) does not answer any more; its main loop last turned {} ago",
                age(told.turned_ns())
            ))
        }
        (_, Some((_, at_ns))) => match told.steering() {
            Some(0) => Verdict::Never(format!(
                "the bridge obeys since {}, but the steering board is an original one, which reports nothing and has no age limit on commands: look at the wheels",
                span(StopTold::age(now_ns, at_ns))
            )),
            Some(_) => Verdict::NotYet(format!("the steering board was told to stand; {last}")),
            None => Verdict::NotYet(format!(
                "the steering board is not connected; {last}; {BY_ITSELF}"
            )),
        },
    }
}

/// The state of a process as the kernel says, such as `S`, if there is such a process.
pub fn process_state(process: u32) -> Option<char> {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The state follows the name, which is in parentheses and may contain anything.
    stat.rsplit(") ").next()?.chars().next()
}

/// A length of time as a person says it.
#[must_use]
pub fn span(time: Duration) -> String {
    match time.as_secs() {
        0 => format!("{} ms", time.as_millis()),
        seconds @ 1..120 => format!("{seconds} s"),
        seconds @ 120..7_200 => format!("{} min", seconds / 60),
        seconds => format!("{} h", seconds / 3_600),
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use lager_home::Clock;
    use lager_topics::{Role, StopCause};

    use super::*;
    use crate::StopWord;

    fn why(verdict: Verdict) -> String {
        match verdict {
            Verdict::Stands(said) | Verdict::NotYet(said) | Verdict::Never(said) => said,
        }
    }

    /// A file in which somebody has ordered a stop and no bridge has answered.
    fn ordered() -> (PathBuf, StopTold) {
        use std::sync::atomic::{AtomicU32, Ordering};
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("lager-st-{}-{number}", std::process::id()));
        StopWord::set(&path, Role::Operator, StopCause::Ordered).expect("a file");
        let told = StopWord::read(&path).expect("readable").expect("a file");
        (path, told)
    }

    #[test]
    fn each_way_of_not_knowing_has_its_sentence() {
        let (path, told) = ordered();
        fs::remove_file(path).expect("a file");
        let now_ns = Clock::monotonic_ns();
        for (bridge, words) in [
            (None, "never up"),
            (Some((7, None)), "no bridge runs (it was process 7)"),
            (Some((7, Some('T'))), "is frozen"),
            (Some((7, Some('S'))), "does not answer"),
        ] {
            let said = why(judge(&told, now_ns, now_ns, bridge));
            assert!(said.contains(words), "{said}");
        }
    }

    #[test]
    fn spans_are_told_as_people_say_them() {
        for (millis, said) in [
            (7, "7 ms"),
            (1_400, "1 s"),
            (200_000, "3 min"),
            (9_000_000, "2 h"),
        ] {
            assert_eq!(span(Duration::from_millis(millis)), said);
        }
    }
}
