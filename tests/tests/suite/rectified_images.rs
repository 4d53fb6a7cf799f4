//! Images whose lens was taken out before they were recorded, beside the calibration of the raw ones.

use std::path::{Path, PathBuf};

use geometry::Stamp;
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, Image, LaserScan};

use crate::bags::{bag_of, messages_of, small_room};
use crate::local_run::files_of;
use crate::program::{succeed, summary};

/// The calibration of the raw image, of a wide lens: what the recording was made with is that of the rectified one.
fn of_raw_image((stamp, info): (Stamp, CameraInfo)) -> (Stamp, CameraInfo) {
    let mut raw = info.clone();
    let [fx, _, cx, _, fy, cy, ..] = info.k;
    raw.p = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0];
    raw.d = vec![-0.25, 0.08, 0.0, 0.0, 0.0];
    raw.k[0] = 0.9 * fx;
    raw.k[4] = 0.9 * fy;
    raw.k[2] = cx + 4.0;
    (stamp, raw)
}

/// The small room with its depth images on `/camera/depth/NAME`.
fn bag(
    folder: &Path,
    name: &str,
    calibration: fn((Stamp, CameraInfo)) -> (Stamp, CameraInfo),
) -> PathBuf {
    let room = small_room(folder);
    let infos = messages_of::<CameraInfo>(&room, "/camera/depth/camera_info");
    let images = messages_of::<Image>(&room, "/camera/depth/image_raw");
    bag_of(folder, &format!("{name}.mcap"), |topics| {
        topics.messages("/scan", messages_of::<LaserScan>(&room, "/scan"));
        topics.messages("/pose", messages_of::<PoseStamped>(&room, "/pose"));
        topics.messages("/camera/depth/camera_info", infos.into_iter().map(calibration));
        topics.messages(&format!("/camera/depth/{name}"), images);
    })
}

/// Regression: `D` was applied to an image that has no distortion any more, and its focal lengths were those of the raw one.
#[test]
fn the_map_of_rectified_images_is_that_of_a_camera_without_a_lens_on_either_transport() {
    let folder = tempfile::tempdir().unwrap();
    let run = |bag: &Path, transport: &str| {
        let out = bag.with_extension(transport);
        let (bag, out_name) = (bag.to_str().unwrap(), out.to_str().unwrap());
        succeed(["run", bag, "--transport", transport, "--map-edge", "0.03", "--out", out_name]);
        assert_eq!(summary(&out)["drops"], serde_json::json!([]), "{bag} {transport}");
        files_of(&out)["map.ply"].clone()
    };
    let without_lens = run(&bag(folder.path(), "image_of_no_lens", |info| info), "local");
    let rectified = bag(folder.path(), "image_rect_raw", of_raw_image);
    for transport in ["local", "dds"] {
        assert!(run(&rectified, transport) == without_lens, "{transport}: the maps differ");
    }
    // The same messages as those of a raw image: the lens is applied.
    let raw = bag(folder.path(), "image_raw", of_raw_image);
    let of_raw = run(&raw, "local");
    assert!(of_raw != without_lens);
    assert!(run(&raw, "dds") == of_raw, "the maps of the raw images differ");
}
