//! Gives a board a new image: into its loader, write, verify, start, ask for the build number.
//!
//! ```text
//!   application --reset packet--> loader --pages, read back--> start --handshake--> its number
//! ```
//!
//! Everything that can be wrong with the image or the board is found before the first page is
//! erased. A board whose update breaks off waits in its loader for the next one.

use lager_wire::link::Up;
use lager_wire::{Callsign, ResetOrder};

use crate::board::{STARTS, ask, connect_or_find, order};
use crate::client::Client;
use crate::error::UpdateError;
use crate::header::PAGE;
use crate::image::Image;
use crate::line::Line;
use crate::stk;

/// Gives the board at `line` this image and starts it. Returns when the running image has told its
/// build number. `told` hears how much is written, in percent.
///
/// # Errors
/// The board has not got the image, or does not run it.
pub fn update<L: Line>(
    line: &mut L,
    image: &Image,
    told: impl FnMut(usize),
) -> Result<Up, UpdateError> {
    enter(line, image.role())?;
    write(line, image, told)?;
    let not_started = UpdateError::NotStarted(image.build(), image.role());
    let up = ask(line, STARTS)?.ok_or(not_started)?;
    if (up.callsign, up.build) != (image.role(), image.build()) {
        return Err(UpdateError::OtherBuild {
            board: up.callsign,
            expected: image.build(),
            told: up.build,
        });
    }
    Ok(up)
}

/// Brings the board at `line` into its loader, if it is the board with this role. A board that waits
/// in its loader stays there.
///
/// # Errors
/// It is the other board, or it has no loader.
pub fn enter<L: Line>(line: &mut L, role: Callsign) -> Result<(), UpdateError> {
    let (found, transmitter) = connect_or_find(line)?;
    let is_board = |board: Callsign| {
        if board == role {
            Ok(())
        } else {
            Err(UpdateError::OtherBoard { image: role, board })
        }
    };
    is_board(found.role)?;
    let Some(mut transmitter) = transmitter else {
        return Ok(());
    };
    order(line, &mut transmitter, role, ResetOrder::Loader)?;
    match Client::find(line, STARTS)? {
        Some(client) => is_board(client.role()),
        None => Err(UpdateError::NoLoader(role)),
    }
}

/// Writes an image to a board that waits in its loader, reads it back and starts it. `told` hears how
/// much is written, in percent.
///
/// # Errors
/// The board has not got the image.
pub fn write<L: Line>(
    line: &mut L,
    image: &Image,
    mut told: impl FnMut(usize),
) -> Result<(), UpdateError> {
    let Some(mut client) = Client::find(line, STARTS)? else {
        return Err(UpdateError::NoLoader(image.role()));
    };
    if client.role() != image.role() {
        return Err(UpdateError::OtherBoard {
            image: image.role(),
            board: client.role(),
        });
    }
    let signature = client.signature()?;
    if signature != stk::SIGNATURE {
        return Err(UpdateError::OtherChip(signature));
    }
    client.enter_programming()?;
    for (address, page) in image.pages() {
        client.write_page(address, page)?;
        told((address as usize + page.len()) * 100 / image.bytes().len());
    }
    for (from, page) in image.pages() {
        let read: [u8; PAGE] = client.read_page(from)?;
        for ((address, expected), found) in (from..).zip(page).zip(read) {
            if *expected != found {
                return Err(UpdateError::Differs {
                    address,
                    found,
                    expected: *expected,
                });
            }
        }
    }
    Ok(client.start()?)
}
