//! Power goes at any moment of an update: no mixed image starts, and the next update succeeds.

use std::time::Duration;

use lager_loader::{BOOT_SECTION, Image, LoaderError, PAGE, UpdateError, write};
use lager_wire::Callsign;

use crate::support::{Bench, Cut, image, other};

/// GPIOR0, in which the loader leaves the reset flags when it starts an application.
const STARTED: u8 = 0x3E;

/// Whether the flash has this image from its beginning on.
fn has(bench: &Bench, image: &Image) -> bool {
    bench.chip.flash()[..image.bytes().len()] == *image.bytes()
}

/// Cuts the update from `old` to `new` once, and then updates again.
fn survives(old: &Image, new: &Image, cut: Cut) {
    let mut bench = Bench::new(old.role(), Some(old));
    let boot_section = bench.boot_section();
    bench.cut = Some(cut);
    match write(&mut bench, new, |_| ()) {
        Err(UpdateError::Loader(LoaderError::Line(_))) => {}
        end => panic!("{cut:?}: {end:?}"),
    }
    bench.power();
    bench.run(Duration::from_millis(900));
    let started = bench.chip.register(STARTED) != 0;
    let whole = has(&bench, old) || has(&bench, new);
    assert_eq!(started, whole, "{cut:?}");
    if started {
        bench.power();
    }
    write(&mut bench, new, |_| ()).unwrap_or_else(|error| panic!("{cut:?}: {error}"));
    assert!(has(&bench, new), "{cut:?}");
    assert!(bench.boot_section() == boot_section, "{cut:?}");
}

/// Cuts at each page: while it is erased, between erasure and write, while it is written, behind it.
fn cut_at(role: Callsign, pages: impl Fn(usize) -> bool) {
    let old = image(role);
    let new = other(&old, 7);
    let count = new.bytes().len().div_ceil(PAGE);
    assert!(new.bytes().len() < BOOT_SECTION as usize);
    for page in (0..count).filter(|page| pages(*page)) {
        for operation in [2 * page + 1, 2 * page + 2] {
            // At another moment for each page; an erasure or a write takes 4.5 ms.
            let within = Duration::from_micros(300 + page as u64 * 811 % 3_900);
            for after in [Some(within), None] {
                survives(&old, &new, Cut { operation, after });
            }
        }
    }
}

#[test]
fn a_power_cut_leaves_a_board_that_can_be_updated() {
    // The first and the last page, and some between.
    let last = other(&image(Callsign::Sensor), 7).bytes().len() / PAGE;
    cut_at(Callsign::Sensor, |page| {
        page.is_multiple_of(16) || page == last
    });
}

#[test]
#[ignore = "all cuts of both boards take some minutes"]
fn a_power_cut_at_any_page_leaves_a_board_that_can_be_updated() {
    cut_at(Callsign::Sensor, |_| true);
    cut_at(Callsign::Steering, |_| true);
}
