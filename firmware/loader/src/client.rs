//! [`Client`]: the Pi's end of the loader's protocol, one command at a time.

use core::time::Duration;
use std::io;

use lager_wire::Callsign;
use thiserror::Error;

use crate::line::Line;
use crate::stk;

/// The loader answers at once, but it may have to write a page (10 ms) or to check the application
/// (150 ms) first, and a machine under load is late.
const PATIENCE: Duration = Duration::from_millis(1_500);
/// How long the Pi waits for an answer before it asks again whether there is a loader.
const ASKS_EVERY: Duration = Duration::from_millis(50);

/// Why a command failed.
#[derive(Debug, Error)]
pub enum LoaderError {
    /// The line is gone.
    #[error("the line to the board is gone: {0}; is the cable in place?")]
    Line(#[from] io::Error),
    /// No answer, or only a part of it.
    #[error("the board's bootloader does not answer any more; try again")]
    Silent,
    /// An answer that it does not give.
    #[error(
        "the board's bootloader answers {found:#04x} where {expected:#04x} was expected; does \
         another program use the line?"
    )]
    Answer {
        /// The byte that came.
        found: u8,
        /// The byte that should have come.
        expected: u8,
    },
    /// It refuses a page.
    #[error("the board's bootloader refuses the page at {address:#07x}")]
    Refused {
        /// The page's first byte.
        address: u32,
    },
}

/// A loader that waits for commands.
#[derive(Debug)]
pub struct Client<'line, L> {
    line: &'line mut L,
    role: Callsign,
}

impl<'line, L: Line> Client<'line, L> {
    /// Looks for a loader. `None`: none has answered within this time.
    ///
    /// # Errors
    /// The line is gone.
    pub fn find(mut line: &'line mut L, within: Duration) -> Result<Option<Self>, LoaderError> {
        let until = line.now() + within;
        while line.now() < until {
            line.send(&[stk::GET_SYNC, stk::EOP])?;
            let mut last = None;
            let asked = line.now();
            while let Some(left) = (asked + ASKS_EVERY).checked_sub(line.now())
                && let Some(byte) = line.receive(left)?
            {
                if last.replace(byte) == Some(stk::INSYNC) && byte == stk::OK {
                    break;
                }
            }
            if last != Some(stk::OK) {
                continue;
            }
            // A board that runs its application can send these two bytes by chance, but not a role
            // between them.
            let mut client = Self {
                line,
                role: Callsign::Error,
            };
            match client
                .parameter(stk::parameter::ROLE)
                .map(Callsign::from_code)
            {
                Ok(Some(role @ (Callsign::Sensor | Callsign::Steering))) => {
                    client.role = role;
                    return Ok(Some(client));
                }
                Err(LoaderError::Line(error)) => return Err(error.into()),
                Ok(_) | Err(_) => line = client.line,
            }
        }
        Ok(None)
    }

    /// The board.
    pub fn role(&self) -> Callsign {
        self.role
    }

    /// The chip's signature.
    ///
    /// # Errors
    /// The loader does not answer as it should; the same for all commands.
    pub fn signature(&mut self) -> Result<[u8; 3], LoaderError> {
        self.command(&[stk::READ_SIGNATURE])
    }

    /// Whether the board has a whole application.
    ///
    /// # Errors
    /// As for [`Client::signature`].
    pub fn is_whole(&mut self) -> Result<bool, LoaderError> {
        Ok(self.parameter(stk::parameter::WHOLE)? == 1)
    }

    /// Writes a page of the flash.
    ///
    /// # Errors
    /// As for [`Client::signature`], or the loader refuses the page.
    pub fn write_page(&mut self, address: u32, bytes: &[u8]) -> Result<(), LoaderError> {
        self.load(address)?;
        let [high, low] = (bytes.len() as u16).to_be_bytes();
        let mut command = vec![stk::WRITE_PAGE, high, low, stk::FLASH];
        command.extend(bytes);
        match self.command::<0>(&command) {
            Err(LoaderError::Answer {
                found: stk::FAILED, ..
            }) => Err(LoaderError::Refused { address }),
            answer => answer.map(|_| ()),
        }
    }

    /// Reads from the flash.
    ///
    /// # Errors
    /// As for [`Client::signature`].
    pub fn read_page<const N: usize>(&mut self, address: u32) -> Result<[u8; N], LoaderError> {
        self.load(address)?;
        let [high, low] = (N as u16).to_be_bytes();
        self.command(&[stk::READ_PAGE, high, low, stk::FLASH])
    }

    /// Starts the application. A loader without a whole application stays.
    ///
    /// # Errors
    /// As for [`Client::signature`].
    pub fn start(mut self) -> Result<(), LoaderError> {
        self.command::<0>(&[stk::LEAVE_PROGRAMMING]).map(|_| ())
    }

    pub(crate) fn enter_programming(&mut self) -> Result<(), LoaderError> {
        self.command::<0>(&[stk::ENTER_PROGRAMMING]).map(|_| ())
    }

    fn parameter(&mut self, which: u8) -> Result<u8, LoaderError> {
        self.command(&[stk::GET_PARAMETER, which])
            .map(|[value]| value)
    }

    fn load(&mut self, address: u32) -> Result<(), LoaderError> {
        let [low, high] = ((address >> 1) as u16).to_le_bytes();
        self.command::<0>(&[stk::LOAD_ADDRESS, low, high])
            .map(|_| ())
    }

    /// Sends a command and takes in its answer of `N` bytes.
    fn command<const N: usize>(&mut self, command: &[u8]) -> Result<[u8; N], LoaderError> {
        let mut bytes = command.to_vec();
        bytes.push(stk::EOP);
        self.line.send(&bytes)?;
        self.expect(stk::INSYNC)?;
        let mut answer = [0; N];
        for place in &mut answer {
            *place = self.receive()?;
        }
        self.expect(stk::OK)?;
        Ok(answer)
    }

    fn expect(&mut self, expected: u8) -> Result<(), LoaderError> {
        match self.receive()? {
            found if found == expected => Ok(()),
            found => Err(LoaderError::Answer { found, expected }),
        }
    }

    fn receive(&mut self) -> Result<u8, LoaderError> {
        self.line.receive(PATIENCE)?.ok_or(LoaderError::Silent)
    }
}
