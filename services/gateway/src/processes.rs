//! Processor time and memory of the robot's processes, as the kernel counts them.

use std::fs;

use lager_ports::{Peer, TopicInfo};

/// One process of the robot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Process {
    pub(crate) role: String,
    pub(crate) pid: u32,
    /// Time of a core that it has taken, in user mode and in the kernel.
    pub(crate) cpu_seconds: f64,
    /// Memory that it has in use, in bytes.
    pub(crate) resident_bytes: u64,
}

/// The processes at the ends of these topics, each once.
pub(crate) fn at(topics: &[TopicInfo]) -> Vec<Process> {
    let peers = topics.iter();
    let peers = peers.flat_map(|topic| topic.writers.iter().chain(&topic.readers));
    let mut found: Vec<(u32, String)> = peers
        .filter_map(|Peer { part, pid, .. }| Some((*pid, part.clone()?)))
        .collect();
    found.sort_by_key(|(pid, _)| *pid);
    found.dedup_by_key(|(pid, _)| *pid);
    let used = found.into_iter().filter_map(|(pid, role)| {
        let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        let statm = fs::read_to_string(format!("/proc/{pid}/statm")).ok()?;
        let (cpu_seconds, resident_bytes) = (cpu_seconds(&stat)?, resident_bytes(&statm)?);
        Some(Process {
            role,
            pid,
            cpu_seconds,
            resident_bytes,
        })
    });
    used.collect()
}

/// From `/proc/PID/stat`, where the name, in parentheses, may contain anything.
fn cpu_seconds(stat: &str) -> Option<f64> {
    let mut fields = stat.rsplit(") ").next()?.split(' ').skip(11);
    let (user, kernel): (u64, u64) = (fields.next()?.parse().ok()?, fields.next()?.parse().ok()?);
    Some((user + kernel) as f64 / rustix::param::clock_ticks_per_second() as f64)
}

/// From `/proc/PID/statm`, which counts pages.
fn resident_bytes(statm: &str) -> Option<u64> {
    let pages: u64 = statm.split(' ').nth(1)?.parse().ok()?;
    Some(pages * rustix::param::page_size() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_with_blanks_and_brackets_shifts_no_field() {
        let stat = "7 (a ) b (c)) S 1 7 7 0 -1 4194560 100 0 0 0 250 50 0 0 20 0 1 0 3 4 5";
        let ticks = rustix::param::clock_ticks_per_second() as f64;
        assert_eq!(cpu_seconds(stat), Some(300.0 / ticks));
        assert_eq!(cpu_seconds("7 (cut off"), None);
        let page = rustix::param::page_size() as u64;
        assert_eq!(resident_bytes("900 12 3 4 0 5 0"), Some(12 * page));
    }

    #[test]
    fn this_process_is_found_once_whatever_it_reads() {
        let pid = std::process::id();
        let here = Peer {
            part: Some("logic".to_owned()),
            pid,
            observes: false,
        };
        let stranger = Peer {
            part: None,
            pid: 0,
            observes: false,
        };
        let topic = TopicInfo {
            unit: "r1".parse().expect("a name"),
            name: "sensor/line".into(),
            entry: None,
            layout: lager_ports::Layout::Ours,
            description: None,
            publishers: 1,
            subscribers: 2,
            observers: 0,
            places: None,
            writers: vec![here.clone()],
            readers: vec![here.clone(), stranger],
            woken: Vec::new(),
        };
        let found = at(&[topic.clone(), topic]);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].role.as_str(), found[0].pid), ("logic", pid));
        assert!(found[0].resident_bytes > 0);
    }
}
