//! A bag through the pipeline over either transport, which yield the same.

use bag_player::{Bag, BagInfo};
use geometry::{OccupancyGrid, TriangleMesh};
use msgs::geometry_msgs::PoseStamped;
use reconstruction::{GridError, MeshError};
use report::RunRecord;

use super::bag_name;
use super::findings::InputLosses;
use super::inputs::Inputs;
use super::local::LocalRun;
use super::parameters::PipelineParameters;
use super::{dds, local};
use crate::failure::Failure;
use crate::import::AddedScans;
use crate::interrupt::Interrupt;
use crate::progress::Progress;

/// What either transport yields.
pub(super) struct Finished {
    pub(super) record: RunRecord,
    pub(super) losses: InputLosses,
    /// Why the run ended before the end of the bag, if it did.
    pub(super) failure: Option<Failure>,
    /// The rig's poses by the visual odometry, where it was asked for.
    pub(super) poses: Option<Vec<PoseStamped>>,
    /// The occupancy grid, where one was asked for.
    pub(super) grid: Option<Result<OccupancyGrid, GridError>>,
    /// The surface as triangles, where it was asked for, of a run in this process.
    pub(super) mesh: Option<Result<TriangleMesh, MeshError>>,
    /// Whether a signal has ended it before the end of the bag.
    pub(super) is_interrupted: bool,
}

/// Runs a bag in this process.
pub(super) fn run_locally(
    bag: &Bag,
    info: &BagInfo,
    (inputs, added_scans): (&Inputs, Option<AddedScans>),
    (parameters, wants_mesh): (&PipelineParameters, bool),
    interrupt: &Interrupt,
) -> Result<Finished, Failure> {
    let topics = inputs.by_node_name();
    let messages = topics.iter().map(|(_, topic)| messages_on(info, topic)).sum();
    let progress = Progress::new("mapping", messages);
    let how = (parameters, wants_mesh);
    let (name, inputs) = (bag_name(bag.path()), (inputs, added_scans));
    let run = local::run(bag, inputs, how, &name, (&progress, interrupt))?;
    progress.finish();
    let LocalRun { record, poses, grid, mesh, is_interrupted, .. } = run;
    let losses = InputLosses {
        bag: run.losses,
        doubtful: run.doubtful,
        lost: Vec::new(),
        bounds_reached: run.bounds_reached,
    };
    Ok(Finished { record, losses, failure: None, poses, grid, mesh, is_interrupted })
}

/// Plays a bag to the nodes, each a process of its own.
pub(super) fn run_over_dds(
    playback: &dds::Playback<'_>,
    info: &BagInfo,
    inputs: &Inputs,
    parameters: &PipelineParameters,
    interrupt: &Interrupt,
) -> Result<Finished, Failure> {
    let progress = Progress::new("mapping", messages_on(info, &inputs.scan));
    let run = dds::run(playback, inputs, parameters, (&progress, interrupt))?;
    progress.finish();
    let losses = InputLosses {
        bag: info.losses.clone(),
        doubtful: run.doubtful,
        lost: run.lost,
        bounds_reached: run.bounds_reached,
    };
    let (record, poses, is_interrupted) = (run.record, run.poses, run.is_interrupted);
    let (failure, grid, mesh) = (run.failure, None, None);
    Ok(Finished { record, losses, failure, poses, grid, mesh, is_interrupted })
}

fn messages_on(info: &BagInfo, topic: &str) -> u64 {
    info.topics.iter().filter(|known| known.topic == topic).map(|known| known.message_count).sum()
}
