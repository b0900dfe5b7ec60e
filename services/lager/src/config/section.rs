//! Declares a section of the configuration once: its keys, their defaults, and the explanation that
//! `lager config` prints and that errors quote.

/// Names and explanations of a section.
#[derive(Clone, Copy, Debug)]
pub struct Section {
    /// Its name in brackets; empty for the keys above all sections.
    pub name: &'static str,
    /// Its explanation, line by line.
    pub about: &'static [&'static str],
    /// Its keys in the order of printing, each with the lines of its explanation.
    pub keys: &'static [(&'static str, &'static [&'static str])],
}

/// Implemented by each structure that [`section`] declares.
pub trait Declared {
    /// Its names and explanations.
    const SECTION: Section;
}

/// Declares a section: `"name"`, and a structure in which each key has its default. `lager config`
/// prints the comments.
macro_rules! section {
    (
        $name:literal
        $(#[doc = $about:literal])*
        pub struct $section:ident {
            $(
                $(#[doc = $explained:literal])*
                $(#[serde($($serde:tt)*)])?
                pub $key:ident: $kind:ty = $default:expr,
            )*
        }
    ) => {
        $(#[doc = $about])*
        // `lager config` prints these lines, in which [name] is a section of the file and no link.
        #[allow(rustdoc::broken_intra_doc_links)]
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct $section {
            $(
                $(#[doc = $explained])*
                $(#[serde($($serde)*)])?
                pub $key: $kind,
            )*
        }

        impl Default for $section {
            fn default() -> Self {
                Self { $($key: $default,)* }
            }
        }

        impl $crate::config::section::Declared for $section {
            const SECTION: $crate::config::section::Section = $crate::config::section::Section {
                name: $name,
                about: &[$($about),*],
                keys: &[$((stringify!($key), &[$($explained),*])),*],
            };
        }
    };
}
pub(super) use section;
