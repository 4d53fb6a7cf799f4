use msgs::std_msgs::Header;
use node_shell::{Host, RosArguments};

use super::*;

fn image(second: i32) -> Arc<Image> {
    let stamp = convert::time_from_stamp(geometry::Stamp::from_secs_nanos(second, 0));
    Arc::new(Image { header: Header { stamp, ..Header::default() }, ..Image::default() })
}

/// Each was held until the calibration came, for ever: 18 MB a second.
#[test]
fn images_whose_calibration_never_comes_do_not_fill_the_memory() {
    let arguments = RosArguments::parse(["--ros-args"]).unwrap();
    let host = Host::in_process();
    let (own, mapper) =
        (host.node("segmentation", &arguments).unwrap(), host.node("mapper", &arguments).unwrap());
    let grid = VoxelGrid::new(0.08).unwrap();
    let mut filter = Filter::new(&own, &FilterParameters::default(), grid).unwrap();
    let statics = mapper.subscription::<Image>("static_depth/image", &Qos::reliable(100)).unwrap();
    filter.follow_subscribers(&own).unwrap();
    for second in 0..VIEWS_WAITING as i32 {
        filter.take(RawArrival::Image(image(second)));
    }
    assert!(statics.try_next().is_none());
    for second in 0..10 {
        filter.take(RawArrival::Image(image(VIEWS_WAITING as i32 + second)));
        assert_eq!(statics.try_next().unwrap().message, image(second));
    }
}
