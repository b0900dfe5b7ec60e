//! The reasons why a warehouse is not saved, as codes with values.

use lager_orders::{Code, Reason};

use crate::warehouse::SaveError;

impl From<&SaveError> for Reason {
    fn from(error: &SaveError) -> Self {
        match error {
            SaveError::Warehouse(why) => Self::new(Code::Unsaved, &[&why.as_str()]),
            SaveError::Toml(_) => Self::new(Code::Misread, &[error]),
            SaveError::Unreadable { path } => Self::new(Code::SaveUnreadable, &[&path.display()]),
            SaveError::Write { path, error } => {
                Self::new(Code::SaveFailed, &[&path.display(), error])
            }
        }
    }
}
