mod near_surface;

use std::collections::HashSet;

use nalgebra::{Isometry3, Point3};
use proptest::prelude::*;

use super::*;
use crate::depth_view::DepthView;
use crate::projection::{CameraBox, Extent, Project};
use crate::testing::{self, Scene};

fn occupancy(edge_m: f64) -> Occupancy {
    Occupancy::new(OccupancyConfig { edge_m, reach_m: 4.0, ..OccupancyConfig::default() }).unwrap()
}

/// Each pixel is one point.
fn join(occupancy: &mut Occupancy, view: &DepthView) -> OccupancyUpdate {
    occupancy.begin_cycle(view.stamp());
    let hits: Vec<VoxelKey> = plain_hits(occupancy, view).collect();
    occupancy.integrate(view, hits)
}

fn place_at(known: &Occupancy, x_m: f64, y_m: f64, z_m: f64) -> Place {
    known.place(known.grid.key(&Point3::new(x_m, y_m, z_m)))
}

fn see(occupancy: &mut Occupancy, scene: &Scene, stamps_s: impl Iterator<Item = u32>) {
    let camera = testing::camera(160, 120);
    for stamp_s in stamps_s {
        let pose = Isometry3::identity();
        let view = testing::view_of_scene(scene, &camera, &pose, f64::from(stamp_s));
        join(occupancy, &view);
    }
}

fn stamp(stamp_s: u32) -> Stamp {
    Stamp::default().plus_seconds(f64::from(stamp_s))
}

#[test]
fn a_place_is_free_before_a_wall_occupied_at_it_and_unknown_behind() {
    let mut known = occupancy(0.08);
    see(&mut known, &Scene::wall(3.0), 0..10);
    let place = |z_m: f64| place_at(&known, 0.02, 0.02, z_m);
    assert_eq!(place(1.0), Place::Free);
    assert_eq!(place(2.7), Place::Free);
    assert_eq!(place(3.0), Place::Occupied { since: stamp(0), last: stamp(9) });
    assert_eq!(place(3.3), Place::Unknown);
    assert_eq!(place_at(&known, 2.5, 0.0, 1.0), Place::Unknown, "out of view");
    let is_near_surface =
        |z_m: f64| known.is_near_surface(known.grid.key(&Point3::new(0.02, 0.02, z_m)), 1);
    assert!(is_near_surface(2.92));
    assert!(!is_near_surface(2.6));
}

#[test]
fn free_space_is_one_cell_a_block_and_shares_its_memory() {
    let mut known = occupancy(0.04);
    see(&mut known, &Scene::wall(3.9), 0..3);
    let early = known.memory_bytes();
    see(&mut known, &Scene::wall(3.9), 3..80);
    let late = known.memory_bytes();
    assert!(late <= early, "{early} bytes, then {late}");
    assert_eq!(place_at(&known, 0.0, 0.0, 2.0), Place::Free);
    let cells = known.blocks() * 512 * size_of::<Cell>();
    // Blocks at the border of the view have free and unknown cells.
    assert!(late * 4 < cells * 3, "{late} of {cells} bytes");
}

#[test]
fn what_moves_is_neither_and_what_it_hides_stays() {
    let camera = testing::camera(160, 120);
    let mut known = occupancy(0.08);
    see(&mut known, &Scene::wall(3.0), 0..10);
    let pose = Isometry3::identity();
    let depths_m = Scene::wall(2.0).depths_m(&camera, &pose);
    let is_moving = vec![true; depths_m.len()];
    for stamp_s in 10..40 {
        let view = testing::view_of(
            &camera,
            &pose,
            f64::from(stamp_s),
            depths_m.clone(),
            Some(&is_moving),
        );
        join(&mut known, &view);
    }
    let place = |z_m: f64| place_at(&known, 0.02, 0.02, z_m);
    assert_eq!(place(2.0), Place::Free, "no hit");
    assert_eq!(place(3.0), Place::Occupied { since: stamp(0), last: stamp(9) });
}

#[test]
fn where_nothing_comes_back_nothing_is_known() {
    let camera = testing::camera(160, 120);
    let mut known = occupancy(0.08);
    for stamp_s in 0..10 {
        let pose = Isometry3::identity();
        let mut depths_m = Scene::wall(3.0).depths_m(&camera, &pose);
        for (pixel, depth_m) in depths_m.iter_mut().enumerate() {
            // The left half has no returns, and neither has one pixel of six of the rest.
            *depth_m = if pixel % 160 < 80 || pixel % 6 == 0 { 0.0 } else { *depth_m };
        }
        join(&mut known, &testing::view_of(&camera, &pose, f64::from(stamp_s), depths_m, None));
    }
    assert_eq!(place_at(&known, -0.5, 0.0, 1.5), Place::Unknown);
    assert_eq!(place_at(&known, 0.5, 0.0, 1.5), Place::Free);
}

/// A floor seen at a grazing angle of 4 degrees.
#[test]
fn rays_that_graze_a_floor_do_not_pass_it() {
    let camera = testing::camera(320, 240);
    let floor = Scene {
        planes: vec![(nalgebra::Vector3::y(), 0.03), (nalgebra::Vector3::z(), 6.0)],
        balls: Vec::new(),
    };
    let mut known = occupancy(0.08);
    let look = |known: &mut Occupancy, pose: Isometry3<f64>, stamps_s: std::ops::Range<u32>| {
        for stamp_s in stamps_s {
            join(known, &testing::view_of_scene(&floor, &camera, &pose, f64::from(stamp_s)));
        }
    };
    look(&mut known, testing::pose([0.0, -1.2, 0.0], [-0.5, 0.0, 0.0]), 0..5);
    let places: Vec<Point3<f64>> =
        (0..20).map(|step| Point3::new(0.01, 0.03, 1.5 + 0.08 * f64::from(step))).collect();
    let occupied = |known: &Occupancy| {
        let is_occupied = |place: &&Point3<f64>| {
            matches!(known.place(known.grid.key(place)), Place::Occupied { .. })
        };
        places.iter().filter(is_occupied).count()
    };
    assert_eq!(occupied(&known), 20);
    look(&mut known, testing::pose([0.0, -0.25, -1.0], [0.0; 3]), 5..60);
    assert_eq!(occupied(&known), 20);
}

#[test]
fn the_bounds_of_memory_and_time_are_kept_and_reported() {
    let config = OccupancyConfig { max_blocks: 40, ..*occupancy(0.08).config() };
    let mut known = Occupancy::new(config).unwrap();
    let camera = testing::camera(160, 120);
    let scene = Scene::room();
    let (mut dropped, mut is_incomplete) = (0, false);
    for step in 0..40 {
        let pose = testing::pose([0.0, 0.0, 0.0], [0.0, 0.2 * f64::from(step), 0.0]);
        let view = testing::view_of_scene(&scene, &camera, &pose, f64::from(step));
        let update = join(&mut known, &view);
        dropped += update.dropped_blocks;
        is_incomplete |= update.is_incomplete;
        assert!(known.blocks() <= 40);
    }
    assert!(dropped > 0 && is_incomplete);
    for edge_m in [0.001, 10.0] {
        let config = OccupancyConfig { max_blocks_per_image: 500, edge_m, ..config };
        let mut known = Occupancy::new(config).unwrap();
        let update =
            join(&mut known, &testing::view_of_scene(&scene, &camera, &Isometry3::identity(), 0.0));
        assert!(update.seen_blocks <= 500);
        assert_eq!(update.is_incomplete, edge_m < 1.0);
    }
    for broken in [
        OccupancyConfig { edge_m: f64::NAN, ..config },
        OccupancyConfig { edge_m: 11.0, ..config },
        OccupancyConfig { reach_m: 0.0, ..config },
        OccupancyConfig { max_blocks: 0, ..config },
        OccupancyConfig { max_blocks_per_image: 0, ..config },
    ] {
        assert!(Occupancy::new(broken).is_err(), "{broken:?}");
    }
}

#[test]
fn a_place_may_be_told_what_it_is() {
    let mut known = occupancy(0.08);
    see(&mut known, &Scene::wall(3.0), 0..10);
    let [free, wall] = [1.0, 3.01].map(|z_m| known.grid.key(&Point3::new(0.0, 0.0, z_m)));
    known.take_for_occupied(free, stamp(4));
    assert_eq!(known.place(free), Place::Occupied { since: stamp(4), last: stamp(9) });
    known.take_for_free(wall);
    assert_eq!(known.place(wall), Place::Free);
    known.forget(wall);
    assert_eq!(known.place(wall), Place::Unknown);
    known.clear();
    assert_eq!((known.place(free), known.blocks()), (Place::Unknown, 0));
}

#[test]
fn without_an_image_there_are_hits_and_nothing_is_passed() {
    let mut known = occupancy(0.08);
    see(&mut known, &Scene::wall(3.0), 0..1);
    let mut blind = testing::view_of_scene(
        &Scene::wall(3.0),
        &testing::camera(16, 12),
        &Isometry3::identity(),
        0.0,
    );
    blind.clear();
    let hit = known.grid.key(&Point3::new(102.0, 0.0, 0.0));
    for stamp_s in 1..10 {
        known.begin_cycle(stamp(stamp_s));
        known.integrate(&blind, [hit]);
    }
    assert_eq!(known.place(hit), Place::Occupied { since: stamp(1), last: stamp(9) });
    assert_eq!(place_at(&known, 101.0, 0.0, 0.0), Place::Unknown, "nothing is passed");
}

/// Regression: all times more than 497 days after the first were the same tick, so that after a clock that began at 0 was set,
/// a surface was background when it was first seen.
#[test]
fn a_clock_that_is_set_forward_by_years_begins_anew() {
    const YEARS_S: u32 = 50 * 365 * 86_400;
    let mut known = occupancy(0.08);
    see(&mut known, &Scene::wall(3.0), 0..10);
    let wall = known.grid.key(&Point3::new(0.0, 0.0, 3.01));
    known.begin_cycle(stamp(YEARS_S));
    assert_eq!(known.place(wall), Place::Unknown);
    see(&mut known, &Scene::wall(3.0), YEARS_S + 1..YEARS_S + 10);
    let (since, last) = (stamp(YEARS_S + 1), stamp(YEARS_S + 9));
    assert_eq!(known.place(wall), Place::Occupied { since, last });
}

/// Each cycle counts, whatever its stamp: late by less than another run, or that of the cycle before.
#[test]
fn cycles_of_one_stamp_count_each() {
    let mut known = occupancy(0.08);
    see(&mut known, &Scene::wall(3.0), [5, 5, 4].into_iter());
    assert_eq!(place_at(&known, 0.0, 0.0, 2.0), Place::Free);
    assert!(matches!(place_at(&known, 0.0, 0.0, 3.01), Place::Occupied { .. }));
}

#[test]
fn a_place_is_taken_for_occupied_when_all_blocks_are_in_use() {
    let config = OccupancyConfig { max_blocks: 40, reach_m: 4.0, ..OccupancyConfig::default() };
    let mut known = Occupancy::new(config).unwrap();
    see(&mut known, &Scene::wall(3.0), 0..3);
    assert!(known.blocks() >= 30, "{}", known.blocks());
    let nothing = Scene { planes: Vec::new(), balls: Vec::new() };
    for x in 0..20 {
        let place = known.grid.key(&Point3::new(20.0 + f64::from(x), 0.0, 0.0));
        // The blocks of the last image are kept; the next image is of another place.
        see(&mut known, &nothing, 4 + x..5 + x);
        known.take_for_occupied(place, stamp(1));
        assert!(matches!(known.place(place), Place::Occupied { .. }), "{x}");
        assert!(known.blocks() <= 40);
    }
}

/// Whether one image passes a voxel, computed for this voxel alone.
fn plain_pass(known: &Occupancy, view: &DepthView, voxel: VoxelKey) -> bool {
    let crate::depth_view::Kind::Pinhole(projection) = view.kind else { unreachable!() };
    let edge_m = known.config.edge_m;
    let margins = crate::descent::Margins {
        before_m: edge_m as f32,
        behind: Default::default(),
        reach_m: 4.0,
    };
    let judge = crate::descent::Judge::new(view, projection, margins, 0.0);
    let steps = judge.frame.steps_m(edge_m);
    let half_m =
        [0, 1, 2].map(|axis: usize| 0.5 * steps.iter().map(|step| step[axis].abs()).sum::<f32>());
    let middle_m = judge.frame.in_camera_m(&known.grid.middle_m(voxel));
    match projection.extent(&CameraBox { middle_m, half_m }) {
        Extent::Within(covered) if !covered.is_cut && covered.farthest_m <= 4.0 => {
            let span = testing::plain_span(view, covered.columns, covered.rows);
            covered.farthest_m + (edge_m as f32) < span.0
        }
        _ => false,
    }
}

/// The voxels that one image hits: of the points in reach.
fn plain_hits(known: &Occupancy, view: &DepthView) -> impl Iterator<Item = VoxelKey> {
    let camera_from_map = view.map_from_camera.inverse();
    let mut points = testing::static_points_in_map(view);
    points.retain(|point| (camera_from_map * point).coords.norm() <= 4.0);
    points.into_iter().map(|point| known.grid.key(&point))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]
    /// A cube that is classified as a whole has the class that each of its voxels would have.
    #[test]
    fn the_update_is_that_of_each_voxel_alone(
        shift in prop::array::uniform3(-0.3..0.3_f64),
        turn in prop::array::uniform3(-0.5..0.5_f64),
        seed in any::<u64>(),
        holes in 0.0..0.9_f64,
    ) {
        let camera = testing::camera(64, 48);
        let pose = testing::pose(shift, turn);
        let mut noise = testing::Noise::new(seed);
        let mut depths_m = Scene::room().depths_m(&camera, &pose);
        let mut is_moving = vec![false; depths_m.len()];
        for (depth_m, is_moving) in depths_m.iter_mut().zip(&mut is_moving) {
            *depth_m += 0.02 * noise.normal() as f32;
            *is_moving = noise.uniform() < 0.1;
            if noise.uniform() < holes * noise.uniform() {
                *depth_m = 0.0;
            }
        }
        let view = testing::view_of(&camera, &pose, 0.0, depths_m, Some(&is_moving));
        let mut known = occupancy(0.16);
        join(&mut known, &view);
        let hits: HashSet<VoxelKey> = plain_hits(&known, &view).collect();
        let mut passes = 0;
        for z in -6..28 {
            for y in -16..16 {
                for x in -16..16 {
                    let voxel = VoxelKey { x, y, z };
                    let mut expected = Cell::default();
                    if hits.contains(&voxel) {
                        expected.hit(1);
                    } else if plain_pass(&known, &view, voxel) {
                        expected.pass(1);
                        passes += 1;
                    }
                    prop_assert_eq!(known.cell(voxel), expected, "{:?}", voxel);
                }
            }
        }
        prop_assert!(passes > 50 || holes > 0.5, "{} passes", passes);
    }
}
