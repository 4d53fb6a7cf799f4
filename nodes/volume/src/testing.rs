//! A room with a ball in it, seen by a depth camera, with ground truth: for tests.

use std::sync::Arc;

use geometry::{CameraModel, DepthFrame, DepthImage, DepthPixels, Distortion, MaskedDepth, Stamp};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::projection::Project;
use crate::{DepthInput, DepthNoise, DepthRange, DepthView};

/// The camera model of a Kinect with an image of this size.
pub(crate) fn camera(width_px: usize, height_px: usize) -> CameraModel {
    let focal_px = 525.0 * width_px as f64 / 640.0;
    CameraModel {
        width_px,
        height_px,
        fx_px: focal_px,
        fy_px: focal_px,
        cx_px: (width_px as f64 - 1.0) / 2.0,
        cy_px: (height_px as f64 - 1.0) / 2.0,
        distortion: Distortion::None,
    }
}

/// A pose that looks along the map's z axis, shifted and turned.
pub(crate) fn pose(shift_m: [f64; 3], turn_rad: [f64; 3]) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_euler_angles(turn_rad[0], turn_rad[1], turn_rad[2]);
    Isometry3::from_parts(Translation3::from(Vector3::from(shift_m)), turn)
}

/// The scene, in the map frame, whose y axis points down.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    /// Normals and offsets: a point is on a plane where `normal . point = offset`.
    pub(crate) planes: Vec<(Vector3<f64>, f64)>,
    /// Centres and radii.
    pub(crate) balls: Vec<(Point3<f64>, f64)>,
}

impl Scene {
    pub(crate) fn room() -> Self {
        let planes = [
            ([0.1, 0.0, 1.0], 3.4),
            ([1.0, 0.0, 0.05], 1.5),
            ([-1.0, 0.03, 0.0], 1.6),
            ([0.0, 1.0, 0.0], 1.1),
            ([0.0, -1.0, 0.02], 1.3),
        ];
        let planes = planes.map(|(normal, offset)| {
            let normal = Vector3::from(normal);
            (normal.normalize(), offset / normal.norm())
        });
        Self { planes: planes.to_vec(), balls: vec![(Point3::new(0.3, 0.2, 2.0), 0.35)] }
    }

    pub(crate) fn wall(depth_m: f64) -> Self {
        Self { planes: vec![(Vector3::z(), depth_m)], balls: Vec::new() }
    }

    /// The distance of the first surface along a ray, in lengths of the direction.
    pub(crate) fn hit(&self, from: &Point3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let planes = self
            .planes
            .iter()
            .map(|(normal, offset)| (offset - normal.dot(&from.coords)) / normal.dot(direction));
        let balls = self.balls.iter().filter_map(|(middle, radius_m)| {
            let from_middle = from - middle;
            let (a, b) = (direction.norm_squared(), direction.dot(&from_middle));
            let root = b * b - a * (from_middle.norm_squared() - radius_m * radius_m);
            (root > 0.0).then(|| (-b - root.sqrt()) / a)
        });
        planes.chain(balls).filter(|along| *along > 0.05).min_by(f64::total_cmp)
    }

    /// The distance of a point from the nearest surface, and the direction away from it.
    pub(crate) fn nearest(&self, point: &Point3<f64>) -> (f64, Vector3<f64>) {
        let planes = self.planes.iter().map(|(normal, offset)| {
            // Seen from inside of the room, where all planes are in front.
            ((offset - normal.dot(&point.coords)).abs(), -normal)
        });
        let balls = self.balls.iter().map(|(middle, radius_m)| {
            let from_middle = point - middle;
            ((from_middle.norm() - radius_m).abs(), from_middle.normalize())
        });
        planes.chain(balls).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
    }

    /// Depths row by row; 0 where there is nothing.
    pub(crate) fn depths_m(&self, camera: &CameraModel, pose: &Isometry3<f64>) -> Vec<f32> {
        let origin: Point3<f64> = pose.translation.vector.into();
        let pixels = (0..camera.height_px)
            .flat_map(|row| (0..camera.width_px).map(move |column| (column, row)));
        pixels
            .map(|(column, row)| {
                let ray = Vector3::new(
                    (column as f64 - camera.cx_px) / camera.fx_px,
                    (row as f64 - camera.cy_px) / camera.fy_px,
                    1.0,
                );
                self.hit(&origin, &(pose.rotation * ray)).unwrap_or(0.0) as f32
            })
            .collect()
    }
}

/// Normally distributed random numbers, the same for the same seed.
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// With mean 0 and standard deviation 1, by the sum of twelve uniform numbers.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// The image of these depths, in whole millimetres.
pub(crate) fn frame(camera: &CameraModel, stamp_s: f64, depths_m: Vec<f32>) -> DepthFrame {
    let stamp = Stamp::default().plus_seconds(stamp_s);
    let size = (camera.width_px, camera.height_px);
    let image = DepthImage::new(stamp, "camera".into(), size, DepthPixels::Metres(depths_m));
    DepthFrame::new(image.unwrap(), *camera).unwrap()
}

/// A view of depths, some of which may move.
pub(crate) fn view_of(
    camera: &CameraModel,
    map_from_camera: &Isometry3<f64>,
    stamp_s: f64,
    depths_m: Vec<f32>,
    is_moving: Option<&[bool]>,
) -> DepthView {
    let mut view =
        DepthView::new(DepthRange { min_m: 0.2, max_m: 8.0 }, DepthNoise::default()).unwrap();
    fill(&mut view, frame(camera, stamp_s, depths_m), is_moving, map_from_camera);
    view
}

/// Fills a view with an image, some of whose pixels may move.
pub(crate) fn fill(
    view: &mut DepthView,
    frame: DepthFrame,
    is_moving: Option<&[bool]>,
    map_from_camera: &Isometry3<f64>,
) {
    let is_moving = is_moving.map_or(vec![false; frame.depths_mm().len()], <[bool]>::to_vec);
    let masked = MaskedDepth::new(Arc::new(frame), is_moving).unwrap();
    view.fill(&DepthInput::masked(&masked, map_from_camera)).unwrap();
}

pub(crate) fn view_of_scene(
    scene: &Scene,
    camera: &CameraModel,
    map_from_camera: &Isometry3<f64>,
    stamp_s: f64,
) -> DepthView {
    let depths_m = scene.depths_m(camera, map_from_camera);
    view_of(camera, map_from_camera, stamp_s, depths_m, None)
}

/// The span of a rectangle computed pixel by pixel, as the pyramid should give it.
pub(crate) fn plain_span(view: &DepthView, columns: [u32; 2], rows: [u32; 2]) -> (f32, f32) {
    const TILE_PX: usize = 4;
    let (width_px, height_px) = view.size_px();
    let tiles = |[first, last]: [u32; 2]| first as usize / TILE_PX..last as usize / TILE_PX + 1;
    let (mut free_to_m, mut known_to_m) = (f32::MAX, 0.0_f32);
    for tile_row in tiles(rows) {
        for tile_column in tiles(columns) {
            let lines = TILE_PX * tile_row..height_px.min(TILE_PX * (tile_row + 1));
            let of_line = TILE_PX * tile_column..width_px.min(TILE_PX * (tile_column + 1));
            let all = lines.len() * of_line.len();
            let pixels =
                lines.flat_map(|row| of_line.clone().map(move |column| row * width_px + column));
            let depths_m = pixels.map(|pixel| view.depths_m[pixel].abs());
            let returns: Vec<f32> = depths_m.filter(|depth_m| *depth_m > 0.0).collect();
            let least_m = returns.iter().copied().fold(f32::MAX, f32::min);
            free_to_m = free_to_m.min(if 2 * returns.len() < all { 0.0 } else { least_m });
            known_to_m = returns.iter().copied().fold(known_to_m, f32::max);
        }
    }
    (free_to_m, known_to_m)
}

/// The points of the pixels that show what is static, in the map.
pub(crate) fn static_points_in_map(view: &DepthView) -> Vec<Point3<f64>> {
    let crate::depth_view::Kind::Pinhole(projection) = view.kind else { return Vec::new() };
    let (width_px, _) = view.size_px();
    let pixels = view.depths_m.iter().enumerate().filter(|(_, depth_m)| **depth_m > 0.0);
    let point = |(pixel, depth_m): (usize, &f32)| {
        let point_m = projection.point_m(pixel % width_px, pixel / width_px, *depth_m);
        view.map_from_camera * Point3::from(point_m).cast::<f64>()
    };
    pixels.map(point).collect()
}
