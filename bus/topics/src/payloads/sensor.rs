//! What the sensor board sees: [`LineFrame`] on `sensor/line`, [`DistanceFrame`] on
//! `sensor/distance`.

use lager_sample::{Tag, payload};
use lager_wire::LineState;

payload! {
    /// One line packet of the sensor board.
    pub struct LineFrame: 8 bytes {
        /// The life of the link to the board from which this came.
        pub link_epoch: u32,
        /// The eleven sensors, bit 10 = leftmost; `0xFFFF` if the board sent only the state.
        pub bits: u16 = Self::NO_BITS,
        /// The board's classification.
        pub state: Tag<LineState>,
        /// The packet's id on the wire, 0..=15.
        pub packet_id: u8,
    }
}

impl LineFrame {
    /// The value of `bits` when the board sent only the state.
    pub const NO_BITS: u16 = 0xFFFF;
}

payload! {
    /// One distance packet of the sensor board.
    pub struct DistanceFrame: 8 bytes {
        /// The life of the link to the board from which this came.
        pub link_epoch: u32,
        /// Distance to the next thing in front, in cm; 255 = nothing in range.
        pub distance_cm: u8 = 255,
        /// The packet's id on the wire, 0..=15.
        pub packet_id: u8,
        /// Always 0.
        #[serde(skip)]
        pub reserved: [u8; 2],
    }
}
