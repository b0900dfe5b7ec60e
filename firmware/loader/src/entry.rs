//! How an application asks for the loader: a mark at the end of the RAM, then a watchdog reset.

/// The mark.
pub const MARK: u32 = 0x4C47_B007;
/// Its address, the last four bytes of the RAM. The loader's stack begins below.
pub const MARK_AT: u16 = 0x40FC;

/// How long the loader waits for a first command when the application has asked for it, in ms.
pub const WAITS_WHEN_ASKED_MS: u16 = 8_000;
/// How long it waits after power-on and after the reset button, in ms.
pub const WAITS_MS: u16 = 500;
/// How long the first whole command makes it wait, counted from the reset, in ms.
pub const WAITS_AFTER_COMMAND_MS: u16 = 2_500;
/// How long it waits after a page was written or read, in ms.
pub const WAITS_AFTER_PAGE_MS: u16 = 3_000;
/// It never stays longer than this when there is an application, in ms.
pub const LONGEST_MS: u32 = 120_000;
