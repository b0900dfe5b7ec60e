//! Whose fault a late frame is: the kernel's events around it, laid beside the stages of the robot.
//!
//! ```text
//!  tracefs ──> page ──> event ──> timeline ──> walk ──> blame ──> report, chrome
//!  (the shell)  bytes    fields     order       pieces   verdict   a table, a file for Perfetto
//!                                     ▲
//!              stages and their stamps ┘  (whoever measures)
//! ```
//!
//! Only [`Tracer`], [`proc`] and [`name_functions`] open files; everything else is pure. The crate
//! knows no topic and no service: a frame is a list of times, and of who was there.
//!
//! **How a cause is found.** The way of a frame is followed back from its end, from each thread to
//! the one that woke it ([`walk`]). Its pieces cover the frame's time once. A piece is own code, a
//! wait for a core, an interrupt, and so on. The verdict is the cause that took the most time beyond
//! its median in frames that were in time ([`blame`]).
//!
//! **Limits.** The kernel says when a page fault begins, not when it ends; it counts until the next
//! event of its core. A virtual machine's core that halts is woken by the host: up to 1 ms counts as
//! the core's sleep, more as the hypervisor's.

pub mod blame;
mod chrome;
pub mod event;
pub mod format;
pub mod frame;
mod limit;
pub mod modest;
mod mount;
pub mod page;
pub mod proc;
pub mod report;
pub mod timeline;
mod tracefs;
pub mod walk;

pub use blame::Explainer;
pub use frame::{Cause, Frame, Machine, Mark, Who};
pub use limit::limit;
pub use modest::Modest;
pub use report::{Report, Verdict};
pub use tracefs::{NoTracing, Tracer, name_functions};
