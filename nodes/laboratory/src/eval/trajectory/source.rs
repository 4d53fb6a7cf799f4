//! The source of a trajectory. The format of a file is recognised by its content.

use std::path::Path;

use bag_player::begins_as_a_bag;
use evaluation::trajectory::{Times, Trajectory, parse_stamps, parse_trajectory};

use super::bag_poses;
use robot::Failure;

/// A trajectory to read.
pub(super) struct Source<'a> {
    pub(super) path: &'a Path,
    /// The topic, if it is a bag.
    pub(super) topic: Option<&'a str>,
    /// The stamps of the frames, if it has none.
    pub(super) times: Option<&'a Path>,
}

/// A trajectory that was read.
pub(super) struct Read {
    pub(super) format: &'static str,
    pub(super) trajectory: Trajectory,
    /// Messages of a bag that could not be read.
    pub(super) losses: usize,
    /// Whether the given stamps are those of its frames.
    pub(super) takes_times: bool,
}

impl Source<'_> {
    /// Reads it; `option` is the argument for the topic.
    pub(super) fn read(&self, option: &str) -> Result<Read, Failure> {
        let path = self.path;
        let is_bag = || begins_as_a_bag(path).map_err(|error| cannot_read(path, &error));
        if path.is_dir() || is_bag()? {
            return bag_poses::read(path, self.topic, option);
        }
        if self.topic.is_some() {
            return Err(Failure::new(format!("{} is not a bag and has no topics", path.display()))
                .fix(format!("leave {option} out")));
        }
        let parsed = parse_trajectory(&read(path)?)
            .map_err(|error| Failure::new(format!("{}: {error}", path.display())))?;
        let mut trajectory = parsed.trajectory;
        let has_frames = matches!(trajectory.times(), Times::Frames(_));
        let times = self.times.filter(|_| has_frames);
        if let Some(times) = times {
            let stamps = parse_stamps(&read(times)?)
                .map_err(|error| Failure::new(format!("{}: {error}", times.display())))?;
            trajectory = trajectory
                .with_stamps(&stamps)
                .map_err(|error| Failure::new(format!("{}: {error}", times.display())))?;
        }
        let (format, takes_times) = (parsed.format.name(), times.is_some());
        Ok(Read { format, trajectory, losses: 0, takes_times })
    }
}

fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    std::fs::read(path).map_err(|error| cannot_read(path, &error))
}

fn cannot_read(path: &Path, error: &std::io::Error) -> Failure {
    Failure::new(format!("cannot read {}: {error}", path.display()))
}
