//! What a sample looks like, as constants: fields, offsets, and one hash over all of it.
//!
//! iceoryx2 compares two types by name, size and alignment only, so a `u64` that became an
//! `f64` would pass. The hash made here is a required attribute of every service and catches
//! that. [`payload!`] is the one way to make a payload: it checks at compile time that the
//! struct has no implicit padding and exactly the stated size.

use core::fmt::Debug;

use iceoryx2::prelude::ZeroCopySend;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::hash;

/// A type that may be a field of a payload: any bit pattern is a valid value.
pub trait Field: Copy + ZeroCopySend + 'static {
    /// Hash of the type's meaning: name, and for compound types everything inside.
    const SHAPE: u64;
    /// The value of a field nobody has written.
    const BLANK: Self;
    /// The type, for tools that make the same one in another language.
    const TYPE: &'static TypeInfo;
}

/// What a field's type is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TypeInfo {
    /// A number, by its name in Rust.
    Number(&'static str),
    /// A [`Tag`](crate::Tag): one byte.
    Enum {
        /// The enum's name.
        name: &'static str,
        /// Each variant's name and code.
        variants: &'static [(&'static str, u8)],
    },
    /// Elements behind each other.
    Array {
        /// What they are.
        of: &'static TypeInfo,
        /// How many.
        length: usize,
    },
    /// A payload, or a struct inside one.
    Struct(StructInfo),
}

/// A payload, or a struct inside one, as it lies in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StructInfo {
    /// [`Schema::TYPE_NAME`].
    pub type_name: &'static str,
    /// [`Schema::HASH`].
    pub hash: u64,
    /// Its size in bytes.
    pub size: usize,
    /// Its alignment in bytes.
    pub align: usize,
    /// [`Schema::FIELDS`].
    pub fields: &'static [FieldInfo],
}

impl StructInfo {
    /// How `T` lies in memory.
    pub const fn of<T: Schema>() -> Self {
        Self {
            type_name: T::TYPE_NAME,
            hash: T::HASH,
            size: size_of::<T>(),
            align: align_of::<T>(),
            fields: T::FIELDS,
        }
    }
}

macro_rules! primitive {
    ($($type:ty = $blank:expr),* $(,)?) => {
        $(impl Field for $type {
            const SHAPE: u64 = hash::bytes(hash::START, stringify!($type).as_bytes());
            const BLANK: Self = $blank;
            const TYPE: &'static TypeInfo = &TypeInfo::Number(stringify!($type));
        })*
    };
}

primitive!(
    u8 = 0,
    u16 = 0,
    u32 = 0,
    u64 = 0,
    i8 = 0,
    i16 = 0,
    i32 = 0,
    i64 = 0,
    f32 = 0.0,
    f64 = 0.0,
);

impl<T: Field, const N: usize> Field for [T; N] {
    const SHAPE: u64 = hash::number(
        hash::number(hash::bytes(hash::START, b"array"), N as u64),
        T::SHAPE,
    );
    const BLANK: Self = [T::BLANK; N];
    const TYPE: &'static TypeInfo = &TypeInfo::Array {
        of: T::TYPE,
        length: N,
    };
}

/// One field of a payload, for tools that describe a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldInfo {
    /// The field's name in the struct and in JSON.
    pub name: &'static str,
    /// The Rust type as written in the struct.
    pub type_name: &'static str,
    /// Bytes from the start of the payload.
    pub offset: usize,
    /// Bytes the field occupies.
    pub size: usize,
    /// What the type is made of.
    pub kind: &'static TypeInfo,
}

/// The layout of a payload as constants.
pub trait Schema: Sized {
    /// The name under which the type crosses processes and languages.
    const TYPE_NAME: &'static str;
    /// Hash over the type's name and every field's name, type and offset.
    const HASH: u64;
    /// The fields in memory order.
    const FIELDS: &'static [FieldInfo];
}

/// Everything a topic needs of its sample type; [`payload!`] provides it.
pub trait Payload:
    Field + Schema + Debug + Default + PartialEq + Serialize + DeserializeOwned + Send + Sync
{
}

/// Defines a payload: `repr(C)`, `Copy`, no implicit padding, exactly the given size.
///
/// A field may state its blank value after `=`; otherwise it is the type's own.
macro_rules! payload {
    (
        $(#[$meta:meta])*
        pub struct $name:ident: $size:literal bytes {
            $( $(#[$field_meta:meta])* pub $field:ident : $type:ty $(= $blank:expr)? ),* $(,)?
        }
    ) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(default)]
        pub struct $name {
            $( $(#[$field_meta])* pub $field: $type, )*
        }

        const _: () = {
            assert!(
                core::mem::size_of::<$name>() == $size,
                concat!(stringify!($name), " does not have its stated size")
            );
            assert!(
                0 $( + core::mem::size_of::<$type>() )* == core::mem::size_of::<$name>(),
                concat!(stringify!($name), " has implicit padding: add a `reserved` field")
            );
        };

        // SAFETY: `repr(C)`, no padding (asserted above), and every field is a `Field`, so it is
        // self-contained and valid for any bit pattern; the supertrait bound is checked by
        // `Field::SHAPE` being taken of each field type below.
        #[allow(unsafe_code)]
        unsafe impl iceoryx2::prelude::ZeroCopySend for $name {
            unsafe fn type_name() -> &'static str {
                <Self as $crate::schema::Schema>::TYPE_NAME
            }
        }

        impl $crate::schema::Field for $name {
            const SHAPE: u64 = <Self as $crate::schema::Schema>::HASH;
            const BLANK: Self = Self {
                $( $field: $crate::schema::blank!($type $(, $blank)?), )*
            };
            const TYPE: &'static $crate::schema::TypeInfo =
                &$crate::schema::TypeInfo::Struct($crate::schema::StructInfo::of::<Self>());
        }

        impl Default for $name {
            fn default() -> Self {
                <Self as $crate::schema::Field>::BLANK
            }
        }

        impl $crate::schema::Schema for $name {
            const TYPE_NAME: &'static str = concat!("lager::", stringify!($name));
            const HASH: u64 = {
                let hash = $crate::hash::bytes($crate::hash::START, Self::TYPE_NAME.as_bytes());
                $(
                    let hash = $crate::hash::bytes(hash, stringify!($field).as_bytes());
                    let hash = $crate::hash::number(
                        hash,
                        <$type as $crate::schema::Field>::SHAPE,
                    );
                    let hash = $crate::hash::number(
                        hash,
                        core::mem::offset_of!($name, $field) as u64,
                    );
                )*
                hash
            };
            const FIELDS: &'static [$crate::schema::FieldInfo] = &[
                $( $crate::schema::FieldInfo {
                    name: stringify!($field),
                    type_name: stringify!($type),
                    offset: core::mem::offset_of!($name, $field),
                    size: core::mem::size_of::<$type>(),
                    kind: <$type as $crate::schema::Field>::TYPE,
                }, )*
            ];
        }

        impl $crate::schema::Payload for $name {}
    };
}

/// The blank value of a field: the stated one, else the type's own.
macro_rules! blank {
    ($type:ty) => {
        <$type as $crate::schema::Field>::BLANK
    };
    ($type:ty, $blank:expr) => {
        $blank
    };
}

pub(crate) use blank;
pub(crate) use payload;

#[cfg(test)]
// The macro makes public types; here they stay inside the test.
#[allow(unreachable_pub)]
mod tests {
    use super::*;

    mod before {
        payload! {
            /// The layout as it was.
            pub struct Probe: 16 bytes {
                /// A count.
                pub count: u64,
                /// Parts.
                pub parts: [u16; 4] = [7; 4],
            }
        }
    }
    mod retyped {
        payload! {
            /// The same name, size and alignment, but another type.
            pub struct Probe: 16 bytes {
                /// A count.
                pub count: f64,
                /// Parts.
                pub parts: [u16; 4],
            }
        }
    }
    mod renamed {
        payload! {
            /// The same types under another field name.
            pub struct Probe: 16 bytes {
                /// A total.
                pub total: u64,
                /// Parts.
                pub parts: [u16; 4],
            }
        }
    }
    mod swapped {
        payload! {
            /// The same fields in another order.
            pub struct Probe: 16 bytes {
                /// Parts.
                pub parts: [u16; 4],
                /// A count.
                pub count: u64,
            }
        }
    }

    #[test]
    fn a_changed_layout_changes_the_hash() {
        let hashes = [
            before::Probe::HASH,
            retyped::Probe::HASH,
            renamed::Probe::HASH,
            swapped::Probe::HASH,
        ];
        for (index, hash) in hashes.iter().enumerate() {
            assert!(!hashes[..index].contains(hash), "{hashes:x?}");
        }
    }

    #[test]
    fn fields_are_described_with_their_offsets() {
        assert_eq!(
            before::Probe::FIELDS,
            &[
                FieldInfo {
                    name: "count",
                    type_name: "u64",
                    offset: 0,
                    size: 8,
                    kind: &TypeInfo::Number("u64")
                },
                FieldInfo {
                    name: "parts",
                    type_name: "[u16; 4]",
                    offset: 8,
                    size: 8,
                    kind: &TypeInfo::Array {
                        of: &TypeInfo::Number("u16"),
                        length: 4
                    }
                },
            ]
        );
    }

    #[test]
    fn a_stated_blank_value_is_the_default() {
        assert_eq!(before::Probe::default().parts, [7; 4]);
        assert_eq!(before::Probe::default().count, 0);
    }
}
