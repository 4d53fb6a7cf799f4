use geometry::{
    Cloud, CycleSetup, DepthImage, DepthPixels, DetectedCycle, Distortion, MaskedDepth,
    SegmentationCounts, SegmentedCycle, Stamp, VoxelGrid,
};
use msgs::sensor_msgs::{CameraInfo, PointCloud2};
use nalgebra::{Isometry3, Point3};
use node_shell::{Host, Publisher, RosArguments, Subscription};

use super::super::{FilterParameters, RawArrival};
use super::*;
use crate::Segmented;
use crate::filter::Verdict;

const SIZE_PX: (usize, usize) = (64, 48);

fn camera() -> CameraModel {
    let (width_px, height_px) = SIZE_PX;
    CameraModel {
        width_px,
        height_px,
        fx_px: 60.0,
        fy_px: 60.0,
        cx_px: 31.5,
        cy_px: 23.5,
        distortion: Distortion::None,
    }
}

fn stamp(milliseconds: i64) -> Stamp {
    Stamp::from_nanos((1_000 + milliseconds) * 1_000_000)
}

/// An object in the middle of the image, before a wall.
fn is_object(pixel: usize) -> bool {
    (24..40).contains(&(pixel % SIZE_PX.0)) && (16..32).contains(&(pixel / SIZE_PX.0))
}

fn depth(milliseconds: i64) -> DepthImage {
    let pixels = SIZE_PX.0 * SIZE_PX.1;
    let depths_mm = (0..pixels).map(|pixel| if is_object(pixel) { 1500 } else { 3000 }).collect();
    let pixels = DepthPixels::Millimetres(depths_mm);
    DepthImage::new(stamp(milliseconds), "camera".to_owned(), SIZE_PX, pixels).unwrap()
}

/// The same without the object.
fn wall(milliseconds: i64) -> DepthImage {
    let pixels = DepthPixels::Millimetres(vec![3000; SIZE_PX.0 * SIZE_PX.1]);
    DepthImage::new(stamp(milliseconds), "camera".to_owned(), SIZE_PX, pixels).unwrap()
}

fn info() -> Arc<CameraInfo> {
    Arc::new(convert::message_from_camera(&camera(), stamp(0), "camera"))
}

fn colour(milliseconds: i64, encoding: &str, pixel_bytes: usize) -> Arc<Image> {
    let (width, height) = (SIZE_PX.0 as u32, SIZE_PX.1 as u32);
    let header = convert::header_of(stamp(milliseconds), "camera_rgb_optical_frame");
    Arc::new(Image {
        header,
        width,
        height,
        encoding: encoding.to_owned(),
        is_bigendian: 0,
        step: width * pixel_bytes as u32,
        data: vec![200; SIZE_PX.0 * SIZE_PX.1 * pixel_bytes],
    })
}

/// A cycle that found the object, which stands at the moment.
fn verdict(milliseconds: i64) -> Verdict {
    let stamp = stamp(milliseconds);
    let setup = CycleSetup::default();
    let ahead = (-3..4).flat_map(|y| (-3..4).map(move |z| (y, z)));
    let points_m: Vec<Point3<f32>> =
        ahead.map(|(y, z)| Point3::new(1.5, 0.06 * y as f32, 0.06 * z as f32)).collect();
    let cloud = |frame_id: &str, points_m| Cloud { stamp, frame_id: frame_id.to_owned(), points_m };
    let detected = DetectedCycle {
        index: 0,
        setup,
        scan_stamp: stamp,
        voxel_points: vec![1; points_m.len()],
        reduced_cloud: cloud("rig", points_m.clone()),
        points_before_reduction: points_m.len(),
        map_from_rig: Isometry3::identity(),
        map_from_continuous: None,
        map_frame_id: "map".to_owned(),
        zones: Vec::new(),
        moving_beams: Vec::new(),
        depth: None,
        scan_rays: Arc::default(),
    };
    let segmented = Segmented {
        cycle: SegmentedCycle {
            index: 0,
            setup,
            static_cloud: cloud("map", Vec::new()),
            dynamic_cloud: cloud("rig", points_m),
            map_from_rig: Isometry3::identity(),
            depth: None::<MaskedDepth>,
            scan_rays: Arc::default(),
            retracted_m: Vec::new(),
        },
        tracks: Vec::new(),
        counts: SegmentationCounts::default(),
        floor_in_rig: None,
    };
    Verdict::of(&detected, &segmented)
}

/// The filter, with who takes its colour images and the drivers.
struct Graph {
    own: Node,
    filter: Filter,
    mapper: Node,
    statics: Subscription<Image>,
    _drivers: Vec<Publisher<Image>>,
}

impl Graph {
    fn new(parameters: &FilterParameters) -> Self {
        let arguments = RosArguments::parse(["--ros-args"]).unwrap();
        let host = Host::in_process();
        let node = |name: &str| host.node(name, &arguments).unwrap();
        let (own, mapper, driver) = (node("segmentation"), node("mapper"), node("driver"));
        let drivers = ["depth/image", "rgb/image"]
            .map(|topic| driver.publisher(topic, &Qos::sensor(1)).unwrap());
        let mut filter = Filter::new(&own, parameters, VoxelGrid::new(0.08).unwrap()).unwrap();
        let statics = mapper.subscription("static_rgb/image", &Qos::reliable(100)).unwrap();
        filter.follow_subscribers(&own).unwrap();
        Self { own, filter, mapper, statics, _drivers: drivers.into() }
    }

    /// With both calibrations, and a cycle.
    fn running() -> Self {
        let mut graph = Self::new(&FilterParameters::default());
        graph.filter.take(RawArrival::CameraInfo(info()));
        graph.filter.take(RawArrival::ColourInfo(info()));
        graph.filter.take_verdict(verdict(0));
        graph
    }

    fn depth(&mut self, milliseconds: i64) {
        let message = convert::message_from_depth(&depth(milliseconds));
        self.filter.take(RawArrival::Image(Arc::new(message)));
    }

    fn colour(&mut self, milliseconds: i64) {
        self.filter.take(RawArrival::Colour(colour(milliseconds, "rgb8", 3)));
    }

    /// The stamps of what has come, and whether it is black where the object is.
    fn came(&self) -> Vec<(Stamp, bool)> {
        let mut came = Vec::new();
        while let Some(received) = self.statics.try_next() {
            let stamp = convert::stamp_from_time(received.message.header.stamp);
            let black = |pixel: usize| received.message.data[3 * pixel..][..3] == [0; 3];
            let object: Vec<bool> =
                (0..SIZE_PX.0 * SIZE_PX.1).filter(|pixel| is_object(*pixel)).map(black).collect();
            assert_eq!(object.contains(&true), !object.contains(&false));
            assert!(received.message.data[..3] == [200; 3]);
            came.push((stamp, object[0]));
        }
        came
    }
}

#[test]
fn a_colour_image_waits_for_the_depth_image_of_its_moment_or_a_later_one() {
    let mut graph = Graph::running();
    graph.depth(10);
    graph.colour(10);
    assert_eq!(graph.came(), [(stamp(10), true)]);
    graph.colour(43);
    graph.colour(76);
    assert_eq!(graph.came(), []);
    graph.depth(43);
    assert_eq!(graph.came(), [(stamp(43), true)]);
    graph.depth(90);
    assert_eq!(graph.came(), [(stamp(76), true)]);
}

#[test]
fn each_colour_image_of_several_has_its_own_depth_image_where_these_waited_for_their_cycle() {
    let parameters =
        FilterParameters { static_depth_max_wait_s: 1.0, ..FilterParameters::default() };
    let mut graph = Graph::new(&parameters);
    graph.filter.take(RawArrival::CameraInfo(info()));
    graph.filter.take(RawArrival::ColourInfo(info()));
    // More than are kept; the object is in the first ones.
    let times: Vec<i64> = (0..14).map(|image| 10 + 33 * image).collect();
    for milliseconds in &times {
        let depth = if *milliseconds < 100 { depth(*milliseconds) } else { wall(*milliseconds) };
        let message = convert::message_from_depth(&depth);
        graph.filter.take(RawArrival::Image(Arc::new(message)));
        graph.colour(*milliseconds);
    }
    assert_eq!(graph.came(), []);
    let (last, decided) = times.split_last().unwrap();
    graph.filter.take_verdict(verdict(last - 1));
    let expected: Vec<(Stamp, bool)> =
        decided.iter().map(|time| (stamp(*time), *time < 100)).collect();
    assert_eq!(graph.came(), expected);
    graph.filter.give_up_waiting();
    assert_eq!(graph.came(), [(stamp(*last), false)]);
}

#[test]
fn a_depth_camera_that_stops_does_not_stop_the_colours() {
    let mut graph = Graph::running();
    graph.depth(10);
    graph.colour(10);
    assert_eq!(graph.came().len(), 1);
    for milliseconds in (50..2_000).step_by(50) {
        graph.colour(milliseconds);
        let waiting = i64::try_from((LATEST_DEPTH_S * 1e3) as u64).unwrap();
        let due = stamp(milliseconds - waiting);
        // Beyond a second nothing is known of what moves.
        let expected =
            (milliseconds - waiting >= 50).then(|| (due, milliseconds - waiting <= 1_000));
        assert_eq!(graph.came(), expected.into_iter().collect::<Vec<_>>(), "{milliseconds}");
    }
    graph.filter.give_up_waiting();
    assert_eq!(graph.came().len(), 4);
}

#[test]
fn images_whose_calibration_never_comes_do_not_fill_the_memory() {
    let mut graph = Graph::new(&FilterParameters::default());
    graph.filter.take(RawArrival::CameraInfo(info()));
    graph.filter.take_verdict(verdict(0));
    for image in 0..COLOURS_WAITING as i64 {
        graph.colour(image);
    }
    assert_eq!(graph.came(), []);
    graph.colour(COLOURS_WAITING as i64);
    assert_eq!(graph.came(), [(stamp(0), false)]);
    graph.filter.take(RawArrival::ColourInfo(info()));
    graph.depth(100);
    assert_eq!(graph.came().len(), COLOURS_WAITING);
}

/// Those of before waited for depth images of before, and of those after nothing is known yet.
#[test]
fn where_the_time_jumps_back_what_waits_goes_out() {
    let mut graph = Graph::running();
    graph.colour(500);
    assert_eq!(graph.came(), []);
    graph.colour(-5_000);
    assert_eq!(graph.came(), [(stamp(500), true), (stamp(-5_000), false)]);
}

#[test]
fn images_that_cannot_be_masked_pass_once_as_they_are() {
    let mut graph = Graph::running();
    let dynamics: Subscription<Image> =
        graph.mapper.subscription("dynamic_rgb/image", &Qos::reliable(10)).unwrap();
    graph.filter.follow_subscribers(&graph.own).unwrap();
    let own = colour(0, "rgb8", 3);
    let planar = colour(0, "nv21", 1);
    let (width, height) = (own.height, own.width);
    let turned = Arc::new(Image { width, height, step: 3 * width, ..(*own).clone() });
    let cut = Arc::new(Image { data: own.data[..100].to_vec(), ..(*own).clone() });
    let narrow = Arc::new(Image { step: 10, ..(*own).clone() });
    let empty = Arc::new(Image { width: 0, height: 0, data: Vec::new(), ..(*own).clone() });
    for (index, image) in [planar, turned, cut, narrow, empty].into_iter().enumerate() {
        graph.depth(10 + index as i64);
        graph.filter.take(RawArrival::Colour(Arc::clone(&image)));
        assert!(Arc::ptr_eq(&graph.statics.try_next().unwrap().message, &image), "{image:?}");
        assert!(graph.statics.try_next().is_none());
    }
    assert!(dynamics.try_next().is_none());
    // What moves alone, of one that can.
    graph.filter.take(RawArrival::Colour(colour(5, "rgb8", 3)));
    let moving = dynamics.try_next().unwrap().message;
    let object = SIZE_PX.0 * 20 + 30;
    assert_eq!((&moving.data[..3], &moving.data[3 * object..][..3]), (&[0; 3][..], &[200; 3][..]));
}

#[test]
fn with_fill_none_images_pass_at_once_and_no_depth_images_are_received() {
    let parameters =
        FilterParameters { static_rgb_fill: ColourFill::None, ..FilterParameters::default() };
    let mut graph = Graph::new(&parameters);
    let depths: Publisher<Image> = graph.mapper.publisher("depth/image", &Qos::sensor(1)).unwrap();
    assert_eq!(depths.subscriber_count(), 0);
    graph.colour(10);
    assert_eq!(graph.came(), [(stamp(10), false)]);
}

#[test]
fn nothing_is_received_while_nobody_wants_colours_and_clouds_only_without_depth_images() {
    let arguments = RosArguments::parse(["--ros-args"]).unwrap();
    let host = Host::in_process();
    let node = |name: &str| host.node(name, &arguments).unwrap();
    let (own, mapper, driver) = (node("segmentation"), node("mapper"), node("driver"));
    let sent = Qos::sensor(1);
    let colours: Publisher<Image> = driver.publisher("rgb/image", &sent).unwrap();
    let infos: Publisher<CameraInfo> = driver.publisher("rgb/camera_info", &sent).unwrap();
    let clouds: Publisher<PointCloud2> = driver.publisher("points", &sent).unwrap();
    let grid = VoxelGrid::new(0.08).unwrap();
    let mut filter = Filter::new(&own, &FilterParameters::default(), grid).unwrap();
    let wanted =
        || [colours.subscriber_count(), infos.subscriber_count(), clouds.subscriber_count()];
    filter.follow_subscribers(&own).unwrap();
    assert!(wanted() == [0; 3] && !filter.is_wanted());
    let statics: Subscription<Image> = mapper.subscription("static_rgb/image", &sent).unwrap();
    filter.follow_subscribers(&own).unwrap();
    assert!(wanted() == [1; 3] && filter.is_wanted());
    let depths: Publisher<Image> = driver.publisher("depth/image", &sent).unwrap();
    filter.follow_subscribers(&own).unwrap();
    assert_eq!((wanted(), depths.subscriber_count()), ([1, 1, 0], 1));
    drop(statics);
    filter.follow_subscribers(&own).unwrap();
    assert_eq!((wanted(), depths.subscriber_count()), ([0; 3], 0));
    let infos_alone: Subscription<CameraInfo> =
        mapper.subscription("static_rgb/camera_info", &sent).unwrap();
    filter.follow_subscribers(&own).unwrap();
    assert_eq!((wanted(), depths.subscriber_count()), ([0, 1, 0], 0));
    filter.take(RawArrival::ColourInfo(info()));
    assert_eq!(*infos_alone.try_next().unwrap().message, *info());
}
