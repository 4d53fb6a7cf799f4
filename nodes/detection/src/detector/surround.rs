//! All beams of a scan, with those of the aperture among them.

use std::f64::consts::TAU;
use std::ops::Range;

use geometry::Scan;
use nalgebra::Isometry3;

use crate::aperture::{Aperture, Beam, ScanAnglesError};

/// The beams of a full turn: what lies behind the rig sees free space too.
#[derive(Clone, Debug)]
pub(super) struct Surround {
    whole: Aperture,
    within: Range<usize>,
}

impl Surround {
    /// The surround of the scans like `scan`, whose aperture holds `in_aperture`.
    pub(super) fn new(
        scan: &Scan,
        rig_from_lidar: &Isometry3<f64>,
        in_aperture: &[Beam],
    ) -> Result<Self, ScanAnglesError> {
        let whole = Aperture::new(scan, rig_from_lidar, TAU)?;
        // Both are sorted alike, so that the beams of the aperture stand side by side here too.
        let first = in_aperture.first().map_or(0, |first| {
            whole.crop(scan).iter().position(|beam| beam.index == first.index).unwrap_or(0)
        });
        let end = (first + in_aperture.len()).min(whole.len());
        Ok(Self { whole, within: first..end })
    }

    /// Whether `scan` has the angles that this surround was made for.
    pub(super) fn fits(&self, scan: &Scan) -> bool {
        self.whole.fits(scan)
    }

    /// All beams with what they measured, by azimuth.
    pub(super) fn beams(&self, scan: &Scan) -> Vec<Beam> {
        self.whole.crop(scan)
    }

    /// The places of the aperture's beams among them.
    pub(super) fn within(&self) -> &Range<usize> {
        &self.within
    }
}
