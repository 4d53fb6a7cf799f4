//! `stillmap import clouds`: scans of a LiDAR, one PLY or PCD file each.

use std::path::{Path, PathBuf};

use clap::Args;
use geometry::{Cloud, PointFileError, Stamp, pcd, ply};
use msgs::convert::message_from_cloud;

use super::print_summary;
use crate::existing::BagOutput;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::map_file::SHIFT;
use crate::progress::Progress;

/// The stamp of the first cloud: a constant, so that the same files always give the same bag.
const START: Stamp = Stamp::from_secs_nanos(1_000_000_000, 0);

/// Arguments of `stillmap import clouds`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap import clouds scans/*.pcd -o drive.mcap
  stillmap odometry drive.mcap --of lidar -o drive.txt

The files are taken in the order in which they are given, which must be that of the numbers in their names. Only the points are read: no times, and no intensities.")]
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
        return Err(Failure::unusable(format!("--rate {} is not a positive number", args.rate))
            .fix("10 is usual"));
    }
    refuse_other_order(&args.files)?;
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

/// A shell lists 10.pcd before 2.pcd.
fn refuse_other_order(files: &[PathBuf]) -> Result<(), Failure> {
    let number = |path: &PathBuf| -> Option<(String, u64)> {
        let stem = path.file_stem()?.to_str()?;
        let digits = stem.len() - stem.trim_end_matches(|one: char| one.is_ascii_digit()).len();
        let (name, number) = stem.split_at_checked(stem.len() - digits)?;
        Some((name.to_owned(), number.parse().ok()?))
    };
    let numbers: Option<Vec<(String, u64)>> = files.iter().map(number).collect();
    let Some(numbers) = numbers else { return Ok(()) };
    let falling =
        numbers.iter().zip(numbers.iter().skip(1)).zip(files.iter().zip(files.iter().skip(1)));
    let falling = falling
        .into_iter()
        .find(|(((name, before), (other, after)), _)| name == other && after < before);
    match falling {
        Some((_, (before, after))) => Err(Failure::new(format!(
            "{} comes before {}: the files are not in the order of the numbers in their names",
            before.display(),
            after.display()
        ))
        .fix("give them in that order: stillmap import clouds $(ls -v scans/*.pcd) -o drive.mcap")),
        None => Ok(()),
    }
}

/// The format of a file is recognised by its content.
fn points(path: &Path) -> Result<Vec<nalgebra::Point3<f32>>, Failure> {
    let bytes = std::fs::read(path)
        .map_err(|error| Failure::new(format!("cannot read {}: {error}", path.display())))?;
    let points_m =
        if bytes.starts_with(b"ply") { ply::decode(&bytes) } else { pcd::decode(&bytes) };
    points_m.map_err(|error| {
        let failure = Failure::new(error.to_string()).within(path.display());
        match error {
            PointFileError::TooFar { .. } => failure.fix(SHIFT),
            _ => failure.fix("give PLY or PCD files"),
        }
    })
}

#[cfg(test)]
mod tests {
    use bag_player::{Bag, Selection};
    use msgs::sensor_msgs::PointCloud2;
    use nalgebra::Point3;

    use super::*;

    /// Regression: scans 0, 1, 10, 11, ... 2, as a shell lists them, were imported in that order without a word.
    #[test]
    fn files_that_are_not_in_the_order_of_their_numbers_are_refused() {
        let check = |names: &[&str]| {
            let files: Vec<PathBuf> = names.iter().map(PathBuf::from).collect();
            refuse_other_order(&files).err().map(|failure| failure.to_string())
        };
        let said = check(&["scans/0.pcd", "scans/1.pcd", "scans/10.pcd", "scans/2.pcd"]).unwrap();
        assert!(said.contains("scans/10.pcd comes before scans/2.pcd"), "{said}");
        assert!(said.contains("ls -v"), "{said}");
        assert!(check(&["scan_9.ply", "scan_10.ply", "scan_8.ply"]).is_some());
        let fine = [
            &["0.pcd", "2.pcd", "10.pcd"][..],
            &["b1.ply", "a0.ply"],
            &["left.ply", "0.ply"],
            &["a_9.ply", "b_1.ply"],
        ];
        for names in fine {
            assert_eq!(check(names), None, "{names:?}");
        }
    }

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
