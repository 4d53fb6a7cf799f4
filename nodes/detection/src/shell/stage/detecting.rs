//! A matched cycle through the core, from its messages on.

use std::sync::Arc;

use calibration::DepthOptics;
use geometry::{Scan, StampedPose};
use msgs::convert;
use node_shell::{NodeFailure, StepTimer};

use super::Stage;
use crate::shell::colour::NoColours;
use crate::shell::inputs::ViewMessage;
use crate::{CycleInput, Detected, Matched, View};

impl Stage {
    pub(super) fn detect(
        &mut self,
        matched: &Matched<Scan, ViewMessage>,
        pose: &StampedPose,
        timer: &mut StepTimer,
    ) -> Result<Detected, NodeFailure> {
        let (image, cloud, organised);
        let view = match (&matched.cloud, self.camera.known()) {
            (ViewMessage::Depth(message), Some(projector)) => {
                image = Arc::new(convert::depth_from_message(message)?);
                View::Depth(projector.image(&image)?)
            }
            (ViewMessage::CompressedDepth(message), Some(projector)) => {
                image = Arc::new(convert::compressed_depth_from_message(message)?);
                View::Depth(projector.image(&image)?)
            }
            (ViewMessage::Depth(_) | ViewMessage::CompressedDepth(_), None) => {
                return Err("the camera has no calibration".into());
            }
            (ViewMessage::Points(message), _) if message.height > 1 => {
                organised = convert::organised_cloud_from_message(message)?;
                View::OrganisedPoints(&organised)
            }
            (ViewMessage::Points(message), _) => {
                cloud = convert::cloud_from_message(message)?;
                View::PointsInCamera(&cloud)
            }
        };
        timer.end_of("convert");
        if let (Some(check), View::Depth(depth)) = (&mut self.extrinsics, view) {
            let optics = DepthOptics { camera: depth.rays().camera(), rays: depth.rays() };
            check.look(&matched.scan, depth.image(), optics, &pose.map_from_rig);
            timer.end_of("extrinsics_check");
        }
        let input = CycleInput {
            scan: &matched.scan,
            view,
            map_from_rig: &pose.map_from_rig,
            map_frame_id: &pose.frame_id,
        };
        let mut detected = self.detector.step(&input, |step| timer.end_of(step.name()))?;
        if self.colours.is_some() {
            self.colour(&mut detected, &matched.cloud);
            timer.end_of("colour");
        }
        Ok(detected)
    }

    /// Gives a cycle its colours, if there are any. One without is a cycle nevertheless.
    fn colour(&mut self, detected: &mut Detected, view: &ViewMessage) {
        let (Some(colours), Some(frame)) = (&mut self.colours, &detected.cycle.depth) else {
            return;
        };
        let of_camera = colours.of_camera(frame);
        let is_of_camera = of_camera.is_some();
        let found = match (of_camera, view) {
            (Some(found), _) => found.map(Some),
            (None, ViewMessage::Points(message)) => {
                let has_pixels = message.height > 1 && detected.statistics.not_pinhole.is_none();
                colours.of_points(message, frame, has_pixels).map_err(NoColours::Unusable)
            }
            (None, _) => Ok(None),
        };
        let found = found.and_then(|found| match found {
            Some(found) => {
                detected.cycle.colour(found).map_err(|error| NoColours::Unusable(error.into()))
            }
            None => Ok(()),
        });
        if is_of_camera {
            colours.note(found.as_ref().map(|_| ()));
        }
        if let Err(NoColours::Unusable(reason)) = &found {
            let [topic, _] = self.inputs.colour_topics();
            let topic = if is_of_camera { topic } else { self.inputs.view_topic() };
            self.refuse_on(topic, &reason.to_string());
        }
    }
}
