//! A room with a person in it, seen by a depth camera, with its truth.

use std::sync::Arc;

use estimation::Random;
use geometry::{
    CameraModel, Cloud, CycleSetup, DepthFrame, DepthImage, DepthPixels, Distortion, MapPath,
    MaskedDepth, PathVertex, SegmentedCycle, Stamp,
};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

const SIZE_PX: (usize, usize) = (320, 240);
/// A person is a ball here, before the far wall.
const PERSON_RADIUS_M: f64 = 0.3;

/// Planes, and the middle of the person.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    /// Normals into the room and offsets: a point is on a plane where `normal . point = offset`.
    planes: Vec<(Vector3<f64>, f64)>,
    person_m: Option<Point3<f64>>,
}

impl Scene {
    /// A far wall, a side wall and the floor; x forward, y left, z up.
    pub(crate) fn room() -> Self {
        let planes = [([-1.0, 0.05, 0.0], -2.8), ([0.0, -1.0, 0.0], -1.2), ([0.0, 0.0, 1.0], -0.9)];
        let planes = planes.map(|(normal, offset)| {
            let normal = Vector3::from(normal);
            (normal.normalize(), offset / normal.norm())
        });
        Self { planes: planes.to_vec(), person_m: None }
    }

    /// The room with a floor at this height, as a table top before the camera is.
    pub(crate) fn room_with_floor_at(height_m: f64) -> Self {
        let mut room = Self::room();
        room.planes[2].1 = height_m;
        room
    }

    /// A corridor 2 m wide along x, from -2 m to so far.
    pub(crate) fn corridor(end_m: f64) -> Self {
        let planes = [
            ([-1.0, 0.0, 0.0], -end_m),
            ([1.0, 0.0, 0.0], -2.0),
            ([0.0, -1.0, 0.0], -1.03),
            ([0.0, 1.0, 0.0], -1.01),
            ([0.0, 0.0, 1.0], -0.9),
            ([0.0, 0.0, -1.0], -1.37),
        ];
        let planes = planes.map(|(normal, offset)| (Vector3::from(normal), offset));
        Self { planes: planes.to_vec(), person_m: None }
    }

    pub(crate) fn with_person(mut self, y_m: f64) -> Self {
        self.person_m = Some(Point3::new(1.8, y_m, 0.0));
        self
    }

    /// How far along a ray the first surface is, and whether it is the person's.
    fn hit(&self, from: &Point3<f64>, direction: &Vector3<f64>) -> Option<(f64, bool)> {
        let planes = self.planes.iter().map(|(normal, offset)| {
            ((offset - normal.dot(&from.coords)) / normal.dot(direction), false)
        });
        let person = self.person_m.and_then(|middle| {
            let from_middle = from - middle;
            let (a, b) = (direction.norm_squared(), direction.dot(&from_middle));
            let root = b * b - a * (from_middle.norm_squared() - PERSON_RADIUS_M.powi(2));
            (root > 0.0).then(|| ((-b - root.sqrt()) / a, true))
        });
        planes.chain(person).filter(|(along, _)| *along > 0.0).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// How far a point is from the nearest surface of the room, and the direction away from that.
    pub(crate) fn nearest(&self, point: &Point3<f64>) -> (f64, Vector3<f64>) {
        let planes = self.planes.iter();
        let off =
            planes.map(|(normal, offset)| ((normal.dot(&point.coords) - offset).abs(), *normal));
        off.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
    }

    /// Which pixels show the person, and those beside.
    pub(crate) fn shows_person(&self, frame: &DepthFrame, rig: &Isometry3<f64>) -> Vec<bool> {
        let shows = hits(self, frame.camera(), rig)
            .map(|hit| hit.is_some_and(|(_, is_person)| is_person))
            .collect::<Vec<_>>();
        let (width_px, height_px) = SIZE_PX;
        let around = |at: usize, most: usize| at.saturating_sub(1)..(at + 2).min(most);
        (0..shows.len())
            .map(|pixel| {
                around(pixel / width_px, height_px).any(|row| {
                    around(pixel % width_px, width_px).any(|column| shows[row * width_px + column])
                })
            })
            .collect()
    }
}

/// How many points are on the person.
pub(crate) fn near(points: &[(Point3<f64>, Vector3<f64>)], scene: &Scene) -> usize {
    let middle = scene.person_m.unwrap();
    let is_near = |(point, _): &&(Point3<f64>, _)| (point - middle).norm() < PERSON_RADIUS_M + 0.05;
    points.iter().filter(is_near).count()
}

/// A path of the map that stands at `x_m` for five seconds, from the first cycle on.
pub(crate) fn path_at(x_m: f64) -> MapPath {
    let at = |seconds| Stamp::from_nanos(1).plus_seconds(seconds);
    let vertex = |seconds| PathVertex { stamp: at(seconds), map_from_rig: rig_at(x_m, 0.0) };
    MapPath::new(at(6.0), "map", vec![vertex(0.0), vertex(5.0)]).unwrap()
}

pub(crate) fn rig_at(x_m: f64, yaw_rad: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw_rad);
    Isometry3::from_parts(Translation3::new(x_m, 0.0, 0.0), turn)
}

pub(crate) fn camera((width_px, height_px): (usize, usize)) -> CameraModel {
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

fn hits(
    scene: &Scene,
    camera: &CameraModel,
    rig: &Isometry3<f64>,
) -> impl Iterator<Item = Option<(f64, bool)>> {
    let from: Point3<f64> = rig.translation.vector.into();
    let CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, .. } = *camera;
    let pixels = (0..height_px).flat_map(move |row| (0..width_px).map(move |column| (column, row)));
    pixels.map(move |(column, row)| {
        let (x, y) = ((column as f64 - cx_px) / fx_px, (row as f64 - cy_px) / fy_px);
        scene.hit(&from, &(rig.rotation * Vector3::new(1.0, -x, -y)))
    })
}

/// A cycle that sees the scene, with the Kinect's noise where there is a source of it.
pub(crate) fn cycle(
    scene: &Scene,
    index: u32,
    rig: &Isometry3<f64>,
    noise: Option<&mut Random>,
) -> SegmentedCycle {
    sized_cycle(scene, index, rig, noise, SIZE_PX)
}

/// A cycle whose image has no depths.
pub(crate) fn blind_cycle(index: u32) -> SegmentedCycle {
    sized_cycle(&Scene { planes: vec![], person_m: None }, index, &rig_at(0.0, 0.0), None, SIZE_PX)
}

/// The same with an image of another size.
pub(crate) fn sized_cycle(
    scene: &Scene,
    index: u32,
    rig: &Isometry3<f64>,
    mut noise: Option<&mut Random>,
    size_px: (usize, usize),
) -> SegmentedCycle {
    let camera = camera(size_px);
    let depths_m: Vec<f32> = hits(scene, &camera, rig)
        .map(|hit| {
            let depth_m = hit.map_or(0.0, |(depth_m, _)| depth_m);
            let deviation_m = 1.425e-3 * depth_m * depth_m;
            let error_m = noise.as_mut().map_or(0.0, |random| deviation_m * random.normal());
            (depth_m + error_m) as f32
        })
        .collect();
    let stamp = Stamp::from_nanos(1).plus_seconds(f64::from(index) / 7.0);
    let pixels = DepthPixels::Metres(depths_m);
    let image = DepthImage::new(stamp, "camera".to_owned(), size_px, pixels).unwrap();
    let is_moving = vec![false; image.pixels().len()];
    let frame = Arc::new(DepthFrame::new(image, camera).unwrap());
    let cloud =
        |frame_id: &str| Cloud { stamp, frame_id: frame_id.to_owned(), points_m: Vec::new() };
    SegmentedCycle {
        index,
        setup: CycleSetup::default(),
        static_cloud: cloud("map"),
        dynamic_cloud: cloud("rig"),
        map_from_rig: *rig,
        depth: MaskedDepth::new(frame, is_moving).ok(),
        scan_rays: std::sync::Arc::default(),
        retracted_m: Vec::new(),
    }
}
