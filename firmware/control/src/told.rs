//! Takes in a profile of the robot that the Pi tells value by value ([`lager_wire::Profile`]).
//!
//! ```text
//!   value --> put aside, answered        check value --> in force as a whole, or refused
//! ```

use lager_wire::{Profile, Setting, SettingStatus};

/// The answer to a setting: the value in force, and the result.
pub(crate) type Answer = (i16, SettingStatus);

/// The values that the Pi is sending; not yet in force.
#[derive(Debug, Clone)]
pub(crate) struct Told<P: Profile> {
    values: P::Values,
}

impl<P: Profile> Told<P> {
    /// Nothing told yet beside what is in force.
    pub(crate) fn new(in_force: &P) -> Self {
        Self {
            values: in_force.told(),
        }
    }

    /// Takes in a setting. Returns the answer and, if all values came and a board can obey them,
    /// what is in force from now on; `None` if the setting is not of this profile.
    pub(crate) fn hear(&mut self, setting: Setting, in_force: &P) -> Option<(Answer, Option<P>)> {
        if setting.key == P::CHECK {
            return Some(self.put_in_force(setting.value, in_force));
        }
        let kept = self.values.as_mut().get_mut(P::index(setting.key)?)?;
        let answer = match u16::try_from(setting.value) {
            Ok(told) => {
                *kept = told;
                (setting.value, SettingStatus::Accepted)
            }
            Err(_) => (kept.cast_signed(), SettingStatus::OutOfRange),
        };
        Some((answer, None))
    }

    fn put_in_force(&self, check: i16, in_force: &P) -> (Answer, Option<P>) {
        if check == P::check(&self.values)
            && let Some(profile) = P::obeyed(&self.values)
        {
            return ((check, SettingStatus::Accepted), Some(profile));
        }
        let kept = P::check(&in_force.told());
        ((kept, SettingStatus::OutOfRange), None)
    }
}

/// A profile's six values as the EEPROM keeps them.
pub(crate) fn kept(values: &[u16; 6]) -> [u8; 12] {
    let mut bytes = [0; 12];
    for (pair, value) in bytes.chunks_exact_mut(2).zip(values) {
        pair.copy_from_slice(&value.to_le_bytes());
    }
    bytes
}

/// The profile that the EEPROM keeps, if a board can obey it.
pub(crate) fn obeyed<P: Profile<Values = [u16; 6]>>(bytes: &[u8; 12]) -> Option<P> {
    let mut values = [0; 6];
    for (value, pair) in values.iter_mut().zip(bytes.chunks_exact(2)) {
        *value = u16::from_le_bytes([pair[0], pair[1]]);
    }
    P::obeyed(&values)
}
