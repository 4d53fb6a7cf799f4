//! The ground truth of a trial that its cycles need later.

use std::collections::BTreeMap;
use std::sync::Arc;

use evaluation::{TruthFrame, TruthFrameError};
use geometry::{CameraModel, DepthImage, DepthLimits, LabelImage, RayTable, Stamp};
use nalgebra::Isometry3;
use simulator::{ObjectPoses, Sample};

use super::failure;
use robot::Failure;

/// The most images kept until their cycle arrives: four seconds of a Kinect's.
const WAITING_IMAGES: usize = 120;

/// The ground truth, by the stamp of the depth image.
pub(super) struct Truth {
    keeps_images: bool,
    rays: Option<(CameraModel, RayTable)>,
    objects: BTreeMap<Stamp, ObjectPoses>,
    /// Images whose cycle may still arrive.
    waiting: BTreeMap<Stamp, Arc<LabelledImage>>,
    /// Images with a cycle.
    claimed: BTreeMap<Stamp, Arc<LabelledImage>>,
}

struct LabelledImage {
    depth: DepthImage,
    labels: LabelImage,
}

impl Truth {
    pub(super) fn new(keeps_images: bool) -> Self {
        Self {
            keeps_images,
            rays: None,
            objects: BTreeMap::new(),
            waiting: BTreeMap::new(),
            claimed: BTreeMap::new(),
        }
    }

    pub(super) fn take(&mut self, sample: Sample) -> Result<(), Failure> {
        match sample {
            Sample::CameraInfo { camera, .. }
                if self.rays.as_ref().is_none_or(|(known, _)| *known != camera) =>
            {
                self.rays = Some((camera, RayTable::new(&camera).map_err(failure)?));
            }
            Sample::Depth { image, labels } if self.keeps_images => {
                let stamp = image.stamp;
                self.waiting.insert(stamp, Arc::new(LabelledImage { depth: image, labels }));
                if self.waiting.len() > WAITING_IMAGES {
                    self.waiting.pop_first();
                }
            }
            Sample::ObjectPoses(poses) => {
                self.objects.insert(poses.stamp, poses);
            }
            _ => {}
        }
        Ok(())
    }

    /// Keeps the image of this stamp: there is a cycle of it.
    pub(super) fn claim(&mut self, stamp: Stamp) {
        if let Some(image) = self.waiting.get(&stamp) {
            self.claimed.insert(stamp, Arc::clone(image));
        }
    }

    /// Drops the images before this stamp, of which no cycle will come. `None` drops nothing.
    pub(super) fn forget_before(&mut self, stamp: Option<Stamp>) {
        if let Some(stamp) = stamp {
            self.waiting = self.waiting.split_off(&stamp);
        }
    }

    /// The poses of the objects in the image of this stamp.
    pub(super) fn objects_at(&self, stamp: Stamp) -> Option<&ObjectPoses> {
        self.objects.get(&stamp)
    }

    /// The labelled points of the image of this stamp, in the rig frame; `None` when it was not claimed.
    pub(super) fn frame_at(
        &self,
        stamp: Stamp,
        rig_from_camera: &Isometry3<f64>,
    ) -> Result<Option<TruthFrame>, TruthFrameError> {
        let (Some(image), Some((_, rays))) = (self.claimed.get(&stamp), &self.rays) else {
            return Ok(None);
        };
        let LabelledImage { depth, labels } = &**image;
        let limits = DepthLimits::default();
        TruthFrame::from_images(depth, labels, rays, &limits, rig_from_camera).map(Some)
    }
}
