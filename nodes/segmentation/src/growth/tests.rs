use proptest::prelude::*;

use super::*;

fn key([x, y, z]: [i32; 3]) -> VoxelKey {
    VoxelKey { x, y, z }
}

fn grown(points: &[([i32; 3], Standing)], seeds: &[usize]) -> Vec<Vec<usize>> {
    let standings: Vec<_> = points.iter().map(|(_, standing)| *standing).collect();
    let voxels: Vec<_> = points.iter().map(|(voxel, _)| key(*voxel)).collect();
    Candidates::new(&standings, &voxels).grown_from(seeds, |_| true)
}

#[test]
fn a_gap_of_one_voxel_is_crossed_in_free_space_only() {
    use Standing::{Came, CameBesideSurface, New};
    for (second, linked) in [(Came, true), (CameBesideSurface, false), (New, false)] {
        let groups = grown(&[([0, 0, 0], Came), ([2, -2, 1], second)], &[0]);
        assert_eq!(groups[0].len() == 2, linked, "{second:?}");
        assert_eq!(grown(&[([0, 0, 0], Came), ([1, -1, 1], second)], &[0])[0].len(), 2);
    }
    assert_eq!(grown(&[([0, 0, 0], Came), ([3, 0, 0], Came)], &[0])[0].len(), 1);
}

#[test]
fn still_points_stop_the_growth() {
    use Standing::{Came, Still};
    let points = [([0, 0, 0], Came), ([1, 0, 0], Still), ([1, 1, 0], Still), ([3, 0, 0], Came)];
    assert_eq!(grown(&points, &[0]), [[0]]);
    assert_eq!(grown(&points, &[3, 0]), [[3], [0]]);
}

#[test]
fn what_may_not_be_taken_is_left_but_a_seed_never() {
    use Standing::New;
    let points = [([0, 0, 0], New), ([1, 0, 0], New), ([2, 0, 0], New)];
    let standings = points.map(|(_, standing)| standing);
    let voxels = points.map(|(voxel, _)| key(voxel));
    let candidates = Candidates::new(&standings, &voxels);
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
        use Standing::{Came, CameBesideSurface, New, Still};
        let points: Vec<_> = voxels
            .iter()
            .zip(kinds)
            .map(|(voxel, kind)| (*voxel, [Still, New, CameBesideSurface, Came][kind]))
            .collect();
        let seeds: Vec<_> = seeds
            .into_iter()
            .filter(|&seed| seed < points.len() && points[seed].1 != Still)
            .collect();
        let groups = grown(&points, &seeds);
        let mut all: Vec<usize> = groups.concat();
        let taken = all.len();
        all.sort_unstable();
        all.dedup();
        prop_assert_eq!(all.len(), taken);
        prop_assert!(seeds.iter().all(|seed| all.contains(seed)));
        prop_assert!(all.iter().all(|&index| points[index].1 != Still));
    }
}
