use geometry::{CameraModel, Distortion, VoxelGrid};
use msgs::sensor_msgs::Image;
use msgs::std_msgs::Header;
use node_shell::{Host, RosArguments, Subscription};

use super::super::{Filter, FilterParameters, RawArrival};
use super::*;

fn stamp(milliseconds: i64) -> Stamp {
    Stamp::from_nanos((10_000 + milliseconds) * 1_000_000)
}

fn info(milliseconds: i64) -> RawArrival {
    let camera = CameraModel {
        width_px: 64,
        height_px: 48,
        fx_px: 60.0,
        fy_px: 60.0,
        cx_px: 31.5,
        cy_px: 23.5,
        distortion: Distortion::None,
    };
    let info = convert::message_from_camera(&camera, stamp(milliseconds), "camera");
    RawArrival::CameraInfo(Arc::new(info))
}

fn image(milliseconds: i64) -> RawArrival {
    let stamp = convert::time_from_stamp(stamp(milliseconds));
    let header = Header { stamp, ..Header::default() };
    RawArrival::Image(Arc::new(Image { header, ..Image::default() }))
}

/// The filter, and who takes depth images with their calibrations.
struct Graph {
    own: Node,
    filter: Filter,
    images: Option<Subscription<Image>>,
    infos: Subscription<CameraInfo>,
}

impl Graph {
    /// Images wait for 0.1 s.
    fn new() -> Self {
        Self::with(RosArguments::parse(["--ros-args"]).unwrap())
    }

    fn with(arguments: RosArguments) -> Self {
        let host = Host::in_process();
        let node = |name: &str| host.node(name, &arguments).unwrap();
        let (own, mapper) = (node("segmentation"), node("mapper"));
        let parameters =
            FilterParameters { static_depth_max_wait_s: 0.1, ..FilterParameters::default() };
        let mut filter = Filter::new(&own, &parameters, VoxelGrid::new(0.08).unwrap()).unwrap();
        let kept = Qos::reliable(100);
        let images = Some(mapper.subscription("static_depth/image", &kept).unwrap());
        let infos = mapper.subscription("static_depth/camera_info", &kept).unwrap();
        filter.follow_subscribers(&own).unwrap();
        Self { own, filter, images, infos }
    }

    fn take(&mut self, arrivals: impl IntoIterator<Item = RawArrival>) {
        for arrival in arrivals {
            self.filter.take(arrival);
        }
    }

    /// The milliseconds of the images and of the calibrations that have come.
    fn came(&self) -> (Vec<i64>, Vec<i64>) {
        let milliseconds = |header: &Header| {
            convert::stamp_from_time(header.stamp).as_nanos() / 1_000_000 - 10_000
        };
        let (mut images, mut infos) = (Vec::new(), Vec::new());
        while let Some(image) = self.images.as_ref().and_then(Subscription::try_next) {
            images.push(milliseconds(&image.message.header));
        }
        while let Some(info) = self.infos.try_next() {
            infos.push(milliseconds(&info.message.header));
        }
        (images, infos)
    }
}

/// Regression: calibrations went out at once, and who takes pairs of equal stamps had forgotten them when their images came: of 276
/// pairs 56 were lost with queues of 5, and 208 with queues of 2.
#[test]
fn an_image_that_waits_for_its_cycle_goes_out_with_its_calibration() {
    let mut graph = Graph::new();
    graph.take([info(0), image(0), info(33), image(33), image(66), info(66)]);
    assert_eq!(graph.came(), (vec![], vec![]));
    graph.take([info(100), image(100)]);
    assert_eq!(graph.came(), (vec![0], vec![0]));
    graph.take([info(133), info(166), image(166)]);
    assert_eq!(graph.came(), (vec![33, 66], vec![33, 66]));
    // The image of 133 was lost on the way, and the calibration of 200 is late.
    graph.take([image(200), image(300)]);
    assert_eq!(graph.came(), (vec![100, 166, 200], vec![100, 133, 166]));
    graph.take([info(200), info(300)]);
    assert_eq!(graph.came(), (vec![], vec![200]));
    graph.filter.give_up_waiting();
    assert_eq!(graph.came(), (vec![300], vec![300]));
}

#[test]
fn calibrations_go_out_where_no_images_come() {
    let mut graph = Graph::new();
    graph.take([info(0), info(200), info(301)]);
    assert_eq!(graph.came(), (vec![], vec![0]));
    // The time has jumped back.
    graph.take([info(-5_000)]);
    assert_eq!(graph.came(), (vec![], vec![200, 301]));
    graph.filter.give_up_waiting();
    assert_eq!(graph.came(), (vec![], vec![-5_000]));
    graph.take([info(400)]);
    // Images are not wanted any more.
    graph.images = None;
    graph.filter.follow_subscribers(&graph.own).unwrap();
    graph.take([info(433)]);
    assert_eq!(graph.came(), (vec![], vec![400, 433]));
}

/// The lens was taken out of the image, and the filtered topic's name does not say so.
#[test]
fn the_calibration_of_a_rectified_image_goes_out_as_that_of_a_raw_one() {
    let calibration = CameraInfo {
        width: 64,
        height: 48,
        distortion_model: "plumb_bob".to_owned(),
        d: vec![0.1, -0.2, 0.0, 0.0, 0.0],
        k: [60.0, 0.0, 31.5, 0.0, 60.0, 23.5, 0.0, 0.0, 1.0],
        p: [55.0, 0.0, 30.0, 0.0, 0.0, 56.0, 24.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraInfo::default()
    };
    for (topic, focal_px) in [("/camera/image_rect", 55.0), ("/camera/image_raw", 60.0)] {
        let remapping = format!("depth/image:={topic}");
        let mut graph = Graph::with(RosArguments::parse(["--ros-args", "-r", &remapping]).unwrap());
        graph.take([RawArrival::CameraInfo(Arc::new(calibration.clone()))]);
        graph.filter.give_up_waiting();
        let sent = graph.infos.try_next().unwrap().message;
        let is_raw = topic.ends_with("raw");
        assert_eq!((sent.k[0], sent.p), (focal_px, calibration.p), "{topic}");
        assert_eq!(sent.d == calibration.d, is_raw, "{topic}");
        let camera = graph.filter.calibration.camera().unwrap();
        assert_eq!((camera.fx_px, camera.distortion.is_none()), (focal_px, !is_raw), "{topic}");
    }
}
