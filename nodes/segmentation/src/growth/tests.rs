use proptest::prelude::*;

use super::*;

fn key([x, y, z]: [i32; 3]) -> VoxelKey {
    VoxelKey { x, y, z }
}

fn grown(points: &[([i32; 3], PointClass)], seeds: &[usize]) -> Vec<Vec<usize>> {
    let classes: Vec<_> = points.iter().map(|(_, class)| *class).collect();
    let voxels: Vec<_> = points.iter().map(|(voxel, _)| key(*voxel)).collect();
    Candidates::new(&classes, &voxels).grown_from(seeds, |_| true)
}

#[test]
fn a_gap_of_one_voxel_is_crossed_in_free_space_only() {
    use PointClass::{InFreeSpace, InFreeSpaceBesideSurface, Unknown};
    for (second, linked) in
        [(InFreeSpace, true), (InFreeSpaceBesideSurface, false), (Unknown, false)]
    {
        let groups = grown(&[([0, 0, 0], InFreeSpace), ([2, -2, 1], second)], &[0]);
        assert_eq!(groups[0].len() == 2, linked, "{second:?}");
        assert_eq!(grown(&[([0, 0, 0], InFreeSpace), ([1, -1, 1], second)], &[0])[0].len(), 2);
    }
    assert_eq!(grown(&[([0, 0, 0], InFreeSpace), ([3, 0, 0], InFreeSpace)], &[0])[0].len(), 1);
}

#[test]
fn still_points_stop_the_growth() {
    use PointClass::{Background, InFreeSpace};
    let points = [
        ([0, 0, 0], InFreeSpace),
        ([1, 0, 0], Background),
        ([1, 1, 0], Background),
        ([3, 0, 0], InFreeSpace),
    ];
    assert_eq!(grown(&points, &[0]), [[0]]);
    assert_eq!(grown(&points, &[3, 0]), [[3], [0]]);
}

#[test]
fn what_may_not_be_taken_is_left_but_a_seed_never() {
    use PointClass::Unknown;
    let points = [([0, 0, 0], Unknown), ([1, 0, 0], Unknown), ([2, 0, 0], Unknown)];
    let classes = points.map(|(_, class)| class);
    let voxels = points.map(|(voxel, _)| key(voxel));
    let candidates = Candidates::new(&classes, &voxels);
    assert_eq!(candidates.grown_from(&[0], |index| index < 2), [[0, 1]]);
    assert_eq!(candidates.grown_from(&[0, 2], |_| false), [[0], [2]]);
}

proptest! {
    #[test]
    fn groups_are_disjoint_and_hold_every_seed(
        voxels in prop::collection::vec(prop::array::uniform3(-6..6_i32), 1..80),
        kinds in prop::collection::vec(0..4_usize, 80),
        seeds in prop::collection::vec(0..80_usize, 0..10),
    ) {
        use PointClass::{InFreeSpace, InFreeSpaceBesideSurface, Unknown, Background};
        let points: Vec<_> = voxels
            .iter()
            .zip(kinds)
            .map(|(voxel, kind)| (*voxel, [Background, Unknown, InFreeSpaceBesideSurface, InFreeSpace][kind]))
            .collect();
        let seeds: Vec<_> = seeds
            .into_iter()
            .filter(|&seed| seed < points.len() && points[seed].1 != Background)
            .collect();
        let groups = grown(&points, &seeds);
        let mut all: Vec<usize> = groups.concat();
        let taken = all.len();
        all.sort_unstable();
        all.dedup();
        prop_assert_eq!(all.len(), taken);
        prop_assert!(seeds.iter().all(|seed| all.contains(seed)));
        prop_assert!(all.iter().all(|&index| points[index].1 != Background));
    }
}
