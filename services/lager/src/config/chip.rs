//! `[chip]`: finds the boards' real images, their bootloaders and their emulator.
//!
//! The emulator is a separate program, because it contains GPL-3 code; this program does not link
//! it. This module looks for the emulator and the images beside this program, as in an
//! installation, and in the source tree of this program or of the current folder.

use std::fmt;
use std::path::{Path, PathBuf};

use super::section::section;

section! {
    "chip"
    /// The emulator's program and the boards' images, built for [serial] baud. Unset, `lager` looks
    /// for them beside itself and in the source tree.
    pub struct ChipSection {
        /// The emulator's program ...
        pub emulator: Option<PathBuf> = None,
        /// ... and the images that the boards run.
        pub sensor_elf: Option<PathBuf> = None,
        pub steering_elf: Option<PathBuf> = None,
        /// Folder that keeps the EEPROM of both boards, which has their settings. Unset, it is in
        /// the folder of the bus: an emulated robot's settings outlive the robot, but not a restart
        /// of the machine, and a simulated robot's outlive its simulator, but not the robot.
        pub eeprom: Option<PathBuf> = None,
        /// The file in which an emulator that somebody else runs at the ports of [serial] publishes
        /// the robot's time. With body = "chip", `up` chooses it.
        pub clock: Option<PathBuf> = None,
    }
}

/// The files that an emulated robot needs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parts {
    /// The emulator's program.
    pub emulator: PathBuf,
    /// The sensor board's image.
    pub sensor_elf: PathBuf,
    /// The steering board's image.
    pub steering_elf: PathBuf,
}

/// One sentence for each missing file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MissingParts(Vec<String>);

impl fmt::Display for MissingParts {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "files for the emulated boards are missing: {}",
            self.0.join("; ")
        )
    }
}

impl std::error::Error for MissingParts {}

/// One of the files: its key, its name, the folder of the source tree in which it is built, and the
/// command that builds it.
struct Part {
    key: &'static str,
    name: &'static str,
    built: &'static str,
    command: &'static str,
}

const EMULATOR: Part = Part {
    key: "emulator",
    name: "lager-emulator",
    built: "firmware/emulator/target/release",
    command: "build it with `cargo build --release` in firmware/emulator, whose README.md says what that needs",
};
const SENSOR: Part = Part {
    key: "sensor_elf",
    name: "sensor.elf",
    built: IMAGES,
    command: BUILD_IMAGES,
};
const STEERING: Part = Part {
    key: "steering_elf",
    name: "steering.elf",
    built: IMAGES,
    command: BUILD_IMAGES,
};
const IMAGES: &str = "firmware/avr/target/images";
const BUILD_IMAGES: &str = "build both images with `firmware/avr/build`, which says what it needs";

/// The images for the original's baud rate. They have a folder of their own.
const SLOW: u32 = 9_600;
const SLOW_SENSOR: Part = Part {
    built: SLOW_IMAGES,
    command: BUILD_SLOW_IMAGES,
    ..SENSOR
};
const SLOW_STEERING: Part = Part {
    built: SLOW_IMAGES,
    command: BUILD_SLOW_IMAGES,
    ..STEERING
};
const SLOW_IMAGES: &str = "firmware/avr/target/images/9600";
/// Where the Debian package has the files for a programmer and for `lager board update`.
const INSTALLED: &str = "share/lager/images";
const SLOW_INSTALLED: &str = "share/lager/images/9600";
const BUILD_SLOW_IMAGES: &str =
    "build both images with `firmware/avr/build --baud 9600`, which says what it needs";

impl ChipSection {
    /// The files of this machine with their full paths; the images are those for `baud`.
    ///
    /// # Errors
    /// A file is missing. The sentence says how to get it.
    pub fn parts(&self, baud: u32) -> Result<Parts, MissingParts> {
        let program = std::env::current_exe().unwrap_or_default();
        let current = std::env::current_dir().unwrap_or_default();
        let program = program.parent().unwrap_or(Path::new("/"));
        self.parts_near(program, &current, baud)
    }

    /// A board's .hex file of this machine, such as `sensor.hex`, for boards at `baud`.
    ///
    /// # Errors
    /// It is missing. The sentence says how to get it.
    pub fn hex(&self, name: &str, baud: u32) -> Result<PathBuf, String> {
        let program = std::env::current_exe().unwrap_or_default();
        let current = std::env::current_dir().unwrap_or_default();
        hex_near(
            program.parent().unwrap_or(Path::new("/")),
            &current,
            name,
            baud,
        )
    }

    fn parts_near(&self, program: &Path, current: &Path, baud: u32) -> Result<Parts, MissingParts> {
        let (sensor, steering) = match baud {
            SLOW => (&SLOW_SENSOR, &SLOW_STEERING),
            _ => (&SENSOR, &STEERING),
        };
        let mut missing = Vec::new();
        let mut find = |part: &Part, named: Option<&PathBuf>| {
            part.find(named, program, current)
                .map_err(|sentence| missing.push(sentence))
        };
        let found = (
            find(&EMULATOR, self.emulator.as_ref()),
            find(sensor, self.sensor_elf.as_ref()),
            find(steering, self.steering_elf.as_ref()),
        );
        match found {
            (Ok(emulator), Ok(sensor_elf), Ok(steering_elf)) => Ok(Parts {
                emulator,
                sensor_elf,
                steering_elf,
            }),
            _ => Err(MissingParts(missing)),
        }
    }
}

impl Part {
    fn find(
        &self,
        named: Option<&PathBuf>,
        program: &Path,
        current: &Path,
    ) -> Result<PathBuf, String> {
        let Self { key, command, .. } = self;
        if let Some(named) = named {
            let whole = current.join(named);
            return if whole.is_file() {
                Ok(whole)
            } else {
                Err(format!(
                    "{} is not there, which [chip] {key} names; {command}",
                    named.display()
                ))
            };
        }
        near(program, current, &[self.built], self.name).ok_or_else(|| {
            format!(
                "there is no {}/{}; {command}, or name it in the configuration's [chip] {key}",
                self.built, self.name
            )
        })
    }
}

/// The program with that name beside this one, or in that folder of the source tree.
pub fn program_near(name: &str, built: &str) -> Option<PathBuf> {
    let program = std::env::current_exe().unwrap_or_default();
    let current = std::env::current_dir().unwrap_or_default();
    near(
        program.parent().unwrap_or(Path::new("/")),
        &current,
        &[built],
        name,
    )
}

/// A file beside this program, or in one of these folders of a tree that this program or the
/// current folder lies in.
fn near(program: &Path, current: &Path, folders: &[&str], name: &str) -> Option<PathBuf> {
    let trees = program.ancestors().chain(current.ancestors());
    let inside = trees.flat_map(|tree| folders.iter().map(|folder| tree.join(folder).join(name)));
    core::iter::once(program.join(name))
        .chain(inside)
        .find(|path| path.is_file())
}

fn hex_near(program: &Path, current: &Path, name: &str, baud: u32) -> Result<PathBuf, String> {
    let (folders, command) = match baud {
        SLOW => ([SLOW_IMAGES, SLOW_INSTALLED], BUILD_SLOW_IMAGES),
        _ => ([IMAGES, INSTALLED], BUILD_IMAGES),
    };
    near(program, current, &folders, name).ok_or_else(|| {
        format!(
            "there is no {}/{name}; {command}, or name the file",
            folders[0]
        )
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    /// An empty folder of the test's own.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let name = format!("lager-parts-{}-{name}", std::process::id());
            let folder = std::env::temp_dir().join(name);
            fs::create_dir_all(&folder).expect("a temporary folder");
            Self(folder)
        }

        fn build(&self, part: &Part) -> PathBuf {
            self.put(&format!("{}/{}", part.built, part.name))
        }

        fn put(&self, path: &str) -> PathBuf {
            let path = self.0.join(path);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            fs::write(&path, b"").expect("a file");
            path
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn what_was_built_is_found_from_the_program_and_from_any_folder_of_the_tree() {
        let tree = Folder::new("tree");
        let parts = Parts {
            emulator: tree.build(&EMULATOR),
            sensor_elf: tree.build(&SENSOR),
            steering_elf: tree.build(&STEERING),
        };
        let chip = ChipSection::default();
        let (program, elsewhere) = (tree.0.join("target/release"), Path::new("/"));
        assert_eq!(
            chip.parts_near(&program, elsewhere, 500_000),
            Ok(parts.clone())
        );
        let inside = tree.0.join("bus");
        assert_eq!(
            chip.parts_near(elsewhere, &inside, 500_000),
            Ok(parts.clone())
        );

        let missing = chip.parts_near(elsewhere, &inside, SLOW);
        let missing = missing.expect_err("no images for this rate").to_string();
        assert!(missing.contains("build --baud 9600"), "{missing}");
        let slow = Parts {
            sensor_elf: tree.build(&SLOW_SENSOR),
            steering_elf: tree.build(&SLOW_STEERING),
            ..parts
        };
        assert_eq!(chip.parts_near(elsewhere, &inside, SLOW), Ok(slow));
    }

    #[test]
    fn a_file_for_a_programmer_is_found_in_the_tree_and_where_the_package_has_it() {
        let (tree, root) = (Folder::new("hex"), Folder::new("installed"));
        let elsewhere = Path::new("/");
        let bin = root.0.join("usr/bin");
        let found = |program: &Path, baud| hex_near(program, elsewhere, "sensor.hex", baud);
        let told = found(&bin, 500_000).expect_err("nothing is there");
        assert!(told.contains("firmware/avr/build`"), "{told}");
        let built = tree.put("firmware/avr/target/images/sensor.hex");
        assert_eq!(found(&tree.0.join("target/debug"), 500_000), Ok(built));
        let fast = root.put("usr/share/lager/images/sensor.hex");
        assert_eq!(found(&bin, 500_000), Ok(fast));
        let told = found(&bin, SLOW).expect_err("not for this rate");
        assert!(told.contains("build --baud 9600"), "{told}");
        let slow = root.put("usr/share/lager/images/9600/sensor.hex");
        assert_eq!(found(&bin, SLOW), Ok(slow));
    }

    #[test]
    fn a_file_that_is_named_goes_before_one_that_is_found() {
        let tree = Folder::new("named");
        for part in [&EMULATOR, &SENSOR, &STEERING] {
            tree.build(part);
        }
        let named = tree.put("slow/sensor.elf");
        let chip = ChipSection {
            sensor_elf: Some("slow/sensor.elf".into()),
            ..ChipSection::default()
        };
        let parts = chip
            .parts_near(Path::new("/"), &tree.0, 500_000)
            .expect("all there");
        assert_eq!(parts.sensor_elf, named);
    }

    #[test]
    fn what_is_missing_is_told_with_the_command_that_builds_it() {
        let tree = Folder::new("bare");
        let chip = ChipSection {
            sensor_elf: Some("nowhere.elf".into()),
            ..ChipSection::default()
        };
        let told = |chip: &ChipSection| {
            let missing = chip.parts_near(&tree.0, &tree.0, 500_000);
            missing.expect_err("nothing is there").to_string()
        };
        let all = told(&chip);
        for words in [
            "cargo build --release` in firmware/emulator",
            "firmware/avr/build",
            "nowhere.elf is not there",
            "[chip] steering_elf",
        ] {
            assert!(all.contains(words), "`{words}` is missing: {all}");
        }
        tree.put("lager-emulator");
        assert!(!told(&chip).contains("cargo"), "{}", told(&chip));
    }
}
