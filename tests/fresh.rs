//! Checks that a program is not older than its sources, for programs that cargo does not build
//! together with the tests that start them.

use std::path::{Path, PathBuf};
use std::time::SystemTime;
use std::{fs, io};

/// Returns `program`. cargo wrote the list of its sources to `list` (make's form, one rule).
///
/// # Errors
/// The program does not exist, or a source has changed since it was built.
pub fn fresh(program: &Path, list: &Path) -> Result<PathBuf, String> {
    let missing = |why: io::Error| format!("{}: {why}; tests/run builds it", program.display());
    let built = changed(program).map_err(missing)?;
    let rule = fs::read_to_string(list).map_err(missing)?;
    let (_, sources) = rule.split_once(": ").ok_or("a list without sources")?;
    // A space in a name is written `\ `.
    for source in sources.trim().replace("\\ ", "\0").split(' ') {
        let source = source.replace('\0', " ");
        if changed(Path::new(&source)).map_or(true, |at| at > built) {
            let program = program.display();
            return Err(format!(
                "{program} is older than {source}; tests/run builds it"
            ));
        }
    }
    Ok(program.to_owned())
}

fn changed(file: &Path) -> io::Result<SystemTime> {
    fs::metadata(file)?.modified()
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_program_that_is_older_than_one_of_its_sources_is_refused() {
        let domain = lager_rig::Domain::new("lager-fresh").expect("a folder");
        let [program, list, source] =
            ["program", "program.d", "its source.rs"].map(|name| domain.files().join(name));
        let told = |why: &str| {
            let said = fresh(&program, &list).expect_err(why);
            assert!(said.contains("tests/run builds it"), "{said}");
            said
        };
        told("it is not built");
        let now = SystemTime::now();
        let write = |file: &Path, seconds| {
            let at = now + Duration::from_secs(seconds);
            let file = File::create(file).expect("a file");
            file.set_modified(at).expect("a time");
        };
        write(&program, 10);
        told("it is not known from what");
        let escaped = source.display().to_string().replace(' ', "\\ ");
        let rule = format!("{}: {escaped} {escaped}\n", program.display());
        fs::write(&list, rule).expect("a file");
        told("the source is gone");
        write(&source, 9);
        assert_eq!(fresh(&program, &list).as_deref(), Ok(program.as_path()));
        write(&source, 11);
        assert!(told("the source is newer").contains("its source.rs"));
    }
}
