//! A surface of which only a part is in memory is the same as one that is there as a whole.

use std::collections::BTreeSet;

use geometry::Stamp;
use proptest::prelude::*;

use super::*;
use crate::block::BlockBox;
use crate::surface::{ChangeFollower, SurfaceChanges};

/// So many blocks an axis are a tile here.
const TILE_BLOCKS: i32 = 3;

fn tile_of(key: BlockKey) -> BlockBox {
    let along = key.coordinates().map(|along| along.div_euclid(TILE_BLOCKS) * TILE_BLOCKS);
    let last = TILE_BLOCKS - 1;
    BlockBox { least: along.into(), most: along.map(|along| along + last).into() }
}

fn view(step: u32) -> DepthView {
    let along_m = 0.05 * f64::from(step);
    let pose = testing::pose([along_m, 0.0, 0.1 * along_m], [0.0, 0.1, 0.0]);
    testing::view_of_scene(&Scene::room(), &testing::camera(160, 120), &pose, f64::from(step))
}

fn seen(images: u32) -> Surface {
    let mut surface = surface(0.05);
    for step in 0..images {
        surface.integrate(&view(step), &Serial);
    }
    surface
}

/// Corrections leave where it is what was put there by hand: it was seen at no moment, and bytes made the first one of that.
#[test]
fn a_block_that_was_seen_at_no_moment_comes_back_as_one() {
    let points = points(&seen(2));
    let points = points.iter().map(|point| (point.position_m, point.normal));
    let mut put = surface(0.05);
    put.put_points(points, 0.0, BlockBox::ALL);
    let before = contents(&put);
    for (key, _) in &before {
        let bytes = put.block_bytes(*key).unwrap();
        assert!(put.remove_block(*key));
        put.put_block(&bytes).unwrap();
    }
    assert!(contents(&put) == before);
    let motion = put.motion_of(before[0].0, |_| Isometry3::translation(1.0, 0.0, 0.0));
    assert_eq!(motion, Isometry3::identity());
    // The times of later images begin with the first of these.
    put.integrate(&view(3), &Serial);
    assert!(before.iter().any(|(key, _)| {
        put.seen(*key).is_none() && put.block(*key).is_some_and(|block| block.last_seen == 1)
    }));
}

#[test]
fn a_part_in_another_surface_gives_the_same_points() {
    let mut surface = seen(3);
    let whole = points(&surface);
    let keys = surface.block_keys();
    let mut other = surface.unbounded();
    for key in keys.iter().filter(|key| (key.x + key.y + key.z) % 2 == 0) {
        other.put_block(&surface.block_bytes(*key).unwrap()).unwrap();
        surface.remove_block(*key);
    }
    assert!(surface.blocks() > 50 && other.blocks() > 50);
    let mut both = Vec::new();
    keys.iter().for_each(|key| {
        surface.points_of_both(&other, *key, PointRules::default(), &mut both);
    });
    assert_eq!(both, whole);
}

#[test]
fn a_block_that_found_no_room_is_added_when_there_is_some() {
    let expected = seen(1);
    let mut small = Surface::new(SurfaceConfig { max_blocks: 50, ..config(0.05) }).unwrap();
    let update = small.integrate(&view(0), &Serial);
    assert_eq!((small.blocks(), small.refused()), (50, update.refused_blocks));
    assert_eq!((small.add_refused(), small.blocks()), (0, 50));
    let first = contents(&small);
    let near_nodes = small.near_nodes();
    first.iter().for_each(|(key, _)| assert!(small.remove_block(*key)));
    let mut all = first;
    let mut counted = near_nodes;
    while small.refused() > 0 {
        assert!(small.add_refused() > 0 && small.blocks() <= 50);
        counted += small.near_nodes();
        all.extend(contents(&small));
        small.block_keys().iter().for_each(|key| assert!(small.remove_block(*key)));
    }
    all.sort_by_key(|(key, _)| *key);
    assert!(all == contents(&expected));
    assert_eq!((counted, small.near_nodes()), (expected.near_nodes(), 0));
    // What has waited until the next image is forgotten.
    small.integrate(&view(0), &Serial);
    small.integrate(&view(1), &Serial);
    small.clear();
    assert_eq!((small.refused(), small.blocks()), (0, 0));
}

#[test]
fn blocks_come_to_be_only_where_they_may() {
    let whole = seen(1);
    let mut part = surface(0.05);
    let may_be_new = |key: BlockKey| key.x >= 0;
    let update = part.integrate_where(&view(0), &Serial, &may_be_new);
    let (there, elsewhere): (Vec<_>, Vec<_>) =
        contents(&whole).into_iter().partition(|(key, _)| may_be_new(*key));
    assert!(contents(&part) == there && !there.is_empty());
    assert_eq!((update.refused_blocks, part.refused()), (elsewhere.len(), 0));
    assert_eq!(part.add_refused(), 0);
}

#[test]
fn points_put_tile_by_tile_give_the_same_surface() {
    let points: Vec<_> = points(&seen(3))
        .iter()
        .enumerate()
        .map(|(index, point)| {
            // Off the surface, so that their order counts.
            let off_m = 0.01 * (index as f32).sin();
            (point.position_m + off_m * point.normal, point.normal)
        })
        .collect();
    for reach_m in [0.0, 0.3] {
        let mut whole = surface(0.05);
        assert_eq!(whole.put_points(points.clone(), reach_m, BlockBox::ALL), 0);
        let mut by_tile = surface(0.05);
        let tiles: BTreeSet<_> =
            whole.block_keys().into_iter().map(|key| tile_of(key).least).rev().collect();
        assert!(tiles.len() > 10);
        for tile in tiles {
            let tile = tile_of(tile);
            let reaches = |point: &Point3<f32>| {
                by_tile.point_box(point, reach_m).intersection(&tile).blocks() > 0
            };
            let near: Vec<_> = points.iter().filter(|(point, _)| reaches(point)).copied().collect();
            assert_eq!(by_tile.put_points(near, reach_m, tile), 0);
        }
        assert!(contents(&by_tile) == contents(&whole));
        assert_eq!(by_tile.near_nodes(), whole.near_nodes());
    }
}

#[test]
fn a_correction_tile_by_tile_gives_the_same_surface() {
    let before = seen(4);
    let now_from_before = |stamp: Stamp| {
        let later_s = stamp.seconds_since(Stamp::default());
        testing::pose([0.1 * later_s, -0.03, 0.0], [0.0, 0.0, 0.02 * later_s])
    };
    let whole = before.corrected(now_from_before);
    let mut by_tile = before.emptied();
    let motions: Vec<_> = before
        .block_keys()
        .into_iter()
        .map(|key| (key, before.motion_of(key, now_from_before)))
        .collect();
    let tiles: BTreeSet<_> = motions
        .iter()
        .flat_map(|(key, motion)| {
            let BlockBox { least, most } = before.moved_box(*key, motion);
            (least.x..=most.x).flat_map(move |x| {
                (least.y..=most.y)
                    .flat_map(move |y| (least.z..=most.z).map(move |z| BlockKey { x, y, z }))
            })
        })
        .map(|key| tile_of(key).least)
        .collect();
    for tile in tiles {
        for (key, _) in &motions {
            by_tile.join_moved(&before, *key, now_from_before, tile_of(tile));
        }
    }
    by_tile.settle_moved();
    assert!(nodes(&by_tile) == nodes(&whole));
    assert_eq!(by_tile.near_nodes(), whole.near_nodes());
}

/// Where blocks come to one place, in whatever order, the moments are those of all of them.
#[test]
fn the_moments_of_blocks_that_meet_are_the_same_in_any_order() {
    let before = seen(4);
    let now_from_before = |stamp: Stamp| {
        let later_s = stamp.seconds_since(Stamp::default());
        testing::pose([0.3 - 0.1 * later_s, 0.0, 0.0], [0.0; 3])
    };
    let moments = |keys: Vec<BlockKey>| {
        let mut after = before.emptied();
        for key in keys {
            after.join_moved(&before, key, now_from_before, BlockBox::ALL);
        }
        let of_block = |(key, block): (BlockKey, SurfaceBlock)| {
            (key, block.evidence, [block.first_seen, block.last_seen, block.last_hit])
        };
        contents(&after).into_iter().map(of_block).collect::<Vec<_>>()
    };
    let mut keys = before.block_keys();
    let ascending = moments(keys.clone());
    keys.reverse();
    assert!(moments(keys) == ascending && ascending.len() > 100);
}

/// A listener was told of a place; the block leaves, comes back and is what it was: nothing is told. What was shown to
/// another listener meanwhile is told of in any case.
#[test]
fn what_listeners_know_leaves_and_comes_back_with_its_block() {
    let surface = seen(2);
    let grid = *surface.grid();
    let key = *surface.block_keys().iter().max_by_key(|key| surface.near_nodes_of(**key)).unwrap();
    let mut points = Vec::new();
    surface.points_of(key, PointRules::default(), &mut points);
    assert!(points.len() > 20);
    let told_now = |follower: &mut ChangeFollower| {
        let mut changes = SurfaceChanges::default();
        while follower.take_next(&surface, PointRules::default(), usize::MAX, &mut changes) {}
        let of_block = changes.updated.iter().filter(|point| BlockKey::of(point.voxel) == key);
        (of_block.count(), changes.removed.len())
    };
    let away = |is_shown: bool, is_waiting: bool| {
        let mut follower = ChangeFollower::default();
        follower.know(key, &points, &grid);
        if is_waiting {
            follower.follow_block(key);
        }
        let bytes = follower.known_bytes(key);
        follower.left(key);
        if is_shown {
            follower.show(key, &points[1..], &grid);
        }
        follower.come_back(key, &bytes);
        follower.follow_block(key);
        told_now(&mut follower)
    };
    assert_eq!(away(false, false), (0, 0));
    assert_eq!(away(false, true), (0, 0));
    assert_eq!(away(true, false), (0, 0), "who does not wait was told of all that was shown");
    assert_eq!(away(true, true), (points.len(), 0));
    // A listener came while the block was gone, or was spilled without a point: it has none of them.
    let mut follower = ChangeFollower::default();
    follower.know(key, &points, &grid);
    follower.follow_block(key);
    follower.begin_to_show();
    assert_eq!(told_now(&mut follower), (points.len(), 0));
    follower.follow_block(key);
    let bytes = follower.known_bytes(key);
    follower.left(key);
    follower.begin_to_show();
    follower.show(key, &[], &grid);
    follower.come_back(key, &bytes);
    assert_eq!(told_now(&mut follower), (points.len(), 0));
    let mut forgotten = ChangeFollower::default();
    forgotten.follow_block(key);
    assert_eq!(told_now(&mut forgotten).0, points.len());
    // One that waits and cannot be looked at comes last.
    let mut follower = ChangeFollower::default();
    follower.follow_block(key);
    let (first, waiting) = (follower.next_waiting(), follower.waiting());
    follower.postpone();
    assert!(follower.next_waiting() != first && follower.waiting() == waiting);
    (1..waiting).for_each(|_| follower.postpone());
    assert_eq!(follower.next_waiting(), first);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever the camera sees: a tile that it does not call in view keeps every bit.
    #[test]
    fn an_image_changes_nothing_but_what_is_in_view(
        shift in prop::array::uniform3(-1.5..1.5_f64),
        turn in prop::array::uniform3(-3.0..3.0_f64),
        holes in 0..40_usize,
        edge_m in 0.03..0.2_f64,
    ) {
        let camera = testing::camera(80, 60);
        let mut surface = Surface::new(config(edge_m)).unwrap();
        for step in 0..6 {
            let pose = testing::pose([0.0; 3], [0.0, f64::from(step), 0.3]);
            surface.integrate(&testing::view_of_scene(&Scene::room(), &camera, &pose, f64::from(step)), &Serial);
        }
        let before = contents(&surface);
        let pose = testing::pose(shift, turn);
        // The room without its ball, and with holes: something goes.
        let scene = Scene { balls: Vec::new(), ..Scene::room() };
        let mut depths_m = scene.depths_m(&camera, &pose);
        for hole in 0..holes {
            let first = (hole * 7919) % depths_m.len();
            depths_m.iter_mut().skip(first).take(30).for_each(|depth_m| *depth_m = 0.0);
        }
        let view = testing::view_of(&camera, &pose, 9.0, depths_m, None);
        let all = surface.view_box(&view).unwrap();
        let may_change = |key: BlockKey| all.contains(key) && surface.is_in_view(&view, tile_of(key));
        let known: BTreeSet<_> = before.iter().map(|(key, _)| *key).collect();
        let still: Vec<_> = before.iter().filter(|(key, _)| !may_change(*key)).cloned().collect();
        let expected_new = {
            let mut twin = surface.unbounded();
            for key in &known {
                twin.put_block(&surface.block_bytes(*key).unwrap()).unwrap();
            }
            twin.integrate(&view, &Serial);
            let new = twin.block_keys().into_iter().filter(|key| !known.contains(key));
            new.map(|key| (key, may_change(key))).collect::<Vec<_>>()
        };
        prop_assert!(expected_new.iter().all(|(_, may_change)| *may_change));
        surface.integrate(&view, &Serial);
        for (key, block) in still {
            prop_assert_eq!(surface.block(key), Some(&block));
        }
    }

    #[test]
    fn blocks_of_a_box_are_those_within(
        least in prop::array::uniform3(-8..8_i32), edges in prop::array::uniform3(0..9_i32),
    ) {
        let surface = seen(1);
        let most = [0, 1, 2].map(|axis: usize| least[axis] + edges[axis]);
        let within = BlockBox { least: least.into(), most: most.into() };
        let expected: Vec<_> =
            surface.block_keys().into_iter().filter(|key| within.contains(*key)).collect();
        prop_assert_eq!(surface.blocks_in(within), expected);
        let far = BlockKey { x: i32::MAX, y: i32::MIN, z: 0 };
        prop_assert!(BlockBox::ALL.contains(far));
    }
}
