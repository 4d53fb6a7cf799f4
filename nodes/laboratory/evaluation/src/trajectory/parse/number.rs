//! Numbers and stamps in trajectory files.

use geometry::Stamp;

const NANOS_PER_SECOND: f64 = 1e9;
/// Digits after the decimal point of a stamp in nanoseconds.
const NANO_DIGITS: usize = 9;
/// The latest stamp that 64 bits of nanoseconds hold, in the year 2262. Nanoseconds in a file that should hold
/// seconds lie far beyond it.
const LATEST_S: f64 = 9.2e9;

/// So large a stamp in the place of seconds is in nanoseconds, of 1973 or later: microseconds of today are less.
const EARLIEST_NS: f64 = 1e17;

/// A number; "nan" and "inf" are numbers too.
pub(super) fn number(text: &str) -> Option<f64> {
    text.parse().ok()
}

/// A stamp in seconds. It is read digit by digit, since a float holds today's seconds only to a quarter of a
/// microsecond; digits beyond nanoseconds are cut off.
pub(super) fn decimal_seconds(text: &str) -> Option<Stamp> {
    let in_range = number(text).filter(|seconds| seconds.abs() < LATEST_S)?;
    let (sign, digits) = match text.strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, text.strip_prefix('+').unwrap_or(text)),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let is_plain = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if !(is_plain(whole) && is_plain(fraction)) {
        // As 1.305031e+09; in range, so the cast is exact but for rounding.
        return Some(Stamp::from_nanos((in_range * NANOS_PER_SECOND).round() as i64));
    }
    // Digits alone: a place of one is the end of another.
    let fraction = fraction.get(..NANO_DIGITS).unwrap_or(fraction);
    let nanos: i64 = format!("{fraction:0<NANO_DIGITS$}").parse().ok()?;
    let whole: i64 = if whole.is_empty() { 0 } else { whole.parse().ok()? };
    Some(Stamp::from_nanos(sign * (whole * 1_000_000_000 + nanos)))
}

/// A stamp in seconds, or in nanoseconds as ORB-SLAM3 writes its EuRoC files: "1403636579763555584.000000".
pub(super) fn tum_stamp(text: &str) -> Option<Stamp> {
    decimal_seconds(text).or_else(|| {
        let is_nanoseconds = number(text)? >= EARLIEST_NS;
        let whole = text.split_once('.').map_or(text, |(whole, _)| whole);
        is_nanoseconds.then(|| integer_nanoseconds(whole))?
    })
}

/// A stamp in whole nanoseconds. Some tools print it as a float, as 1.403715e+18.
pub(super) fn integer_nanoseconds(text: &str) -> Option<Stamp> {
    if let Ok(nanos) = text.parse() {
        return Some(Stamp::from_nanos(nanos));
    }
    let nanos = number(text).filter(|nanos| nanos.abs() < LATEST_S * NANOS_PER_SECOND)?;
    // A decimal point with digits means seconds, and the order of such a file's quaternion is unknown.
    (nanos.fract() == 0.0 && (text.contains(['e', 'E']))).then(|| Stamp::from_nanos(nanos as i64))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn seconds_keep_their_nanoseconds() {
        let nanos = |text| decimal_seconds(text).map(Stamp::as_nanos);
        assert_eq!(nanos("1305031229.564442"), Some(1_305_031_229_564_442_000));
        assert_eq!(nanos("1403636579.763555527"), Some(1_403_636_579_763_555_527));
        assert_eq!(nanos("1403636579.7635555274"), Some(1_403_636_579_763_555_527));
        assert_eq!(nanos("-0.5"), Some(-500_000_000));
        assert_eq!(nanos("12"), Some(12_000_000_000));
        assert_eq!(nanos(".5"), Some(500_000_000));
        assert_eq!(nanos("5."), Some(5_000_000_000));
        assert_eq!(nanos("1.5e+2"), Some(150_000_000_000));
        for text in
            ["", ".", "-", "x", "1.2.3", "nan", "inf", "1403636579763555584", "1e300", "0x10"]
        {
            assert_eq!(nanos(text), None, "{text}");
        }
    }

    /// Regression: the files of ORB-SLAM3 for EuRoC were refused.
    #[test]
    fn stamps_far_beyond_seconds_are_nanoseconds() {
        let nanos = |text| tum_stamp(text).map(Stamp::as_nanos);
        let whole = Some(1_403_636_579_763_555_584);
        for text in ["1403636579763555584.000000", "1403636579763555584", "1403636579763555584."] {
            assert_eq!(nanos(text), whole, "{text}");
        }
        assert_eq!(nanos("1403636579.763555584"), whole);
        // Milliseconds, microseconds, beyond the latest, and no number.
        for text in ["1403636579763", "1403636579763555", "99999999999999999999", "1e300", "inf"] {
            assert_eq!(nanos(text), None, "{text}");
        }
    }

    #[test]
    fn nanoseconds_are_whole() {
        let nanos = |text| integer_nanoseconds(text).map(Stamp::as_nanos);
        assert_eq!(nanos("1403636579763555584"), Some(1_403_636_579_763_555_584));
        assert_eq!(nanos("1.4036365797635556e+18"), Some(1_403_636_579_763_555_584));
        for text in ["1403636579.76", "", "nan", "1e300", "1.5"] {
            assert_eq!(nanos(text), None, "{text}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_a_stamp_or_none(text in "\\PC{0,24}", digits in "[-+.0-9eEnaif]{0,30}") {
            for text in [text, digits] {
                let _ = (tum_stamp(&text), integer_nanoseconds(&text));
            }
        }

        #[test]
        fn what_is_printed_is_read(nanos in -9_000_000_000_000_000_000_i64..9_000_000_000_000_000_000) {
            let sign = if nanos < 0 { "-" } else { "" };
            let magnitude = nanos.unsigned_abs();
            let text = format!("{sign}{}.{:09}", magnitude / 1_000_000_000, magnitude % 1_000_000_000);
            prop_assert_eq!(decimal_seconds(&text), Some(Stamp::from_nanos(nanos)));
        }
    }
}
