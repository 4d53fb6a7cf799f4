//! One recording, written as each driver writes it: what moves is found and removed, or a line says what is not supported and what to do.

mod recording;
mod rewrites;

use std::path::Path;
use std::sync::OnceLock;

use geometry::DynamicZone;
use nalgebra::Point3;
use robot::Failure;
use robot::run::cycles::CycleRun;
use robot::run::inputs::TopicArgs;
use robot::run::parameters::ParameterArgs;

use recording::Recording;
use rewrites::*;

/// Of the pixels that show a person, so many are masked at least.
const LEAST_REMOVED: f64 = 0.95;
/// Of those that show what stands still, so many are masked at most: beside a person, and where nothing is known yet.
const MOST_LOST: f64 = 0.12;
/// A zone is in the direction of something that moves in so many of the cycles with both, at least.
const LEAST_IN_ZONE: f64 = 0.8;
/// So many points of the map lie on that of the recording as it was simulated, at least ...
const LEAST_ON_MAP: f64 = 0.9;
/// ... within this.
const NEAR_M: f32 = 0.05;
/// Points of the map, by those of the recording as it was simulated; a lens shows more or less of the room.
const MAP: std::ops::RangeInclusive<f64> = 0.8..=1.25;
/// Coarse and near, so that a run takes a fraction of a second: the persons are at 3 m.
const OF_ALL: &str = "evidence_reach_m: 4.5";
const MAP_EDGE_M: f64 = 0.08;

/// A driver's way of writing the recording.
struct Row {
    /// Whose way it is.
    driver: &'static str,
    rewrite: fn(&mut Recording),
    /// What the user has to say of it, as a parameter file has it below `ros__parameters`.
    parameters: &'static str,
}

/// A way that is not read, and what the failure says.
struct Refused {
    driver: &'static str,
    rewrite: fn(&mut Recording),
    says: &'static [&'static str],
}

const fn row(driver: &'static str, rewrite: fn(&mut Recording)) -> Row {
    Row { driver, rewrite, parameters: "" }
}

const ROWS: [Row; 39] = [
    row("the simulator", |_| {}),
    // Scanners.
    row("rplidar_ros: intensities, inf for no return", |r| {
        r.each_scan(|scan| scan.intensities = vec![47.0; scan.ranges.len()]);
        r.each_scan(|scan| no_return(scan, f32::INFINITY));
    }),
    row("sllidar_ros2, Standard: 720 beams", |r| r.each_scan(|scan| finer(scan, 2))),
    row("sllidar_ros2, Boost: 1,440 beams, intensities of 0", |r| {
        r.each_scan(|scan| finer(scan, 4));
        r.each_scan(|scan| scan.intensities = vec![0.0; scan.ranges.len()]);
    }),
    row("sllidar_ros2, DenseBoost: 3,240 beams", |r| r.each_scan(|scan| finer(scan, 9))),
    row("a scanner of 3,600 beams", |r| r.each_scan(|scan| finer(scan, 10))),
    row("rplidar_ros, inverted: the beams the other way round", |r| r.each_scan(backwards)),
    row("a scanner from 0 to 2 pi", |r| r.each_scan(from_zero)),
    row("a driver that repeats the first beam", |r| r.each_scan(first_beam_again)),
    row("urg_node: NaN for no return", |r| r.each_scan(|scan| no_return(scan, f32::NAN))),
    row("ydlidar: 0 for no return", |r| r.each_scan(|scan| no_return(scan, 0.0))),
    row("a driver with more than range_max for no return", |r| {
        r.each_scan(|scan| no_return(scan, scan.range_max + 1.0));
    }),
    row("Gazebo: no times of the beams", |r| {
        r.each_scan(|scan| (scan.time_increment, scan.scan_time) = (0.0, 0.0));
    }),
    row("frames of other names", |r| {
        r.each_scan(|scan| scan.header.frame_id = "base_scan".to_owned());
        r.each_image(|image| image.header.frame_id = "oak_right_camera_optical_frame".to_owned());
    }),
    Row {
        driver: "a scanner upside down",
        rewrite: |r| r.each_scan(upside_down),
        parameters: "rig_from_lidar: [0.0, 0.0, -0.05, 0.0, 0.0, 3.14159265]",
    },
    // Depth cameras.
    row("openni2_camera: mono16", |r| r.each_image(|image| image.encoding = "mono16".to_owned())),
    row("a big-endian driver with padded rows", |r| r.each_image(big_endian_and_padded)),
    row("freenect, zed: 32FC1 with NaN", |r| r.each_image(|image| in_metres(image, f32::NAN))),
    row("Gazebo: 32FC1 with inf", |r| r.each_image(|image| in_metres(image, f32::INFINITY))),
    row("orbbec: 32FC1 with 0", |r| r.each_image(|image| in_metres(image, 0.0))),
    row("32FC1, big-endian, padded", |r| {
        r.each_image(|image| in_metres(image, f32::NAN));
        r.each_image(big_endian_and_padded);
    }),
    row("realsense2_camera: depth aligned to colour", |r| {
        r.view_topics("/camera/aligned_depth_to_color/image_raw");
    }),
    row("zed_wrapper", |r| r.view_topics("/zed/zed_node/depth/depth_registered")),
    row("oak: stereo", |r| r.view_topics("/oak/stereo/image_raw")),
    row("image_transport: compressedDepth, PNG", |r| r.compress(PNG)),
    row("image_transport: compressedDepth, RVL", |r| r.compress(RVL)),
    row("image_transport: compressedDepth, PNG of 32FC1", |r| {
        r.each_image(|image| in_metres(image, f32::NAN));
        r.compress(PNG_OF_METRES);
    }),
    row("azure_kinect: organised clouds", Recording::clouds),
    row("a rectified image: plumb_bob of zeros", |r| r.each_info(|info| info.d = vec![0.0; 5])),
    row("realsense2_camera: no distortion model", |r| {
        r.each_info(|info| (info.distortion_model, info.d) = (String::new(), Vec::new()));
    }),
    row("openni2_camera: a calibrated plumb_bob", |r| r.seen_through(PLUMB_BOB)),
    row("azure_kinect: rational_polynomial", |r| r.seen_through(RATIONAL)),
    row("orbbec: the same by the name plumb_bob", |r| {
        r.seen_through(RATIONAL);
        r.each_info(|info| info.distortion_model = "plumb_bob".to_owned());
    }),
    row("oak: rational_polynomial of 14, with a thin prism", |r| {
        r.seen_through(PRISM);
        r.each_info(|info| info.d.extend([0.0; 2]));
    }),
    row("a fisheye lens: equidistant", |r| r.seen_through(FISHEYE)),
    row("a region of interest", Recording::middle_of_the_sensor),
    row("6 images a second", |r| r.keep_images(|index| index % 5 != 0 && index % 2 == 0)),
    row("realsense2_camera: 90 images a second", Recording::three_times_the_images),
    row("a calibration that is sent behind its image", |r| {
        r.each_info_stamp(|stamp| stamp.plus_seconds(0.002));
    }),
];

const REFUSED: [Refused; 4] = [
    Refused {
        driver: "urg_node: several echoes",
        rewrite: Recording::several_echoes,
        says: &["/echoes, which is not read", "laser_proc"],
    },
    Refused {
        driver: "a distortion model that is not known",
        rewrite: |r| r.each_info(|info| info.distortion_model = "fov".to_owned()),
        says: &["/camera/depth/camera_info: unusable message", "\"fov\" is not supported"],
    },
    Refused {
        driver: "a camera that is not calibrated",
        rewrite: |r| r.each_info(|info| info.k = [0.0; 9]),
        says: &["/camera/depth/camera_info: unusable message", "calibrated"],
    },
    Refused {
        driver: "colours for depths",
        rewrite: |r| r.each_image(|image| image.encoding = "8UC2".to_owned()),
        says: &["/camera/depth/image_raw", "16UC1, mono16 and 32FC1"],
    },
];

/// What a run has found.
struct Found {
    removed: f64,
    lost: f64,
    /// Of the cycles with a zone and something that moves, the share in which a zone is in its direction.
    in_zone: f64,
    map_m: Vec<Point3<f32>>,
}

impl Found {
    /// The share of every tenth point of the map that lies on a map.
    fn on(&self, map_m: &[Point3<f32>]) -> f64 {
        let is_on = |point: &&Point3<f32>| {
            map_m.iter().any(|other| (*point - other).norm_squared() < NEAR_M * NEAR_M)
        };
        let sample = || self.map_m.iter().step_by(10);
        sample().filter(is_on).count() as f64 / sample().count() as f64
    }
}

#[test]
fn what_moves_goes_whichever_driver_wrote_it() {
    let folder = tempfile::tempdir().unwrap();
    let simulated = Recording::simulated(folder.path());
    let reference = OnceLock::new();
    let mut faults = Vec::new();
    for (number, Row { driver, rewrite, parameters }) in ROWS.iter().enumerate() {
        let mut recording = simulated.clone();
        rewrite(&mut recording);
        let bag = recording.write(&folder.path().join(format!("{number}.mcap")));
        let found = match run(&bag, parameters, folder.path(), &recording) {
            Ok(found) => found,
            Err(failure) => {
                faults.push(format!("{driver}: {failure}"));
                continue;
            }
        };
        let reference = reference.get_or_init(|| found.map_m.clone());
        let Found { removed, lost, in_zone, .. } = found;
        let (map, on) = (found.map_m.len() as f64 / reference.len() as f64, found.on(reference));
        let line = format!(
            "{driver}: {removed:.3} removed, {lost:.5} lost, {in_zone:.2} in a zone; {map:.2} of the map, {on:.3} on it"
        );
        println!("{line}");
        let is_well = removed >= LEAST_REMOVED && lost <= MOST_LOST && in_zone >= LEAST_IN_ZONE;
        if !is_well || !MAP.contains(&map) || on < LEAST_ON_MAP {
            faults.push(line);
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_way_that_is_not_read_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let simulated = Recording::simulated(folder.path());
    for (number, Refused { driver, rewrite, says }) in REFUSED.iter().enumerate() {
        let mut recording = simulated.clone();
        rewrite(&mut recording);
        let bag = recording.write(&folder.path().join(format!("{number}.mcap")));
        let failure = run(&bag, "", folder.path(), &recording).err().map(|one| one.to_string());
        let failure = failure.unwrap_or_else(|| panic!("{driver} is read"));
        println!("{driver}: {failure}");
        assert!(says.iter().all(|part| failure.contains(part)), "{driver}: {failure}");
    }
}

/// Runs a bag, and compares the mask of each cycle with what its image shows in truth.
fn run(
    bag: &Path,
    parameters: &str,
    folder: &Path,
    recording: &Recording,
) -> Result<Found, Failure> {
    let file = folder.join("parameters.yaml");
    let lines = format!("/**:\n  ros__parameters:\n    {OF_ALL}\n    {parameters}\n");
    std::fs::write(&file, lines).unwrap();
    let by_user =
        ParameterArgs { files: vec![file], map_edge: Some(MAP_EDGE_M), ..ParameterArgs::default() };
    let mut run = CycleRun::begin(bag, &TopicArgs::default(), &by_user, true)?;
    let ([mut moving, mut removed], [mut still, mut lost]) = ([0_usize; 2], [0_usize; 2]);
    let (mut with_zones, mut in_zone) = (0_usize, 0_usize);
    let mut is_going = true;
    while is_going {
        is_going = run.advance()?;
        while let Some(found) = run.next_found() {
            let moving_m = &found.segmented.dynamic_cloud.points_m;
            if !found.zones.is_empty() && !moving_m.is_empty() {
                with_zones += 1;
                in_zone += usize::from(moving_m.iter().any(|point| is_in(&found.zones, point)));
            }
            let depth = found.segmented.depth.as_ref().unwrap();
            let image = depth.frame().image();
            let truth = recording.labels_at(image.stamp);
            for (index, (&is_masked, &label)) in depth.is_moving().iter().zip(truth).enumerate() {
                let (column, row) = (index % image.width_px(), index / image.width_px());
                if image.depth_m(column, row).is_none() {
                    continue;
                }
                let (seen, masked) =
                    if label > 0 { (&mut moving, &mut removed) } else { (&mut still, &mut lost) };
                *seen += 1;
                *masked += usize::from(is_masked);
            }
        }
    }
    Ok(Found {
        removed: removed as f64 / moving as f64,
        lost: lost as f64 / still as f64,
        in_zone: in_zone as f64 / with_zones as f64,
        map_m: run.map().points.points_m,
    })
}

/// Whether a point of the rig lies in the direction of a zone.
fn is_in(zones: &[DynamicZone], point: &Point3<f32>) -> bool {
    let azimuth_rad = f64::from(point.y.atan2(point.x));
    zones.iter().any(|zone| (zone.azimuth_min_rad..=zone.azimuth_max_rad).contains(&azimuth_rad))
}
