//! The filter by rays: as if the sensor had fewer of them.

use serde::{Deserialize, Serialize};

use crate::registration::{ParameterError, check};

/// Leaves out points by the laser that measured them. The thesis leaves out the lowest ones, of 32 between 10 and 26, and
/// rejects the filter for what it does to the height; one of a few rays keeps the height.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RayFilter {
    /// This many of the lowest rays are left out.
    pub lowest_left_out: u16,
    /// Of the others one of this many is kept, from the lowest on.
    pub every: u16,
}

impl Default for RayFilter {
    fn default() -> Self {
        // Nothing is left out.
        Self { lowest_left_out: 0, every: 1 }
    }
}

impl RayFilter {
    /// Checks every parameter.
    ///
    /// # Errors
    /// When `every` is 0.
    pub fn validate(&self) -> Result<(), ParameterError> {
        check("every", "at least 1", f64::from(self.every), self.every > 0)
    }

    /// Whether each point is kept, by the ring that measured it, counted from the lowest, 0, up.
    #[must_use]
    pub fn keeps(&self, rings: &[u16]) -> Vec<bool> {
        let keep = |ring: &u16| {
            ring.checked_sub(self.lowest_left_out)
                .is_some_and(|above| above % self.every.max(1) == 0)
        };
        rings.iter().map(keep).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::selection::kept;

    #[test]
    fn the_lowest_go_and_one_of_a_few_stays() {
        let rings: Vec<u16> = (0..10).collect();
        let left = |lowest_left_out, every| {
            kept(&rings, &RayFilter { lowest_left_out, every }.keeps(&rings))
        };
        assert_eq!(left(0, 1), rings);
        assert_eq!(left(6, 1), [6, 7, 8, 9]);
        assert_eq!(left(0, 4), [0, 4, 8]);
        assert_eq!(left(3, 3), [3, 6, 9]);
        assert!(RayFilter { lowest_left_out: 0, every: 0 }.validate().is_err());
    }
}
