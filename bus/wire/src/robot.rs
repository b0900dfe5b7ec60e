//! What differs between robots beside the arm: [`SteeringProfile`] and [`SensorProfile`], each told
//! to one board ([`crate::Profile`]).
//!
//! Their parts are sections of the configuration. The defaults are the robot of the simulator's
//! world, and what a board obeys that nobody has told anything. A board keeps what it was told, so
//! a reset in the middle of a way changes nothing.

use core::fmt;
use core::ops::RangeInclusive;

use crate::arm::ArmProfile;
use crate::coded::coded;
use crate::profile::{Profile, profile};
use crate::setting::SettingKey;

/// Duties at which wheels can drive: below, no motor moves a robot, and above, the regulator has no
/// room to make one side faster.
pub const DRIVING_DUTIES: RangeInclusive<u8> = 40..=200;

/// Times in which a robot can turn once on the spot, in ms.
pub const FULL_TURNS_MS: RangeInclusive<u16> = 2_000..=30_000;

/// Distances of an own curve, in cm.
pub const OWN_CURVE_CM: RangeInclusive<u8> = 3..=200;

/// The greatest reading of the IR ranger.
pub const IR_MAX: u16 = 1023;

/// An own curve needs this much between its two readings.
const LEAST_IR_SPAN: u16 = 20;

profile! {
    /// The motors and their wheels; the steering board is told at every start, and the robot stands
    /// until the board has taken it.
    pub struct WheelsProfile {
        /// Whether each motor hangs at the driver of the other side ...
        pub swapped: bool = false,
        /// ... and whether the motor of the left side turns backwards when it is told forwards, ...
        pub left_reversed: bool = false,
        /// ... or the motor of the right side.
        pub right_reversed: bool = false,
        /// Part of the full power at which the wheels drive, of 255: 40 to 200.
        pub duty: u8 = 100,
        /// How long a full turn on the spot takes at this duty, in ms: 2000 to 30000.
        pub full_turn_ms: u16 = 12_000,
    }
}

profile! {
    /// The line sensors; the sensor board is told at every start.
    pub struct LineProfile {
        /// Whether a sensor reads high over dark tape; some modules read low there.
        pub dark_is_high: bool = true,
    }
}

profile! {
    /// The IR ranger at the front; the sensor board is told at every start.
    pub struct RangerProfile {
        /// The model: "gp2y0a21" (10 to 80 cm), "gp2y0a41" (4 to 30 cm), "gp2y0a02" (20 to 150 cm),
        /// or "own" for the two points below.
        pub model: IrModel = IrModel::Gp2y0a21,
        /// A near distance in cm, the least that is ever reported, ...
        pub near_cm: u8 = 10,
        /// ... and what the ranger reads there, 0 to 1023 for 0 to 5 V.
        pub near_reading: u16 = 472,
        /// A far distance in cm, the greatest that is ever reported, ...
        pub far_cm: u8 = 80,
        /// ... and what the ranger reads there.
        pub far_reading: u16 = 84,
    }
}

coded! {
    /// The IR ranger's curve. The document does not name the model.
    #[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
    pub enum IrModel {
        /// The two points of [`RangerProfile`].
        Own = 0,
        /// Sharp GP2Y0A21YK0F, 10 to 80 cm.
        Gp2y0a21 = 1,
        /// Sharp GP2Y0A41SK0F, 4 to 30 cm.
        Gp2y0a41 = 2,
        /// Sharp GP2Y0A02YK, 20 to 150 cm.
        Gp2y0a02 = 3,
    }
}

/// What the steering board must know of its robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SteeringProfile {
    /// Motors and wheels.
    pub wheels: WheelsProfile,
    /// Whether a quarter of the battery's voltage is at the board's input. Without it the input
    /// floats and says nothing.
    pub divider: bool,
}

/// What the sensor board must know of its robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensorProfile {
    /// The line sensors.
    pub line: LineProfile,
    /// The IR ranger.
    pub ranger: RangerProfile,
}

/// Everything that the boards are told of their robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RobotProfile {
    /// For the steering board.
    pub steering: SteeringProfile,
    /// For the sensor board.
    pub sensors: SensorProfile,
    /// The arm, for the steering board.
    pub arm: ArmProfile,
}

/// Why a description is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RobotProfileError {
    /// A duty at which no wheels drive.
    Duty(u8),
    /// A time in which no robot turns.
    FullTurn(u16),
    /// A distance of an own curve that no ranger measures.
    Distance {
        /// Its key.
        key: &'static str,
        /// Its value.
        cm: u8,
    },
    /// The near point of an own curve is not nearer than the far one.
    Order {
        /// `near_cm`.
        near_cm: u8,
        /// `far_cm`.
        far_cm: u8,
    },
    /// Two readings of an own curve that do not differ as they must.
    Readings {
        /// `near_reading`.
        near: u16,
        /// `far_reading`.
        far: u16,
    },
}

impl fmt::Display for RobotProfileError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Duty(duty) => write!(
                formatter,
                "[wheels] duty is {duty}; it must be from {} to {} (100 is usual)",
                DRIVING_DUTIES.start(),
                DRIVING_DUTIES.end()
            ),
            Self::FullTurn(ms) => write!(
                formatter,
                "[wheels] full_turn_ms is {ms}; it must be from {} to {}: let the robot turn once \
                 on the spot and take the time",
                FULL_TURNS_MS.start(),
                FULL_TURNS_MS.end()
            ),
            Self::Distance { key, cm } => write!(
                formatter,
                "[distance] {key} is {cm}; an own curve goes from {} to {} cm",
                OWN_CURVE_CM.start(),
                OWN_CURVE_CM.end()
            ),
            Self::Order { near_cm, far_cm } => write!(
                formatter,
                "[distance] near_cm is {near_cm} and far_cm is {far_cm}; the near distance must be \
                 the smaller one"
            ),
            Self::Readings { near, far } => write!(
                formatter,
                "[distance] near_reading is {near} and far_reading is {far}; a ranger reads at \
                 least {LEAST_IR_SPAN} more at the near distance, and at most {IR_MAX}: measure \
                 both again, with something wide and light in front of it"
            ),
        }
    }
}

impl core::error::Error for RobotProfileError {}

impl SensorProfile {
    /// The default, for constants.
    pub const USUAL: Self = Self {
        line: LineProfile { dark_is_high: true },
        ranger: RangerProfile {
            model: IrModel::Gp2y0a21,
            near_cm: 10,
            near_reading: 472,
            far_cm: 80,
            far_reading: 84,
        },
    };
}

impl WheelsProfile {
    /// Checks that wheels can be driven by this description.
    ///
    /// # Errors
    /// The first value that is wrong.
    pub fn validate(&self) -> Result<(), RobotProfileError> {
        if !DRIVING_DUTIES.contains(&self.duty) {
            return Err(RobotProfileError::Duty(self.duty));
        }
        if !FULL_TURNS_MS.contains(&self.full_turn_ms) {
            return Err(RobotProfileError::FullTurn(self.full_turn_ms));
        }
        Ok(())
    }
}

impl RangerProfile {
    /// The least and the greatest distance that the ranger tells, in cm.
    #[must_use]
    pub const fn range_cm(&self) -> (u8, u8) {
        match self.model {
            IrModel::Own => (self.near_cm, self.far_cm),
            IrModel::Gp2y0a21 => (10, 80),
            IrModel::Gp2y0a41 => (4, 30),
            IrModel::Gp2y0a02 => (20, 150),
        }
    }

    /// Checks that an own curve tells distances apart. The points do not count for a named model.
    ///
    /// # Errors
    /// The first value that is wrong.
    pub fn validate(&self) -> Result<(), RobotProfileError> {
        if self.model != IrModel::Own {
            return Ok(());
        }
        for (key, cm) in [("near_cm", self.near_cm), ("far_cm", self.far_cm)] {
            if !OWN_CURVE_CM.contains(&cm) {
                return Err(RobotProfileError::Distance { key, cm });
            }
        }
        if self.near_cm >= self.far_cm {
            return Err(RobotProfileError::Order {
                near_cm: self.near_cm,
                far_cm: self.far_cm,
            });
        }
        let (near, far) = (self.near_reading, self.far_reading);
        if near > IR_MAX || near < far.saturating_add(LEAST_IR_SPAN) {
            return Err(RobotProfileError::Readings { near, far });
        }
        Ok(())
    }
}

/// A yes or no among the values; `None` if it is neither.
const fn flag(value: u16) -> Option<bool> {
    match value {
        0 => Some(false),
        1 => Some(true),
        _ => None,
    }
}

impl Profile for SteeringProfile {
    type Values = [u16; 6];
    const FIRST: SettingKey = SettingKey::SteeringSwapped;
    const CHECK: SettingKey = SettingKey::Steering;

    fn told(&self) -> Self::Values {
        let Self { wheels, divider } = self;
        [
            wheels.swapped.into(),
            wheels.left_reversed.into(),
            wheels.right_reversed.into(),
            wheels.duty.into(),
            wheels.full_turn_ms,
            (*divider).into(),
        ]
    }

    fn obeyed(values: &Self::Values) -> Option<Self> {
        let [swapped, left, right, duty, full_turn_ms, divider] = *values;
        let wheels = WheelsProfile {
            swapped: flag(swapped)?,
            left_reversed: flag(left)?,
            right_reversed: flag(right)?,
            duty: u8::try_from(duty).ok()?,
            full_turn_ms,
        };
        wheels.validate().ok()?;
        Some(Self {
            wheels,
            divider: flag(divider)?,
        })
    }
}

impl Profile for SensorProfile {
    type Values = [u16; 6];
    const FIRST: SettingKey = SettingKey::SensorsDarkHigh;
    const CHECK: SettingKey = SettingKey::Sensors;

    fn told(&self) -> Self::Values {
        let Self { line, ranger } = self;
        [
            line.dark_is_high.into(),
            ranger.model.code().into(),
            ranger.near_cm.into(),
            ranger.near_reading,
            ranger.far_cm.into(),
            ranger.far_reading,
        ]
    }

    fn obeyed(values: &Self::Values) -> Option<Self> {
        let [dark_high, model, near_cm, near_reading, far_cm, far_reading] = *values;
        let ranger = RangerProfile {
            model: IrModel::from_code(u8::try_from(model).ok()?)?,
            near_cm: u8::try_from(near_cm).ok()?,
            near_reading,
            far_cm: u8::try_from(far_cm).ok()?,
            far_reading,
        };
        ranger.validate().ok()?;
        Some(Self {
            line: LineProfile {
                dark_is_high: flag(dark_high)?,
            },
            ranger,
        })
    }
}

const LAST_STEERING: u8 = SettingKey::SteeringDivider.code();
const LAST_SENSORS: u8 = SettingKey::SensorsFarAdc.code();
const _: () = assert!(LAST_STEERING - SteeringProfile::FIRST.code() == 5);
const _: () = assert!(LAST_SENSORS - SensorProfile::FIRST.code() == 5);
