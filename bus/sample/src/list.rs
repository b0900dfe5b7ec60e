//! Long fixed arrays in JSON: writing leaves out the blank end, and reading adds it again.
//!
//! A field uses it as `#[serde(with = "lager_sample::list")]`. Nothing is lost, because a missing
//! element reads as the blank value that it had.

use core::fmt;
use core::marker::PhantomData;

use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::schema::Field;

/// Writes the elements up to the last one that is not blank.
pub fn serialize<T, S, const N: usize>(items: &[T; N], serializer: S) -> Result<S::Ok, S::Error>
where
    T: Field + Serialize + PartialEq,
    S: Serializer,
{
    let used = items
        .iter()
        .rposition(|item| *item != T::BLANK)
        .map_or(0, |last| last + 1);
    serializer.collect_seq(&items[..used])
}

/// Reads up to `N` elements; the rest stay blank.
pub fn deserialize<'de, T, D, const N: usize>(deserializer: D) -> Result<[T; N], D::Error>
where
    T: Field + Deserialize<'de>,
    D: Deserializer<'de>,
{
    struct UpTo<T, const N: usize>(PhantomData<T>);

    impl<'de, T: Field + Deserialize<'de>, const N: usize> Visitor<'de> for UpTo<T, N> {
        type Value = [T; N];

        fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(formatter, "a list of at most {N} elements")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<[T; N], A::Error> {
            let mut items = [T::BLANK; N];
            let mut used = 0;
            while let Some(item) = list.next_element()? {
                let slot = items
                    .get_mut(used)
                    .ok_or_else(|| A::Error::invalid_length(used + 1, &self))?;
                *slot = item;
                used += 1;
            }
            Ok(items)
        }
    }

    deserializer.deserialize_seq(UpTo(PhantomData))
}
