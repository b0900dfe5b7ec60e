//! The error byte of a status packet: the errors that a servo reports.

/// Error bits of a status packet, the same bits as in the registers `ALARM_LED` and
/// `ALARM_SHUTDOWN`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct ErrorBits(pub u8);

impl ErrorBits {
    /// Nothing is wrong.
    pub const NONE: Self = Self(0);
    /// The supply voltage is outside the set range.
    pub const INPUT_VOLTAGE: Self = Self(1 << 0);
    /// The goal position is outside the angle limits.
    pub const ANGLE_LIMIT: Self = Self(1 << 1);
    /// The servo is hotter than its limit.
    pub const OVERHEATING: Self = Self(1 << 2);
    /// A parameter is outside its register's range.
    pub const RANGE: Self = Self(1 << 3);
    /// The instruction packet's checksum was wrong.
    pub const CHECKSUM: Self = Self(1 << 4);
    /// The servo cannot hold the load with the torque that is set.
    pub const OVERLOAD: Self = Self(1 << 5);
    /// The instruction is unknown, or an ACTION came without a REG_WRITE.
    pub const INSTRUCTION: Self = Self(1 << 6);

    /// The byte as it stands on the wire.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Whether no bit is set.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether any bit of `other` is set here.
    #[must_use]
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Both sets of bits together.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}
