//! avrdude itself at a board, by a pty in place of its cable.

use std::fs::File;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use lager_emulator::chip::FREQUENCY;
use lager_loader::Line;
use lager_pty::Port;
use lager_wire::Callsign;

use crate::support::{Bench, image, other};

/// This only ends a test that hangs.
const PATIENCE: Duration = Duration::from_secs(600);

/// Runs avrdude at a board that waits in its loader. Returns whether it succeeded, and what it said.
fn avrdude(bench: &mut Bench, test: &str, arguments: &[&str]) -> (bool, String) {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let link = folder.join(format!("avrdude-{test}"));
    // A file, because avrdude can say more than a pipe holds.
    let said = folder.join(format!("avrdude-{test}.said"));
    let mut port = Port::create(&link).expect("there are ptys");
    let mut command = Command::new("avrdude");
    command.args(["-c", "arduino", "-p", "m1284p", "-b", "500000", "-D", "-P"]);
    command.arg(&link).args(arguments);
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(File::create(&said).expect("the folder is there"))
        .spawn()
        .expect("avrdude is installed; tests/run installs it");
    let success = serve(bench, &mut port, &mut child);
    (
        success,
        std::fs::read_to_string(said).expect("it says words"),
    )
}

/// Runs the chip in real time, because avrdude's timeouts are of real time, until avrdude ends.
fn serve(bench: &mut Bench, port: &mut Port, child: &mut Child) -> bool {
    let began = Instant::now();
    let from = bench.now();
    let mut bytes = Vec::new();
    loop {
        if let Some(status) = child.try_wait().expect("it is our child") {
            return status.success();
        }
        if began.elapsed() > PATIENCE {
            child.kill().expect("it is our child");
            panic!("avrdude does not end");
        }
        port.look();
        bytes.clear();
        if port.is_open() {
            port.read(&mut bytes);
        }
        bench.send(&bytes).unwrap();
        let ahead = (bench.now() - from).checked_sub(began.elapsed());
        match ahead {
            Some(ahead) if ahead > Duration::from_millis(1) => std::thread::sleep(ahead),
            _ => bench.chip.run_until(bench.chip.cycle() + FREQUENCY / 5_000),
        }
        port.write(&bench.take());
    }
}

/// A hex file of these bytes.
fn hex_file(name: &str, bytes: &[u8]) -> String {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let (raw, hex) = (
        folder.join(format!("{name}.bin")),
        folder.join(format!("{name}.hex")),
    );
    std::fs::write(&raw, bytes).unwrap();
    let status = Command::new("avr-objcopy")
        .args(["-I", "binary", "-O", "ihex"])
        .args([&raw, &hex])
        .status()
        .expect("avr-objcopy is installed");
    assert!(status.success());
    hex.to_str().expect("plain folders").to_owned()
}

fn write(file: &str) -> String {
    format!("flash:w:{file}:i")
}

/// A board without an application waits in its loader.
fn waiting(role: Callsign) -> Bench {
    let mut bench = Bench::new(role, None);
    bench.run(Duration::from_millis(100));
    bench
}

#[test]
fn it_writes_an_image_and_settings_and_reads_them_back() {
    let role = Callsign::Steering;
    let new = other(&image(role), 7);
    let mut bench = waiting(role);
    let before = bench.boot_section();
    let file = hex_file("avrdude-image", new.bytes());
    let settings = hex_file("avrdude-settings", &[0x11, 0x22, 0x33]);
    let eeprom = format!("eeprom:w:{settings}:i");
    let fuses = [
        "-U",
        "lfuse:v:0xF7:m",
        "-U",
        "hfuse:v:0x92:m",
        "-U",
        "efuse:v:0xFC:m",
    ];
    let flash = write(&file);
    let mut arguments = vec!["-U", flash.as_str(), "-U", eeprom.as_str()];
    arguments.extend(fuses);
    let (success, said) = avrdude(&mut bench, "image", &arguments);
    assert!(success, "{said}");
    assert!(bench.chip.flash()[..new.bytes().len()] == *new.bytes());
    assert_eq!(bench.chip.eeprom(4), [0x11, 0x22, 0x33, 0xFF]);
    assert!(bench.boot_section() == before);
}

// When a page is refused, avrdude 7.1 goes on byte by byte, and finds by reading back that nothing was
// written.

#[test]
fn it_fails_at_the_image_of_the_other_board() {
    let mut bench = waiting(Callsign::Steering);
    let before = bench.chip.flash();
    let file = hex_file("avrdude-other", image(Callsign::Sensor).bytes());
    let (success, said) = avrdude(&mut bench, "other", &["-U", &write(&file)]);
    assert!(!success, "{said}");
    assert!(bench.chip.flash() == before, "nothing was erased");
}

#[test]
fn it_fails_at_an_image_that_reaches_into_the_boot_section() {
    let role = Callsign::Sensor;
    let mut bench = waiting(role);
    let before = bench.boot_section();
    let file = hex_file("avrdude-beyond", image(role).bytes());
    // One byte at 0x1F000.
    let text = std::fs::read_to_string(&file).unwrap();
    let text = text.replace(":00000001FF", ":020000021000EC\n:01F0000011FE\n:00000001FF");
    std::fs::write(&file, text).unwrap();
    let (success, said) = avrdude(&mut bench, "beyond", &["-U", &write(&file)]);
    assert!(!success, "{said}");
    assert!(bench.boot_section() == before);
    // The board can still be updated.
    bench.power();
    lager_loader::update(&mut bench, &image(role), |_| ()).unwrap();
}
