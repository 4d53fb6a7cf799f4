//! What moves in a depth image, pixel by pixel with its depth and its velocity: for the image of another camera, at another moment.
//!
//! A pixel of the mask may measure what is behind the object, or nothing: in the margin, and at edges. Seen from elsewhere that is
//! elsewhere, so each pixel has the depth of the object:
//! 1. pixels of the voxels that move have their own depth, and the velocity of the voxel's point;
//! 2. so have pixels of the mask that continue these;
//! 3. the others of the mask have the depth and the velocity of the pixel beside them that had one first;
//! 4. so have pixels without a depth that touch the mask, as far as the mask grows: hair and black cloth are parts of the object. A
//!    gap no wider than the mask's margin is an edge between two depths, such as that of a table behind.

mod splats;
#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::ops::Range;

use geometry::{BuildVoxelHasher, DepthFrame, RayTable, Stamp, VoxelBox, VoxelGrid, VoxelKey};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::moving_pixels::{MARGIN_PX, Reach, area_of, pixels_beside};
pub(crate) use splats::Splats;

/// What moves in a depth image.
#[derive(Clone, Debug)]
pub(crate) struct MovingView {
    pub(crate) stamp: Stamp,
    /// At that stamp.
    pub(crate) rig_from_camera: Isometry3<f64>,
    /// None where nothing moves.
    rays: Option<RayTable>,
    /// Those of the pixels, each once, in the map.
    velocities_m_per_s: Vec<Vector3<f64>>,
    pixels: Vec<SeenPixel>,
}

/// A pixel of the depth image that shows what moves.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct SeenPixel {
    pixel: u32,
    depth_mm: u16,
    /// The index of its velocity.
    velocity: u16,
}

impl MovingView {
    /// A view in which nothing moves.
    pub(crate) fn of_nothing(stamp: Stamp, rig_from_camera: &Isometry3<f64>) -> Self {
        Self {
            stamp,
            rig_from_camera: *rig_from_camera,
            rays: None,
            velocities_m_per_s: Vec::new(),
            pixels: Vec::new(),
        }
    }

    /// A view by the mask that was made of these points, which are in the rig and have a velocity in the map.
    pub(crate) fn of_mask(
        frame: &DepthFrame,
        rig_from_camera: &Isometry3<f64>,
        is_moving: &[bool],
        moving: &[(Point3<f32>, Vector3<f64>)],
        grid: &VoxelGrid,
    ) -> Self {
        let nothing = Self::of_nothing(frame.image().stamp, rig_from_camera);
        if !is_moving.contains(&true) {
            return nothing;
        }
        let (velocities_m_per_s, voxels) = velocities_of(moving, grid);
        let mut spread = Spread {
            width_px: frame.camera().width_px,
            is_taken: vec![false; is_moving.len()],
            pixels: Vec::new(),
        };
        let points = moving.iter().map(|(point, _)| point);
        let area = area_of(frame.camera(), rig_from_camera, points, grid.edge_m());
        let depths_mm = frame.depths_mm();
        let Some(around) = VoxelBox::around(voxels.keys()) else { return nothing };
        frame.for_each_voxel(rig_from_camera, area, (grid, &around), |pixel, voxel| {
            let depth_mm = depths_mm.get(pixel).copied().unwrap_or(0);
            if let Some(velocity) = voxels.get(&voxel)
                && is_moving.get(pixel) == Some(&true)
            {
                spread.take(pixel, depth_mm, *velocity);
            }
        });
        let is_of_mask = |pixel: usize| is_moving.get(pixel) == Some(&true);
        let own_mm = |pixel: usize| depths_mm.get(pixel).copied().unwrap_or(0);
        let reach = Reach::new(frame.camera(), grid);
        spread.go_on(|from, beside, _| {
            let depth_mm = own_mm(beside);
            let joins = reach.joins(metres(from.depth_mm), metres(depth_mm));
            (is_of_mask(beside) && joins).then_some(depth_mm)
        });
        spread.go_on(|from, beside, _| is_of_mask(beside).then_some(from.depth_mm));
        let gaps = Gaps { depths_mm, width_px: frame.camera().width_px };
        spread.go_on(|from, beside, grown_px| {
            let goes_on = reach.goes_on(grown_px, metres(from.depth_mm));
            (goes_on && gaps.is_wide_at(beside)).then_some(from.depth_mm)
        });
        Self {
            rays: Some(frame.rays().clone()),
            velocities_m_per_s,
            pixels: spread.pixels,
            ..nothing
        }
    }

    /// Adds what the view shows to the image of another camera: `other_from_camera` takes a point of the depth camera to that, at the
    /// moment of its image, and `other_from_map` the velocities, which the points have had for so long by then.
    pub(crate) fn splat(
        &self,
        other_from_camera: &Isometry3<f64>,
        (other_from_map, after_s): (&Isometry3<f64>, f64),
        splats: &mut Splats<'_>,
    ) {
        let Some(rays) = &self.rays else { return };
        let (camera, width_px) = (rays.camera(), rays.width_px().max(1));
        let moved: Vec<Vector3<f64>> = self
            .velocities_m_per_s
            .iter()
            .map(|velocity| other_from_map.rotation * (velocity * after_s))
            .collect();
        for SeenPixel { pixel, depth_mm, velocity } in &self.pixels {
            let pixel = *pixel as usize;
            let (Some(ray), Some(moved_m)) =
                (rays.ray(pixel % width_px, pixel / width_px), moved.get(usize::from(*velocity)))
            else {
                continue;
            };
            let depth_m = f64::from(*depth_mm) / 1e3;
            let in_camera_m = Point3::from(ray.cast::<f64>().push(1.0) * depth_m);
            let extent_m = [depth_m / camera.fx_px, depth_m / camera.fy_px];
            splats.add(&(other_from_camera * in_camera_m + moved_m), extent_m);
        }
    }
}

/// The different velocities of points, and the voxels of the points with the index of theirs.
fn velocities_of(
    moving: &[(Point3<f32>, Vector3<f64>)],
    grid: &VoxelGrid,
) -> (Vec<Vector3<f64>>, HashMap<VoxelKey, u16, BuildVoxelHasher>) {
    let mut velocities: Vec<Vector3<f64>> = Vec::new();
    let mut voxels = HashMap::default();
    for (point, velocity) in moving {
        let known = velocities.iter().position(|known| known == velocity);
        let index = known.unwrap_or_else(|| {
            velocities.push(*velocity);
            velocities.len() - 1
        });
        // There are as many as tracks.
        voxels.insert(grid.key(point), u16::try_from(index).unwrap_or(u16::MAX));
    }
    (velocities, voxels)
}

/// The pixels of an object, while they spread over the image.
struct Spread {
    width_px: usize,
    is_taken: Vec<bool>,
    pixels: Vec<SeenPixel>,
}

impl Spread {
    fn take(&mut self, pixel: usize, depth_mm: u16, velocity: u16) {
        if let Some(is_taken) = self.is_taken.get_mut(pixel)
            && !*is_taken
        {
            *is_taken = true;
            self.pixels.push(SeenPixel { pixel: pixel as u32, depth_mm, velocity });
        }
    }

    /// Goes on from all pixels so far to those beside them, a pixel to each side at a time: to those that are given a depth, by the
    /// pixel that they are reached from, their own index, and how far that pixel is from those that there were before.
    fn go_on(&mut self, depth_mm: impl Fn(&SeenPixel, usize, u32) -> Option<u16>) {
        let mut begin = 0;
        for grown_px in 0_u32.. {
            let end = self.pixels.len();
            if begin == end {
                return;
            }
            for index in begin..end {
                let Some(from) = self.pixels.get(index).copied() else { return };
                for beside in pixels_beside(from.pixel as usize, self.width_px) {
                    if self.is_taken.get(beside) == Some(&false)
                        && let Some(depth_mm) = depth_mm(&from, beside, grown_px)
                    {
                        self.take(beside, depth_mm, from.velocity);
                    }
                }
            }
            begin = end;
        }
    }
}

/// The places of a depth image where nothing was measured.
struct Gaps<'a> {
    depths_mm: &'a [u16],
    width_px: usize,
}

impl Gaps<'_> {
    /// Whether a pixel is of a gap that is wider and higher than the margin.
    fn is_wide_at(&self, pixel: usize) -> bool {
        let width_px = self.width_px.max(1);
        let row = pixel / width_px * width_px;
        let rest = self.depths_mm.len();
        self.has(pixel)
            && self.is_longer(pixel, 1, row..(row + width_px).min(rest))
            && self.is_longer(pixel, width_px, 0..rest)
    }

    /// Whether the gap goes on for more pixels than the margin, `step` from each other, through a pixel of it.
    fn is_longer(&self, pixel: usize, step: usize, within: Range<usize>) -> bool {
        let is_gap = |at: &usize| within.contains(at) && self.has(*at);
        let ahead = (1..=MARGIN_PX).map(|count| pixel + count * step).take_while(is_gap).count();
        let behind = (1..=MARGIN_PX).map_while(|count| pixel.checked_sub(count * step));
        1 + ahead + behind.take_while(is_gap).count() > MARGIN_PX
    }

    fn has(&self, pixel: usize) -> bool {
        self.depths_mm.get(pixel) == Some(&0)
    }
}

fn metres(depth_mm: u16) -> f32 {
    f32::from(depth_mm) / 1e3
}
