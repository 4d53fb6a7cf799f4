//! What the sensors saw in the cycles of a run, for the report: bounded, however long the run is.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use geometry::{CameraModel, DepthFrame, DetectedCycle, Scan, Stamp};
use nalgebra::Isometry3;
use report::{CycleView, ScanView, SmallDepth, cloud_steps};

/// Views that are kept: of two minutes of 5 Hz every one, of ten minutes every eighth. A view takes about 60 kB.
const MAX_VIEWS: usize = 600;
/// Scans that wait for their cycle, which detection's result tells.
const WAITING_SCANS: usize = 256;

/// The views of the cycles whose number is a multiple of a stride. The stride doubles when there are too many.
#[derive(Debug)]
pub(super) struct Views {
    by_cycle: BTreeMap<u32, (Stamp, CycleView)>,
    stride: u32,
    waiting_scans: VecDeque<(Stamp, ScanView)>,
    camera: Option<CameraModel>,
    rig_from_lidar: Isometry3<f64>,
    rig_from_camera: Option<Isometry3<f64>>,
}

impl Default for Views {
    fn default() -> Self {
        Self {
            by_cycle: BTreeMap::new(),
            stride: 1,
            waiting_scans: VecDeque::new(),
            camera: None,
            rig_from_lidar: Isometry3::identity(),
            rig_from_camera: None,
        }
    }
}

impl Views {
    /// Detection's result with its cloud and image.
    pub(super) fn detected(&mut self, cycle: &DetectedCycle) {
        self.rig_from_lidar = cycle.setup.mounts.rig_from_lidar;
        self.rig_from_camera.get_or_insert(cycle.setup.mounts.rig_from_camera);
        self.camera = self.camera.or(cycle.depth.as_ref().map(|frame| *frame.camera()));
        if !cycle.index.is_multiple_of(self.stride) {
            return;
        }
        // An image of another camera would be drawn and compared as if it were this one's.
        let has_camera = |frame: &&Arc<DepthFrame>| self.camera.as_ref() == Some(frame.camera());
        let scan = self.waiting_scans.iter().position(|(stamp, _)| *stamp == cycle.scan_stamp);
        let view = CycleView {
            scan: scan.and_then(|index| self.waiting_scans.remove(index)).map(|(_, scan)| scan),
            cloud: cycle.reduced_cloud.points_m.iter().filter_map(cloud_steps).collect(),
            depth: cycle.depth.as_ref().filter(has_camera).map(|frame| SmallDepth::from(&**frame)),
        };
        self.by_cycle.insert(cycle.index, (cycle.scan_stamp, view));
        if self.by_cycle.len() > MAX_VIEWS {
            self.stride *= 2;
            let stride = self.stride;
            self.by_cycle.retain(|index, _| index.is_multiple_of(stride));
        }
    }

    /// A scan, before or after detection's result of its cycle.
    pub(super) fn scan(&mut self, scan: &Scan) {
        let latest = self.by_cycle.values_mut().rev().take(WAITING_SCANS);
        let mut without_scan = latest.filter(|(_, view)| view.scan.is_none());
        match without_scan.find(|(stamp, _)| *stamp == scan.stamp) {
            Some((_, view)) => view.scan = Some(scan.into()),
            None => self.waiting_scans.push_back((scan.stamp, scan.into())),
        }
        if self.waiting_scans.len() > WAITING_SCANS {
            self.waiting_scans.pop_front();
        }
    }

    /// Takes the view of a cycle.
    pub(super) fn take(&mut self, index: u32) -> Option<CycleView> {
        self.by_cycle.remove(&index).map(|(_, view)| view)
    }

    /// The depth camera, once a cycle had a depth image.
    pub(super) fn camera(&self) -> Option<CameraModel> {
        self.camera
    }

    /// Its mount, as the first cycle had it.
    pub(super) fn rig_from_camera(&self) -> Option<Isometry3<f64>> {
        self.rig_from_camera
    }

    /// The scanner in the rig, as the latest cycle had it.
    pub(super) fn rig_from_lidar(&self) -> Isometry3<f64> {
        self.rig_from_lidar
    }
}
