//! How many cycles may wait before a node that takes longer for one than the scanner.
//!
//! Live, the newest data count: a waiting cycle is old when it is processed, and a node that is to end would have to process it. For a
//! recording every cycle counts, and its player can be paced.

/// The variable that names another number.
pub(crate) const VARIABLE: &str = "STILLMAP_MAX_WAITING_CYCLES";

/// The cycles that may wait live: the next one, and one more for a step that takes longer once.
const LIVE: usize = 2;

/// Where each cycle counts: seven seconds of the RPLIDAR A1.
pub(crate) const EVERY: usize = 50;

/// The variable of the environment, and its value, by which the nodes of a process take every cycle of a recording.
pub const EVERY_CYCLE: (&str, &str) = (VARIABLE, "50");

const ACCEPTED: std::ops::RangeInclusive<usize> = 1..=10_000;

/// The number of cycles that may wait, by the variable's value.
///
/// # Errors
/// When it is no such number.
pub(crate) fn parse(wanted: Option<&str>) -> Result<usize, String> {
    let Some(text) = wanted.filter(|text| !text.is_empty()) else { return Ok(LIVE) };
    let number = text.parse().ok().filter(|number| ACCEPTED.contains(number));
    number.ok_or_else(|| {
        format!(
            "{VARIABLE}={text}: a number from {} to {} is accepted",
            ACCEPTED.start(),
            ACCEPTED.end()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_cycles_wait_unless_another_number_is_given() {
        assert_eq!((parse(None), parse(Some(""))), (Ok(2), Ok(2)));
        assert_eq!(parse(Some(EVERY_CYCLE.1)), Ok(EVERY));
        for bad in ["0", "-1", "many", "10001"] {
            assert!(parse(Some(bad)).unwrap_err().contains("1 to 10000"), "{bad}");
        }
    }
}
