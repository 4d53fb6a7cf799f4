//! The arrangement of the lasers of each model.

use serde::{Deserialize, Serialize};

use super::Laser;

/// A model of Velodyne.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum VelodyneModel {
    /// 32 lasers from -30.67 to 10.67 degrees.
    Hdl32e,
    /// 16 lasers from -15 to 15 degrees.
    Vlp16,
    /// 64 lasers from -24.33 to 2 degrees.
    Hdl64e,
}

impl VelodyneModel {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Hdl32e, Self::Vlp16, Self::Hdl64e];

    /// The time from one firing of all lasers to the next, in seconds. From the manuals: of the HDL-32E and the
    /// VLP-16 as printed, of the HDL-64E (S2) from its 1.333 million shots a second.
    #[must_use]
    pub fn firing_period_s(self) -> f64 {
        match self {
            Self::Hdl32e => 46.08e-6,
            Self::Vlp16 => 55.296e-6,
            Self::Hdl64e => 48.0e-6,
        }
    }

    /// The time from one laser to the next.
    fn laser_period_s(self) -> f64 {
        match self {
            Self::Hdl32e => 1.152e-6,
            Self::Vlp16 => 2.304e-6,
            // Its blocks fire four at a time; here they follow each other evenly.
            Self::Hdl64e => 0.75e-6,
        }
    }

    /// Elevations in the order of firing, in degrees. Two blocks take turns, each from its lowest laser up (of the
    /// HDL-64E from its highest down).
    fn elevations_deg(self) -> Vec<f64> {
        let blocks = |count: u32, first: f64, second: f64, steps: [f64; 2]| {
            (0..count)
                .flat_map(|index| {
                    let index = f64::from(index);
                    [first + steps[0] * index, second + steps[1] * index]
                })
                .collect()
        };
        match self {
            Self::Hdl32e => blocks(16, -92.0 / 3.0, -28.0 / 3.0, [4.0 / 3.0; 2]),
            Self::Vlp16 => blocks(8, -15.0, 1.0, [2.0; 2]),
            Self::Hdl64e => blocks(32, 2.0, -53.0 / 6.0, [-1.0 / 3.0, -0.5]),
        }
    }

    /// The lasers in the order of firing.
    pub(crate) fn lasers(self) -> Vec<Laser> {
        let elevations_deg = self.elevations_deg();
        elevations_deg
            .iter()
            .enumerate()
            .map(|(index, elevation_deg)| Laser {
                elevation_rad: elevation_deg.to_radians(),
                delay_s: index as f64 * self.laser_period_s(),
                ring: elevations_deg.iter().filter(|other| *other < elevation_deg).count() as u16,
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rounded_deg(model: VelodyneModel) -> Vec<f64> {
        let lasers = model.lasers();
        lasers
            .iter()
            .map(|laser| (laser.elevation_rad.to_degrees() * 100.0).round() / 100.0)
            .collect()
    }

    #[test]
    fn elevations_are_those_of_the_tables_in_the_order_of_firing() {
        // Road LiDAR, Table 2.2.
        let hdl_32e = rounded_deg(VelodyneModel::Hdl32e);
        assert_eq!(hdl_32e[..6], [-30.67, -9.33, -29.33, -8.0, -28.0, -6.67]);
        assert_eq!((hdl_32e.len(), hdl_32e[30], hdl_32e[31]), (32, -10.67, 10.67));
        let vlp_16 = rounded_deg(VelodyneModel::Vlp16);
        assert_eq!(vlp_16[..4], [-15.0, 1.0, -13.0, 3.0]);
        assert_eq!((vlp_16.len(), vlp_16[15]), (16, 15.0));
        let hdl_64e = rounded_deg(VelodyneModel::Hdl64e);
        assert_eq!((hdl_64e[0], hdl_64e[62], hdl_64e[63]), (2.0, -8.33, -24.33));
    }

    #[test]
    fn rings_count_from_the_lowest_and_a_firing_ends_before_the_next() {
        for model in VelodyneModel::ALL {
            let mut lasers = model.lasers();
            assert!(lasers.iter().all(|laser| laser.delay_s < model.firing_period_s()));
            lasers.sort_by(|a, b| a.elevation_rad.total_cmp(&b.elevation_rad));
            assert!((0..).zip(&lasers).all(|(ring, laser)| laser.ring == ring));
        }
    }
}
