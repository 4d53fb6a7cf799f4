//! All beams of a scan, with those of the aperture among them.

use std::f64::consts::TAU;
use std::ops::Range;

use geometry::{RobotBox, Scan, ScanError, is_same_mount};
use nalgebra::Isometry3;

use crate::aperture::{Aperture, Beam};

/// The beams of a full turn: what lies behind the rig sees free space too.
#[derive(Clone, Debug)]
pub(super) struct Surround {
    rig_from_lidar: Isometry3<f64>,
    whole: Aperture,
    within: Range<usize>,
}

/// The beams of one scan with what they measured, by azimuth.
#[derive(Clone, Debug)]
pub(super) struct ScanBeams {
    /// All of them.
    pub(super) all: Vec<Beam>,
    /// The places of the aperture's beams among them.
    pub(super) within: Range<usize>,
}

impl ScanBeams {
    /// Those of the aperture.
    pub(super) fn in_aperture(&self) -> &[Beam] {
        self.all.get(self.within.clone()).unwrap_or_default()
    }

    /// Takes the returns that are of the robot itself for none.
    pub(super) fn leave_out(
        &mut self,
        robot: &RobotBox,
        scan: &Scan,
        rig_from_lidar: &Isometry3<f64>,
    ) {
        for beam in &mut self.all {
            let is_of_robot =
                scan.hit_m(beam.index).is_some_and(|hit| robot.contains(&(rig_from_lidar * hit)));
            beam.range_m = beam.range_m.filter(|_| !is_of_robot);
        }
    }
}

impl Surround {
    /// The surround of the scans like `scan`, with an aperture of `aperture_rad`.
    pub(super) fn new(
        scan: &Scan,
        rig_from_lidar: &Isometry3<f64>,
        aperture_rad: f64,
    ) -> Result<Self, ScanError> {
        let whole = Aperture::new(scan, rig_from_lidar, TAU)?;
        let within = whole.places_within(aperture_rad);
        Ok(Self { rig_from_lidar: *rig_from_lidar, whole, within })
    }

    /// Takes another aperture than before.
    pub(super) fn set_aperture(&mut self, aperture_rad: f64) {
        self.within = self.whole.places_within(aperture_rad);
    }

    /// Whether `scan`, of a scanner with this mount, has the beams of this surround.
    pub(super) fn fits(&self, scan: &Scan, rig_from_lidar: &Isometry3<f64>) -> bool {
        self.has_angles_of(scan) && is_same_mount(&self.rig_from_lidar, rig_from_lidar)
    }

    /// Whether `scan` has the angles that this surround was made for.
    pub(super) fn has_angles_of(&self, scan: &Scan) -> bool {
        self.whole.fits(scan)
    }

    /// The beams of a scan.
    pub(super) fn crop(&self, scan: &Scan) -> ScanBeams {
        ScanBeams { all: self.whole.crop(scan), within: self.within.clone() }
    }
}
