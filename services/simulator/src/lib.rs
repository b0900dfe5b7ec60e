//! The robot without hardware: plant and board control behind the UART bytes of the real boards.
