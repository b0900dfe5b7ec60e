//! The bus, bare iceoryx2 and Zenoh as `rust.cpp` calls them. A failure is printed, and 0 or null is
//! returned.

#![allow(unsafe_code)]
#![allow(
    clippy::missing_safety_doc,
    reason = "each function is called by rust.cpp alone"
)]

use core::ffi::{CStr, c_char, c_void};
use core::fmt::Display;

use lager_benches::rivals::{Heard, Member, Receiver, Sender, Setup, Way, join};

fn said<T, E: Display>(result: Result<T, E>) -> Option<T> {
    result.map_err(|error| eprintln!("{error}")).ok()
}

/// A pointer that is never freed: the process ends with its measurement.
fn kept<T>(made: Option<T>) -> *mut T {
    made.map_or(core::ptr::null_mut(), |made| Box::into_raw(Box::new(made)))
}

/// Joins; `kind` and `folder` are strings, `bytes` a multiple of 8.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rivals_join(
    kind: *const c_char,
    folder: *const c_char,
    bytes: usize,
    depth: usize,
    readers: usize,
) -> *mut Box<dyn Member> {
    let text = |text| {
        // SAFETY: the caller gives strings.
        let text = unsafe { CStr::from_ptr(text) };
        text.to_string_lossy().into_owned()
    };
    let setup = Setup {
        kind: text(kind),
        folder: text(folder).into(),
        words: bytes / 8,
        depth,
        readers,
    };
    kept(said(join(&setup)))
}

const fn way(is_back: bool) -> Way {
    if is_back { Way::Back } else { Way::There }
}

/// A sending end of the member, in the member's thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rivals_sender(
    member: *const Box<dyn Member>,
    is_back: bool,
) -> *mut Box<dyn Sender> {
    // SAFETY: the caller gives what `rivals_join` returned.
    kept(said(unsafe { &*member }.sender(way(is_back))))
}

/// A receiving end of the member, in the member's thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rivals_receiver(
    member: *const Box<dyn Member>,
    is_back: bool,
) -> *mut Box<dyn Receiver> {
    // SAFETY: the caller gives what `rivals_join` returned.
    kept(said(unsafe { &*member }.receiver(way(is_back))))
}

/// Sends a sample that `write` writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rivals_send(
    sender: *mut Box<dyn Sender>,
    write: unsafe extern "C" fn(*mut c_void, *mut u8),
    context: *mut c_void,
) -> bool {
    // SAFETY: the caller's function takes its context, and writes as many bytes as it told `rivals_join`.
    let mut write = |place| unsafe { write(context, place) };
    // SAFETY: the caller gives what `rivals_sender` returned, from one thread at a time.
    said(unsafe { &mut *sender }.send(&mut write)).is_some()
}

/// Receives until `is_over`. The context is for both functions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rivals_run(
    receiver: *const Box<dyn Receiver>,
    heard: unsafe extern "C" fn(*mut c_void, *const u8, usize),
    is_over: unsafe extern "C" fn(*mut c_void) -> bool,
    context: *mut c_void,
) -> bool {
    // SAFETY: the caller's functions take its context, and its `heard` may be called in any thread.
    let (heard, is_over) = unsafe { (Heard::new(heard, context), || is_over(context)) };
    // SAFETY: the caller gives what `rivals_receiver` returned.
    said(unsafe { &*receiver }.run(heard, &is_over)).is_some()
}

/// How many samples the receiver has said to be lost; -1 = it never tells.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rivals_told(receiver: *const Box<dyn Receiver>) -> i64 {
    // SAFETY: the caller gives what `rivals_receiver` returned.
    let told = unsafe { &*receiver }.told();
    told.map_or(-1, |told| i64::try_from(told).unwrap_or(i64::MAX))
}
