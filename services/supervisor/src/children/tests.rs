//! Children that are scripts of the shell: real processes that start, die and are ended.

use std::fs;

use super::*;

/// How long anything may take before the test is stuck.
const WATCHDOG: Duration = Duration::from_secs(60);

/// Children that run a script of the shell, in which `$3` is the service.
struct Family {
    children: Children,
    folder: PathBuf,
}

impl Family {
    fn new(name: &str, script: &str) -> Self {
        let folder = format!("lager-children-{}-{name}", std::process::id());
        let folder = std::env::temp_dir().join(folder);
        fs::create_dir_all(&folder).expect("a folder");
        let program = folder.join("program");
        let text = format!("#!/bin/sh\ncd {}\n{script}\n", folder.display());
        let draft = folder.join("draft");
        fs::write(&draft, text).expect("a file");
        // Another process writes what is run: a child that another test starts meanwhile would hold a
        // file that this one writes open, and the kernel runs no such file.
        let mut install = std::process::Command::new("install");
        let made = install
            .args(["-m", "700"])
            .args([&draft, &program])
            .status();
        assert!(made.expect("coreutils").success());
        Self {
            children: Children::of(program, "speed = 2".into()),
            folder,
        }
    }

    fn start(&mut self, service: Service, resume: bool) -> u32 {
        let start = Start {
            resume,
            output: Stdio::null(),
            errors: Stdio::inherit(),
        };
        self.children.start(service, start).expect("it starts")
    }

    /// What a child has written into its file, once it has.
    fn written(&self, name: &str) -> String {
        let path = self.folder.join(name);
        until(name, || {
            let text = fs::read_to_string(&path).unwrap_or_default();
            text.ends_with('\n').then(|| text.trim_end().to_owned())
        })
    }

    fn ended(&mut self) -> Ended {
        let children = &mut self.children;
        until("an end", || children.reap().pop())
    }
}

impl Drop for Family {
    fn drop(&mut self) {
        self.children.kill_all();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(began.elapsed() < WATCHDOG, "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_child_reads_the_configuration_and_is_told_who_started_it() {
    let script = "cat > config; echo >> config; echo \"$@\" > $3";
    let mut family = Family::new("told", script);
    let parent = family.children.parent.to_string();
    family.start(Service::Bridge, false);
    assert_eq!(family.written("config"), "speed = 2");
    let told = format!("--config - bridge --parent {parent}");
    assert_eq!(family.written("bridge"), told);
    family.ended();
    family.start(Service::Logic, true);
    assert_eq!(
        family.written("logic"),
        format!("--config - logic --parent {parent} --resume")
    );
    assert_eq!(family.children.restarts(), 0);
}

#[test]
fn how_a_child_has_ended_is_told() {
    let script = format!(
        "case $3 in bridge) exit 7 ;; logic) exit {TRY_AGAIN} ;; comm) kill -BUS $$ ;; esac
        exec sleep 600"
    );
    let mut family = Family::new("ends", &script);
    let mut end = |service| {
        family.start(service, false);
        let ended = family.ended();
        assert_eq!(ended.service, service);
        (ended.by_itself, ended.may_try_again, ended.lost_memory)
    };
    assert_eq!(end(Service::Bridge), (true, false, false));
    assert_eq!(end(Service::Logic), (true, true, false));
    assert_eq!(end(Service::Comm), (false, false, true));
    family.start(Service::Station, false);
    family.children.kill(Service::Station);
    let ended = family.ended();
    assert!(ended.how.contains("signal: 9"), "{ended:?}");
    assert!(!ended.by_itself && !ended.lost_memory);
}

#[test]
fn a_child_that_ends_at_once_is_due_after_a_while_and_hopeless_in_the_end() {
    let mut family = Family::new("again", "exit 1");
    for start in 0..5 {
        assert_eq!(family.children.hopeless(), None, "{start}");
        family.start(Service::Logic, start > 0);
        family.ended();
        assert_eq!(family.children.process(Service::Logic), None);
        let children = &family.children;
        until("the next start", || {
            children.wait(&[], Duration::from_millis(20));
            (children.due() == [Service::Logic]).then_some(())
        });
    }
    assert_eq!(family.children.hopeless(), Some(Service::Logic));
    assert_eq!(family.children.restarts(), 4);
}

#[test]
fn children_end_in_order_and_who_does_not_is_killed_and_told() {
    let script = "trap 'echo $3 >> order; exit 0' TERM
        [ $3 = station ] && trap '' TERM
        echo up > $3
        while :; do sleep 0.01; done";
    let mut family = Family::new("order", script);
    let all = [Service::Station, Service::Bridge, Service::Logic];
    for service in all {
        family.start(service, false);
        family.written(service.command());
    }
    let mut signals = Signals::listen().expect("signals");
    let patience = Duration::from_millis(300);
    let told = family.children.stop(patience, &mut signals);
    let ended = family.written("order");
    // On a busy machine one that would end may be killed as well, and then that is told.
    let slow = told.len() - 1;
    assert!(
        told.iter()
            .any(|line| line.contains("the station does not stop")),
        "{told:?}"
    );
    let order = ["logic", "bridge"].join("\n");
    assert!(slow > 0 || ended == order, "{ended}; {told:?}");
    assert_eq!(family.children.running().count(), 0);
}

#[test]
fn a_parent_is_read_as_it_was_written() {
    let parent = Parent {
        pid: 4711,
        started_ns: u64::MAX,
    };
    assert_eq!(parent.to_string().parse(), Ok(parent));
    for text in ["", "4711", "@", "4711@", "@7", "-1@7", "4711@7 "] {
        let refused = text.parse::<Parent>().expect_err(text);
        assert!(refused.contains("PID@NS"), "{text}: {refused}");
    }
}
