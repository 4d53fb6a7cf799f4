//! Poses that are wrong as a whole: the image lies beside what is known.

use super::*;

/// A person crosses before a platform that stands for two seconds and then does as `yaw_rad` says; each image is told to have been taken
/// where `told_rad` says.
fn score(yaw_rad: &dyn Fn(f64) -> f64, told_rad: &dyn Fn(f64) -> f64) -> Score {
    let mut segmenter = Segmenter::new(config()).unwrap();
    let mut random = Random::new(7);
    let mut score = Score::default();
    for index in 0..60 {
        let time_s = f64::from(index) * CYCLE_S;
        let mut solids = furnished();
        solids.extend(walker(1, 2.6, across_m(time_s, -2.5, 0.6)));
        let [room_from_rig, told] =
            [yaw_rad(time_s), told_rad(time_s)].map(|yaw_rad| rig_at(0.0, 0.0, yaw_rad));
        let map_from_rig = rig_at(0.0, 0.0, 0.0).inverse() * told;
        let mut view = look(&solids, index, &room_from_rig, map_from_rig, &mut random);
        view.cycle.setup = config().pipeline.setup();
        let segmented = segmenter.step(&view.cycle, |_| ()).unwrap();
        score.take(&view, &segmented);
    }
    score
}

/// To and fro by 0.5 rad, at 1 rad/s at most, after two seconds.
fn to_and_fro_rad(time_s: f64) -> f64 {
    0.5 * (2.0 * (time_s - 2.0).max(0.0)).sin()
}

/// Regression: while a platform turned whose camera's stamps are late, the rims of furniture and walls were cut out: they lay where space
/// had been seen to be free.
#[test]
fn images_that_are_late_cut_out_no_furniture_on_a_platform_that_turns() {
    let late_s = 0.08;
    let score = score(&|time_s| to_and_fro_rad(time_s - late_s), &to_and_fro_rad);
    println!("{score:?}");
    // 6.5 % were. What is left came into view during a turn: all that is known of it lies beside the rest.
    assert!(score.static_lost() < 0.01, "{}", score.static_lost());
    assert!(score.recall() >= 0.99, "{}", score.recall());
}

/// Regression: wheels that slipped cut furniture out until the evidence was that of the new poses.
#[test]
fn wheels_that_slip_cut_out_no_furniture() {
    let slipped_rad = |time_s: f64| if time_s > 3.0 { 0.05 } else { 0.0 };
    let score = score(&|_| 0.0, &slipped_rad);
    println!("{score:?}");
    // 1 % were.
    assert!(score.static_lost() < 0.001, "{}", score.static_lost());
    assert!(score.recall() >= 0.99, "{}", score.recall());
}

/// The points that are newly occupied, as all are when the image is turned.
fn plain_if_turned(
    segmenter: &FreeSpaceSegmenter,
    points: &CyclePoints<'_>,
    classes: &[PointClass],
    turn: &UnitQuaternion<f64>,
) -> Vec<(usize, PointClass)> {
    let turned = CyclePoints::turned(points.cycle, &segmenter.grid, turn);
    let places = turned.voxels.iter().map(|&voxel| segmenter.occupancy.place(voxel));
    let known: Vec<Known> = places.map(|place| segmenter.known(place)).collect();
    let all = segmenter.classes(&turned, &known).into_iter().enumerate();
    all.filter(|(point, _)| classes[*point].is_newly_occupied()).collect()
}

/// A person who crosses, and a doorway behind him from which nothing returns.
#[test]
fn what_is_newly_occupied_is_by_itself_what_all_points_make_it() {
    let grid = config().pipeline.voxel_grid().unwrap();
    let mut segmenter = FreeSpaceSegmenter::new(config().free_space, grid).unwrap();
    let mut random = Random::new(7);
    let (mut asked, mut changed) = (0, 0);
    for index in 0..40 {
        let time_s = f64::from(index) * CYCLE_S;
        let mut solids = furnished();
        solids.remove(1);
        solids.extend(walker(1, 2.6, across_m(time_s, -2.5, 0.6)));
        let rig = rig_at(0.0, 0.0, 0.0);
        let map_from_rig = Isometry3::identity();
        let mut view = look(&solids, index, &rig, map_from_rig, &mut random);
        view.cycle.setup = config().pipeline.setup();
        let points = CyclePoints::of(&view.cycle, &segmenter.grid);
        let mut before = segmenter.clone();
        before.begin(view.cycle.reduced_cloud.stamp, &view.cycle);
        let known = before.known_places(&points);
        let classes = before.classes(&points, &known);
        for turn_rad in [-0.06, 0.02, 0.06] {
            let turn = UnitQuaternion::from_scaled_axis(turn_rad * Vector3::z());
            let turned = before.newly_occupied_if_turned(&points, &classes, &turn);
            asked += turned.len();
            changed += turned.iter().filter(|(_, class)| !class.is_newly_occupied()).count();
            assert_eq!(turned, plain_if_turned(&before, &points, &classes, &turn), "{index}");
        }
        segmenter.step(&view.cycle, &mut |_| ());
    }
    println!("{changed} of {asked}");
    assert!(asked > 1000 && changed > 0, "{changed} of {asked}");
}
