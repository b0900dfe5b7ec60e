//! [`ResetOrder`]: the Pi tells a board to restart. Version 1 only.
//!
//! ```text
//! reset     order  !order  0  0  0  0  0  0
//! ```
//!
//! The board makes itself safe first, and its next handshake says that it was told to.

use crate::bytes::{Bytes, Fault, unused_from};
use crate::coded::coded;

coded! {
    /// Where a board goes on after the reset.
    pub enum ResetOrder {
        /// It starts its program again.
        Restart = 1,
        /// It waits in its bootloader for a new image.
        Loader = 2,
    }
}

impl ResetOrder {
    pub(crate) fn write(self, payload: &mut Bytes) {
        let code = self.code();
        *payload = [code, !code, 0, 0, 0, 0, 0, 0];
    }

    pub(crate) fn read(payload: &Bytes) -> Result<Self, Fault> {
        let order = Self::from_code(payload[0]).ok_or(Fault { index: 0 })?;
        if payload[1] != !payload[0] {
            return Err(Fault { index: 1 });
        }
        unused_from(2, payload)?;
        Ok(order)
    }
}
