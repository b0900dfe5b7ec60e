//! How large a floor may be.

/// The most squares each way.
pub const MAX_SQUARES: u8 = 99;

/// The most nodes of a floor.
pub const MAX_NODES: usize = (MAX_SQUARES as usize + 1) * (MAX_SQUARES as usize + 1);

/// The shortest side of a square in cm. The sensors must find a mark at the middle of an edge after
/// the axle has passed the node before. Marks are 17 cm long, and goods stand behind them.
pub(crate) const MIN_SIDE_CM: u16 = 40;

/// The longest side of a square in cm. Over a longer one, dead reckoning misses the next mark.
pub(crate) const MAX_SIDE_CM: u16 = 500;

/// The most products in one warehouse.
pub const MAX_PRODUCTS: usize = 256;
