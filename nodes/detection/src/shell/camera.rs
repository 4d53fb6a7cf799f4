//! The calibration of the depth camera, from a file or its topic, and the images received before it.

use std::collections::VecDeque;

use calibration::camera_file::camera_from_yaml;
use geometry::{CameraModel, CameraModelError, DepthProjector, RayTable};
use node_shell::{Counters, NodeFailure};

use super::DetectionParameters;
use super::inputs::ViewMessage;
use crate::Detector;

/// The cause of a drop that costs no scan by itself: too many images before their camera's calibration.
pub const IMAGE_WITHOUT_CALIBRATION: &str = "image without a calibration";

/// The depth camera, as far as it is known.
pub(super) struct Camera {
    known: Option<DepthProjector>,
    /// Whether the calibration comes from a file; then that of the topic is ignored.
    is_given: bool,
    /// Images received before the calibration of their camera.
    uncalibrated: VecDeque<ViewMessage>,
    most_uncalibrated: usize,
    counters: Counters,
}

impl Camera {
    /// The camera of the parameters' file, or one whose calibration is received on its topic.
    ///
    /// # Errors
    /// When the file of the parameters has no valid calibration.
    pub(super) fn new(
        parameters: &DetectionParameters,
        detector: &Detector,
        counters: Counters,
    ) -> Result<Self, NodeFailure> {
        let given = given_camera(&parameters.camera_info_file)?;
        let rays = given.as_ref().map(RayTable::new).transpose()?;
        Ok(Self {
            known: rays.map(|rays| detector.depth_projector(rays)),
            is_given: given.is_some(),
            uncalibrated: VecDeque::new(),
            most_uncalibrated: parameters.config.max_waiting_clouds,
            counters,
        })
    }

    /// The projector of its images.
    pub(super) fn known(&self) -> Option<&DepthProjector> {
        self.known.as_ref()
    }

    /// Whether images were received, but not their calibration.
    pub(super) fn is_missing(&self) -> bool {
        self.known.is_none() && !self.uncalibrated.is_empty()
    }

    /// Returns the view if it can be used at once. An image waits for the calibration of its camera, which many drivers send
    /// after it.
    pub(super) fn usable(&mut self, view: ViewMessage) -> Option<ViewMessage> {
        if !view.needs_calibration() || self.known.is_some() {
            return Some(view);
        }
        if self.uncalibrated.len() >= self.most_uncalibrated {
            self.uncalibrated.pop_front();
            self.counters.count_drop(IMAGE_WITHOUT_CALIBRATION);
        }
        self.uncalibrated.push_back(view);
        None
    }

    /// Takes a calibration of the topic. Returns whether it is new; then [`Camera::take_uncalibrated`] must be called.
    ///
    /// # Errors
    /// When the numbers do not describe a camera.
    pub(super) fn take(
        &mut self,
        camera: CameraModel,
        detector: &Detector,
    ) -> Result<bool, CameraModelError> {
        let is_known = |known: &DepthProjector| *known.rays().camera() == camera;
        if self.is_given || self.known.as_ref().is_some_and(is_known) {
            return Ok(false);
        }
        self.known = Some(detector.depth_projector(RayTable::new(&camera)?));
        Ok(true)
    }

    /// Takes over the mounts that `detector` has by now.
    pub(super) fn mount(&mut self, detector: &Detector) {
        if let Some(projector) = &mut self.known {
            *projector = detector.depth_projector(projector.rays().clone());
        }
    }

    /// The waiting images, in their order.
    pub(super) fn take_uncalibrated(&mut self) -> VecDeque<ViewMessage> {
        std::mem::take(&mut self.uncalibrated)
    }

    /// Drops the waiting images.
    pub(super) fn drop_uncalibrated(&mut self) {
        self.uncalibrated.clear();
    }

    /// Drops the waiting images, and the calibration unless it is of a file.
    pub(super) fn reset(&mut self) {
        self.drop_uncalibrated();
        if !self.is_given {
            self.known = None;
        }
    }
}

/// The calibration in a file; none for an empty name.
///
/// # Errors
/// When there is no such file, or it has no valid calibration.
fn given_camera(path: &str) -> Result<Option<CameraModel>, NodeFailure> {
    if path.is_empty() {
        return Ok(None);
    }
    let within = |reason: String| format!("parameter camera_info_file: {path}: {reason}");
    let text = std::fs::read_to_string(path).map_err(|error| within(error.to_string()))?;
    let file = camera_from_yaml(&text).map_err(|error| within(error.to_string()))?;
    Ok(Some(file.camera))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_calibration_file_is_loaded_or_named() {
        assert!(given_camera("").unwrap().is_none());
        let annex_2 =
            concat!(env!("CARGO_MANIFEST_DIR"), "/../calibration/cameras/rec_hv_annex_2.yaml");
        let camera = given_camera(annex_2).unwrap().unwrap();
        assert_eq!((camera.width_px, camera.height_px), (640, 480));
        let missing = given_camera("/no/such/camera.yaml").unwrap_err().to_string();
        assert!(
            missing.contains("camera_info_file") && missing.contains("/no/such/camera.yaml"),
            "{missing}"
        );
        let wrong = given_camera(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")).unwrap_err();
        assert!(wrong.to_string().contains("camera_info_file"), "{wrong}");
    }
}
