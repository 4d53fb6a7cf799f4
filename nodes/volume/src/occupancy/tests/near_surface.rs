//! The voxels around one, block by block.

use super::*;

/// Voxel by voxel.
fn plain(known: &Occupancy, voxel: VoxelKey, steps: i32) -> bool {
    let mut beside = voxel.within(steps).filter(|beside| *beside != voxel);
    beside.any(|beside| known.cell(beside).may_be_surface())
}

fn along() -> impl Strategy<Value = i32> {
    prop_oneof![12 => -10..10, 1 => i32::MIN..i32::MIN + 10, 1 => i32::MAX - 9..=i32::MAX]
}

proptest! {
    #[test]
    fn surfaces_are_found_as_voxel_by_voxel(
        hits in prop::collection::vec(prop::array::uniform3(along()), 0..12),
        asked in prop::collection::vec(prop::array::uniform3(along()), 1..60),
        steps in -1..5,
    ) {
        let mut known = occupancy(0.08);
        let nothing = DepthView::new(Default::default(), Default::default()).unwrap();
        let voxel = |[x, y, z]: [i32; 3]| VoxelKey { x, y, z };
        for stamp_s in 0..3 {
            known.begin_cycle(stamp(stamp_s));
            known.integrate(&nothing, hits.iter().map(|hit| voxel(*hit)));
        }
        for voxel in asked.into_iter().chain(hits).map(voxel) {
            let (found, expected) = (known.is_near_surface(voxel, steps), plain(&known, voxel, steps));
            prop_assert_eq!(found, expected, "{:?}", voxel);
        }
    }
}

/// Among blocks that are one cell, and some that there are not.
#[test]
fn surfaces_are_found_before_a_wall_as_voxel_by_voxel() {
    let mut known = occupancy(0.08);
    see(&mut known, &Scene::wall(3.0), 0..80);
    let mut near = 0;
    for z in 0..50 {
        for y in -10..10 {
            for x in -10..10 {
                let voxel = VoxelKey { x, y, z };
                let found = known.is_near_surface(voxel, 2);
                assert_eq!(found, plain(&known, voxel, 2), "{voxel:?}");
                near += usize::from(found);
            }
        }
    }
    assert!((400..10_000).contains(&near), "{near}");
}
