//! The stack of the main thread. Where `ulimit -s` leaves too little, the kernel ends the process in
//! the middle of something without a sentence. The kernel looks at the limit whenever the stack
//! grows, so it is raised here, before anything needs it, and child processes inherit that. All other
//! threads have 2 MiB of their own, whatever the limit is.

use anyhow::{Result, bail};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// What the main thread of any command needs, with some to spare, in bytes.
const NEEDED: u64 = 1 << 20;
/// What it gets where it may, as on every other Linux machine, in bytes.
const USUAL: u64 = 8 << 20;

/// Makes sure that the stack suffices.
///
/// # Errors
/// It does not, and this user may not raise its limit.
pub fn must_suffice() -> Result<()> {
    let Some(raised) = raised(&getrlimit(Resource::Stack)) else {
        return Ok(());
    };
    if let Err(error) = setrlimit(Resource::Stack, raised) {
        bail!(
            "the stack may have less than the {} KiB that are needed, and the limit cannot be \
             raised ({error}); say `ulimit -s {}` first",
            NEEDED / 1024,
            USUAL / 1024
        );
    }
    Ok(())
}

/// The limit that is needed instead, if this one is too low. Above the upper limit only root goes.
fn raised(limit: &Rlimit) -> Option<Rlimit> {
    limit.current.filter(|current| *current < NEEDED)?;
    let maximum = limit.maximum.map(|maximum| maximum.max(NEEDED));
    Some(Rlimit {
        current: Some(maximum.unwrap_or(USUAL).min(USUAL)),
        maximum,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stack_that_is_too_small_is_raised_as_far_as_it_may() {
        let limit = |current, maximum| Rlimit { current, maximum };
        for fine in [None, Some(NEEDED), Some(USUAL)] {
            assert_eq!(raised(&limit(fine, None)), None);
        }
        let small = Some(256 << 10);
        for (maximum, expected) in [
            (None, (Some(USUAL), None)),
            (Some(64 << 20), (Some(USUAL), Some(64 << 20))),
            (Some(2 << 20), (Some(2 << 20), Some(2 << 20))),
            (small, (Some(NEEDED), Some(NEEDED))),
        ] {
            let expected = limit(expected.0, expected.1);
            assert_eq!(raised(&limit(small, maximum)), Some(expected));
        }
    }
}
