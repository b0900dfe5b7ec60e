//! The layout of a payload as constants: its fields, their offsets, and one hash over all of it.
//!
//! iceoryx2 compares two types by name, size and alignment only, so a `u64` that became an `f64`
//! would pass. The hash made here is a required attribute of every service and catches that.
//! [`payload!`](crate::payload) is the only way to make a payload. It checks at compile time that
//! the struct has no implicit padding and exactly the stated size.

use core::fmt::Debug;

use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::hash;

/// A type that may be a field of a payload.
///
/// # Safety
/// Any bit pattern is a valid value of the type, and it has no padding.
#[allow(
    unsafe_code,
    reason = "what shared memory holds is read as such a type"
)]
pub unsafe trait Field: Copy + ZeroCopySend + 'static {
    /// Hash of the type's meaning: its name, and for compound types everything inside.
    const SHAPE: u64;
    /// The parts of which the type is made.
    const MAKE: Make;
    /// The value of a field that nobody has written.
    const BLANK: Self;
}

macro_rules! primitive {
    ($($type:ty = $blank:expr),* $(,)?) => {
        $(
        // SAFETY: a number without padding; any bits are a valid number.
        #[allow(unsafe_code)]
        unsafe impl Field for $type {
            const SHAPE: u64 = hash::bytes(hash::START, stringify!($type).as_bytes());
            const MAKE: Make = Make::Number(stringify!($type));
            const BLANK: Self = $blank;
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

// SAFETY: elements lie without gaps, and each is a `Field`.
#[allow(unsafe_code)]
unsafe impl<T: Field, const N: usize> Field for [T; N] {
    const MAKE: Make = Make::List(&T::MAKE, N);
    const SHAPE: u64 = hash::number(
        hash::number(hash::bytes(hash::START, b"array"), N as u64),
        T::SHAPE,
    );
    const BLANK: Self = [T::BLANK; N];
}

/// The bytes of a value as they lie in memory, to compare or hash them.
#[allow(unsafe_code, reason = "a `Field` has no padding")]
pub fn bytes_of<T: Field>(value: &T) -> &[u8] {
    // SAFETY: a `Field` has no padding, so all its bytes are initialised, and they are borrowed as
    // long as the value is.
    unsafe { core::slice::from_raw_parts(core::ptr::from_ref(value).cast(), size_of::<T>()) }
}

/// The value of which these are the bytes, as [`bytes_of`] gives them; `None` if they are too many or
/// too few.
#[allow(unsafe_code, reason = "any bits are a valid `Field`")]
pub fn from_bytes<T: Field>(bytes: &[u8]) -> Option<T> {
    // SAFETY: as many bytes as the value has, which need not be aligned; any bits are a valid value.
    (bytes.len() == size_of::<T>()).then(|| unsafe { bytes.as_ptr().cast::<T>().read_unaligned() })
}

/// One field of a payload, for tools that describe a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldInfo {
    /// The field's name in the struct and in JSON.
    pub name: &'static str,
    /// The Rust type as written in the struct.
    pub type_name: &'static str,
    /// Bytes from the start of the payload to this field.
    pub offset: usize,
    /// The size of the field in bytes.
    pub size: usize,
    /// The parts of which the field is made.
    pub make: Make,
}

/// The parts of which a type is made, for [`Description`](crate::Description).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Make {
    /// A number; the name of its Rust type.
    Number(&'static str),
    /// A list; the type of its elements and their number.
    List(&'static Make, usize),
    /// A [`Tag`](crate::Tag).
    Tag {
        /// The enum's name.
        name: &'static str,
        /// The code and the name of every variant.
        variants: &'static [(u8, &'static str)],
    },
    /// A struct made by [`payload!`](crate::payload).
    Record(StructInfo),
}

/// The memory layout of a struct made by [`payload!`](crate::payload).
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
    /// The memory layout of `T`.
    pub const fn of<T: Schema>() -> Self {
        Self {
            type_name: T::TYPE_NAME,
            hash: T::HASH,
            size: size_of::<T>(),
            align: align_of::<T>(),
            fields: T::FIELDS,
        }
    }

    /// The struct's name: the type's name without the family.
    pub fn name(&self) -> &'static str {
        self.type_name
            .rsplit_once("::")
            .map_or(self.type_name, |(_, name)| name)
    }
}

/// The layout of a payload as constants.
pub trait Schema {
    /// The name under which the type crosses processes and languages.
    const TYPE_NAME: &'static str;
    /// Hash over the type's name and the name, type and offset of every field.
    const HASH: u64;
    /// The fields in memory order.
    const FIELDS: &'static [FieldInfo];
}

/// All that a topic needs of its sample type. [`payload!`](crate::payload) implements it.
pub trait Payload:
    Field + Schema + Debug + Default + PartialEq + Serialize + DeserializeOwned + Send + Sync
{
}

/// Defines a payload: `repr(C)`, `Copy`, no implicit padding, exactly the given size.
///
/// A field may state its blank value after `=`; otherwise it has the blank value of its type.
/// Fields whose names begin with `reserved` fill gaps, and tools do not show them.
///
/// ```
/// lager_sample::payload! {
///     /// What a weather station sees.
///     pub struct Weather: 8 bytes {
///         /// Wind in mm/s.
///         pub wind: u32,
///         /// From where it blows, in degrees; 65535 = not known.
///         pub from: u16 = u16::MAX,
///         /// Fills the gap.
///         pub reserved: [u8; 2],
///     }
/// }
/// assert_eq!(Weather::default().from, 65535);
/// ```
#[macro_export]
macro_rules! payload {
    (
        $(#[$meta:meta])*
        pub struct $name:ident: $size:literal bytes {
            $( $(#[$field_meta:meta])* pub $field:ident : $type:ty $(= $blank:expr)? ),* $(,)?
        }
    ) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(
            Clone, Copy, Debug, PartialEq,
            $crate::private::serde::Serialize, $crate::private::serde::Deserialize,
        )]
        #[serde(default, crate = "lager_sample::private::serde")]
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
        // self-contained and valid for any bit pattern. `Field::SHAPE` of each field type below
        // checks the supertrait bound.
        #[allow(unsafe_code)]
        unsafe impl $crate::private::ZeroCopySend for $name {
            unsafe fn type_name() -> &'static str {
                <Self as $crate::schema::Schema>::TYPE_NAME
            }
        }

        // SAFETY: as above.
        #[allow(unsafe_code)]
        unsafe impl $crate::schema::Field for $name {
            const SHAPE: u64 = <Self as $crate::schema::Schema>::HASH;
            const MAKE: $crate::schema::Make = $crate::schema::Make::Record($crate::schema::StructInfo::of::<Self>());
            const BLANK: Self = Self {
                $( $field: $crate::__blank!($type $(, $blank)?), )*
            };
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
                    make: <$type as $crate::schema::Field>::MAKE,
                }, )*
            ];
        }

        impl $crate::schema::Payload for $name {}
    };
}

/// The blank value of a field: the stated one, else that of the field's type.
#[doc(hidden)]
#[macro_export]
macro_rules! __blank {
    ($type:ty) => {
        <$type as $crate::schema::Field>::BLANK
    };
    ($type:ty, $blank:expr) => {
        $blank
    };
}

#[cfg(test)]
// The macro makes public types; here they stay inside the test.
#[allow(unreachable_pub)]
mod tests {
    use super::*;

    mod before {
        crate::payload! {
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
        crate::payload! {
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
        crate::payload! {
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
        crate::payload! {
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
                    make: Make::Number("u64"),
                },
                FieldInfo {
                    name: "parts",
                    type_name: "[u16; 4]",
                    offset: 8,
                    size: 8,
                    make: Make::List(&Make::Number("u16"), 4),
                },
            ]
        );
    }

    #[test]
    fn a_value_comes_back_from_its_bytes_wherever_they_lie() {
        let probe = before::Probe {
            count: 7,
            ..before::Probe::default()
        };
        let mut shifted = vec![0];
        shifted.extend(bytes_of(&probe));
        assert_eq!(from_bytes(&shifted[1..]), Some(probe));
        assert_eq!(from_bytes::<before::Probe>(&shifted), None);
        assert_eq!(from_bytes::<before::Probe>(&shifted[2..]), None);
    }

    #[test]
    fn a_stated_blank_value_is_the_default() {
        assert_eq!(before::Probe::default().parts, [7; 4]);
        assert_eq!(before::Probe::default().count, 0);
    }
}
