//! Where the map is on the earth.

use clap::Args;

use crate::failure::Failure;

/// The reference system, and where the map is in it.
#[derive(Args, Clone, PartialEq, Debug, Default)]
#[command(next_help_heading = "Georeference, of .las, .laz and .e57")]
pub(super) struct Georeference {
    /// Where the map's origin is (after --transform): east, north and height, in metres
    #[arg(long, num_args = 3, value_names = ["EAST", "NORTH", "HEIGHT"], allow_negative_numbers = true)]
    origin: Option<Vec<f64>>,
    /// The projected reference system of --origin, by its number at EPSG, as 25832 for ETRS89 / UTM zone 32N; of .las and .laz
    #[arg(long, value_name = "NUMBER", requires = "origin")]
    epsg: Option<u16>,
}

/// The numbers of EPSG that GeoTIFF keys can hold (OGC GeoTIFF 1.1, requirement 12.2).
const NUMBERS: std::ops::RangeInclusive<u16> = 1024..=32_766;
/// The usual systems in degrees, or geocentric: WGS 84, ETRS89, NAD83, CGCS2000, JGD, GDA, SIRGAS and others. EPSG has them and projected
/// systems side by side, so that no range of numbers tells.
const NOT_PROJECTED: [u16; 22] = [
    4230, 4258, 4267, 4269, 4283, 4312, 4314, 4326, 4490, 4612, 4617, 4674, 4936, 4937, 4978, 4979,
    6318, 6668, 6697, 7843, 7844, 9057,
];

/// Whether a number may be that of a projected system.
fn is_projected(epsg: u16) -> bool {
    NUMBERS.contains(&epsg) && !NOT_PROJECTED.contains(&epsg)
}

impl Georeference {
    /// Refuses what the form of the file cannot hold, before anything is read.
    ///
    /// # Errors
    /// With the option and its value.
    pub(super) fn check(&self, form_holds: Holds) -> Result<(), Failure> {
        if self.origin.is_some() && form_holds == Holds::Nothing {
            let reason = "--origin: the coordinates of this file are single precision, to half a metre on a map of a country";
            return Err(Failure::new(reason).fix("-o must end in .las, .laz or .e57"));
        }
        if let Some(far_m) = self.origin.iter().flatten().find(|along_m| !along_m.is_finite()) {
            return Err(Failure::unusable(format!("--origin: {far_m} m is no place")));
        }
        let Some(epsg) = self.epsg else { return Ok(()) };
        if form_holds != Holds::System {
            return Err(Failure::unusable(
                "--epsg: an E57 file names its system by a text that the number does not give",
            )
            .fix("leave it out, or write .las or .laz"));
        }
        if !is_projected(epsg) {
            return Err(Failure::unusable(format!("--epsg {epsg} is no projected system"))
                .fix("a map is in metres, and not in degrees; its system has a number from 1024 to 32766, as 25832"));
        }
        Ok(())
    }

    /// The map's origin in the system; 0 0 0 where none was given.
    pub(super) fn origin_m(&self) -> [f64; 3] {
        match self.origin.as_deref() {
            Some(&[east_m, north_m, height_m]) => [east_m, north_m, height_m],
            _ => [0.0; 3],
        }
    }

    pub(super) fn epsg(&self) -> Option<u16> {
        self.epsg
    }
}

/// What a form of file can say of the earth.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Holds {
    Nothing,
    /// A place.
    Origin,
    /// A place, and the system that it is in.
    System,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(origin: Option<[f64; 3]>, epsg: Option<u16>) -> Georeference {
        Georeference { origin: origin.map(Vec::from), epsg }
    }

    #[test]
    fn what_a_file_cannot_hold_is_refused() {
        let here = Some([5e5, 5.4e6, 100.0]);
        assert!(of(here, Some(25832)).check(Holds::System).is_ok());
        assert!(of(here, None).check(Holds::Origin).is_ok());
        // Regression: all numbers from 4000 to 4999 were refused, as those of China's and of UTM with the zone before the east.
        for projected in [4547, 4647, 4839] {
            assert!(of(here, Some(projected)).check(Holds::System).is_ok(), "{projected}");
        }
        assert!(of(here, Some(7844)).check(Holds::System).is_err());
        assert!(of(None, None).check(Holds::Nothing).is_ok());
        for (georeference, holds, said) in [
            (of(here, None), Holds::Nothing, "single precision"),
            (of(here, Some(25832)), Holds::Origin, "E57"),
            (of(here, Some(4326)), Holds::System, "4326"),
            (of(here, Some(0)), Holds::System, "--epsg 0"),
            (of(here, Some(40_000)), Holds::System, "32766"),
            (of(Some([f64::NAN, 0.0, 0.0]), None), Holds::Origin, "NaN"),
        ] {
            let failure = georeference.check(holds).unwrap_err();
            assert!(format!("{failure:?}").contains(said), "{failure:?}");
        }
        assert_eq!(of(here, None).origin_m(), [5e5, 5.4e6, 100.0]);
        assert_eq!(of(None, None).origin_m(), [0.0; 3]);
    }
}
