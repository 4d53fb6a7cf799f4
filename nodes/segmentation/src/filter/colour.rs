//! The pixels of a colour image that show what moves, by the depth image nearest in stamp.

use std::collections::VecDeque;

use geometry::{CameraModel, DepthFrame, Stamp, VoxelGrid};
use nalgebra::Isometry3;

use super::{LONGEST_CARRY_S, MotionFilter, Moving, Verdict, nearest_in_time};
use crate::moving_view::{MovingView, Splats};

/// More than come before a colour image of the same moment: it is larger, and later.
const VIEWS_KEPT: usize = 8;

/// What the last depth images show that moves, where somebody wants to know.
#[derive(Clone, Debug, Default)]
pub(super) struct Views {
    is_wanted: bool,
    views: VecDeque<MovingView>,
    /// The stamp of the latest image, whatever is known of it.
    looked_at: Option<Stamp>,
}

impl Views {
    pub(super) fn clear(&mut self) {
        self.views.clear();
        self.looked_at = None;
    }

    /// A cycle says more of this moment than the one before did.
    pub(super) fn forget_at(&mut self, stamp: Stamp) {
        self.views.retain(|view| view.stamp != stamp);
    }

    /// Takes note of an image. One of an earlier time begins anew.
    pub(super) fn look_at(&mut self, stamp: Stamp) {
        if self.looked_at.is_some_and(|last| last.seconds_since(stamp) > LONGEST_CARRY_S) {
            self.clear();
        }
        self.looked_at = self.looked_at.max(Some(stamp));
    }

    pub(super) fn keep_nothing(&mut self, stamp: Stamp, rig_from_camera: &Isometry3<f64>) {
        if self.is_wanted {
            self.push(MovingView::of_nothing(stamp, rig_from_camera));
        }
    }

    /// Keeps what an image shows, by the mask that was made of these points.
    pub(super) fn keep(
        &mut self,
        frame: &DepthFrame,
        rig_from_camera: &Isometry3<f64>,
        (is_moving, moving): (&[bool], &[Moving]),
        grid: &VoxelGrid,
    ) {
        if self.is_wanted {
            self.push(MovingView::of_mask(frame, rig_from_camera, is_moving, moving, grid));
        }
    }

    fn push(&mut self, view: MovingView) {
        if self.views.len() == VIEWS_KEPT {
            self.views.pop_front();
        }
        self.views.push_back(view);
    }

    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.views.len()
    }

    fn nearest(&self, stamp: Stamp) -> Option<&MovingView> {
        nearest_in_time(&self.views, stamp, |view| view.stamp)
    }
}

impl MotionFilter {
    /// Says whether [`Self::colour_pixels`] is going to be asked for. What it needs of the depth images is kept only then.
    pub fn keep_for_colours(&mut self, is_wanted: bool) {
        if self.views.is_wanted && !is_wanted {
            self.views.clear();
        }
        self.views.is_wanted = is_wanted;
    }

    /// Whether the depth image of a colour image of this stamp, or a later one, has come.
    #[must_use]
    pub fn has_depth(&self, stamp: Stamp) -> bool {
        self.views.looked_at.is_some_and(|last| last >= stamp)
    }

    /// The pixels of an image of a colour camera that show what moves, row by row; `None` where no cycle is near.
    ///
    /// It is what the depth image nearest in stamp shows, the cycles' own among them, carried on to the moment of the colour image
    /// and seen by its camera. Where there is none it is the places of the moving points.
    pub fn colour_pixels(
        &mut self,
        stamp: Stamp,
        colour_camera: &CameraModel,
    ) -> Option<Vec<bool>> {
        self.keep_view_of_cycle(stamp);
        let verdict = self.nearest(stamp)?;
        let colour_from_rig = verdict.colour_from_depth * verdict.mounts.rig_from_camera.inverse();
        let colour_from_map = colour_from_rig * self.map_from_rig(verdict, stamp).inverse();
        let mut splats = Splats::new(colour_camera);
        match self.views.nearest(stamp) {
            Some(view) => {
                let map_from_then = self.map_from_rig(verdict, view.stamp) * view.rig_from_camera;
                let after_s = stamp.seconds_since(view.stamp);
                let motion = (&colour_from_map, after_s);
                view.splat(&(colour_from_map * map_from_then), motion, &mut splats);
            }
            None => {
                // A voxel, and the half of one to each side that an object may go on beyond it.
                let extent_m = [2.0 * self.grid.edge_m(); 2];
                for (point, _) in self.moving_in_rig(verdict, stamp) {
                    splats.add(&(colour_from_rig * point.cast::<f64>()), extent_m);
                }
            }
        }
        Some(splats.into_mask())
    }

    /// Keeps what the image of the nearest cycle shows, where no image has come that is nearer.
    fn keep_view_of_cycle(&mut self, stamp: Stamp) {
        let Some(verdict) = self.nearest(stamp) else { return };
        let away_s = |at: Stamp| at.seconds_since(stamp).abs();
        let known = self.views.nearest(stamp);
        if known.is_some_and(|view| away_s(view.stamp) <= away_s(verdict.view_stamp)) {
            return;
        }
        let Verdict { view_stamp, mounts, depth: Some(depth), .. } = verdict else { return };
        let moving = self.moving_in_rig(verdict, *view_stamp);
        let view = MovingView::of_mask(
            depth.frame(),
            &mounts.rig_from_camera,
            depth.is_moving(),
            &moving,
            &self.grid,
        );
        self.views.push(view);
    }
}
