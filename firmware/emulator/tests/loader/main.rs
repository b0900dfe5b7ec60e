//! The boards' bootloader on its chip, with the Pi's end in virtual time.

mod avrdude;
mod cut;
mod stay;
mod support;
mod update;
