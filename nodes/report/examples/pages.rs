//! Writes report pages of runs that are made up into a folder, for the tests of the page in a browser (`page/test.sh`).
//!
//! `room.html` is of a small room that a person crosses, `hostile.html` the same with names that are markup, `coloured.html` the same
//! with the colours of a camera and a ceiling, `meshed.html` has the floor as triangles, too, more than its page carries, `large.html` has ten million points.

#![allow(clippy::print_stdout, reason = "a program of the tests")]

use std::error::Error;
use std::f32::consts::{PI, TAU};
use std::path::Path;

use geometry::{
    CameraModel, Distortion, DynamicZone, RigConfig, Scan, SegmentationCounts, Stamp, TriangleMesh,
    VoxelGrid, ZoneSource,
};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use report::{
    CycleRecord, CycleView, DropCount, PageLimits, RigCamera, RunRecord, ScanView, SmallDepth,
    Summary, cloud_steps, report_html_within,
};

const CYCLES: u32 = 40;
const PERIOD_S: f64 = 0.2;
/// Half the room's edges, and its height.
const ROOM_M: [f32; 3] = [3.0, 2.5, 2.4];
const RIG_HEIGHT_M: f32 = 1.0;
const EDGE_M: f64 = 0.08;
/// Cells along an edge of the floor, of two triangles each, and the triangles that a page carries at most.
const FLOOR_CELLS: u32 = 100;
const TRIANGLES: usize = 15_000;
const LARGE_POINTS: usize = 10_000_000;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("give a folder")?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let room = room();
    write(folder, "room.html", &room)?;
    let markup = "<script>document.title='taken'</script>\"'><img src=x onerror=document.title='taken'></script><!--";
    let name = format!("{markup}{}", "x".repeat(10_000 - markup.len()));
    let drops = vec![DropCount { topic_or_stage: name.clone(), reason: name.clone(), count: 1 }];
    let hostile = RunRecord {
        bag_name: name.clone(),
        map_frame_id: name.clone(),
        method: name,
        drops,
        ..room.clone()
    };
    write(folder, "hostile.html", &hostile)?;
    let under_ceiling: Vec<_> = room.static_map.iter().copied().chain(ceiling(8_000)).collect();
    let colours = under_ceiling.iter().map(wall_colour).collect();
    let coloured = RunRecord { map_colours: colours, static_map: under_ceiling, ..room.clone() };
    write(folder, "coloured.html", &coloured)?;
    let meshed = RunRecord { mesh: Some(floor()), ..room.clone() };
    write(folder, "meshed.html", &meshed)?;
    write(folder, "large.html", &RunRecord { static_map: walls(LARGE_POINTS), ..room })?;
    Ok(())
}

fn write(folder: &Path, name: &str, run: &RunRecord) -> Result<(), Box<dyn Error>> {
    let summary = Summary::of_run(run, None, false)?;
    let limits =
        PageLimits { map_points: usize::MAX, triangles: TRIANGLES, ..PageLimits::default() };
    let page = report_html_within(run, &summary, &limits)?;
    println!("{name}: {} bytes", page.len());
    Ok(std::fs::write(folder.join(name), page)?)
}

/// A room whose walls and floor the rig sees while it turns on the spot, and a person who crosses it.
fn room() -> RunRecord {
    let map = walls(40_000);
    let grid = VoxelGrid::new(EDGE_M).unwrap_or_else(|error| unreachable!("{error}"));
    let cycles: Vec<CycleRecord> = (0..CYCLES).map(cycle).collect();
    let removed = cycles.iter().flat_map(|cycle| {
        let map_from_rig: Isometry3<f32> = cycle.map_from_rig.cast();
        cycle.dynamic_points_m.iter().map(move |point| map_from_rig * point)
    });
    // A few points that no map holds: noise near the wall, and in the air.
    let noise = (0..200).map(|n| {
        let [across, up] = [golden(n, 0), golden(n, 1)];
        Point3::new((across - 0.5) * 4.0, ROOM_M[1] - 0.1 - 0.4 * up, 2.0 * up)
    });
    let unfiltered =
        grid.reduce(&map.iter().copied().chain(removed).chain(noise).collect::<Vec<_>>());
    let RigCamera { model, rig_from_camera } = camera();
    RunRecord {
        bag_name: "room.mcap".to_owned(),
        method: "free_space".to_owned(),
        voxel_edge_m: EDGE_M,
        map_edge_m: Some(0.02),
        camera: Some(model),
        rig_from_lidar: RigConfig::default().mounts().rig_from_lidar,
        rig_from_camera: Some(rig_from_camera),
        map_frame_id: "map".to_owned(),
        cycles,
        static_map: map,
        unfiltered_map: unfiltered,
        ..RunRecord::default()
    }
}

/// Points spread evenly on the walls, the floor and a table.
fn walls(count: usize) -> Vec<Point3<f32>> {
    let [x_m, y_m, height_m] = ROOM_M;
    (0..count)
        .map(|n| {
            let (across, up) = (golden(n, 0) * 2.0 - 1.0, golden(n, 1));
            match n % 8 {
                0..3 => Point3::new(across * x_m, (2.0 * up - 1.0) * y_m, 0.0),
                3 => Point3::new(x_m, across * y_m, up * height_m),
                4 => Point3::new(-x_m, across * y_m, up * height_m),
                5 => Point3::new(across * x_m, y_m, up * height_m),
                6 => Point3::new(across * x_m, -y_m, up * height_m),
                _ => Point3::new(1.5 + 0.4 * across, -1.5 + 0.5 * up, 0.75),
            }
        })
        .collect()
}

/// Points spread evenly on a ceiling over the walls.
fn ceiling(count: usize) -> impl Iterator<Item = Point3<f32>> {
    let [x_m, y_m, height_m] = ROOM_M;
    (0..count).map(move |n| {
        Point3::new((golden(n, 0) * 2.0 - 1.0) * x_m, (golden(n, 1) * 2.0 - 1.0) * y_m, height_m)
    })
}

/// The floor as triangles.
fn floor() -> TriangleMesh {
    let row = FLOOR_CELLS + 1;
    let along = |n: u32, half_m: f32| (2.0 * n as f32 / FLOOR_CELLS as f32 - 1.0) * half_m;
    let at = |n: u32| Point3::new(along(n % row, ROOM_M[0]), along(n / row, ROOM_M[1]), 0.01);
    let cell = |x: u32, y: u32| {
        let [here, above] = [y * row + x, (y + 1) * row + x];
        [[here, here + 1, above], [here + 1, above + 1, above]]
    };
    let cells = (0..FLOOR_CELLS).flat_map(|x| (0..FLOOR_CELLS).map(move |y| (x, y)));
    TriangleMesh {
        points_m: (0..row * row).map(at).collect(),
        triangles: cells.flat_map(|(x, y)| cell(x, y)).collect(),
        ..TriangleMesh::default()
    }
}

/// A red and a blue half of the room under a white ceiling; no colour was seen of the far corner.
fn wall_colour(point_m: &Point3<f32>) -> [u8; 3] {
    if point_m.z >= ROOM_M[2] {
        return [240; 3];
    }
    match (point_m.x > 2.5 && point_m.y > 2.0, point_m.y > 0.0) {
        (true, _) => geometry::NO_COLOUR,
        (_, true) => [220, 40, 30],
        (_, false) => [30, 60, 230],
    }
}

/// Numbers of 0 to 1 that fill it evenly.
fn golden(n: usize, axis: usize) -> f32 {
    let step = [0.754_877_666_246_693, 0.569_840_290_998_053][axis];
    (n as f64 * step).fract() as f32
}

fn camera() -> RigCamera {
    let model = CameraModel {
        width_px: 160,
        height_px: 120,
        fx_px: 145.0,
        fy_px: 145.0,
        cx_px: 79.5,
        cy_px: 59.5,
        distortion: Distortion::None,
    };
    RigCamera { model, rig_from_camera: RigConfig::default().mounts().rig_from_camera }
}

fn cycle(index: u32) -> CycleRecord {
    let share = index as f32 / (CYCLES - 1) as f32;
    let yaw_rad = (share - 0.5) * PI;
    let map_from_rig = Isometry3::from_parts(
        Vector3::new(-0.5 + share, 0.0, RIG_HEIGHT_M).into(),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad),
    );
    let person_m = Point3::new(1.6, 1.5 - 3.0 * share, 0.0);
    let rig_from_map = map_from_rig.inverse();
    let body = (0..300).map(|n| {
        let (around_rad, up) = (golden(n, 0) * TAU, golden(n, 1));
        rig_from_map
            * Point3::new(
                person_m.x + 0.2 * around_rad.cos(),
                person_m.y + 0.2 * around_rad.sin(),
                1.75 * up,
            )
    });
    let is_ahead = |point: &Point3<f32>| point.x > 0.3 && point.y.abs() < 0.55 * point.x;
    let dynamic: Vec<Point3<f32>> = body.filter(is_ahead).collect();
    let fixed = walls(9000).into_iter().map(|point| rig_from_map * point).filter(is_ahead);
    let cloud: Vec<[i16; 3]> =
        fixed.chain(dynamic.iter().copied()).filter_map(|point| cloud_steps(&point)).collect();
    let stamp = Stamp::default().plus_seconds(f64::from(index) * PERIOD_S);
    let person_in_rig = rig_from_map * person_m;
    let azimuth_rad = f64::from(person_in_rig.y.atan2(person_in_rig.x));
    let range_m = person_in_rig.coords.xy().norm();
    let zone = DynamicZone {
        azimuth_min_rad: azimuth_rad - 0.2,
        azimuth_max_rad: azimuth_rad + 0.2,
        peak_std_dev_m: 0.5,
        source: if index % 5 == 4 { ZoneSource::Held { cycles: 1 } } else { ZoneSource::Measured },
        returns: Some(geometry::ReturnSpan { nearest_m: range_m - 0.2, farthest_m: range_m + 0.2 }),
    };
    let view = CycleView {
        scan: Some(ScanView::from(&scan(&map_from_rig, &person_m))),
        depth: Some(depth(&map_from_rig, &person_m)),
        cloud: cloud.clone(),
    };
    let zones = if (5..35).contains(&index) { vec![zone] } else { Vec::new() };
    CycleRecord {
        index,
        scan_stamp: stamp,
        cloud_stamp: stamp,
        map_from_rig: map_from_rig.cast(),
        points_in: 19_200,
        counts: SegmentationCounts {
            reduced: cloud.len(),
            in_zone: 2 * dynamic.len(),
            dynamic: dynamic.len(),
        },
        map_points: 5000 + 800 * index as usize,
        dynamic_points_m: dynamic,
        tracks_m: [(3, person_m.cast() + Vector3::new(0.0, 0.0, 0.9))].into(),
        zones,
        view: Some(view),
        ..CycleRecord::default()
    }
}

/// How far it is from a place along a direction to the room's walls, or the person's body.
fn range_m(from: &Point3<f32>, direction: &Vector3<f32>, person: &Point3<f32>) -> f32 {
    let mut nearest_m = f32::INFINITY;
    for (axis, half_m) in [(0, ROOM_M[0]), (1, ROOM_M[1])] {
        let towards_m = half_m.copysign(direction[axis]);
        nearest_m = nearest_m.min((towards_m - from[axis]) / direction[axis]);
    }
    if direction.z < 0.0 {
        nearest_m = nearest_m.min(-from.z / direction.z);
    }
    let [offset, flat] = [from.coords - person.coords, *direction].map(|vector| vector.xy());
    let (a, b, c) = (flat.dot(&flat), offset.dot(&flat), offset.dot(&offset) - 0.04);
    let body_m = (-b - (b * b - a * c).max(0.0).sqrt()) / a;
    let hits = b * b > a * c && body_m > 0.0 && from.z + body_m * direction.z < 1.75;
    if hits { nearest_m.min(body_m) } else { nearest_m }
}

fn scan(map_from_rig: &Isometry3<f32>, person: &Point3<f32>) -> Scan {
    let step_rad = TAU / 360.0;
    let at = map_from_rig.translation.vector.into();
    let range = |beam: usize| {
        let azimuth_rad = -PI + beam as f32 * step_rad;
        let direction = Vector3::new(azimuth_rad.cos(), azimuth_rad.sin(), 0.0);
        range_m(&at, &(map_from_rig.rotation * direction), person)
    };
    Scan {
        angle_min_rad: -PI,
        angle_increment_rad: step_rad,
        range_min_m: 0.1,
        range_max_m: 12.0,
        ranges_m: (0..360).map(range).collect(),
        ..Scan::default()
    }
}

fn depth(map_from_rig: &Isometry3<f32>, person: &Point3<f32>) -> SmallDepth {
    let RigCamera { model, rig_from_camera } = camera();
    let rotation = map_from_rig.rotation * rig_from_camera.rotation.cast::<f32>();
    let at = map_from_rig.translation.vector.into();
    let depth_mm = |pixel: usize| {
        let (column, row) = ((pixel % model.width_px) as f32, (pixel / model.width_px) as f32);
        let ray = Vector3::new((column - 79.5) / 145.0, (row - 59.5) / 145.0, 1.0);
        // The ray is one metre long along the optical axis, so that the range in rays is the depth.
        let depth_m = range_m(&at, &(rotation * ray), person);
        if pixel.is_multiple_of(97) { 0 } else { (depth_m * 1e3) as u16 }
    };
    let depths_mm = (0..model.width_px * model.height_px).map(depth_mm).collect();
    SmallDepth { columns: model.width_px, rows: model.height_px, pixel_step: 1, depths_mm }
}
