//! Times the integration of recorded depth images, for comparison with other programs:
//! `integrate_frames FOLDER EDGE_M REPETITIONS [THREADS]`.
//!
//! The folder has `0000.depth.bin` (640 x 480 depths, 16 bits, millimetres, row by row) and `0000.pose.txt` (4 x 4, map from
//! optical frame), and so on. Prints one line of JSON: milliseconds of each image, preparation included, and the size of the map.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::fs;
use std::path::Path;
use std::time::Instant;

use estimation::executor::{Executor, ScopedThreads, Serial};
use geometry::{CameraModel, DepthFrame, DepthImage, DepthPixels, Distortion, Stamp};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion};
use volume::{
    DepthInput, DepthNoise, DepthRange, DepthView, MeshFollower, Occupancy, OccupancyConfig,
    PointRules, Surface, SurfaceConfig,
};

fn pose(text: &str) -> Isometry3<f64> {
    let m: Vec<f64> = text.split_whitespace().map(|number| number.parse().unwrap()).collect();
    let rotation = Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
    let rotation = Rotation3::from_matrix_unchecked(rotation);
    Isometry3::from_parts(
        Translation3::new(m[3], m[7], m[11]),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}

/// As many triangles as the node of the map has in a message.
const MESSAGE_TRIANGLES: usize = 1_000;

/// Farther from the camera there is neither a surface nor evidence.
const REACH_M: f64 = 6.0;

/// Every eighth pixel's point along each axis: about as many as a cloud has that was reduced to voxels of 8 cm.
fn points_of(frame: &DepthFrame, map_from_camera: &Isometry3<f64>) -> Vec<Point3<f64>> {
    let (depths_mm, camera) = (frame.depths_mm(), frame.camera());
    let pixels =
        (0..480).step_by(8).flat_map(|row| (0..640).step_by(8).map(move |column| (column, row)));
    let point = |(column, row): (usize, usize)| {
        let depth_m = f64::from(depths_mm[row * 640 + column]) / 1e3;
        let x = (column as f64 - camera.cx_px) / camera.fx_px;
        let y = (row as f64 - camera.cy_px) / camera.fy_px;
        (depth_m > 0.0 && depth_m <= REACH_M)
            .then(|| map_from_camera * Point3::new(x * depth_m, y * depth_m, depth_m))
    };
    pixels.filter_map(point).collect()
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let folder = Path::new(&arguments[0]);
    let (edge_m, repetitions): (f64, usize) =
        (arguments[1].parse().unwrap(), arguments[2].parse().unwrap());
    let threads = arguments.get(3).and_then(|threads| threads.parse().ok());
    let threads = threads.map(ScopedThreads::new);
    let executor: &dyn Executor = match &threads {
        Some(threads) if threads.threads().get() > 1 => threads,
        _ => &Serial,
    };
    let camera = CameraModel {
        width_px: 640,
        height_px: 480,
        fx_px: 525.0,
        fy_px: 525.0,
        cx_px: 319.5,
        cy_px: 239.5,
        distortion: Distortion::None,
    };
    let has_colour = std::env::var_os("COLOUR").is_some();
    let frames: Vec<(DepthFrame, Isometry3<f64>)> = (0..)
        .map_while(|index| {
            let bytes = fs::read(folder.join(format!("{index:04}.depth.bin"))).ok()?;
            let values = bytes.as_chunks::<2>().0.iter().map(|pair| u16::from_le_bytes(*pair));
            let pixels = DepthPixels::Millimetres(values.collect());
            let stamp = Stamp::default().plus_seconds(0.1 * f64::from(index));
            let text = fs::read_to_string(folder.join(format!("{index:04}.pose.txt"))).unwrap();
            let image = DepthImage::new(stamp, "camera".into(), (640, 480), pixels).unwrap();
            let mut frame = DepthFrame::new(image, camera).unwrap();
            if has_colour {
                frame = frame.with_colours(vec![[128; 3]; 640 * 480]).unwrap();
            }
            Some((frame, pose(&text)))
        })
        .collect();

    let range = DepthRange { min_m: 0.1, max_m: 6.0 };
    let mut view = DepthView::new(range, DepthNoise::default()).unwrap();
    let config = SurfaceConfig { edge_m, reach_m: REACH_M, has_colour, ..SurfaceConfig::default() };
    let mut surface = Surface::new(config).unwrap();
    let mut occupancy =
        Occupancy::new(OccupancyConfig { reach_m: REACH_M, ..Default::default() }).unwrap();
    let (mut ms, mut preparation, mut space) = (Vec::new(), Vec::new(), Vec::new());
    let (mut follower, mut mesh) = (MeshFollower::default(), Vec::new());
    let mut update = None;
    // The first images create the blocks of the room, which happens only once in a run.
    for (frame, map_from_camera) in frames.iter().cycle().take(repetitions.max(1) + 2) {
        let mut start = Instant::now();
        let mut lap_ms = || {
            let now = Instant::now();
            (now - std::mem::replace(&mut start, now)).as_secs_f64() * 1e3
        };
        view.fill(&DepthInput::new(frame, map_from_camera)).unwrap();
        let prepared_ms = lap_ms();
        update = Some(surface.integrate(&view, executor));
        ms.push(prepared_ms + lap_ms());
        occupancy.begin_cycle(frame.image().stamp);
        let grid = *occupancy.grid();
        let points = points_of(frame, map_from_camera);
        occupancy.integrate(&view, points.iter().map(|point| grid.key(point)));
        preparation.push(prepared_ms);
        space.push(lap_ms());
        follower.follow(&surface);
        while follower.waiting() > 0 {
            follower.take(&surface, PointRules::default(), MESSAGE_TRIANGLES);
        }
        mesh.push(lap_ms());
    }
    ms.drain(..2);
    // The minimum is the time on an idle machine.
    let of = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        let most = times[times.len() - 1];
        format!("{:.2} (least {:.2}, most {most:.2})", times[times.len() / 2], times[0])
    };
    let start = Instant::now();
    let points = surface.points(PointRules::default()).len();
    let points_ms = start.elapsed().as_secs_f64() * 1e3;
    let triangles = surface.mesh(PointRules::default()).triangles.len();
    let update = update.unwrap();
    println!(
        "{{\"ms\": {ms:.3?}, \"note\": \"{} blocks compared of {}, {:.1} MB; preparation {} ms; {points} points in \
         {points_ms:.1} ms; occupancy at 8 cm {} ms more; the mesh of what has changed {} ms, of {triangles} triangles\"}}",
        update.compared_blocks,
        surface.blocks(),
        surface.memory_bytes() as f64 / 1e6,
        of(&mut preparation),
        of(&mut space),
        of(&mut mesh),
    );
}
