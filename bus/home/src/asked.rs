//! What people have ordered of a unit otherwise than through its external computer, in a file of the
//! unit's folder.
//!
//! It is there to be told: nobody carries an order out because it stands here. So it may be wrong,
//! too long or gone, and its writers and its reader never wait for each other.
//!
//! ```text
//!   asked:  "73012345678901 operator mode manual\n"    when, in ns of CLOCK_MONOTONIC; by which part;
//!                                                      the order in the words of its line
//! ```

use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};

use crate::clock::Clock;
use crate::home::Home;
use crate::name::UnitName;

pub(crate) const FILE: &str = "asked";
/// Where the file begins anew, in bytes. Its reader looks several times a second.
const MOST: u64 = 16_384;

impl Home {
    /// Has what people ask of a unit written down from now on, until [`Self::forget_asked`].
    ///
    /// # Errors
    /// The unit has no folder, or it cannot be written.
    pub fn listen_asked(&self, unit: &UnitName) -> io::Result<()> {
        let mut options = OpenOptions::new();
        options.create(true).append(true);
        options.open(self.folder_of(unit).join(FILE)).map(drop)
    }

    /// Adds a line with these words to what people have asked of a unit at this moment.
    ///
    /// # Errors
    /// Nobody reads it, or it cannot be written.
    pub fn note_asked(&self, unit: &UnitName, words: &str) -> io::Result<()> {
        let path = self.folder_of(unit).join(FILE);
        let is_long = fs::metadata(&path).is_ok_and(|file| file.len() > MOST);
        let mut options = OpenOptions::new();
        // What was there has been read long ago.
        match is_long {
            true => options.write(true).truncate(true),
            false => options.append(true),
        };
        // One write, so that the lines of two writers stay apart.
        let line = format!("{} {words}\n", Clock::monotonic_ns());
        options.open(path)?.write_all(line.as_bytes())
    }

    /// What people have asked of a unit later than `after_ns`: when, and in which words.
    pub fn asked(&self, unit: &UnitName, after_ns: u64) -> Vec<(u64, String)> {
        let text = fs::read_to_string(self.folder_of(unit).join(FILE)).unwrap_or_default();
        // A line without an end is still being written.
        let whole = text.split_inclusive('\n');
        let lines = whole.filter_map(|line| line.strip_suffix('\n')?.split_once(' '));
        let asked = lines.filter_map(|(at, words)| Some((at.parse().ok()?, words.to_owned())));
        asked.filter(|(at, _)| *at > after_ns).collect()
    }

    /// Removes what was written: nobody reads it any more.
    pub fn forget_asked(&self, unit: &UnitName) {
        let _ = fs::remove_file(self.folder_of(unit).join(FILE));
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn what_was_asked_is_read_once_and_the_file_has_a_limit() {
        let folder = PathBuf::from(format!("/dev/shm/lpasked{}", std::process::id()));
        let home = Home::open("lager", Some(&folder)).expect("a folder");
        let unit = UnitName::default();
        assert!(home.listen_asked(&unit).is_err(), "there is no folder");
        home.unit(&unit);
        assert!(home.note_asked(&unit, "x").is_err(), "nobody reads it");
        home.listen_asked(&unit).expect("a file");
        assert_eq!(home.asked(&unit, 0), []);
        let ask = |words| home.note_asked(&unit, words).expect("a file");
        ask("operator mode manual");
        let first = home.asked(&unit, 0);
        assert_eq!(first[0].1, "operator mode manual");
        ask("operator gains 3 2");
        let later = home.asked(&unit, first[0].0);
        assert_eq!(later[0].1, "operator gains 3 2");
        assert_eq!(later.len(), 1);

        let file = home.folder_of(&unit).join(FILE);
        fs::write(&file, "no time\n7\n8 seven\n9 half a li").expect("a file");
        assert_eq!(home.asked(&unit, 0), [(8, "seven".to_owned())]);
        let longest = " ".repeat(MOST as usize + 1);
        fs::write(&file, longest).expect("a file");
        ask("operator calibrate");
        assert_eq!(home.asked(&unit, 0).len(), 1);
        home.forget_asked(&unit);
        assert_eq!(home.asked(&unit, 0), []);
        home.remove();
    }
}
