//! The hash FNV-1a as `const fn`, so that a layout's hash is a compile-time constant.
//!
//! It is not for untrusted input: it only has to tell two layouts of this project apart.

/// The start value of the 64-bit FNV-1a hash.
pub const START: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01b3;

/// Continues `hash` over `bytes` and one separator, so that `ab`+`c` differs from `a`+`bc`.
pub const fn bytes(mut hash: u64, bytes: &[u8]) -> u64 {
    let mut index = 0;
    while index < bytes.len() {
        hash = (hash ^ bytes[index] as u64).wrapping_mul(PRIME);
        index += 1;
    }
    (hash ^ 0x1f).wrapping_mul(PRIME)
}

/// Continues `hash` over a number, little end first.
pub const fn number(hash: u64, number: u64) -> u64 {
    bytes(hash, &number.to_le_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_border_between_two_names_counts() {
        assert_ne!(
            bytes(bytes(START, b"ab"), b"c"),
            bytes(bytes(START, b"a"), b"bc")
        );
    }

    #[test]
    fn fnv_1a_of_a_known_text() {
        // The published FNV-1a test vector for "foobar", before the separator.
        let mut hash = START;
        for byte in b"foobar" {
            hash = (hash ^ u64::from(*byte)).wrapping_mul(PRIME);
        }
        assert_eq!(hash, 0x8594_4171_f739_67e8);
        assert_eq!(bytes(START, b"foobar"), (hash ^ 0x1f).wrapping_mul(PRIME));
    }
}
