//! The two methods: each a whole implementation, chosen once.

mod free_space;
mod variability;

use geometry::{MapPath, Method};
use nalgebra::Isometry3;

use self::free_space::FreeSpaceFinder;
use self::variability::VariabilityFinder;
use super::cycle::{CycleInput, Step};
use super::found::Found;
use super::surround::ScanBeams;
use crate::config::DetectionConfig;

/// Finds the zones of a cycle by one of the methods.
#[derive(Clone, Debug)]
pub(super) enum Finder {
    RecHv(VariabilityFinder),
    FreeSpace(Box<FreeSpaceFinder>),
}

impl Finder {
    /// One that has seen nothing yet; `config` has been validated.
    pub(super) fn new(config: &DetectionConfig) -> Self {
        match config.pipeline.method {
            Method::RecHv => Self::RecHv(VariabilityFinder::new(config)),
            Method::FreeSpace => Self::FreeSpace(Box::new(FreeSpaceFinder::new(config))),
        }
    }

    /// The zones of a cycle whose scan has these beams, of a scanner with this mount. `observe` is called at the end of each stage.
    pub(super) fn find(
        &mut self,
        input: &CycleInput<'_>,
        beams: &ScanBeams,
        rig_from_lidar: &Isometry3<f64>,
        observe: &mut impl FnMut(Step),
    ) -> Found {
        match self {
            Self::RecHv(finder) => finder.find(input.scan, beams.in_aperture(), observe),
            Self::FreeSpace(finder) => finder.find(input, beams, rig_from_lidar, observe),
        }
    }

    /// Bounds zones by another aperture than before.
    pub(super) fn set_aperture(&mut self, aperture_rad: f64) {
        match self {
            // As published, it has one aperture.
            Self::RecHv(_) => {}
            Self::FreeSpace(finder) => finder.set_aperture(aperture_rad),
        }
    }

    /// The scan's geometry is another than before.
    pub(super) fn clear_window(&mut self) {
        match self {
            Self::RecHv(finder) => finder.clear_window(),
            Self::FreeSpace(finder) => finder.clear_window(),
        }
    }

    /// Forgets all that was seen.
    pub(super) fn clear(&mut self) {
        match self {
            Self::RecHv(finder) => finder.clear(),
            Self::FreeSpace(finder) => finder.clear(),
        }
    }

    /// Takes the trajectory of the platform as the map of its poses has it by now.
    pub(super) fn follow_path(&mut self, path: MapPath) {
        match self {
            // It asks for no pose.
            Self::RecHv(_) => {}
            Self::FreeSpace(finder) => finder.follow_path(path),
        }
    }
}
