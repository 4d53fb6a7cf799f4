//! Whether the scan lies on the surfaces that the camera sees: with the mount of the parameters, and with that of tf.

use bag_player::Bag;
use calibration::{
    CalibrationConfig, Cycle, DepthOptics, DriftConfig, DriftMonitor, Extrinsics, RigMounts,
};
use detection::shell::DetectionParameters;
use geometry::{ExtrinsicsSource, RayTable, RigConfig, Stamp, pose_vector};

use super::reading::BagFacts;
use crate::calibrate::mounts_of_tf::{MountsOfTf, is_one_mount};
use crate::calibrate::reader::{self, Choosing, Topics};
use crate::calibrate::rig_poses::RigPoses;
use crate::doctor::checks::Check;
use crate::doctor::finding::Finding;
use crate::run::inputs::{Inputs, ViewTopics};

/// Cycles that are compared together, each with its image in memory: those in which the platform moves least.
const MOST_CYCLES: usize = 20;
/// If the platform moves the returns of a scan farther than this, the motion may explain an offset from the surfaces: the
/// time of each beam is known to half a turn. A third of the limit for the mount's error.
const MOST_MOTION_M: f64 = 0.01;
/// What determines the mount.
const CALIBRATE: &str =
    "stillmap calibrate BAG -o extrinsics.yaml, then --params-file extrinsics.yaml";
/// With fewer cycles the mount is not judged.
const LEAST_CYCLES: usize = 5;

/// Where the bag does not show whether the mount holds: that nothing says what it is. `is_given` is whether the user gives parameters;
/// `None` where they or tf say it.
pub(super) fn unknown(
    facts: &BagFacts,
    parameters: &DetectionParameters,
    is_given: bool,
) -> Option<Finding> {
    let inputs = facts.choice.as_ref().ok()?;
    if is_given || parameters.config.pipeline.rig != RigConfig::default() {
        return None;
    }
    let view = match &inputs.view {
        ViewTopics::Depth { image, .. } => image,
        ViewTopics::Points(points) => points,
    };
    let frame = |topic: &str| facts.topics.get(topic)?.content.frame();
    let (camera, scanner) = (frame(view)?, frame(&inputs.scan)?);
    if facts.transforms.tree().lookup_latest(camera, scanner).is_ok() {
        return None;
    }
    Some(Finding::warn(
        Check::Extrinsics,
        format!(
            "neither tf ({camera} to {scanner}) nor a parameter file says where the scanner is: it is taken to be 5 cm below the camera, and \
             to look ahead; this bag does not show whether it is"
        ),
        format!(
            "{CALIBRATE}, of a recording with walls in view of both; or a --params-file with `rig_from_lidar`"
        ),
    ))
}

/// That the mount was not compared with what the camera sees, where the poses that this takes are on no topic.
pub(super) fn not_checked(facts: &BagFacts) -> Option<Finding> {
    let inputs = facts.choice.as_ref().ok()?;
    inputs.pose.topic().is_none().then(|| {
        Finding::ok(
            Check::Extrinsics,
            "not checked: whether the scan lies on the surfaces that the camera sees takes poses around the scans, on a topic (--pose TOPIC) or by tf",
        )
    })
}

/// That the mount was not compared, where the bag has too few scans for it.
fn too_few_scans(scans: usize) -> Finding {
    Finding::ok(
        Check::Extrinsics,
        format!(
            "not checked: whether the scan lies on the surfaces that the camera sees takes {LEAST_CYCLES} scans with a depth image during which \
             the platform stands by its poses; there are {scans}"
        ),
    )
}

/// The finding about the mount, and what is `unknown` where the bag does not show it.
pub(super) fn finding(
    bag: &Bag,
    facts: &BagFacts,
    parameters: &DetectionParameters,
    unknown: Option<Finding>,
) -> Option<Finding> {
    match checked(bag, facts, parameters) {
        None => unknown,
        Some(Ok(finding)) => finding.or(unknown),
        Some(Err(scans)) => unknown.or_else(|| Some(too_few_scans(scans))),
    }
}

/// What the check finds, if anything; or how many scans there are where these are too few.
fn checked(
    bag: &Bag,
    facts: &BagFacts,
    parameters: &DetectionParameters,
) -> Option<Result<Option<Finding>, usize>> {
    let inputs = facts.choice.as_ref().ok()?;
    let ViewTopics::Depth { image, camera_info } = &inputs.view else { return None };
    let config = &parameters.config;
    let choosing = Choosing {
        most_cycles: MOST_CYCLES,
        most_motion_m: MOST_MOTION_M,
        max_pose_gap_s: config.max_pose_gap_s,
        max_image_offset_s: config.max_cloud_offset_s,
        beam_order: config.free_space.beam_order,
    };
    let topics = Topics {
        scan: inputs.scan.clone(),
        image: image.clone(),
        camera_info: camera_info.clone(),
        poses: RigPoses::of(inputs, parameters)?,
    };
    // Other faults of the bag are found by other rules.
    let Ok(read) = reader::read(bag, &facts.info, &topics, &choosing) else {
        return Some(Err(0));
    };
    let (cycles, camera) = (read.cycles.cycles, read.camera?);
    let size_px = (camera.width_px, camera.height_px);
    let fits = |cycle: &Cycle| (cycle.image.width_px(), cycle.image.height_px()) == size_px;
    if !cycles.iter().all(fits) {
        return None;
    }
    if cycles.len() < LEAST_CYCLES {
        return Some(Err(cycles.len()));
    }
    let rays = RayTable::new(&camera).ok()?;
    let optics = DepthOptics { camera: &camera, rays: &rays };
    let rig = &config.pipeline.rig;
    let by_tf = mounts_of_tf(bag, facts, (inputs, rig), &cycles);
    let limit_m = parameters.extrinsics_limit_m;
    let judged = |mounts: &[Option<RigMounts>]| judge(&cycles, mounts, optics, limit_m);
    let tf = by_tf.map(|mounts| ByTf { verdict: judged(&mounts), mounts: only_mounts(&mounts) });
    let by_parameters = judged(&vec![Some(rig.mounts()); cycles.len()]);
    Some(Ok(from_verdicts(by_parameters, tf, rig.extrinsics)))
}

/// What tf says of the mount.
struct ByTf {
    verdict: Extrinsics,
    /// None where a joint moves a sensor.
    mounts: Option<RigMounts>,
}

/// The mounts of the sensors by tf in each cycle, as far as they are known there; `None` where tf does not have them.
fn mounts_of_tf(
    bag: &Bag,
    facts: &BagFacts,
    (inputs, rig): (&Inputs, &RigConfig),
    cycles: &[Cycle],
) -> Option<Vec<Option<RigMounts>>> {
    let ViewTopics::Depth { image, .. } = &inputs.view else { return None };
    let frame = |topic: &str| facts.topics.get(topic)?.content.frame();
    let frames = MountsOfTf { rig, camera: frame(image)?, scanner: frame(&inputs.scan)? };
    let tree = facts.transforms.tree();
    let latest = frames.latest(tree).ok()?;
    if !frames.are_jointed(tree) {
        return Some(vec![Some(latest); cycles.len()]);
    }
    let stamps: Vec<Stamp> = cycles.iter().map(|cycle| cycle.image.stamp).collect();
    frames.at(bag, &inputs.transforms, &stamps).ok()
}

/// The mounts of all cycles, where they are the same.
fn only_mounts(mounts: &[Option<RigMounts>]) -> Option<RigMounts> {
    let known: Vec<RigMounts> = mounts.iter().copied().flatten().collect();
    if is_one_mount(&known) { known.last().copied() } else { None }
}

/// The verdict about mounts, one for each cycle; those without are left out.
fn judge(
    cycles: &[Cycle],
    mounts: &[Option<RigMounts>],
    optics: DepthOptics<'_>,
    limit_m: f64,
) -> Extrinsics {
    let known: Vec<(&Cycle, &RigMounts)> = cycles
        .iter()
        .zip(mounts)
        .filter_map(|(cycle, mounts)| Some((cycle, mounts.as_ref()?)))
        .collect();
    // All cycles are one window.
    let config = DriftConfig {
        limit_m,
        window_cycles: known.len().max(LEAST_CYCLES),
        windows_in_a_row: 1,
        ..DriftConfig::default()
    };
    let mut monitor = DriftMonitor::new(config, CalibrationConfig::default());
    let mut verdict = Extrinsics::Unknown { returns: 0 };
    for (cycle, mounts) in known {
        verdict = monitor.observe(&cycle.returns, &cycle.image, optics, mounts);
    }
    verdict
}

/// The offset and its standard deviation, in words.
fn offset(verdict: &Extrinsics) -> Option<String> {
    match verdict {
        Extrinsics::Unknown { .. }
        | Extrinsics::Undetermined { .. }
        | Extrinsics::Uncertain { .. } => None,
        Extrinsics::Right { offset_m, std_dev_m, limit_m }
        | Extrinsics::Wrong { offset_m, std_dev_m, limit_m } => Some(format!(
            "{offset_m:.3} m (+- {std_dev_m:.3}, limit {limit_m:.3}) beside the surfaces that the camera sees"
        )),
    }
}

fn from_verdicts(
    by_parameters: Extrinsics,
    by_tf: Option<ByTf>,
    source: ExtrinsicsSource,
) -> Option<Finding> {
    let reads_tf = source != ExtrinsicsSource::Parameters;
    if let Some(ByTf { verdict, mounts }) = &by_tf {
        let offset_by_tf = offset(verdict)?;
        if verdict.is_wrong() {
            return Some(Finding::grave_if(
                reads_tf,
                Check::Extrinsics,
                format!("by tf the scan lies {offset_by_tf}"),
                format!("{CALIBRATE}, and set the mount in the robot's description"),
            ));
        }
        if by_parameters.is_wrong() && !reads_tf {
            return Some(Finding::error(
                Check::Extrinsics,
                format!(
                    "by the parameter rig_from_lidar the scan lies {}, and by tf {offset_by_tf}",
                    offset(&by_parameters)?
                ),
                by_tf_fix(mounts.as_ref()),
            ));
        }
        return Some(Finding::ok(Check::Extrinsics, format!("by tf the scan lies {offset_by_tf}")));
    }
    let what = format!("by the parameter rig_from_lidar the scan lies {}", offset(&by_parameters)?);
    Some(if by_parameters.is_wrong() {
        Finding::error(Check::Extrinsics, what, CALIBRATE)
    } else {
        Finding::ok(Check::Extrinsics, what)
    })
}

fn by_tf_fix(mounts: Option<&RigMounts>) -> String {
    const FIX: &str = "a --params-file with `extrinsics: tf` under detection: ros__parameters:";
    mounts.map_or(FIX.to_owned(), |mounts| {
        format!("{FIX}, or `rig_from_lidar: {:.4?}`", pose_vector(&mounts.rig_from_lidar))
    })
}
