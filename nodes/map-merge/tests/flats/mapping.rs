//! Maps of simulated flats, and what is true of them.

use estimation::{Random, Serial};
use geometry::{DepthFrame, MapView, MapViews, OrientedPoints, VoxelGrid, pose_from_vector};
use map_merge::{Group, SavedMap};
use nalgebra::{Isometry3, Point3};
use simulator::{Body, Home, Piece, Sample, Scenario, Shape};
use volume::{DepthInput, DepthNoise, DepthRange, DepthView, PointRules, Surface, SurfaceConfig};

/// A flat at one time, and its map.
pub(crate) struct Visit {
    pub(crate) home: Home,
    pub(crate) map: SavedMap,
    pub(crate) map_from_room: Isometry3<f64>,
    /// What the camera saw, with the true pose in the room.
    images: Vec<(DepthFrame, Isometry3<f64>)>,
}

/// What the camera of a visit saw of a place.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Look {
    /// It was never in an image, or nearer or farther than is measured.
    Never,
    /// Something was before it, or nothing was measured there.
    Hidden,
    /// Something was measured clearly behind it.
    Through,
}

/// How a flat is mapped.
#[derive(Clone, Copy)]
pub(crate) struct Mapping {
    pub(crate) edge_m: f64,
    pub(crate) size_px: (usize, usize),
    pub(crate) position_noise_m: f64,
    pub(crate) rotation_noise_rad: f64,
}

impl Default for Mapping {
    fn default() -> Self {
        Self {
            edge_m: 0.05,
            size_px: (160, 120),
            position_noise_m: 0.005,
            rotation_noise_rad: 0.002,
        }
    }
}

pub(crate) fn visit(home: &Home, rooms: &[usize], seed: u64, mapping: Mapping) -> Visit {
    let (width_px, height_px) = mapping.size_px;
    let scenario: Scenario = home.visit(rooms, seed).with_depth_size(width_px, height_px);
    let rig_from_camera = pose_from_vector(&scenario.rig.depth_camera.rig_from_camera);
    let camera = scenario.rig.depth_camera.camera;
    let mut random = Random::new(seed ^ 0x5eed);
    let mut view = DepthView::new(DepthRange::default(), DepthNoise::default()).unwrap();
    let mut surface =
        Surface::new(SurfaceConfig { edge_m: mapping.edge_m, ..SurfaceConfig::default() }).unwrap();
    let mut views = MapViews::default();
    let mut images = Vec::new();
    let room_from_map = scenario.map_from_room().inverse();
    for sample in scenario.samples().unwrap() {
        let Sample::Depth { image, .. } = sample else { continue };
        let time_s = image.stamp.seconds_since(scenario.start);
        let noise = random.perturbation(mapping.position_noise_m, mapping.rotation_noise_rad);
        let noise =
            Isometry3::new(noise.fixed_rows::<3>(0).into(), noise.fixed_rows::<3>(3).into());
        let true_pose = scenario.map_from_rig(time_s) * rig_from_camera;
        let map_from_camera = true_pose * noise;
        let stamp = image.stamp;
        let frame = DepthFrame::new(image, camera).unwrap();
        view.fill(&DepthInput::new(&frame, &map_from_camera)).unwrap();
        surface.integrate(&view, &Serial);
        views.add(MapView { stamp, map_from_camera, camera });
        images.push((frame, room_from_map * true_pose));
    }
    let points = surface.points(PointRules::default());
    let points = OrientedPoints {
        points_m: points.iter().map(|point| point.position_m).collect(),
        normals: points.iter().map(|point| point.normal).collect(),
        colours: Vec::new(),
    };
    let map = SavedMap { points, views: views.as_slice().to_vec(), edge_m: mapping.edge_m };
    Visit { home: home.clone(), map, map_from_room: scenario.map_from_room(), images }
}

impl Visit {
    pub(crate) fn all_rooms(home: &Home) -> Vec<usize> {
        (0..home.rooms.len()).collect()
    }

    pub(crate) fn room_from_map(&self, point_m: &Point3<f32>) -> Point3<f64> {
        self.map_from_room.inverse() * point_m.cast::<f64>()
    }

    /// The most that an image of the visit says of a place of the room.
    pub(crate) fn look_at(&self, in_room_m: &Point3<f64>) -> Look {
        let looks = self.images.iter().map(|(frame, room_from_camera)| {
            let in_camera = room_from_camera.inverse() * in_room_m;
            let pixel = Some(in_camera)
                .filter(|point| (0.5..6.0).contains(&point.z))
                .and_then(|point| frame.camera().project(&point))
                .map(|pixel| [pixel.x.round(), pixel.y.round()]);
            let image = frame.image();
            let is_inside = |[x, y]: &[f64; 2]| {
                (0.0..image.width_px() as f64).contains(x)
                    && (0.0..image.height_px() as f64).contains(y)
            };
            let Some([x, y]) = pixel.filter(is_inside) else { return Look::Never };
            let depth_m = image.depth_m(x as usize, y as usize);
            let is_behind = depth_m.is_some_and(|depth_m| f64::from(depth_m) > in_camera.z + 0.1);
            if is_behind { Look::Through } else { Look::Hidden }
        });
        looks.max().unwrap_or(Look::Never)
    }

    /// The pieces of furniture that another visit did not see in the same place.
    pub(crate) fn pieces_not_in<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = &'a Piece> {
        self.home.furniture.iter().filter(|piece| !other.home.furniture.contains(piece))
    }

    /// What stands in the same place at another visit.
    pub(crate) fn bodies_also_in<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = &'a Body> {
        let furniture = self.home.furniture.iter();
        let stayed = furniture.filter(|piece| other.home.furniture.contains(piece));
        self.home.shell.iter().chain(stayed.flat_map(|piece| &piece.bodies))
    }
}

/// How far a point is from the surface of a body; negative inside of it.
pub(crate) fn signed_distance_m(body: &Body, in_room_m: &Point3<f64>) -> f64 {
    let point = pose_from_vector(&body.pose).inverse() * in_room_m;
    let of_box = |outside: nalgebra::Vector3<f64>| {
        let beyond = outside.map(|side| side.max(0.0)).norm();
        beyond + outside.max().min(0.0)
    };
    match body.shape {
        Shape::Box { size_m } => of_box(point.coords.abs() - nalgebra::Vector3::from(size_m) / 2.0),
        Shape::Sphere { radius_m } => point.coords.norm() - radius_m,
        Shape::Cylinder { radius_m, height_m } => of_box(nalgebra::Vector3::new(
            point.coords.xy().norm() - radius_m,
            point.z.abs() - height_m / 2.0,
            f64::NEG_INFINITY,
        )),
        _ => f64::INFINITY,
    }
}

pub(crate) fn nearest_m<'a>(bodies: impl Iterator<Item = &'a Body>, point: &Point3<f64>) -> f64 {
    bodies.map(|body| signed_distance_m(body, point).abs()).fold(f64::INFINITY, f64::min)
}

/// How well a change is found.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Score {
    /// The points that are on furniture that the other visit did not see there, and those that the other camera saw through.
    pub(crate) changed: usize,
    pub(crate) changed_and_seen: usize,
    pub(crate) found: usize,
    pub(crate) found_and_changed: usize,
    pub(crate) found_and_seen: usize,
}

impl Score {
    pub(crate) fn precision(&self) -> f64 {
        self.found_and_changed as f64 / (self.found as f64).max(1.0)
    }

    pub(crate) fn recall(&self) -> f64 {
        self.found_and_seen as f64 / (self.changed_and_seen as f64).max(1.0)
    }

    pub(crate) fn recall_of_all(&self) -> f64 {
        self.found_and_changed as f64 / (self.changed as f64).max(1.0)
    }
}

/// Scores the groups of points of `own` that were found not to be in `other`.
pub(crate) fn score(own: &Visit, other: &Visit, groups: &[Group]) -> Score {
    let moved: Vec<&Body> = own.pieces_not_in(other).flat_map(|piece| &piece.bodies).collect();
    let rest: Vec<&Body> = own.bodies_also_in(other).collect();
    let there: Vec<Body> = other.home.scene().bodies;
    let mut is_found = vec![false; own.map.points.points_m.len()];
    groups.iter().flat_map(|group| &group.points).for_each(|index| is_found[*index] = true);
    let mut score = Score::default();
    for (point_m, is_found) in own.map.points.points_m.iter().zip(is_found) {
        let point = own.room_from_map(point_m);
        let of_moved_m = nearest_m(moved.iter().copied(), &point);
        let is_moved = of_moved_m < nearest_m(rest.iter().copied(), &point);
        // What comes to lie upon something of the other visit is no change of a map.
        let is_changed = is_moved && nearest_m(there.iter(), &point) > own.map.edge_m;
        let is_seen = is_changed && other.look_at(&point) == Look::Through;
        score.changed += usize::from(is_changed);
        score.changed_and_seen += usize::from(is_seen);
        score.found += usize::from(is_found);
        score.found_and_changed += usize::from(is_found && is_moved);
        score.found_and_seen += usize::from(is_found && is_seen);
    }
    score
}

/// The map in another frame, of another edge, or without normals or views.
pub(crate) fn altered(map: &SavedMap, new_from_map: &Isometry3<f64>) -> SavedMap {
    let mut map = map.clone();
    for point in &mut map.points.points_m {
        *point = (new_from_map * point.cast::<f64>()).cast();
    }
    for normal in &mut map.points.normals {
        *normal = (new_from_map.rotation * normal.cast::<f64>()).cast();
    }
    for view in &mut map.views {
        view.map_from_camera = new_from_map * view.map_from_camera;
    }
    map
}

/// A map without what files of other programs lack.
pub(crate) fn bare(map: &SavedMap, edge_m: f64) -> SavedMap {
    let grid = VoxelGrid::new(edge_m).unwrap();
    let points_m = if edge_m > map.edge_m {
        grid.reduce(&map.points.points_m)
    } else {
        map.points.points_m.clone()
    };
    let points = OrientedPoints { points_m, ..OrientedPoints::default() };
    SavedMap { points, views: Vec::new(), edge_m: edge_m.max(map.edge_m) }
}
