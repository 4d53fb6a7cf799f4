//! The three cores, one after the other, on the same recording with different voxel edges.

use std::sync::Arc;
use std::time::Instant;

use detection::{CycleInput, DetectionConfig, Detector, View};
use geometry::{CameraModel, DepthImage, DynamicZone, RayTable, Scan, ZoneSource};
use nalgebra::Isometry3;
use reconstruction::{Map, ReconstructionConfig};
use segmentation::Segmenter;
use simulator::{Sample, Scenario};

use geometry::Method;
use robot::Failure;
use robot::run::parameters::PipelineParameters;

/// A voxel grid that merges hardly any points: pixels of a Kinect are 1.7 mm apart at 1 m.
pub(super) const UNREDUCED_EDGE_M: f64 = 0.002;
/// The fixed zone is the middle third of the aperture's 90 degrees.
const ZONE_HALF_WIDTH_DEG: f64 = 15.0;
/// The limit of the map of unreduced clouds: some 400 MB.
const MAX_VOXELS: usize = 2_000_000;

/// The scans of a scenario, each with the newest depth image before it.
pub(super) struct Recording {
    cycles: Vec<(Scan, Arc<DepthImage>)>,
    camera: CameraModel,
}

/// The mean cost of a cycle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Cost {
    pub(super) cycle_ms: f64,
    pub(super) segmentation_ms: f64,
    /// Points of the reduced cloud.
    pub(super) points: f64,
}

impl Recording {
    /// The platform is at rest: poses are left out.
    pub(super) fn of(scenario: &Scenario) -> Result<Self, Failure> {
        let mut newest: Option<DepthImage> = None;
        let mut camera_model = None;
        let mut cycles = Vec::new();
        for sample in scenario.samples().map_err(failure)? {
            match sample {
                Sample::CameraInfo { camera, .. } => camera_model = Some(camera),
                Sample::Depth { image, .. } => newest = Some(image),
                Sample::Scan { scan, .. } => {
                    cycles.extend(newest.take().map(|image| (scan, Arc::new(image))))
                }
                _ => {}
            }
        }
        let camera =
            camera_model.ok_or_else(|| Failure::new("the scenario has no depth image to sweep"))?;
        Ok(Self { cycles, camera })
    }

    /// The cost of a cycle by a method with voxels of `edge_m`.
    pub(super) fn cost(&self, method: Method, edge_m: f64) -> Result<Cost, Failure> {
        let mut pipeline = Pipeline::new(method, edge_m)?;
        let rays = RayTable::new(&self.camera).map_err(failure)?;
        let projector = pipeline.detector.depth_projector(rays);
        let mut sum = Cost { cycle_ms: 0.0, segmentation_ms: 0.0, points: 0.0 };
        for (scan, image) in &self.cycles {
            let depth = projector.image(image).map_err(failure)?;
            let cost = pipeline.step(scan, View::Depth(depth))?;
            sum.cycle_ms += cost.cycle_ms;
            sum.segmentation_ms += cost.segmentation_ms;
            sum.points += cost.points;
        }
        let count = self.cycles.len().max(1) as f64;
        Ok(Cost {
            cycle_ms: sum.cycle_ms / count,
            segmentation_ms: sum.segmentation_ms / count,
            points: sum.points / count,
        })
    }
}

struct Pipeline {
    detector: Detector,
    segmenter: Segmenter,
    map: Map,
}

impl Pipeline {
    fn new(method: Method, edge_m: f64) -> Result<Self, Failure> {
        let parameters = PipelineParameters::of_method(method, Some(edge_m));
        let reconstruction =
            ReconstructionConfig { max_voxels: MAX_VOXELS, ..parameters.reconstruction().clone() };
        Ok(Self {
            detector: Detector::new(parameters.detection().clone()).map_err(failure)?,
            segmenter: Segmenter::new(parameters.segmentation_node().config.clone())
                .map_err(failure)?,
            map: Map::new(reconstruction, None).map_err(failure)?,
        })
    }

    fn step(&mut self, scan: &Scan, view: View<'_>) -> Result<Cost, Failure> {
        let input =
            CycleInput { scan, view, map_from_rig: &Isometry3::identity(), map_frame_id: "map" };
        let start = Instant::now();
        let mut cycle = self.detector.step(&input, |_| ()).map_err(failure)?.cycle;
        cycle.zones = vec![middle_third()];
        let detected = Instant::now();
        let segmented = self.segmenter.step(&cycle, |_| ()).map_err(failure)?;
        let segmentation = detected.elapsed();
        self.map.integrate(&segmented.cycle).map_err(failure)?;
        let milliseconds = |duration: std::time::Duration| duration.as_secs_f64() * 1e3;
        Ok(Cost {
            cycle_ms: milliseconds(start.elapsed()),
            segmentation_ms: milliseconds(segmentation),
            points: cycle.reduced_cloud.points_m.len() as f64,
        })
    }
}

fn middle_third() -> DynamicZone {
    let half_rad = ZONE_HALF_WIDTH_DEG.to_radians();
    DynamicZone {
        azimuth_min_rad: -half_rad,
        azimuth_max_rad: half_rad,
        peak_std_dev_m: DetectionConfig::default().min_std_dev_m as f32,
        source: ZoneSource::Measured,
        returns: None,
    }
}

fn failure(error: impl std::fmt::Display) -> Failure {
    Failure::new(error.to_string())
}

#[cfg(test)]
mod tests {
    use simulator::SceneName;

    use super::*;
    use crate::experiments::scans::for_scans;

    #[test]
    fn finer_voxels_leave_more_points_and_every_cycle_is_timed() {
        let scenario = for_scans(Scenario::empty(SceneName::B, 1), 4).with_depth_size(80, 60);
        let recording = Recording::of(&scenario).unwrap();
        assert_eq!(recording.cycles.len(), 3);
        let cost = |edge_m| recording.cost(Method::FreeSpace, edge_m).unwrap();
        let (fine, coarse) = (cost(0.05), cost(0.16));
        assert!(fine.points > 1.5 * coarse.points && coarse.points > 0.0);
        assert!(fine.segmentation_ms > 0.0 && fine.cycle_ms > fine.segmentation_ms);
        let unreduced = recording.cost(Method::RecHv, UNREDUCED_EDGE_M).unwrap();
        assert!(unreduced.points > 0.8 * 80.0 * 60.0 * 0.9, "{unreduced:?}");
    }
}
