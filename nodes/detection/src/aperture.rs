//! The forward aperture: the beams of a scan that are used, and their directions in the rig frame.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use geometry::{Scan, ScanError};
use nalgebra::{Isometry3, Vector3};

/// Beams this close to a bound count as lying on it: the angles of a scan are sums of 32-bit steps.
const ROUNDING_RAD: f64 = 1e-5;

/// A beam of the aperture, with its range in one scan.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Beam {
    /// Its index in the scan.
    pub index: usize,
    /// Its direction in the rig's XY plane, from x towards y, in `[-pi, pi)`.
    pub azimuth_rad: f64,
    /// Its range; `None` where the scan has Inf, -Inf or NaN, or a range outside the scanner's
    /// limits.
    pub range_m: Option<f32>,
}

/// The beams within the forward aperture of scans of one geometry, in the order of their azimuths in
/// the rig frame (Rec-HV 3.2.1, eq. 1).
///
/// The direction of a beam is turned into the rig frame by the scanner's mount, so that it does not
/// matter whether the scanner counts from -pi or from 0, turns clockwise, or is mounted backwards or
/// upside down. The offset of the mount is not used: the method assumes that the two sensors are concentric
/// in the XY plane (Rec-HV 3.3.3.1); the tolerance of the zone covers the error.
#[derive(Clone, PartialEq, Debug)]
pub struct Aperture {
    angles: ScanAngles,
    /// Index in the scan, azimuth in the rig frame.
    directions: Vec<(usize, f64)>,
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct ScanAngles {
    beams: usize,
    angle_min_rad: f32,
    angle_increment_rad: f32,
}

impl ScanAngles {
    fn of(scan: &Scan) -> Self {
        Self {
            beams: scan.ranges_m.len(),
            angle_min_rad: scan.angle_min_rad,
            angle_increment_rad: scan.angle_increment_rad,
        }
    }
}

impl Aperture {
    /// The beams of scans like `scan` that point less than half of `aperture_rad` away from the rig's x
    /// axis. The left bound itself is left out, so that 1 degree beams give the thesis' l = 90.
    ///
    /// # Errors
    /// When the scan says nothing: [`Scan::validate`].
    pub fn new(
        scan: &Scan,
        rig_from_lidar: &Isometry3<f64>,
        aperture_rad: f64,
    ) -> Result<Self, ScanError> {
        scan.validate()?;
        let angles = ScanAngles::of(scan);
        let bounds_rad = bounds_rad(aperture_rad);
        let mut directions: Vec<(usize, f64)> = (0..angles.beams)
            .map(|index| (index, azimuth_in_rig_rad(scan.azimuth_rad(index), rig_from_lidar)))
            .filter(|(_, azimuth_rad)| bounds_rad.contains(azimuth_rad))
            .collect();
        directions.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        Ok(Self { angles, directions })
    }

    /// The places of the beams that a narrower aperture has, among those of this one.
    #[must_use]
    pub fn places_within(&self, aperture_rad: f64) -> Range<usize> {
        let bounds_rad = bounds_rad(aperture_rad);
        let before = |bound_rad: f64| {
            self.directions.partition_point(|(_, azimuth_rad)| *azimuth_rad < bound_rad)
        };
        before(bounds_rad.start)..before(bounds_rad.end)
    }

    /// Whether `scan` has the angles that this aperture was made for.
    #[must_use]
    pub fn fits(&self, scan: &Scan) -> bool {
        self.angles == ScanAngles::of(scan)
    }

    /// How many beams lie within it: the thesis' l.
    #[must_use]
    pub fn len(&self) -> usize {
        self.directions.len()
    }

    /// Whether no beam lies within it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.directions.is_empty()
    }

    /// The beams with what they measured in `scan`, by azimuth: the thesis' vectors theta and r.
    #[must_use]
    pub fn crop(&self, scan: &Scan) -> Vec<Beam> {
        self.directions
            .iter()
            .map(|&(index, azimuth_rad)| Beam {
                index,
                azimuth_rad,
                range_m: scan.measured_range_m(index),
            })
            .collect()
    }
}

/// The azimuths of an aperture, in the rig frame.
fn bounds_rad(aperture_rad: f64) -> Range<f64> {
    (-0.5 * aperture_rad - ROUNDING_RAD)..(0.5 * aperture_rad - ROUNDING_RAD)
}

fn azimuth_in_rig_rad(azimuth_in_scan_rad: f64, rig_from_lidar: &Isometry3<f64>) -> f64 {
    let (sin, cos) = azimuth_in_scan_rad.sin_cos();
    let direction = rig_from_lidar.rotation * Vector3::new(cos, sin, 0.0);
    let azimuth_rad = direction.y.atan2(direction.x);
    // -pi and pi are the same direction; only -pi is used, so that an aperture of a full turn has it once.
    if azimuth_rad > PI - ROUNDING_RAD { azimuth_rad - TAU } else { azimuth_rad }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use geometry::pose_from_vector;
    use proptest::prelude::*;

    use super::*;

    /// A full turn of one-degree beams; the range of each tells its index.
    fn turn(angle_min_rad: f64, increment_rad: f64) -> Scan {
        Scan {
            angle_min_rad: angle_min_rad as f32,
            angle_increment_rad: increment_rad as f32,
            range_min_m: 0.0,
            range_max_m: 1000.0,
            ranges_m: (0..360).map(|index| index as f32).collect(),
            ..Scan::default()
        }
    }

    fn azimuths_deg(aperture: &Aperture, scan: &Scan) -> Vec<f64> {
        aperture.crop(scan).iter().map(|beam| beam.azimuth_rad.to_degrees()).collect()
    }

    #[test]
    fn ninety_one_degree_beams_in_the_thesis_aperture() {
        for (angle_min, increment, mount) in [
            (-PI, TAU / 360.0, [0.0; 6]),
            (0.0, TAU / 360.0, [0.0; 6]),
            (PI, -TAU / 360.0, [0.0; 6]),
            (0.0, TAU / 360.0, [0.3, 0.0, -0.05, PI, 0.0, 0.0]),
            (-PI, TAU / 360.0, [0.0, 0.0, 0.0, 0.0, 0.0, PI]),
            (0.0, TAU / 360.0, [0.0, 0.0, 0.0, FRAC_PI_2, 0.0, PI]),
        ] {
            let scan = turn(angle_min, increment);
            let aperture = Aperture::new(&scan, &pose_from_vector(&mount), FRAC_PI_2).unwrap();
            assert_eq!(aperture.len(), 90, "{angle_min} {increment} {mount:?}");
            for (got, expected) in azimuths_deg(&aperture, &scan).iter().zip(-45..45) {
                assert!((got - f64::from(expected)).abs() < 1e-3, "{got} is not {expected}");
            }
        }
    }

    #[test]
    fn a_full_turn_holds_every_beam_once() {
        for angle_min in [-PI, 0.0] {
            let scan = turn(angle_min, TAU / 360.0);
            assert_eq!(Aperture::new(&scan, &Isometry3::identity(), TAU).unwrap().len(), 360);
        }
    }

    #[test]
    fn a_beam_keeps_its_range_through_the_mount() {
        // Mounted backwards, counting from 0: the beam straight ahead is number 180, and 190 points to
        // 10 degrees left. Upside down it counts clockwise: 350 points 10 degrees left.
        for (mount, expected_index) in
            [([0.0, 0.0, 0.0, PI, 0.0, 0.0], 190), ([0.0, 0.0, 0.0, 0.0, 0.0, PI], 350)]
        {
            let scan = turn(0.0, TAU / 360.0);
            let aperture = Aperture::new(&scan, &pose_from_vector(&mount), FRAC_PI_2).unwrap();
            let left = aperture.crop(&scan)[55];
            assert!((left.azimuth_rad.to_degrees() - 10.0).abs() < 1e-3);
            assert_eq!((left.index, left.range_m), (expected_index, Some(expected_index as f32)));
        }
    }

    #[test]
    fn a_range_that_is_no_return_is_a_gap() {
        let mut scan = turn(-PI, TAU / 360.0);
        scan.range_min_m = 0.15;
        scan.range_max_m = 8.0;
        let bad = [f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 0.1, 8.1, -1.0, 0.0];
        scan.ranges_m.fill(2.0);
        scan.ranges_m[180..187].copy_from_slice(&bad);
        let aperture = Aperture::new(&scan, &Isometry3::identity(), FRAC_PI_2).unwrap();
        let gaps: Vec<usize> = aperture
            .crop(&scan)
            .iter()
            .filter_map(|beam| beam.range_m.is_none().then_some(beam.index))
            .collect();
        assert_eq!(gaps, (180..187).collect::<Vec<_>>());
    }

    #[test]
    fn invalid_angles_are_refused() {
        for (angle_min_rad, angle_increment_rad) in
            [(f32::NAN, 0.01), (0.0, f32::INFINITY), (0.0, 0.0)]
        {
            let scan = Scan { angle_min_rad, angle_increment_rad, ..turn(0.0, 0.1) };
            let error = Aperture::new(&scan, &Isometry3::identity(), FRAC_PI_2).unwrap_err();
            assert!(matches!(error, ScanError::Angles { .. }), "{error}");
        }
        let empty = Aperture::new(&Scan::default(), &Isometry3::identity(), FRAC_PI_2);
        assert_eq!(empty, Err(ScanError::NoRays));
    }

    proptest! {
        #[test]
        fn beams_are_in_order_and_within_the_aperture(
            angle_min in -7.0f32..7.0,
            increment in prop_oneof![-0.2f32..-1e-3, 1e-3f32..0.2],
            beams in 1usize..800,
            aperture_rad in 0.01f64..TAU,
            mount in prop::array::uniform6(-4.0f64..4.0),
        ) {
            // Once round at most.
            let most = (TAU / f64::from(increment.abs())) as usize;
            let scan = Scan {
                angle_min_rad: angle_min,
                angle_increment_rad: increment,
                ranges_m: vec![1.0; beams.min(most)],
                range_max_m: 8.0,
                ..Scan::default()
            };
            let aperture = Aperture::new(&scan, &pose_from_vector(&mount), aperture_rad).unwrap();
            let cropped = aperture.crop(&scan);
            prop_assert!(aperture.fits(&scan));
            prop_assert!(cropped.windows(2).all(|w| w[0].azimuth_rad <= w[1].azimuth_rad));
            let half_rad = 0.5 * aperture_rad + ROUNDING_RAD;
            prop_assert!(cropped.iter().all(|beam| beam.azimuth_rad.abs() <= half_rad));
            // The same beams are found among those of the whole turn.
            let whole = Aperture::new(&scan, &pose_from_vector(&mount), TAU).unwrap();
            prop_assert_eq!(&whole.crop(&scan)[whole.places_within(aperture_rad)], &cropped[..]);
        }
    }
}
