use bag_player::{Bag, Selection};
use clap::Parser;
use msgs::convert::depth_from_message;
use msgs::sensor_msgs::Image;

use super::*;
use crate::sensor_bag::DEPTH;

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    tum: TumArgs,
}

/// The bag of a folder with one depth image of this size, whose pixels are 1000.
fn imported(
    folder: &Path,
    (width_px, height_px): (u32, u32),
    more: &[&str],
) -> Result<Bag, String> {
    let pixel = image::Luma([1000_u16]);
    let depth = image::ImageBuffer::from_pixel(width_px, height_px, pixel);
    std::fs::create_dir_all(folder).unwrap();
    depth.save(folder.join("0.png")).unwrap();
    std::fs::write(folder.join(DEPTH_LIST), "100.0 0.png\n").unwrap();
    let (folder, bag) = (folder.display().to_string(), folder.join("bag.mcap"));
    let to = bag.display().to_string();
    let line = [&["import", folder.as_str(), "--overwrite", "-o", &to], more].concat();
    import(&Line::parse_from(line).tum, &Interrupt::default())
        .map_err(|error| error.to_string())?;
    Ok(Bag::open(&bag).unwrap())
}

fn depth_m(bag: &Bag) -> Option<f32> {
    let topics = Some(vec![DEPTH.to_owned()]);
    let mut messages = bag.messages(&Selection { topics, ..Selection::default() }).unwrap();
    let image: Image = messages.next().unwrap().unwrap().decode().unwrap();
    depth_from_message(&image).unwrap().depth_m(0, 0)
}

/// Regression: depth images of 1000 units to the metre were read as of 5000, and a path of 1.07 m became 0.17 m long.
#[test]
fn depth_units_are_those_that_are_given() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("freiburg3");
    let of = |more: &[&str]| depth_m(&imported(&path, (640, 480), more).unwrap());
    assert_eq!((of(&[]), of(&["--units-per-metre", "1000"])), (Some(0.2), Some(1.0)));
}

/// Regression: a folder with the name of the benchmark's camera and images of half its size became a bag with a wrong calibration.
#[test]
fn a_calibration_of_larger_images_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("freiburg3");
    let refused = |more: &[&str]| imported(&path, (320, 240), more).err().unwrap_or_default();
    let by_name = refused(&[]);
    assert!(by_name.contains("320 x 240 pixels: the optical centre cx = 320.1 px"), "{by_name}");
    assert!(by_name.contains("--intrinsics"), "{by_name}");
    assert!(!path.join("bag.mcap").exists());
    assert!(refused(&["--intrinsics", "525,525,319.5,239.5"]).is_empty());
    assert!(!refused(&["--intrinsics", "525,525,325,247"]).is_empty());
    assert!(imported(&path, (320, 240), &["--intrinsics", "262,262,159.5,119.5"]).is_ok());
}
