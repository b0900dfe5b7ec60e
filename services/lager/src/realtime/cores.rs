//! A set of processor cores as people and the kernel write it: `0`, `0,2`, `4-7`.

use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A set of cores by the kernel's numbers, which start at 0. An empty set means that nobody chose.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct CoreSet(BTreeSet<usize>);

impl CoreSet {
    /// Whether nobody chose.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// How many cores it has.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The cores in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().copied()
    }

    /// Whether it has `core`.
    pub fn contains(&self, core: usize) -> bool {
        self.0.contains(&core)
    }
}

impl FromIterator<usize> for CoreSet {
    fn from_iter<I: IntoIterator<Item = usize>>(cores: I) -> Self {
        Self(cores.into_iter().collect())
    }
}

/// Reads ranges and single numbers with commas between them, as in the kernel's files.
impl fmt::Display for CoreSet {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut cores = self.iter().peekable();
        let mut separator = "";
        while let Some(first) = cores.next() {
            let mut last = first;
            while let Some(next) = cores.next_if(|next| *next == last + 1) {
                last = next;
            }
            write!(formatter, "{separator}{first}")?;
            if last > first {
                write!(formatter, "-{last}")?;
            }
            separator = ",";
        }
        Ok(())
    }
}

/// A text that names no cores.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` names no cores; write their numbers from 0, such as 1 or 0,2 or 2-3")]
pub struct CoreSetError(String);

impl FromStr for CoreSet {
    type Err = CoreSetError;

    fn from_str(text: &str) -> Result<Self, CoreSetError> {
        let wrong = || CoreSetError(text.to_owned());
        let number = |text: &str| text.trim().parse::<usize>().map_err(|_| wrong());
        let mut cores = BTreeSet::new();
        for part in text.trim().split(',') {
            let (first, last) = match part.split_once('-') {
                Some((first, last)) => (number(first)?, number(last)?),
                None => (number(part)?, number(part)?),
            };
            // The kernel's own sets end there. A mistyped number must not fill the memory.
            if last < first || last >= rustix::thread::CpuSet::MAX_CPU {
                return Err(wrong());
            }
            cores.extend(first..=last);
        }
        Ok(Self(cores))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cores(text: &str) -> CoreSet {
        text.parse().expect("a set of cores")
    }

    #[test]
    fn sets_are_written_as_the_kernel_writes_them() {
        for (text, written) in [
            ("0", "0"),
            ("3,1,2", "1-3"),
            ("0-1,3", "0-1,3"),
            (" 0,2-2,4\n", "0,2,4"),
        ] {
            assert_eq!(cores(text).to_string(), written);
            assert_eq!(cores(written), cores(text));
        }
        assert_eq!(CoreSet::default().to_string(), "");
    }

    #[test]
    fn what_names_no_cores_is_refused() {
        for wrong in ["", "one", "1,", "-1", "3-1", "0-9999999999", "1;2"] {
            let error = wrong.parse::<CoreSet>().expect_err("no cores");
            assert!(error.to_string().contains("from 0"), "{error}");
        }
    }
}
