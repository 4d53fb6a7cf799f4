use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, LaserScan, PointCloud2};

use super::*;

/// What is chosen among images and clouds beside a scanner, a calibration and a pose.
fn view(images: &[&str], clouds: &[&str]) -> Result<ViewTopics, String> {
    let beside = [
        ("/scan", LaserScan::TYPE_NAME),
        ("/pose", PoseStamped::TYPE_NAME),
        ("/camera_info", CameraInfo::TYPE_NAME),
    ];
    let images = images.iter().map(|topic| (*topic, Image::TYPE_NAME));
    let clouds = clouds.iter().map(|topic| (*topic, PointCloud2::TYPE_NAME));
    let offer = Offer::of_graph(beside.into_iter().chain(images).chain(clouds));
    let chosen = Inputs::choose_from(&TopicArgs::default(), &offer, PoseInput::Pose);
    chosen.map(|inputs| inputs.view).map_err(|failure| failure.to_string())
}

/// Regression: the only images of a bag were taken for depths, though they were of an infrared camera and there were clouds, too: its
/// brightness was mapped as millimetres.
#[test]
fn images_of_colour_and_infrared_are_no_depths() {
    let cloud = "/camera/depth/points";
    let points = Ok(ViewTopics::Points(cloud.to_owned()));
    for others in [
        &["/ir/image_raw"][..],
        &["/camera/color/image_raw"],
        &["/camera/rgb/image_raw", "/camera/infra1/image_rect_raw"],
        &["/image"],
    ] {
        assert_eq!(view(others, &[cloud]), points, "{others:?}");
    }
    let depth_of = |images: &[&str]| match view(images, &[cloud]) {
        Ok(ViewTopics::Depth { image, .. }) => image,
        other => panic!("{images:?}: {other:?}"),
    };
    let depth = "/camera/depth/image_rect_raw";
    assert_eq!(depth_of(&["/camera/color/image_raw", depth]), depth);
    assert_eq!(depth_of(&["/depth_to_rgb/image_raw"]), "/depth_to_rgb/image_raw");
    // A name that says nothing is that of the only images; one that says something else is none.
    assert!(matches!(view(&["/image"], &[]), Ok(ViewTopics::Depth { .. })));
    let said = view(&["/ir/image_raw"], &[]).unwrap_err();
    assert!(said.contains("no depth images: /ir/image_raw") && said.contains("--depth"), "{said}");
}
