use geometry::{
    CycleSetup, PipelineConfig, Stamp, ZoneSource, homogeneous_from_pose_vector, pose_from_vector,
};
use nalgebra::{Isometry3, Point3};
use proptest::prelude::*;

use super::*;

fn zone_deg(min: f64, max: f64) -> DynamicZone {
    DynamicZone {
        azimuth_min_rad: min.to_radians(),
        azimuth_max_rad: max.to_radians(),
        peak_std_dev_m: 0.6,
        source: ZoneSource::Measured,
        returns: None,
    }
}

fn cycle(points_m: Vec<Point3<f32>>, zones: Vec<DynamicZone>) -> DetectedCycle {
    DetectedCycle {
        depth: None,
        scan_rays: std::sync::Arc::default(),
        index: 7,
        scan_stamp: Stamp::from_nanos(1_000),
        voxel_points: vec![1; points_m.len()],
        points_before_reduction: points_m.len(),
        reduced_cloud: Cloud {
            stamp: Stamp::from_nanos(2_000),
            frame_id: "rig".to_owned(),
            points_m,
        },
        map_from_rig: Isometry3::identity(),
        map_from_continuous: None,
        map_frame_id: "map".to_owned(),
        setup: CycleSetup::default(),
        zones,
        moving_beams: Vec::new(),
    }
}

/// The published method.
fn rec_hv() -> SegmentationConfig {
    let pipeline = PipelineConfig { method: Method::RecHv, ..PipelineConfig::default() };
    SegmentationConfig { pipeline, ..SegmentationConfig::default() }
}

fn segmented(cycle: &DetectedCycle) -> Segmented {
    Segmenter::new(rec_hv()).unwrap().step(cycle, |_| ()).unwrap()
}

/// A grid of points, 5 cm apart, upright at depth `x_m`, over `y_m`, from 0.5 m below to 0.5 m above.
fn screen(x_m: f32, y_m: std::ops::Range<f32>) -> Vec<Point3<f32>> {
    let columns = ((y_m.end - y_m.start) / 0.05).round() as usize;
    (0..columns)
        .flat_map(|column| (0..20).map(move |row| (column as f32, row as f32)))
        .map(|(column, row)| Point3::new(x_m, y_m.start + 0.05 * column, 0.05 * row - 0.5))
        .collect()
}

#[test]
fn the_two_stages_take_the_object_and_leave_the_wall() {
    let wall = screen(4.0, -2.0..2.0);
    let robot = screen(2.5, -0.2..0.2);
    let points: Vec<_> = wall.iter().chain(&robot).copied().collect();
    // The robot spans 9.1 degrees at most; the wall within the zone is PCL_Oe.
    let cycle = cycle(points, vec![zone_deg(-6.0, 6.0)]);
    let result = segmented(&cycle);

    let wall_in_zone = wall.iter().filter(|p| p.y.atan2(p.x).to_degrees().abs() <= 6.0).count();
    assert!(wall_in_zone > robot.len());
    assert_eq!(result.cycle.dynamic_cloud.points_m, robot);
    assert_eq!(result.cycle.static_cloud.points_m, wall);
    assert_eq!(
        result.counts,
        SegmentationCounts {
            reduced: wall.len() + robot.len(),
            in_zone: wall_in_zone + robot.len(),
            dynamic: robot.len(),
        }
    );
    assert_eq!(
        (result.cycle.index, result.cycle.static_cloud.stamp),
        (7, Stamp::from_nanos(2_000))
    );
    assert_eq!(
        (&*result.cycle.static_cloud.frame_id, &*result.cycle.dynamic_cloud.frame_id),
        ("map", "rig")
    );
}

#[test]
fn without_a_zone_everything_is_static() {
    let points = screen(4.0, -1.0..1.0);
    let result = segmented(&cycle(points.clone(), vec![]));
    assert_eq!(result.cycle.static_cloud.points_m, points);
    assert!(result.cycle.dynamic_cloud.points_m.is_empty());
    assert_eq!((result.counts.in_zone, result.counts.dynamic), (0, 0));
}

#[test]
fn a_zone_that_holds_one_group_gives_all_of_it_to_the_object() {
    // The published method's price: the nearest group is the object even where it is the wall.
    let wall = screen(4.0, -2.0..2.0);
    let result = segmented(&cycle(wall, vec![zone_deg(-6.0, 6.0)]));
    assert!(result.counts.in_zone > 0);
    assert_eq!(result.counts.dynamic, result.counts.in_zone);
}

#[test]
fn each_zone_has_its_own_nearest_group() {
    let wall = screen(5.0, -3.0..3.0);
    let near = screen(1.5, 0.6..0.9);
    let far = screen(3.0, -1.2..-0.9);
    let points: Vec<_> = near.iter().chain(&wall).chain(&far).copied().collect();
    let zones = vec![zone_deg(20.0, 35.0), zone_deg(-25.0, -15.0)];
    let result = segmented(&cycle(points, zones));
    let objects: Vec<_> = near.into_iter().chain(far).collect();
    assert_eq!(result.cycle.dynamic_cloud.points_m, objects);
    assert_eq!(result.cycle.static_cloud.points_m, wall);
}

#[test]
fn a_point_of_two_zones_is_counted_once_and_dynamic_if_it_is_so_in_one() {
    let points = vec![
        Point3::new(1.0, 0.1, 0.0), // in the left zone alone: its object
        Point3::new(3.0, 0.0, 0.0), // in both: behind in the left one, the object of the right one
    ];
    let result =
        segmented(&cycle(points.clone(), vec![zone_deg(-1.0, 10.0), zone_deg(-10.0, 1.0)]));
    assert_eq!(result.cycle.dynamic_cloud.points_m, points);
    assert_eq!((result.counts.in_zone, result.counts.dynamic), (2, 2));
}

#[test]
fn the_static_part_is_moved_by_the_matrix_of_equation_8() {
    let vector = [1.0, -2.0, 0.5, 0.3, -0.2, 0.1];
    let mut cycle = cycle(screen(4.0, -1.0..1.0), vec![]);
    cycle.map_from_rig = pose_from_vector(&vector);
    let matrix = homogeneous_from_pose_vector(&vector);
    let moved = segmented(&cycle).cycle.static_cloud.points_m;
    for (before, after) in cycle.reduced_cloud.points_m.iter().zip(&moved) {
        let expected = matrix.transform_point(&before.cast::<f64>());
        assert!((after.cast::<f64>() - expected).norm() < 1e-5, "{after} is not {expected}");
    }
}

#[test]
fn the_stages_are_told_in_their_order() {
    let mut steps = Vec::new();
    let mut segmenter = Segmenter::new(rec_hv()).unwrap();
    segmenter.step(&cycle(vec![], vec![]), |step| steps.push(step.name())).unwrap();
    assert_eq!(steps, ["angular", "depth_clustering", "transform"]);
}

#[test]
fn numbers_that_mean_nothing_are_told() {
    let mut segmenter = Segmenter::new(rec_hv()).unwrap();
    for zone in [zone_deg(f64::NAN, 1.0), zone_deg(0.0, f64::INFINITY), zone_deg(2.0, 1.0)] {
        let error = segmenter.step(&cycle(vec![], vec![zone]), |_| ()).unwrap_err();
        assert!(matches!(error, SegmentationError::Zone { index: 7, .. }));
    }
    let mut lost = cycle(vec![], vec![]);
    lost.map_from_rig.translation.x = f64::NAN;
    let error = segmenter.step(&lost, |_| ()).unwrap_err();
    assert_eq!(error, SegmentationError::Pose { index: 7, source: UnusablePose::NotFinite });
    for edge_m in [0.0, -0.08, f64::NAN] {
        let mut config = rec_hv();
        config.pipeline.voxel_edge_m = edge_m;
        let message = Segmenter::new(config).unwrap_err().to_string();
        assert!(message.contains("voxel_edge_m"), "{message}");
    }
}

proptest! {
    #[test]
    fn the_split_is_a_partition_in_order(
        coordinates in prop::collection::vec(prop::array::uniform3(-6.0f32..6.0), 0..150),
        bounds_deg in prop::collection::vec((-180.0f64..180.0, 0.0f64..120.0), 0..4),
    ) {
        let points: Vec<_> = coordinates.into_iter().map(Point3::from).collect();
        let zones: Vec<_> =
            bounds_deg.into_iter().map(|(min, width)| zone_deg(min, min + width)).collect();
        let result = segmented(&cycle(points.clone(), zones.clone()));

        let counts = result.counts;
        prop_assert!(counts.dynamic <= counts.in_zone && counts.in_zone <= counts.reduced);
        prop_assert_eq!(counts.reduced, points.len());
        // Taking the points in their order, the next one is the next of one of the two clouds, and of
        // the dynamic one only within a zone.
        let mut still = result.cycle.static_cloud.points_m.iter().peekable();
        let mut moving = result.cycle.dynamic_cloud.points_m.iter().peekable();
        for point in &points {
            let in_zone = zones.iter().any(|zone| zone.contains(point));
            if in_zone && moving.peek() == Some(&point) {
                moving.next();
            } else {
                prop_assert_eq!(still.next(), Some(point));
            }
        }
        prop_assert!(still.next().is_none() && moving.next().is_none());
        // Every zone that holds points has an object.
        for zone in &zones {
            let mut held = points.iter().filter(|point| zone.contains(point)).peekable();
            if held.peek().is_some() {
                prop_assert!(result.cycle.dynamic_cloud.points_m.iter().any(|point| zone.contains(point)));
            }
        }
    }
}
