use std::time::Instant;

use super::super::testing::room;
use super::world::World;

/// What a cycle of 360 beams costs. It bounds nothing tightly: the machine may be busy, and the build is not
/// optimised.
#[test]
fn a_cycle_costs_little() {
    let mut world = World::new(1);
    world.look(&room(), 20);
    let scans: Vec<_> = (0..50)
        .map(|cycle| {
            let pose = nalgebra::Isometry3::identity();
            world.scanner.scan(&room(), &pose, 20 + cycle, &mut world.dice)
        })
        .collect();
    let pose = nalgebra::Isometry3::identity();
    let mut times_s: Vec<f64> = scans
        .iter()
        .map(|scan| {
            let cloud = geometry::Cloud { stamp: scan.stamp, ..geometry::Cloud::default() };
            let input = crate::CycleInput {
                scan,
                view: crate::View::PointsInRig(&cloud),
                map_from_rig: &pose,
                map_frame_id: "map",
            };
            let start = Instant::now();
            world.detector.step(&input, |_| ()).unwrap();
            start.elapsed().as_secs_f64()
        })
        .collect();
    times_s.sort_by(f64::total_cmp);
    println!("a cycle takes {:.3} ms (median)", 1e3 * times_s[times_s.len() / 2]);
    assert!(times_s[times_s.len() / 2] < 0.05);
}
