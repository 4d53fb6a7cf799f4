//! The latest cycle as the page shows it: the sensors' readings, what moves in them, the tracks, where the rig is.

use geometry::{DetectedCycle, Scan, SegmentedCycle, Track};
use report::payload::{self, pose, push_cloud, push_depth, push_scan, rounded, zone};
use report::{RigCamera, ScanView, SmallDepth, cloud_steps};
use serde_json::json;

use crate::message::{Kind, message};

/// What is known of one cycle.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// What segmentation made of it.
    pub segmented: &'a SegmentedCycle,
    /// What detection made of it; absent where it was lost on its way.
    pub detected: Option<&'a DetectedCycle>,
    /// The scan of the cycle, or the latest one.
    pub scan: Option<&'a Scan>,
    /// What moves, in the map frame.
    pub tracks: &'a [Track],
    /// Points of the map that is shown.
    pub map_points: usize,
}

/// The message about a cycle: JSON with its length in front of it, then scan, cloud and depth image as the report has them.
#[must_use]
pub fn of_moment(moment: &Moment<'_>) -> Vec<u8> {
    let Moment { segmented, detected, scan, tracks, map_points } = moment;
    let mounts = &segmented.setup.mounts;
    let frame = segmented.depth.as_ref().map(|depth| depth.frame());
    let camera = frame
        .map(|frame| RigCamera { model: *frame.camera(), rig_from_camera: mounts.rig_from_camera });
    let places: Vec<[f64; 4]> = tracks
        .iter()
        .map(|track| {
            let at_m = track.position_m;
            [f64::from(track.id), rounded(at_m.x), rounded(at_m.y), rounded(at_m.z)]
        })
        .collect();
    let zones = detected.map_or(&[][..], |cycle| &cycle.zones);
    let dynamic = segmented.dynamic_cloud.points_m.len();
    let reduced = segmented.static_cloud.points_m.len() + dynamic;
    let json = json!({
        "index": segmented.index,
        "t_s": segmented.static_cloud.stamp.as_nanos() as f64 * 1e-9,
        "frame": segmented.static_cloud.frame_id,
        "pose": pose(&segmented.map_from_rig),
        "zones": zones.iter().map(zone).collect::<Vec<_>>(),
        "tracks": places,
        "counts": {
            "before": detected.map(|cycle| cycle.points_before_reduction), "reduced": reduced,
            "dynamic": dynamic, "map": map_points,
        },
        "rig": {
            "camera": camera.as_ref().map(payload::camera), "rig_from_lidar": pose(&mounts.rig_from_lidar),
        },
    })
    .to_string();
    let mut body = Vec::new();
    body.extend((json.len() as u32).to_le_bytes());
    body.extend(json.as_bytes());
    push_scan(&mut body, scan.map(ScanView::from).as_ref());
    push_clouds(&mut body, segmented);
    let small = frame.map(|frame| SmallDepth::from(&**frame));
    push_depth(&mut body, small.as_ref(), |pixel| is_moving(segmented, small.as_ref(), pixel));
    message(Kind::Moment, &body)
}

/// Both parts of the cloud in the rig's frame.
fn push_clouds(body: &mut Vec<u8>, segmented: &SegmentedCycle) {
    let rig_from_map = segmented.map_from_rig.inverse().cast::<f32>();
    let fixed = &segmented.static_cloud.points_m;
    let fixed: Vec<[i16; 3]> =
        fixed.iter().filter_map(|point_m| cloud_steps(&(rig_from_map * point_m))).collect();
    let moving: Vec<[i16; 3]> =
        segmented.dynamic_cloud.points_m.iter().filter_map(cloud_steps).collect();
    push_cloud(body, &fixed, &moving);
}

/// Whether a pixel of the small image moves: that of the whole image.
fn is_moving(segmented: &SegmentedCycle, small: Option<&SmallDepth>, pixel: usize) -> bool {
    let (Some(depth), Some(small)) = (&segmented.depth, small) else { return false };
    let (column, row) = (pixel % small.columns, pixel / small.columns);
    let width_px = depth.frame().image().width_px();
    let whole = row * small.pixel_step * width_px + column * small.pixel_step;
    depth.is_moving().get(whole).copied().unwrap_or(false)
}
