use super::*;
use crate::Sample;

#[test]
fn the_way_leads_round_the_block_at_its_speed_and_clear_of_everything() {
    let scenario = Scenario::road(VelodyneModel::Vlp16, 1);
    assert_eq!(scenario.validate(), Ok(()));
    let path = &scenario.rig.path;
    let length_m = path.distance_at(scenario.duration_s);
    assert!((280.0..330.0).contains(&length_m), "{length_m} m");
    assert!((30.0..45.0).contains(&scenario.duration_s), "{} s", scenario.duration_s);
    let still = crate::still::StillSolids::new(&scenario.scene.static_solids());
    for step in 0..200 {
        let time_s = scenario.duration_s * f64::from(step) / 200.0;
        let pose = path.pose_at(time_s);
        let ahead = pose * nalgebra::Vector3::x();
        let going = path.position_at(time_s + 0.05) - path.position_at(time_s - 0.05);
        if going.norm() > 0.2 {
            assert!(ahead.dot(&going.normalize()) > 0.995, "at {time_s} s");
        }
        assert!(going.norm() / 0.1 < 9.5, "{} m/s", going.norm() / 0.1);
        for direction in 0..36 {
            let angle_rad = f64::from(direction) * TAU / 36.0;
            let direction = nalgebra::Vector3::new(angle_rad.cos(), angle_rad.sin(), -0.25);
            let origin = path.position_at(time_s) - nalgebra::Vector3::z() * 0.8;
            let ray = crate::Ray { origin, direction: direction.normalize() };
            let sighting = still.nearest_sighting(&[], &ray, 1e-9);
            let free_m = sighting.map_or(f64::INFINITY, |sighting| sighting.distance_m);
            assert!(free_m > 1.0, "{free_m} m at {time_s} s, {origin}");
        }
    }
}

#[test]
fn a_turn_sees_road_marks_houses_and_poles() {
    let scenario = Scenario::road(VelodyneModel::Hdl32e, 1).with_duration_s(0.2);
    let mut turns = 0;
    for sample in scenario.samples().unwrap() {
        let Sample::Velodyne(turn) = sample else { continue };
        turns += 1;
        let measured: Vec<_> = turn.points.iter().filter(|point| point.is_measured()).collect();
        assert!(measured.len() * 10 > turn.points.len() * 6, "{}", measured.len());
        let on_road: Vec<_> = measured
            .iter()
            .filter(|p| p.position_m[2] < -1.68 && p.position_m[2] > -1.78)
            .collect();
        let near = |p: &&&&crate::VelodynePoint| p.position_m[0].hypot(p.position_m[1]) < 6.0;
        let bright = on_road.iter().filter(near).filter(|p| p.intensity > 20.0).count();
        let dark = on_road.iter().filter(near).filter(|p| p.intensity < 15.0).count();
        assert!(bright > 50 && dark > 3 * bright, "{bright} bright, {dark} dark");
        let above = measured.iter().filter(|p| p.position_m[2] > 0.5).count();
        let farthest =
            measured.iter().map(|p| p.position_m[0].hypot(p.position_m[1])).fold(0.0, f32::max);
        assert!(above > 3000 && farthest > 40.0, "{above} above, {farthest} m");
    }
    assert_eq!(turns, 2);
}
