//! Numbers on the command line: what is expected is said of negative ones too, which the parser of arguments would
//! otherwise take for options that it does not know.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// A finite number above zero.
pub fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok();
    number
        .filter(|x| *x > 0.0 && x.is_finite())
        .ok_or_else(|| "expected a number above zero".to_string())
}

/// A kind of whole numbers.
pub trait Whole: FromStr + PartialOrd + Display + Copy + Send + Sync + 'static {
    /// Stands for no limit where a range ends with it.
    const NO_LIMIT: Option<Self> = None;
}

impl Whole for u16 {}

impl Whole for u32 {}

impl Whole for i64 {}

impl Whole for u64 {
    const NO_LIMIT: Option<u64> = Some(u64::MAX);
}

impl Whole for usize {
    const NO_LIMIT: Option<usize> = Some(usize::MAX);
}

/// A parser of whole numbers within `range`.
pub fn whole<T: Whole>(
    range: RangeInclusive<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.parse::<T>().ok().filter(|n| range.contains(n));
        number.ok_or_else(|| match Some(*range.end()) == T::NO_LIMIT {
            true => format!("expected a whole number of at least {}", range.start()),
            false => format!(
                "expected a whole number from {} to {}",
                range.start(),
                range.end()
            ),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_in_their_range_or_it_is_named() {
        assert_eq!(whole(1..=8u32)("8"), Ok(8));
        let ends = Err("expected a whole number from 1 to 8".to_string());
        for text in ["0", "9", "-1", "1.5", "", "x", "99999999999999999999"] {
            assert_eq!(whole(1..=8u32)(text), ends, "{text}");
        }
        let least = Err("expected a whole number of at least 2".to_string());
        assert_eq!(whole(2..=u64::MAX)("1"), least);
        assert_eq!(whole(2..=u64::MAX)("18446744073709551615"), Ok(u64::MAX));
        assert_eq!(positive("1e-12"), Ok(1e-12));
        for text in ["0", "-1", "-1e-5", "inf", "nan", ""] {
            assert!(positive(text).is_err(), "{text}");
        }
    }
}
