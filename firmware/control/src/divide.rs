//! A small division of 32-bit numbers. The chip has no instruction for it, and the compiler's own
//! routine takes a kilobyte of flash.

/// `dividend / divisor`, rounded down. Long division in binary, with as many steps as the quotient
/// has bits.
#[inline(never)]
pub(crate) fn divide(dividend: u32, divisor: u32) -> u32 {
    debug_assert!(divisor > 0);
    let mut rest = dividend;
    let mut step = divisor;
    let mut bit = 1;
    while step <= dividend >> 1 {
        step <<= 1;
        bit <<= 1;
    }
    let mut quotient = 0;
    while bit > 0 {
        if rest >= step {
            rest -= step;
            quotient |= bit;
        }
        step >>= 1;
        bit >>= 1;
    }
    quotient
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_divides() {
        let numbers = [
            0,
            1,
            2,
            3,
            7,
            10,
            99,
            100,
            255,
            256,
            65_535,
            65_536,
            1_000_003,
            0x7FFF_FFFF,
        ];
        for dividend in numbers.into_iter().chain([0x8000_0000, u32::MAX]) {
            for divisor in numbers.into_iter().skip(1) {
                assert_eq!(
                    divide(dividend, divisor),
                    dividend / divisor,
                    "{dividend} / {divisor}"
                );
            }
        }
    }
}
