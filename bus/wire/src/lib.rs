//! The UART packets between the boards and the Pi.
