//! The parts of a sample that the tools use.

use lager_ports::Look;
use lager_sample::Stamp;
use serde::Serialize;
use serde_json::{Value, to_value};

/// Its stamp and payload, for tools that show it.
pub(crate) struct Shown;

impl Look for Shown {
    type Output = (Stamp, serde_json::Result<Value>);

    fn look<P: Serialize>(self, stamp: &Stamp, _lost: u64, payload: &P) -> Self::Output {
        (*stamp, to_value(payload))
    }
}

/// Its stamp alone, for tools that measure.
pub(crate) struct Stamped;

impl Look for Stamped {
    type Output = Stamp;

    fn look<P: Serialize>(self, stamp: &Stamp, _lost: u64, _payload: &P) -> Stamp {
        *stamp
    }
}
