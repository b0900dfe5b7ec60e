//! Writes packets into a fixed buffer.

use core::fmt;

use crate::{BROADCAST_ID, ErrorBits, HEADER, Instruction, MAX_FRAME, OVERHEAD, checksum};

/// Why a packet could not be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EncodeError {
    /// The parameters do not fit into [`MAX_FRAME`] bytes.
    TooLong {
        /// How many bytes the packet would need.
        length: usize,
    },
    /// A servo of a SYNC_WRITE has another number of values than the first.
    UnevenValues {
        /// Id of that servo.
        id: u8,
    },
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooLong { length } => {
                write!(
                    f,
                    "the packet would have {length} bytes, split it: {MAX_FRAME} fit"
                )
            }
            Self::UnevenValues { id } => {
                write!(
                    f,
                    "servo {id} has another number of values than the first, give every servo the same"
                )
            }
        }
    }
}

impl core::error::Error for EncodeError {}

/// One finished packet, ready for the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    bytes: [u8; MAX_FRAME],
    length: u8,
}

impl Frame {
    /// The packet's bytes, header to checksum.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }

    /// Asks servo `id` to answer.
    #[must_use]
    pub fn ping(id: u8) -> Self {
        Self::fitting(id, Instruction::Ping, &[])
    }

    /// Asks servo `id` for `count` registers from `address` on.
    #[must_use]
    pub fn read(id: u8, address: u8, count: u8) -> Self {
        Self::fitting(id, Instruction::Read, &[address, count])
    }

    /// Writes `values` from `address` on, at once.
    pub fn write(id: u8, address: u8, values: &[u8]) -> Result<Self, EncodeError> {
        Self::with_address(id, Instruction::Write, address, values)
    }

    /// Writes `values` from `address` on, but only when [`Frame::action`] comes.
    pub fn reg_write(id: u8, address: u8, values: &[u8]) -> Result<Self, EncodeError> {
        Self::with_address(id, Instruction::RegWrite, address, values)
    }

    /// Carries out the writes that servos hold back; for all servos with [`BROADCAST_ID`].
    #[must_use]
    pub fn action(id: u8) -> Self {
        Self::fitting(id, Instruction::Action, &[])
    }

    /// Writes the same registers of several servos at once. No servo answers.
    pub fn sync_write(address: u8, servos: &[(u8, &[u8])]) -> Result<Self, EncodeError> {
        let width = servos.first().map_or(0, |(_, values)| values.len());
        let mut builder = Builder::new(BROADCAST_ID, Instruction::SyncWrite.code());
        builder.byte(address);
        builder.byte(u8::try_from(width).unwrap_or(u8::MAX));
        for (id, values) in servos {
            if values.len() != width {
                return Err(EncodeError::UnevenValues { id: *id });
            }
            builder.byte(*id);
            builder.bytes(values);
        }
        builder.finish()
    }

    /// Any instruction with any parameters.
    pub fn instruction(
        id: u8,
        instruction: Instruction,
        parameters: &[u8],
    ) -> Result<Self, EncodeError> {
        let mut builder = Builder::new(id, instruction.code());
        builder.bytes(parameters);
        builder.finish()
    }

    /// A servo's answer.
    pub fn status(id: u8, errors: ErrorBits, parameters: &[u8]) -> Result<Self, EncodeError> {
        let mut builder = Builder::new(id, errors.bits());
        builder.bytes(parameters);
        builder.finish()
    }

    fn with_address(
        id: u8,
        instruction: Instruction,
        address: u8,
        values: &[u8],
    ) -> Result<Self, EncodeError> {
        let mut builder = Builder::new(id, instruction.code());
        builder.byte(address);
        builder.bytes(values);
        builder.finish()
    }

    /// A packet of at most two parameters, which always fit.
    fn fitting(id: u8, instruction: Instruction, parameters: &[u8]) -> Self {
        debug_assert!(parameters.len() <= 2);
        let mut builder = Builder::new(id, instruction.code());
        builder.bytes(parameters);
        builder.close()
    }
}

/// A packet under construction. It counts on when the buffer is full, so that the error can give
/// the length.
///
/// It is built in place: the chip needs 500 cycles to move it, while the wheels wait.
struct Builder {
    frame: Frame,
    used: usize,
}

impl Builder {
    fn new(id: u8, code: u8) -> Self {
        let mut bytes = [0; MAX_FRAME];
        bytes[..5].copy_from_slice(&[HEADER[0], HEADER[1], id, 0, code]);
        Self {
            frame: Frame { bytes, length: 0 },
            used: 5,
        }
    }

    fn byte(&mut self, byte: u8) {
        if let Some(place) = self.frame.bytes.get_mut(self.used) {
            *place = byte;
        }
        self.used += 1;
    }

    fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.byte(*byte);
        }
    }

    fn finish(self) -> Result<Frame, EncodeError> {
        if self.used >= MAX_FRAME {
            return Err(EncodeError::TooLong {
                length: self.used + 1,
            });
        }
        Ok(self.close())
    }

    fn close(mut self) -> Frame {
        let parameters = self.used + 1 - OVERHEAD;
        let bytes = &mut self.frame.bytes;
        bytes[3] = (parameters + 2) as u8;
        bytes[self.used] = checksum(&bytes[2..self.used]);
        self.frame.length = (self.used + 1) as u8;
        self.frame
    }
}
