//! The stack of the main thread. If `ulimit -s` is too small, the kernel kills the process
//! somewhere in its work, without a sentence. The kernel checks the limit whenever the stack grows,
//! so this file raises it before the program needs it. Child processes inherit the limit. All other
//! threads have 2 MiB of their own, whatever the limit is.

use anyhow::{Result, bail};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// What the main thread of any command needs, with a reserve, in bytes.
const NEEDED: u64 = 1 << 20;
/// What it gets if the limit allows, as on every other Linux machine, in bytes.
const USUAL: u64 = 8 << 20;

/// Makes sure that the stack is large enough.
///
/// # Errors
/// It is too small, and this user may not raise its limit.
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

/// The new limit, if this one is too low. Only root may raise it above the upper limit.
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
