//! How urgent a thread is to the kernel.

/// Gives the calling thread a scheduling class (`libc::SCHED_FIFO`, …), and a priority in it.
///
/// # Errors
/// The user may not.
#[allow(unsafe_code)]
pub fn schedule(class: i32, priority: i32) -> std::io::Result<()> {
    let parameter = libc::sched_param {
        sched_priority: priority,
    };
    // SAFETY: the parameter outlives the call, which reads it and changes this thread only.
    match unsafe { libc::sched_setscheduler(0, class, &raw const parameter) } {
        0 => Ok(()),
        _ => Err(std::io::Error::last_os_error()),
    }
}
