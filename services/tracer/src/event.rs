//! The kernel's events that a late frame is explained with, and how they are read from its bytes.
//!
//! The places of fields come from the kernel's own descriptions ([`Format`]). Nothing here opens a
//! file.

use std::collections::HashMap;

use crate::format::Format;

/// A thread, by the kernel's number; 0 is the idle thread of each core.
pub type Thread = i32;

/// One event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Event {
    /// When, in ns of `CLOCK_MONOTONIC`.
    pub at_ns: u64,
    /// On which core.
    pub core: usize,
    /// The thread that the core ran.
    pub thread: Thread,
    /// Whether the core was in an interrupt, or in work that one has left.
    pub in_interrupt: bool,
    /// What happened.
    pub what: What,
}

/// What happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// The core went from one thread to another.
    Switch {
        /// Why the thread before stopped.
        left: Left,
        /// The next thread.
        next: Thread,
        /// The names of both.
        names: [Name; 2],
    },
    /// Somebody wakes a thread.
    Waking(Thread),
    /// An interrupt, or work that one has left, begins.
    Enter(Source),
    /// It ends.
    Exit(Source),
    /// A timer was set.
    Set {
        /// The timer.
        timer: u64,
        /// When it is due, in ns of its own clock.
        due_ns: u64,
    },
    /// A timer's function is called.
    Expired {
        /// The timer.
        timer: u64,
        /// The function.
        function: u64,
        /// The time, in ns of its own clock.
        now_ns: u64,
    },
    /// The thread touched memory that was not there.
    Fault,
    /// The core goes to sleep in an idle state, or leaves it.
    Idle(Option<u32>),
    /// A text that a program wrote: its first number.
    Marker(u64),
}

/// Why a thread stopped running.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Left {
    /// It could go on: another one took the core.
    Ready,
    /// It waits to be woken.
    Asleep,
    /// It waits and cannot be interrupted: for a disk, mostly.
    Disk,
    /// A signal or a debugger stopped it.
    Stopped,
}

/// A thread's name, as the kernel cuts it.
pub type Name = [u8; 16];

/// Where an interrupt comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Source {
    /// A device, by the number of its line.
    Line(u32),
    /// The processor itself, by the name of the event.
    Vector(&'static str),
    /// Work that an interrupt has left, by its number.
    Soft(u32),
}

/// The kinds of event that are read. What the others say follows from these.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Switch,
    Waking,
    Line(bool),
    Vector(&'static str, bool),
    Soft(bool),
    Set,
    Expired,
    Fault,
    Idle,
    Marker,
}

/// The events to switch on: the folder and the name of each.
pub const WANTED: &[(&str, &str)] = &[
    ("sched", "sched_switch"),
    ("sched", "sched_waking"),
    ("irq", "irq_handler_entry"),
    ("irq", "irq_handler_exit"),
    ("irq", "softirq_entry"),
    ("irq", "softirq_exit"),
    ("timer", "hrtimer_start"),
    ("timer", "hrtimer_expire_entry"),
    ("exceptions", "page_fault_user"),
    ("exceptions", "page_fault_kernel"),
    ("power", "cpu_idle"),
    ("irq_vectors", "local_timer_entry"),
    ("irq_vectors", "local_timer_exit"),
    ("irq_vectors", "reschedule_entry"),
    ("irq_vectors", "reschedule_exit"),
    ("irq_vectors", "call_function_entry"),
    ("irq_vectors", "call_function_exit"),
    ("irq_vectors", "call_function_single_entry"),
    ("irq_vectors", "call_function_single_exit"),
    ("irq_vectors", "irq_work_entry"),
    ("irq_vectors", "irq_work_exit"),
];

/// The names of work that interrupts leave, by number.
pub const SOFT: [&str; 10] = [
    "HI", "TIMER", "NET_TX", "NET_RX", "BLOCK", "IRQ_POLL", "TASKLET", "SCHED", "HRTIMER", "RCU",
];

fn kind(name: &str) -> Option<Kind> {
    const VECTORS: [&str; 5] = [
        "local_timer",
        "reschedule",
        "call_function",
        "call_function_single",
        "irq_work",
    ];
    Some(match name {
        "sched_switch" => Kind::Switch,
        "sched_waking" => Kind::Waking,
        "irq_handler_entry" => Kind::Line(true),
        "irq_handler_exit" => Kind::Line(false),
        "softirq_entry" => Kind::Soft(true),
        "softirq_exit" => Kind::Soft(false),
        "hrtimer_start" => Kind::Set,
        "hrtimer_expire_entry" => Kind::Expired,
        "page_fault_user" | "page_fault_kernel" => Kind::Fault,
        "cpu_idle" => Kind::Idle,
        "print" => Kind::Marker,
        vector => {
            let of = |end| vector.strip_suffix(end);
            let (own, begins) = match (of("_entry"), of("_exit")) {
                (Some(own), _) => (own, true),
                (_, own) => (own?, false),
            };
            let known = VECTORS.iter().find(|known| **known == own);
            Kind::Vector(known?, begins)
        }
    })
}

/// Place and length of a field.
type Place = (usize, usize);

/// A kind of event with the places of the fields that it is made of.
#[derive(Debug)]
struct Layout {
    kind: Kind,
    thread: Place,
    flags: Place,
    fields: Vec<Place>,
    /// The bits of a thread's state: uninterruptible, stopped, traced.
    bits: [u64; 3],
}

/// Reads events out of the kernel's bytes.
#[derive(Debug, Default)]
pub struct Decoder {
    layouts: HashMap<u16, Layout>,
    /// The names of devices, by the number of their line.
    pub lines: HashMap<u32, String>,
}

/// An event's description lacks a field.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("this kernel's event {event} has no field {field}, or one of another size")]
pub struct Lacks {
    /// The event.
    pub event: String,
    /// The field.
    pub field: &'static str,
}

impl Decoder {
    /// From now on it reads events of this description; others it passes over.
    ///
    /// # Errors
    /// A field is missing.
    pub fn learn(&mut self, format: &Format) -> Result<(), Lacks> {
        let Some(kind) = kind(&format.name) else {
            return Ok(());
        };
        let lacks = |field| Lacks {
            event: format.name.clone(),
            field,
        };
        let place = |name| {
            let field = format.field(name).ok_or_else(|| lacks(name))?;
            let size = if field.size == 0 { 8 } else { field.size };
            Ok((field.offset, size))
        };
        let names: &[&'static str] = match kind {
            Kind::Switch => &["prev_state", "next_pid", "prev_comm", "next_comm"],
            Kind::Waking => &["pid"],
            Kind::Line(true) => &["irq", "name"],
            Kind::Line(false) => &["irq"],
            Kind::Vector(..) | Kind::Fault => &[],
            Kind::Soft(_) => &["vec"],
            Kind::Set => &["hrtimer", "expires"],
            Kind::Expired => &["hrtimer", "function", "now"],
            Kind::Idle => &["state"],
            Kind::Marker => &["buf"],
        };
        let bit = |name, usual| format.bit(name).unwrap_or(usual);
        let layout = Layout {
            kind,
            thread: place("common_pid")?,
            flags: place("common_flags")?,
            fields: names
                .iter()
                .map(|name| place(name))
                .collect::<Result<_, _>>()?,
            bits: [bit("D", 2), bit("T", 4), bit("t", 8)],
        };
        self.layouts.insert(format.id, layout);
        Ok(())
    }

    /// The event in these bytes; `None` for one that it does not know or that is cut.
    pub fn event(&mut self, at_ns: u64, core: usize, bytes: &[u8]) -> Option<Event> {
        /// In an interrupt; in work that one has left; in one that cannot be masked.
        const INTERRUPTED: u64 = 0x08 | 0x10 | 0x40;
        let id = u16::from_ne_bytes(bytes.get(..2)?.try_into().ok()?);
        let layout = self.layouts.get(&id)?;
        let field = |index: usize| number(bytes, *layout.fields.get(index)?);
        let small = |index| field(index).map(|number| number as u32);
        let source = |source, begins| match begins {
            true => What::Enter(source),
            false => What::Exit(source),
        };
        let what = match layout.kind {
            Kind::Switch => {
                let [disk, stopped, traced] = layout.bits;
                let state = field(0)?;
                let left = match () {
                    () if state & (stopped | traced) != 0 => Left::Stopped,
                    () if state & disk != 0 => Left::Disk,
                    // Above these bits stands that the thread could go on.
                    () if state & 0xff != 0 => Left::Asleep,
                    () => Left::Ready,
                };
                let name = |index: usize| {
                    let (from, size) = *layout.fields.get(index)?;
                    bytes.get(from..from + size)?.try_into().ok()
                };
                What::Switch {
                    left,
                    next: small(1)?.cast_signed(),
                    names: [name(2)?, name(3)?],
                }
            }
            Kind::Waking => What::Waking(small(0)?.cast_signed()),
            Kind::Line(begins) => {
                let line = small(0)?;
                if begins && !self.lines.contains_key(&line) {
                    let at = small(1)? as usize;
                    let text = bytes.get(at & 0xffff..)?;
                    let end = text.iter().position(|byte| *byte == 0);
                    let name = String::from_utf8_lossy(&text[..end.unwrap_or(text.len())]);
                    self.lines.insert(line, name.into_owned());
                }
                source(Source::Line(line), begins)
            }
            Kind::Vector(name, begins) => source(Source::Vector(name), begins),
            Kind::Soft(begins) => source(Source::Soft(small(0)?), begins),
            Kind::Set => What::Set {
                timer: field(0)?,
                due_ns: field(1)?,
            },
            Kind::Expired => What::Expired {
                timer: field(0)?,
                function: field(1)?,
                now_ns: field(2)?,
            },
            Kind::Fault => What::Fault,
            Kind::Idle => What::Idle(small(0).filter(|state| *state != u32::MAX)),
            Kind::Marker => {
                let from = layout.fields.first()?.0;
                let text = bytes.get(from..)?;
                let digits = text.iter().take_while(|byte| byte.is_ascii_digit());
                let add = |sum: u64, byte: &u8| {
                    let digit = u64::from(byte - b'0');
                    sum.checked_mul(10)?.checked_add(digit)
                };
                What::Marker(digits.into_iter().try_fold(0, add)?)
            }
        };
        Some(Event {
            at_ns,
            core,
            thread: number(bytes, layout.thread)? as u32 as Thread,
            in_interrupt: number(bytes, layout.flags)? & INTERRUPTED != 0,
            what,
        })
    }
}

/// The number in a field of 1, 2, 4 or 8 bytes.
fn number(bytes: &[u8], (from, size): Place) -> Option<u64> {
    let bytes = bytes.get(from..from.checked_add(size)?)?;
    Some(match size {
        1 => bytes[0].into(),
        2 => u16::from_ne_bytes(bytes.try_into().ok()?).into(),
        4 => u32::from_ne_bytes(bytes.try_into().ok()?).into(),
        8 => u64::from_ne_bytes(bytes.try_into().ok()?),
        _ => return None,
    })
}

/// A name as text.
pub fn text(name: &Name) -> String {
    let end = name.iter().position(|byte| *byte == 0);
    String::from_utf8_lossy(&name[..end.unwrap_or(name.len())]).into_owned()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const COMMON: &str = "field:unsigned char common_flags;\toffset:2;\tsize:1;\tsigned:0;
field:int common_pid;\toffset:4;\tsize:4;\tsigned:1;\n";

    fn decoder() -> Decoder {
        let mut decoder = Decoder::default();
        // An older kernel has other places and bits than a newer one.
        for (name, id, more) in [
            (
                "sched_switch",
                7,
                "field:char prev_comm[16];\toffset:8;\tsize:16;\tsigned:0;
field:char next_comm[16];\toffset:24;\tsize:16;\tsigned:0;
field:pid_t next_pid;\toffset:40;\tsize:4;\tsigned:1;
field:long prev_state;\toffset:48;\tsize:8;\tsigned:1;
print fmt: { 0x10, \"T\" }, { 0x2, \"D\" }",
            ),
            (
                "irq_handler_entry",
                8,
                "field:int irq;\toffset:8;\tsize:4;\tsigned:1;
field:__data_loc char[] name;\toffset:12;\tsize:4;\tsigned:0;",
            ),
            ("local_timer_exit", 9, ""),
        ] {
            let text = format!("name: {name}\nID: {id}\n{COMMON}{more}\n");
            let format = Format::parse(&text).expect("a description");
            decoder.learn(&format).expect("all its fields");
        }
        decoder
    }

    fn switch(state: u64) -> Vec<u8> {
        let mut bytes = vec![0; 56];
        bytes[0] = 7;
        bytes[4] = 42;
        bytes[8..11].copy_from_slice(b"old");
        bytes[24..27].copy_from_slice(b"new");
        bytes[40] = 43;
        bytes[48..56].copy_from_slice(&state.to_ne_bytes());
        bytes
    }

    #[test]
    fn fields_are_read_where_the_kernel_says() {
        let mut decoder = decoder();
        for (state, expected) in [
            (0, Left::Ready),
            (0x100, Left::Ready),
            (1, Left::Asleep),
            (2, Left::Disk),
            (0x10, Left::Stopped),
        ] {
            let event = decoder.event(5, 1, &switch(state)).expect("a switch");
            let What::Switch { left, next, names } = event.what else {
                panic!("{event:?}");
            };
            assert_eq!((event.thread, next, left), (42, 43, expected));
            assert_eq!(names.each_ref().map(text), ["old", "new"]);
        }
        let mut bytes = vec![8, 0, 0x08, 0, 0, 0, 0, 0, 24, 0, 0, 0, 16, 0, 4, 0];
        bytes.extend(b"tty\0");
        let event = decoder.event(5, 1, &bytes).expect("an interrupt");
        assert_eq!(event.what, What::Enter(Source::Line(24)));
        assert!(event.in_interrupt);
        assert_eq!(decoder.lines[&24], "tty");
        let exit = decoder.event(5, 1, &[9, 0, 0, 0, 0, 0, 0, 0]);
        let exit = exit.expect("an end").what;
        assert_eq!(exit, What::Exit(Source::Vector("local_timer")));
        assert_eq!(decoder.event(5, 1, &[77, 0, 0, 0]), None);
    }

    #[test]
    fn a_field_that_is_not_there_is_named() {
        let text = format!("name: sched_waking\nID: 3\n{COMMON}");
        let format = Format::parse(&text).expect("a description");
        let lacks = Decoder::default().learn(&format).expect_err("no pid");
        assert_eq!(lacks.field, "pid");
        assert!(lacks.to_string().contains("sched_waking"), "{lacks}");
    }

    proptest! {
        #[test]
        fn cut_events_are_passed_over(bytes in prop::collection::vec(any::<u8>(), 0..60), id in 6_u8..11) {
            let mut bytes = bytes;
            if let Some(first) = bytes.first_mut() {
                *first = id;
            }
            let _ = decoder().event(1, 0, &bytes);
        }
    }
}
