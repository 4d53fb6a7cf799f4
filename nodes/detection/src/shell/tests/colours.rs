//! The colours of the cycles, by a colour camera and by the points.

use geometry::{Cloud, ColourImage, ColouredCloud, DetectedCycle, NO_COLOUR};
use msgs::convert::ImageCodec;
use msgs::sensor_msgs::PointCloud2;
use nalgebra::Point3;
use node_shell::{Arrived, ValueSubscription};

use super::*;

const RED: [u8; 3] = [200, 30, 20];
const BLUE: [u8; 3] = [10, 20, 220];

/// The stage, with everything that it takes.
struct Camera {
    stage: Stage,
    scans: Publisher<LaserScan>,
    images: Publisher<Image>,
    camera_infos: Publisher<CameraInfo>,
    clouds: Publisher<PointCloud2>,
    poses: Publisher<PoseStamped>,
    colours: Publisher<Image>,
    compressed: Publisher<CompressedImage>,
    colour_infos: Publisher<CameraInfo>,
    cycles: ValueSubscription<DetectedCycle>,
}

impl Camera {
    fn new(parameters: DetectionParameters, max_waiting_cycles: usize) -> Self {
        let host = node_shell::Host::in_process().with_max_waiting_cycles(max_waiting_cycles);
        let arguments = RosArguments::parse([] as [String; 0]).unwrap();
        let node = |name| host.node(name, &arguments).unwrap();
        let (own, peer) = (node("detection"), node("robot"));
        let qos = Qos::reliable(50);
        let this = Self {
            stage: Stage::new(&own, &parameters).unwrap(),
            scans: peer.publisher("scan", &qos).unwrap(),
            images: peer.publisher("depth/image", &qos).unwrap(),
            camera_infos: peer.publisher("depth/camera_info", &qos).unwrap(),
            clouds: peer.publisher("points", &qos).unwrap(),
            poses: peer.publisher("pose", &qos).unwrap(),
            colours: peer.publisher("rgb/image", &qos).unwrap(),
            compressed: peer.publisher("rgb/image/compressed", &qos).unwrap(),
            colour_infos: peer.publisher("rgb/camera_info", &qos).unwrap(),
            cycles: peer.value_subscription("reduced_cloud", &qos).unwrap(),
        };
        if this.camera_infos.subscriber_count() > 0 {
            this.camera_infos.publish(camera_info(4)).unwrap();
        }
        this
    }

    fn of_a_recording(colour: ColourInput) -> Self {
        Self::new(DetectionParameters { colour, ..DetectionParameters::default() }, OF_A_RECORDING)
    }

    /// Everything of a moment but the colour image.
    fn depth(&mut self, milliseconds: i64) {
        let stamp = at(milliseconds);
        self.images.publish(image(stamp)).unwrap();
        self.poses.publish(pose(stamp, 0.0)).unwrap();
        self.scans.publish(scan(stamp)).unwrap();
        process(&mut self.stage);
    }

    fn colour(&mut self, milliseconds: i64, colour: [u8; 3]) {
        self.colours.publish(colour_image(milliseconds, colour)).unwrap();
        process(&mut self.stage);
    }

    fn calibrate(&mut self, width_px: usize) {
        self.colour_infos.publish(camera_info(width_px)).unwrap();
        process(&mut self.stage);
    }

    /// The cycles so far: when, and the colour of the first pixel where they have colours.
    fn cycles(&self) -> Vec<(i64, Option<[u8; 3]>)> {
        let mut cycles = Vec::new();
        while let Some(received) = self.cycles.try_next() {
            let Arrived::Value(cycle) = &*received.message else { panic!("a message") };
            let colours = cycle.depth.as_ref().unwrap().colours().map(|colours| colours[0]);
            cycles.push((cycle.scan_stamp.as_nanos() / 1_000_000, colours));
        }
        cycles
    }
}

fn colour_image(milliseconds: i64, colour: [u8; 3]) -> Image {
    let image = ColourImage::new(at(milliseconds), (4, 3), vec![colour; 12]).unwrap();
    convert::message_from_colour_image(&image, "camera_optical_frame")
}

#[test]
fn a_cycle_has_the_colours_of_the_nearest_image() {
    let mut camera = Camera::of_a_recording(ColourInput::Raw);
    camera.calibrate(4);
    camera.colour(990, BLUE);
    camera.colour(1_005, RED);
    camera.depth(1_000);
    assert_eq!(camera.cycles(), [(1_000, Some(RED))]);
    camera.depth(1_100);
    assert_eq!(camera.cycles(), [], "a nearer image may come");
    camera.colour(1_110, BLUE);
    assert_eq!(camera.cycles(), [(1_100, Some(BLUE))]);
}

#[test]
fn compressed_images_and_raw_ones_give_the_same_colours() {
    let mut camera = Camera::of_a_recording(ColourInput::Compressed);
    camera.calibrate(4);
    let image = colour_image(1_000, RED);
    let compressed = convert::compressed_message_from_image(&image, ImageCodec::Png).unwrap();
    camera.compressed.publish(compressed).unwrap();
    camera.depth(1_000);
    assert_eq!(camera.cycles(), [(1_000, Some(RED))]);
}

/// A recording gives the same cycles in whatever order its topics arrive.
#[test]
fn the_order_of_arrival_changes_no_colour() {
    let stamps = [1_000, 1_100, 1_200, 1_300];
    let colour_of = |milliseconds: i64| [100, 100, (milliseconds / 10) as u8];
    let expected: Vec<_> = stamps.map(|stamp| (stamp, Some(colour_of(stamp)))).to_vec();
    let mut early = Camera::of_a_recording(ColourInput::Raw);
    early.calibrate(4);
    stamps.into_iter().for_each(|stamp| early.colour(stamp, colour_of(stamp)));
    stamps.into_iter().for_each(|stamp| early.depth(stamp));
    assert_eq!(early.cycles(), expected);
    let mut late = Camera::of_a_recording(ColourInput::Raw);
    stamps.into_iter().for_each(|stamp| late.depth(stamp));
    assert_eq!(late.cycles(), []);
    late.calibrate(4);
    stamps.into_iter().for_each(|stamp| late.colour(stamp, colour_of(stamp)));
    assert_eq!(late.cycles(), expected);
}

/// Live, a cycle waits until the next one, and not at all for a camera that sends nothing.
#[test]
fn a_cycle_does_not_wait_long_for_its_colours() {
    let parameters =
        DetectionParameters { colour: ColourInput::Raw, ..DetectionParameters::default() };
    let mut camera = Camera::new(parameters, LIVE);
    camera.calibrate(4);
    camera.depth(1_000);
    assert_eq!(camera.cycles(), [(1_000, None)], "no image has ever come");
    camera.colour(1_050, RED);
    camera.depth(1_100);
    assert_eq!(camera.cycles(), [], "the camera sends images");
    camera.depth(1_200);
    assert_eq!(camera.cycles(), [(1_100, None)]);
    camera.colour(1_205, BLUE);
    assert_eq!(camera.cycles(), [(1_200, Some(BLUE))]);
    camera.depth(2_300);
    assert_eq!(camera.cycles(), [(2_300, None)], "the camera has stopped");
}

#[test]
fn a_recording_without_more_images_gives_all_its_cycles() {
    let mut camera = Camera::of_a_recording(ColourInput::Raw);
    camera.calibrate(4);
    camera.colour(1_000, RED);
    for stamp in [1_000, 1_300, 1_600, 1_900] {
        camera.depth(stamp);
    }
    assert_eq!(camera.cycles(), [(1_000, Some(RED)), (1_300, None)], "half a second later");
    camera.stage.give_up_waiting();
    assert_eq!(camera.cycles(), [(1_600, None), (1_900, None)]);
}

#[test]
fn an_image_that_cannot_be_used_costs_the_colours_alone() {
    let mut camera = Camera::of_a_recording(ColourInput::Raw);
    camera.colour(1_000, RED);
    camera.depth(1_000);
    assert_eq!(camera.cycles(), [(1_000, None)], "no calibration");
    camera.calibrate(5);
    camera.colour(1_100, RED);
    camera.depth(1_100);
    assert_eq!(camera.cycles(), [(1_100, None)], "the calibration of another size");
    camera.calibrate(4);
    let unknown = Image { encoding: "yuv422".to_owned(), ..colour_image(1_200, RED) };
    camera.colours.publish(unknown).unwrap();
    camera.depth(1_200);
    assert_eq!(camera.cycles(), [(1_200, None)], "an encoding that is not read");
    camera.colour(1_300, RED);
    camera.depth(1_300);
    assert_eq!(camera.cycles(), [(1_300, Some(RED))]);
}

#[test]
fn nothing_is_subscribed_to_where_no_colours_are_used() {
    let rec_hv = geometry::PipelineConfig::new(geometry::Method::RecHv, 0.08);
    let config = DetectionConfig { pipeline: rec_hv, ..DetectionConfig::default() };
    for parameters in [
        DetectionParameters::default(),
        DetectionParameters { colour: ColourInput::None, ..DetectionParameters::default() },
        DetectionParameters { colour: ColourInput::Raw, config, ..DetectionParameters::default() },
    ] {
        let camera = Camera::new(parameters, LIVE);
        let counts = [
            camera.colours.subscriber_count(),
            camera.compressed.subscriber_count(),
            camera.colour_infos.subscriber_count(),
        ];
        assert_eq!(counts, [0; 3]);
    }
}

/// A cloud of a pinhole camera, red on the left and blue on the right, with a hole.
fn coloured_points(milliseconds: i64) -> PointCloud2 {
    let pixels = (0..12).flat_map(|row| (0..16).map(move |column| (column, row)));
    let (points_m, colours) = pixels
        .map(|(column, row)| {
            let (x, y) = (0.1 * (column as f32 - 7.5), 0.1 * (row as f32 - 5.5));
            let depth_m = if (column, row) == (3, 2) { f32::NAN } else { 2.0 };
            let colour = if column < 8 { RED } else { BLUE };
            (Point3::new(x * depth_m, y * depth_m, depth_m), colour)
        })
        .unzip();
    let (stamp, frame_id) = (at(milliseconds), "camera_optical_frame".to_owned());
    let cloud = Cloud { stamp, frame_id, points_m };
    convert::message_from_coloured_cloud(&ColouredCloud { cloud, colours })
}

fn colours_of_points(message: PointCloud2, colour: ColourInput) -> Option<Vec<[u8; 3]>> {
    let input = CloudInput::Points;
    let parameters = DetectionParameters { input, colour, ..DetectionParameters::default() };
    let camera = &mut Camera::new(parameters, OF_A_RECORDING);
    let stamp = convert::stamp_from_time(message.header.stamp);
    camera.clouds.publish(message).unwrap();
    camera.poses.publish(pose(stamp, 0.0)).unwrap();
    camera.scans.publish(scan(stamp)).unwrap();
    camera.stage.take_waiting();
    camera.stage.give_up_waiting();
    let received = camera.cycles.try_next().unwrap();
    let Arrived::Value(cycle) = &*received.message else { panic!("a message") };
    cycle.depth.as_ref().unwrap().colours().map(<[[u8; 3]]>::to_vec)
}

#[test]
fn the_points_of_a_cloud_have_colours_of_their_own() {
    let organised = || PointCloud2 {
        height: 12,
        width: 16,
        row_step: 16 * 16,
        is_dense: false,
        ..coloured_points(1_000)
    };
    let colours = colours_of_points(organised(), ColourInput::Cloud).unwrap();
    assert_eq!(colours.len(), 16 * 12);
    for (pixel, colour) in colours.iter().enumerate() {
        assert_eq!(*colour, if pixel % 16 < 8 { RED } else { BLUE }, "{pixel}");
    }
    assert_eq!(colours_of_points(organised(), ColourInput::None), None);
    let mut plain = organised();
    plain.fields.truncate(3);
    assert_eq!(colours_of_points(plain, ColourInput::Cloud), None);

    // In one row they are rendered into an image of whatever size, and their colours with them.
    let colours = colours_of_points(coloured_points(1_000), ColourInput::Cloud).unwrap();
    let count = |wanted: [u8; 3]| colours.iter().filter(|colour| **colour == wanted).count();
    assert_eq!(count(RED) + count(BLUE) + count(NO_COLOUR), colours.len());
    assert!(count(RED) > 50 && count(BLUE) > 50, "{} {}", count(RED), count(BLUE));
}

/// Cycles with and without colours are counted, and that there are none is a warning with the reason.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn cycles_without_colours_are_counted_in_the_diagnostics() {
    use msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
    let parameters =
        DetectionParameters { colour: ColourInput::Raw, ..DetectionParameters::default() };
    let own = node_with("detection", "colours", LIVE);
    let bench = Bench::start_node(own, "colours", parameters).await;
    let reliable = Qos::reliable(50);
    let diagnostics =
        bench.peer.subscription::<DiagnosticArray>("/diagnostics", &reliable).unwrap();
    bench.camera_infos.publish(camera_info(4)).unwrap();
    for stamp in [1_000, 1_100, 1_200].map(at) {
        bench.images.publish(image(stamp)).unwrap();
        bench.poses.publish(pose(stamp, 0.0)).unwrap();
        bench.scans.publish(scan(stamp)).unwrap();
        // Of three that come at once the first would be dropped.
        assert!(bench.report().await.processed);
    }
    let status = soon("the count", async {
        loop {
            let message = diagnostics.next().await.message;
            let own = message.part(&bench.name);
            let counts =
                |status: &&DiagnosticStatus| status.value("cycles_without_colour") == Some("3");
            if let Some(status) = own.filter(counts) {
                break status.clone();
            }
        }
    })
    .await;
    assert_eq!(status.level, DiagnosticStatus::WARN);
    assert!(status.message.contains("no image within 0.02 s of the depth image"), "{status:?}");
    drop(diagnostics);
    bench.end().await;
}
