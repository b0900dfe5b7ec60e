//! Choices that have a name on the command line, in limits and in JSON.

/// A text that names none of the choices.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` is not known here; use {}", either(choices))]
pub struct UnknownName {
    /// The text.
    pub text: String,
    /// What it could have been.
    pub choices: &'static [&'static str],
}

fn either(choices: &[&str]) -> String {
    match choices.split_last() {
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => "nothing".to_owned(),
    }
}

/// An enum whose variants have names: `ALL` of them in the order of the tables, `as_str`, `Display`
/// and `FromStr`.
macro_rules! named {
    (
        $(#[$meta:meta])*
        pub enum $name:ident {
            $( $(#[$variant_meta:meta])* $variant:ident = $text:literal, )*
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
        pub enum $name {
            $( $(#[$variant_meta])* #[serde(rename = $text)] $variant, )*
        }

        impl $name {
            /// Every one, in the order of the tables.
            pub const ALL: [Self; [$($text),*].len()] = [$(Self::$variant),*];

            /// Its name on the command line and in JSON.
            #[must_use]
            pub const fn as_str(self) -> &'static str {
                match self {
                    $( Self::$variant => $text, )*
                }
            }
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                formatter.pad(self.as_str())
            }
        }

        impl core::str::FromStr for $name {
            type Err = $crate::names::UnknownName;

            fn from_str(text: &str) -> Result<Self, Self::Err> {
                let mut all = Self::ALL.into_iter();
                all.find(|one| one.as_str() == text)
                    .ok_or_else(|| $crate::names::UnknownName {
                        text: text.to_owned(),
                        choices: &[$($text),*],
                    })
            }
        }
    };
}

pub(crate) use named;
