//! Serial ports, on pseudo terminals and on what is no port.

use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::time::Duration;

use lager_bridge::serial::{OpenPortError, PacketWriter, Sent, SerialPort};
use rustix::termios::{ControlModes, OptionalActions, tcgetattr, tcsetattr};

use crate::harness::{Isolation, Pty, wait_until};

const WAIT: Duration = Duration::from_secs(10);

fn pair(isolation: &Isolation) -> (Pty, SerialPort) {
    let path = isolation.folder().join("port");
    let pty = Pty::new(&path);
    let port = SerialPort::open(&path, 500_000).unwrap();
    (pty, port)
}

fn read_exactly(port: &SerialPort, count: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut buffer = [0; 64];
    wait_until("the bytes come", || {
        let got = port.read(&mut buffer, Duration::from_millis(1)).unwrap();
        bytes.extend(&buffer[..got]);
        bytes.len() >= count
    });
    bytes
}

#[test]
fn every_byte_passes_unchanged_in_both_directions() {
    let isolation = Isolation::new();
    let (pty, port) = pair(&isolation);
    let all: Vec<u8> = (0..=u8::MAX).collect();
    assert_eq!(pty.write(&all), all.len());
    assert_eq!(read_exactly(&port, all.len()), all);

    let mut writer = PacketWriter::default();
    let mut expected = Vec::new();
    for chunk in all.chunks_exact(11) {
        let packet = chunk.try_into().unwrap();
        assert_eq!(writer.write(&port, &packet), Ok(Sent::Whole));
        expected.extend(packet);
    }
    let mut got: Vec<u8> = Vec::new();
    let mut buffer = [0; 64];
    wait_until("the bytes come", || {
        let count = pty.read(&mut buffer);
        got.extend(&buffer[..count]);
        got.len() >= expected.len()
    });
    assert_eq!(got, expected);
}

#[test]
fn a_port_hangs_up_nothing_when_it_is_closed_whatever_was_set_before() {
    let isolation = Isolation::new();
    let path = isolation.folder().join("port");
    let _pty = Pty::new(&path);
    let other = std::fs::File::open(&path).unwrap();
    let mut termios = tcgetattr(&other).unwrap();
    termios.control_modes |= ControlModes::HUPCL;
    tcsetattr(&other, OptionalActions::Now, &termios).unwrap();
    // An adapter would drop DTR at the last close, and reset a board behind it.
    let port = SerialPort::open(&path, 500_000).unwrap();
    drop(port);
    let modes = tcgetattr(&other).unwrap().control_modes;
    assert!(!modes.contains(ControlModes::HUPCL), "{modes:?}");
}

#[test]
fn the_speed_is_the_one_asked_for() {
    let isolation = Isolation::new();
    let path = isolation.folder().join("port");
    let _pty = Pty::new(&path);
    for baud in [9_600, 115_200, 500_000, 1_000_000] {
        let port = SerialPort::open(&path, baud).unwrap();
        let termios = tcgetattr(port.as_fd()).unwrap();
        assert_eq!(
            (termios.input_speed(), termios.output_speed()),
            (baud, baud)
        );
    }
    let error = SerialPort::open(&path, 0).unwrap_err();
    assert!(matches!(error, OpenPortError::Baud { baud: 0, .. }));
}

#[test]
fn what_lay_in_the_buffer_before_opening_is_thrown_away() {
    let isolation = Isolation::new();
    let path = isolation.folder().join("port");
    let pty = Pty::new(&path);
    let mut earlier = pty.slave();
    drop(SerialPort::open(&path, 500_000).unwrap());
    pty.write(b"stale");
    let port = SerialPort::open(&path, 500_000).unwrap();
    pty.write(b"fresh");
    assert_eq!(read_exactly(&port, 5), b"fresh");
    // The slave that was open all the time shares the buffer, so nothing is left in it.
    drop(port);
    pty.write(b"next!");
    let mut next = [0; 5];
    earlier.read_exact(&mut next).unwrap();
    assert_eq!(&next, b"next!");
    earlier.write_all(b"x").unwrap();
}

#[test]
fn a_port_that_is_not_there_is_said_to_be_missing() {
    let isolation = Isolation::new();
    let error = SerialPort::open(&isolation.folder().join("none"), 9_600).unwrap_err();
    assert!(matches!(error, OpenPortError::Missing { .. }));
    let text = error.to_string();
    assert!(text.contains("/none") && text.contains("plug in"), "{text}");
}

#[test]
fn what_is_no_terminal_is_said_to_be_none() {
    let isolation = Isolation::new();
    let file = isolation.folder().join("file");
    std::fs::write(&file, "text").unwrap();
    for path in [file.as_path(), "/dev/null".as_ref(), isolation.folder()] {
        let error = SerialPort::open(path, 9_600).unwrap_err();
        assert!(
            matches!(error, OpenPortError::NotATerminal { .. }),
            "{error:?}"
        );
        assert!(error.to_string().contains("is not a serial port"));
    }
}

#[test]
fn a_port_has_one_owner_and_is_free_when_that_one_is_gone() {
    let isolation = Isolation::new();
    let (_pty, port) = pair(&isolation);
    let path = isolation.folder().join("port");
    let error = SerialPort::open(&path, 500_000).unwrap_err();
    assert!(matches!(error, OpenPortError::Busy { .. }));
    assert!(error.to_string().contains("fuser"));
    drop(port);
    SerialPort::open(&path, 500_000).unwrap();
}

#[test]
fn a_port_whose_device_goes_is_found_gone() {
    let isolation = Isolation::new();
    let (pty, port) = pair(&isolation);
    // Both ways to wait: before the read, and in it.
    for timeout in [Duration::ZERO, Duration::from_millis(5), WAIT] {
        assert_eq!(port.read(&mut [0; 8], timeout), Ok(0), "nothing has come");
    }
    drop(pty);
    for timeout in [WAIT, Duration::ZERO] {
        assert!(port.read(&mut [0; 8], timeout).is_err(), "{timeout:?}");
    }
    assert!(PacketWriter::default().write(&port, &[0; 11]).is_err());
}

#[test]
fn a_full_driver_never_tears_a_packet_and_never_blocks() {
    let isolation = Isolation::new();
    let (pty, port) = pair(&isolation);
    let mut writer = PacketWriter::default();
    let packet = |number: u32| {
        let mut packet = [0xEE; 11];
        packet[..4].copy_from_slice(&number.to_be_bytes());
        packet
    };
    let mut taken = Vec::new();
    let mut refused = 0;
    let mut number = 0;
    // Written faster than it is read: some packets are refused, none is torn.
    let mut received: Vec<u8> = Vec::new();
    let mut buffer = [0; 37];
    while refused < 50 || number < 5_000 {
        match writer.write(&port, &packet(number)).unwrap() {
            Sent::Whole | Sent::Partly => taken.push(number),
            Sent::NotNow => refused += 1,
        }
        number += 1;
        if number % 8 == 0 {
            let count = pty.read(&mut buffer);
            received.extend(&buffer[..count]);
        }
        assert!(number < 1_000_000, "the driver takes everything");
    }
    wait_until("the rest comes", || {
        let count = pty.read(&mut buffer);
        received.extend(&buffer[..count]);
        received.len() >= taken.len() * 11 - 10
    });
    let got: Vec<_> = received
        .chunks_exact(11)
        .map(|chunk| {
            assert!(chunk[4..].iter().all(|byte| *byte == 0xEE), "{chunk:02x?}");
            u32::from_be_bytes(chunk[..4].try_into().unwrap())
        })
        .collect();
    assert_eq!(got, taken[..got.len()]);
}

#[test]
fn what_waits_in_the_driver_is_thrown_away_before_a_stop_and_what_follows_is_sent() {
    let isolation = Isolation::new();
    let (pty, port) = pair(&isolation);
    let mut writer = PacketWriter::default();
    let mut written = 0;
    // Nobody reads, until the driver takes no more.
    while writer.write(&port, &[0xEE; 11]).unwrap() != Sent::NotNow {
        written += 11;
        assert!(written < 11_000_000, "the driver takes everything");
    }
    port.discard_output();
    let standby = *b"the standby";
    let mut received = Vec::new();
    let mut buffer = [0; 4_096];
    let mut writer = PacketWriter::default();
    let mut is_sent = false;
    wait_until("what follows comes", || {
        let count = pty.read(&mut buffer);
        received.extend(&buffer[..count]);
        is_sent = is_sent || writer.write(&port, &standby) == Ok(Sent::Whole);
        received.ends_with(&standby)
    });
    // What the other end of a pseudo terminal has taken in already counts as sent.
    assert!(
        received.len() < written / 2,
        "{} of {written} bytes were sent all the same",
        received.len()
    );
}

#[test]
fn a_pseudo_terminal_works_without_low_latency() {
    let isolation = Isolation::new();
    let (_pty, port) = pair(&isolation);
    assert!(!port.is_low_latency());
}
