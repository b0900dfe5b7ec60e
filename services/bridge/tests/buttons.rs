//! The buttons on lines of a simulated chip of the kernel (gpio-sim). From the lines on, the way
//! through the whole bridge is tested in `bridge/pressed.rs`.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::Duration;

use lager_bridge::buttons::{ButtonsConfig, Chips, Listening, Touch, watch};
use lager_orders::{Contact, Level, Mode, SwitchKind};

const SIMULATOR: &str = "/sys/kernel/config/gpio-sim";
/// How long a touch is waited for before the test has failed.
const WATCHDOG: Duration = Duration::from_secs(20);
const RESET: u8 = 0;
const SWITCH: u8 = 1;

/// A simulated chip with two lines; it is gone when this is dropped.
struct Chip {
    config: PathBuf,
    lines: PathBuf,
    device: PathBuf,
}

impl Chip {
    fn new() -> std::io::Result<Self> {
        let config = Path::new(SIMULATOR).join(format!("lager-{}", std::process::id()));
        let bank = config.join("bank");
        fs::create_dir(&config)?;
        fs::create_dir(&bank)?;
        fs::write(bank.join("num_lines"), "2")?;
        fs::write(config.join("live"), "1")?;
        let name =
            |path: PathBuf| Ok::<_, std::io::Error>(fs::read_to_string(path)?.trim().to_owned());
        let chip = name(bank.join("chip_name"))?;
        let device = name(config.join("dev_name"))?;
        Ok(Self {
            lines: Path::new("/sys/devices/platform").join(device).join(&chip),
            device: Path::new("/dev").join(chip),
            config,
        })
    }

    /// Closes a contact to ground, or opens it.
    fn contact(&self, line: u8, is_closed: bool) {
        let pull = self.lines.join(format!("sim_gpio{line}/pull"));
        let to = if is_closed { "pull-down" } else { "pull-up" };
        fs::write(pull, to).expect("a line of the simulated chip");
    }
}

impl Drop for Chip {
    fn drop(&mut self) {
        let _ = fs::write(self.config.join("live"), "0");
        let _ = fs::remove_dir(self.config.join("bank"));
        let _ = fs::remove_dir(&self.config);
    }
}

#[test]
#[ignore = "needs gpio-sim in the kernel, and root; `tests/run` runs it where it has them"]
fn what_people_do_to_the_lines_of_a_chip_is_heard() {
    let chip = Chip::new().expect("a simulated chip, which root can make where gpio-sim is loaded");
    chip.contact(RESET, false);
    chip.contact(SWITCH, true);
    let config = ButtonsConfig {
        chip: chip.device.clone(),
        reset: Some(contact(RESET)),
        switch: Some(contact(SWITCH)),
        switch_kind: SwitchKind::Position,
        reset_starts: true,
        debounce: Duration::from_millis(5),
    };
    let (end, listening) = (AtomicBool::new(false), Listening::default());
    let (to, touches) = mpsc::channel();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            watch(
                Some(&config),
                &Chips,
                false,
                (&end, &listening),
                |touch, _| {
                    to.send(touch).expect("it is waited for");
                },
            );
        });
        let next = || touches.recv_timeout(WATCHDOG).expect("a touch");
        assert_eq!(next(), Touch::Switched(Mode::Autonomous), "where it stands");
        chip.contact(SWITCH, false);
        assert_eq!(next(), Touch::Switched(Mode::Manual));
        chip.contact(RESET, true);
        assert_eq!(next(), Touch::Reset);
        chip.contact(RESET, false);
        chip.contact(SWITCH, true);
        assert_eq!(
            next(),
            Touch::Switched(Mode::Autonomous),
            "letting go is no press"
        );
        end.store(true, Ordering::Release);
    });
}

fn contact(line: u8) -> Contact {
    let closed = Level::Low;
    Contact { line, closed }
}
