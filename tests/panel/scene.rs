//! The scene of the panel's tests: a running robot with its panel, a browser, and the true world.

use lager_home::Clock;
use lager_ports::{Bus, Subscriber};
use lager_tests::{Domain, Running, pid, wait_for};
use lager_topics::TruthPose;
use rustix::process::{Pid, Signal, kill_process};

use crate::browser::{Browser, Page};

/// Makes each function a test with its own robot and page.
macro_rules! each_alone {
    ($($file:ident::$test:ident),* $(,)?) => { $(
        #[test]
        fn $test() {
            let mut scene = $crate::Scene::among_others();
            let mut page = scene.page();
            $crate::$file::$test(&mut scene, &mut page);
            page.close();
            scene.end();
        }
    )* };
}

pub(crate) use each_alone;

/// A running robot with its panel, and the true state of its world.
pub(crate) struct Scene {
    pub(crate) truth: Subscriber<TruthPose>,
    pub(crate) bus: Bus,
    pub(crate) up: Running,
    pub(crate) browser: Browser,
    pub(crate) url: String,
    pub(crate) domain: Domain,
}

/// A frozen service; dropping this lets it run again.
pub(crate) struct Frozen([Pid; 3]);

impl Drop for Frozen {
    fn drop(&mut self) {
        for process in self.0.into_iter().rev() {
            let _ = kill_process(process, Signal::CONT);
        }
    }
}

impl Scene {
    pub(crate) fn new(speed: f64, more: &[&str]) -> Self {
        Self::on(Domain::new(), speed, more)
    }

    /// A robot beside which other tests may drive theirs.
    pub(crate) fn among_others() -> Self {
        Self::on(Domain::among_others(), 1.0, &[])
    }

    pub(crate) fn on(domain: Domain, speed: f64, more: &[&str]) -> Self {
        let speed_word = speed.to_string();
        let mut args = vec!["up", "--panel", "127.0.0.1:0", "--speed", &speed_word];
        args.extend(more);
        let up = domain.start(&args);
        let bus = domain.observe("r1", speed);
        let url = wait_for("the panel's address", || {
            let told = up.output();
            let (_, rest) = told.split_once("the panel is at ")?;
            rest.split_whitespace().next().map(str::to_owned)
        });
        Self {
            truth: bus.subscriber().expect("a topic"),
            bus,
            up,
            browser: Browser::new(),
            url,
            domain,
        }
    }

    /// The address of the display on the robot.
    pub(crate) fn screen(&self) -> String {
        self.url.replacen("/?", "/screen?", 1)
    }

    pub(crate) fn page(&self) -> Page {
        let mut page = self.browser.page(&self.url);
        page.wait_for("#link", " ms");
        page
    }

    pub(crate) fn moves(&mut self) -> Option<bool> {
        let truth = self.truth.latest().expect("readable")?;
        Some(truth.left_duty != 0 || truth.right_duty != 0)
    }

    pub(crate) fn wait_to_move(&mut self) {
        wait_for("the robot to move", || self.moves().filter(|moves| *moves));
    }

    pub(crate) fn wait_to_stand(&mut self) {
        wait_for("the robot to stand", || self.moves().filter(|moves| !moves));
    }

    /// Asserts that the robot stands for a while in every sample of the world.
    pub(crate) fn assert_stands(&mut self) {
        let from = Clock::monotonic_ns();
        let mut seen = 0;
        while seen < 15 {
            let truth = wait_for("the world", || self.truth.latest().expect("readable"));
            if truth.stamp().publish_time_ns > from {
                assert_eq!((truth.left_duty, truth.right_duty), (0, 0));
                seen += 1;
            }
            drop(truth);
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
    }

    /// Takes the wheel, chooses full speed and sets the manual mode.
    pub(crate) fn take_over(&mut self, page: &mut Page) {
        page.click("#tab-drive");
        page.click("#control");
        page.wait_for("#control", "You drive");
        page.click("#speed-full_speed");
        self.by_hand(page);
        self.wait_to_stand();
    }

    /// Sets the manual mode from a page that has the wheel.
    pub(crate) fn by_hand(&self, page: &mut Page) {
        // For a robot on its way, the page asks first. What came too late is refused.
        wait_for("the mode to be the hand's", || {
            page.click("#manual");
            for _ in 0..100 {
                if page.value("document.querySelector('#hand').hidden") == false {
                    page.click("#hand-now");
                }
                if page.text("#mode").contains("BY HAND") {
                    return Some(());
                }
                std::thread::sleep(std::time::Duration::from_millis(50));
            }
            None
        });
    }

    /// Takes the wheel, and turns driving by keys and buttons on.
    pub(crate) fn arm(&mut self, page: &mut Page) {
        self.take_over(page);
        page.click("#armed");
        page.value("document.activeElement.blur()");
    }

    /// Presses a key until the robot moves by it; if an order was held up, presses again.
    pub(crate) fn hold(&mut self, page: &mut Page, key: &str) {
        wait_for("the robot to be driven", || {
            page.key_down(key);
            for _ in 0..100 {
                if self.moves() == Some(true) {
                    return Some(());
                }
                std::thread::sleep(std::time::Duration::from_millis(10));
            }
            page.key_up(key);
            None
        });
    }

    /// Holds a key until this is so; if the hold has ended by itself, presses again.
    pub(crate) fn hold_until(
        &mut self,
        page: &mut Page,
        key: &str,
        is_so: impl Fn(&mut Page) -> bool,
    ) {
        wait_for("what the held key is to do", || {
            self.hold(page, key);
            for _ in 0..100 {
                if is_so(page) {
                    return Some(());
                }
                std::thread::sleep(std::time::Duration::from_millis(20));
            }
            page.key_up(key);
            None
        });
    }

    /// Freezes a service and the supervisor, which would replace a service that is silent for 2 s.
    pub(crate) fn freeze(&self, name: &str) -> Frozen {
        let service = |name: &str| pid(self.up.service(name).expect("it runs"));
        let frozen = Frozen([pid(self.up.pid()), service("attend"), service(name)]);
        for process in frozen.0 {
            kill_process(process, Signal::STOP).expect("it runs");
        }
        frozen
    }

    /// Tests that the page saves the station's history as a table and as a recording that others can
    /// read.
    pub(crate) fn saves(&self, page: &mut Page) {
        let folder = self.domain.folder();
        page.wait_for("#link", " ms");
        page.save_into(folder);
        page.click("#tab-log");
        assert_eq!(page.text("#save-span option"), "10 min");
        page.wait_until("!document.querySelector('#save-csv').disabled");
        page.click("#save-csv");
        let table = wait_for("the table", || {
            let text = std::fs::read_to_string(folder.join("r1.csv")).ok()?;
            // The browser makes the file before it fills it.
            text.ends_with('\n').then_some(text)
        });
        // Each column with a unit names it.
        let units =
            "unix_time_s,x_mm,y_mm,line_error_half_sensors,left_duty_of_255,right_duty_of_255,";
        assert!(table.starts_with(units), "{table}");
        let (head, lines) = table.split_once('\n').expect("lines");
        // The station knows what happened before this page was there.
        let began = page.value("performance.timeOrigin / 1000");
        let first = lines.split(',').next().expect("a cell");
        let first: f64 = first.parse().expect("a time in s");
        assert!(
            first < began.as_f64().expect("a time in s"),
            "{first}, {began}"
        );
        for key in [
            "heading_deg",
            "mode",
            "next",
            "line_bits",
            "servos_of_1023",
            "loads_of_1023",
            "battery_V",
            "path_p99_us",
        ] {
            assert!(head.split(',').any(|name| name == key), "{key}: {head}");
        }
        // Lists of numbers are in quotation marks, so all lines have the same number of cells.
        let cells = |line: &str| {
            let outside: String = line.split('"').step_by(2).collect();
            outside.matches(',').count()
        };
        for line in lines.lines() {
            assert_eq!(cells(line), cells(head), "{line}");
        }
        // The page saves one file after the other.
        page.wait_until("!document.querySelector('#save-mcap').disabled");
        page.click("#save-mcap");
        let file = folder.join("r1.mcap");
        wait_for("the recording", || file.exists().then_some(()));
        let file = file.to_str().expect("a name");
        self.domain.done(&["bag", "check", file]);
        let told = self.domain.run(&["bag", "info", "--json", file]);
        let told: serde_json::Value = serde_json::from_slice(&told.stdout).expect("JSON");
        let topics = told["topics"].as_array().expect("topics");
        let names: Vec<_> = topics.iter().map(|topic| &topic["topic"]).collect();
        assert_eq!(names, ["events", "state"]);
        assert!(
            topics
                .iter()
                .all(|topic| topic["messages"].as_u64() > Some(0)),
            "{told}"
        );
    }

    /// Releases a stop, if there is one.
    pub(crate) fn resume(&self) {
        self.domain.done(&["resume"]);
    }

    pub(crate) fn end(self) {
        let Self {
            truth,
            bus,
            up,
            browser,
            domain,
            ..
        } = self;
        drop((truth, bus, browser, up));
        domain.assert_clean();
    }
}
