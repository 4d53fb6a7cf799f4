//! `stillmap import clouds`: scans of a LiDAR, one PLY or PCD file each.

use std::path::{Path, PathBuf};

use clap::Args;
use geometry::{Cloud, Stamp, pcd, ply};
use msgs::convert::message_from_cloud;

use super::print_summary;
use crate::existing::BagOutput;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::progress::Progress;

/// The stamp of the first cloud: a constant, so that the same files always give the same bag.
const START: Stamp = Stamp::from_secs_nanos(1_000_000_000, 0);

/// Arguments of `stillmap import clouds`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap import clouds scans/*.pcd -o drive.mcap
  stillmap odometry drive.mcap --of lidar -o drive.txt

The files are taken in the order in which they are given. Only the points are read: no times, and no intensities.")]
pub struct CloudsArgs {
    /// PLY and PCD files, in chronological order
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Clouds per second
    #[arg(long, value_name = "HZ", default_value_t = 10.0)]
    rate: f64,
    /// The frame of the clouds
    #[arg(long, value_name = "FRAME", default_value = "velodyne")]
    frame: String,
    #[command(flatten)]
    pub(super) output: BagOutput,
}

pub(crate) fn import(args: &CloudsArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    if !(args.rate.is_finite() && args.rate > 0.0) {
        return Err(Failure::new(format!("--rate {} is not a positive number", args.rate))
            .fix("10 is usual"));
    }
    let mut bag = args.output.create()?;
    let progress = Progress::new("importing", args.files.len() as u64);
    for (index, path) in args.files.iter().enumerate() {
        if interrupt.has_come() {
            break;
        }
        let stamp = START.plus_seconds(index as f64 / args.rate);
        let cloud = Cloud { stamp, frame_id: args.frame.clone(), points_m: points(path)? };
        bag.velodyne(stamp, &message_from_cloud(&cloud))?;
        progress.advance();
    }
    progress.finish();
    let summary = bag.finish()?;
    print_summary(&args.output, &summary, interrupt, Outcome::Complete)
}

/// The format of a file is recognised by its content.
fn points(path: &Path) -> Result<Vec<nalgebra::Point3<f32>>, Failure> {
    let bytes = std::fs::read(path)
        .map_err(|error| Failure::new(format!("cannot read {}: {error}", path.display())))?;
    let points_m =
        if bytes.starts_with(b"ply") { ply::decode(&bytes) } else { pcd::decode(&bytes) };
    points_m.map_err(|error| {
        Failure::new(error.to_string()).within(path.display()).fix("give PLY or PCD files")
    })
}

#[cfg(test)]
mod tests {
    use bag_player::{Bag, Selection};
    use msgs::sensor_msgs::PointCloud2;
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn files_of_both_forms_become_clouds_in_their_order() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let never = Interrupt::default();
        let points = |x_m: f32| vec![Point3::new(x_m, 2.0, 3.0); 5];
        std::fs::write(path("b.ply"), ply::encode(&points(1.0))).unwrap();
        std::fs::write(path("a.pcd"), pcd::encode(&points(2.0))).unwrap();
        std::fs::write(path("none.pcd"), b"no cloud").unwrap();
        let args = |files: Vec<PathBuf>, rate| CloudsArgs {
            files,
            rate,
            frame: "lidar".to_owned(),
            output: BagOutput::new(path("out.mcap")),
        };
        import(&args(vec![path("b.ply"), path("a.pcd")], 20.0), &never).unwrap();
        let bag = Bag::open(&path("out.mcap")).unwrap();
        let messages = bag.messages(&Selection::default()).unwrap();
        let clouds: Vec<PointCloud2> =
            messages.map(|message| message.unwrap().decode().unwrap()).collect();
        let clouds: Vec<Cloud> =
            clouds.iter().map(|cloud| msgs::convert::cloud_from_message(cloud).unwrap()).collect();
        assert_eq!((clouds[0].points_m[0].x, clouds[1].points_m[0].x), (1.0, 2.0));
        assert!((clouds[1].stamp.seconds_since(clouds[0].stamp) - 0.05).abs() < 1e-9);
        let bad = import(&args(vec![path("none.pcd")], 20.0), &never).unwrap_err().to_string();
        assert!(bad.contains("none.pcd"), "{bad}");
        assert!(import(&args(vec![path("b.ply")], 0.0), &never).is_err());
    }
}
