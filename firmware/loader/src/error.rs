//! [`UpdateError`]: what can go wrong with a board, in sentences that say what to do.

use lager_wire::Callsign;
use thiserror::Error;

use crate::client::LoaderError;

/// Why a board has no new image, or has not restarted.
#[derive(Debug, Error)]
pub enum UpdateError {
    /// A command failed.
    #[error(transparent)]
    Loader(#[from] LoaderError),
    /// Nobody answers.
    #[error(
        "no board answers; is it switched on, is this its port, and is its image built for this \
         baud rate?"
    )]
    NobodyAnswers,
    /// The board's program is the original one.
    #[error(
        "the {} board has its original program, which cannot be told to reset; give it ours once \
         with a programmer (`lager board flash --help`)",
        .0
    )]
    Original(Callsign),
    /// The board does not come up in its loader.
    #[error(
        "the {} board did not start its bootloader; if it has none, give it one with a \
         programmer (`lager board flash --help`)",
        .0
    )]
    NoLoader(Callsign),
    /// Another board than the one that was meant.
    #[error("the {} board is at this port, not the {} board", .board, .asked)]
    OtherRole {
        /// The board that was meant.
        asked: Callsign,
        /// The board at the line.
        board: Callsign,
    },
    /// Its loader has nothing to start.
    #[error(
        "the {} board has no whole image and waits in its bootloader; `lager board update` gives \
         it one",
        .0
    )]
    NoImage(Callsign),
    /// It has not done what it was told.
    #[error(
        "the {} board has not started again within 5 s; switch it off and on, and look at its cable",
        .0
    )]
    NotReset(Callsign),
    /// Another chip.
    #[error("this is no ATmega1284P: its signature is {0:02x?}")]
    OtherChip([u8; 3]),
    /// The image is for the other board.
    #[error(
        "this is the image of the {} board, and the {} board is at this port; nothing was written",
        .image,
        .board
    )]
    OtherBoard {
        /// The board that the image is for.
        image: Callsign,
        /// The board at the line.
        board: Callsign,
    },
    /// The flash has not taken a byte.
    #[error(
        "the board has {found:#04x} at {address:#07x} and should have {expected:#04x}; try again, \
         and if it stays so, the chip is worn out"
    )]
    Differs {
        /// The byte's address.
        address: u32,
        /// The byte that was read back.
        found: u8,
        /// The byte of the image.
        expected: u8,
    },
    /// The image is written, but the board has not started it.
    #[error(
        "build {0} is written, but the {board} board did not start it; switch the board off and on",
        board = .1
    )]
    NotStarted(u16, Callsign),
    /// The board runs another image than the one that was written.
    #[error(
        "build {expected} was written, but the {} board says that it runs build {told}",
        .board
    )]
    OtherBuild {
        /// The board.
        board: Callsign,
        /// The number in the image's header.
        expected: u16,
        /// The number in its handshake.
        told: u16,
    },
}
