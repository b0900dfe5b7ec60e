//! The command register, the copy register and the flag between them (T2): which commands run.
//!
//! ```text
//!   reception              the loop
//!  -----------> command ----------------> copy ----> what is executed
//!      |           |       flag is reset    |
//!      '-- differs from copy: sets the flag-'
//! ```
//!
//! A received command does not act directly. Reception only writes the command register; the loop
//! takes the command over when it is ready. The number tells a repetition from a new command: the
//! same command with the same number only renews the age, anything else is executed. A command that
//! differs only in its code is executed too, so a Pi that restarts its numbers can always stop the
//! robot.

use lager_wire::SteerCommand;

/// What reception did with a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Receipt {
    /// The flag is set: the loop has a command to take over.
    New,
    /// It repeats the command that runs or ran last: the Pi still wants it.
    Renewed,
    /// It repeats a refused command, and renews nothing.
    AlreadyRefused,
}

/// The two registers and the flag.
#[derive(Debug, Clone, Default)]
pub struct CommandRegister {
    command: Option<SteerCommand>,
    copy: Option<SteerCommand>,
    refused: Option<SteerCommand>,
    flag: bool,
}

impl CommandRegister {
    /// Registers without any command.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            command: None,
            copy: None,
            refused: None,
            flag: false,
        }
    }

    /// Called by reception: writes the command register.
    pub fn receive(&mut self, command: SteerCommand) -> Receipt {
        if self.copy == Some(command) {
            return Receipt::Renewed;
        }
        if self.refused == Some(command) {
            return Receipt::AlreadyRefused;
        }
        self.command = Some(command);
        self.flag = true;
        Receipt::New
    }

    /// Called by the loop: returns a new command once and resets the flag. The loop then calls
    /// [`CommandRegister::accept`] or [`CommandRegister::refuse`].
    pub fn take(&mut self) -> Option<SteerCommand> {
        if !core::mem::take(&mut self.flag) {
            return None;
        }
        self.command
    }

    /// Copies the command register into the copy register.
    pub fn accept(&mut self) {
        self.copy = self.command;
        self.refused = None;
    }

    /// Leaves the copy register as it is and remembers the command as refused.
    pub fn refuse(&mut self) {
        self.refused = self.command;
    }

    /// The copy register: the command that was accepted last.
    #[must_use]
    pub fn copy(&self) -> Option<SteerCommand> {
        self.copy
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn command(code: u8, seq: u8) -> SteerCommand {
        SteerCommand { code, seq }
    }

    #[test]
    fn a_command_is_taken_over_once() {
        let mut register = CommandRegister::new();
        assert_eq!(register.take(), None);
        assert_eq!(register.receive(command(2, 7)), Receipt::New);
        assert_eq!(register.copy(), None, "reception acts on nothing");
        assert_eq!(register.take(), Some(command(2, 7)));
        register.accept();
        assert_eq!(register.copy(), Some(command(2, 7)));
        assert_eq!(register.take(), None);
        assert_eq!(register.receive(command(2, 7)), Receipt::Renewed);
        assert_eq!(register.take(), None);
    }

    #[test]
    fn the_same_code_with_a_new_number_is_new() {
        let mut register = CommandRegister::new();
        register.receive(command(7, 1));
        register.take();
        register.accept();
        assert_eq!(register.receive(command(7, 2)), Receipt::New);
        assert_eq!(register.take(), Some(command(7, 2)));
    }

    #[test]
    fn another_code_with_the_same_number_is_new() {
        let mut register = CommandRegister::new();
        register.receive(command(2, 1));
        register.take();
        register.accept();
        assert_eq!(register.receive(command(1, 1)), Receipt::New);
    }

    #[test]
    fn a_refused_command_leaves_the_copy_and_is_judged_once() {
        let mut register = CommandRegister::new();
        register.receive(command(2, 1));
        register.take();
        register.accept();
        register.receive(command(0x0C, 2));
        register.take();
        register.refuse();
        assert_eq!(register.copy(), Some(command(2, 1)));
        assert_eq!(register.receive(command(0x0C, 2)), Receipt::AlreadyRefused);
        assert_eq!(register.receive(command(2, 1)), Receipt::Renewed);
        assert_eq!(register.receive(command(0x0C, 3)), Receipt::New);
    }
}
