//! The data sharer: the only owner of the serial ports, and the arbiter of who steers.
