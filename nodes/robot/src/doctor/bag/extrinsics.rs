//! Whether the scan lies on the surfaces that the camera sees: with the mount of the parameters, and with that of tf.

use bag_player::Bag;
use calibration::{
    CalibrationConfig, Cycle, DepthOptics, DriftConfig, DriftMonitor, Extrinsics, RigMounts,
};
use detection::shell::DetectionParameters;
use geometry::{ExtrinsicsSource, RayTable, RigConfig, Stamp, pose_vector};

use super::reading::BagFacts;
use super::seen_depths::SeenDepths;
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

/// That the mount was not compared with what the camera sees: what that takes.
fn not_checked(takes: &str) -> Finding {
    Finding::ok(
        Check::Extrinsics,
        format!(
            "not checked: whether the scan lies on the surfaces that the camera sees takes {takes}"
        ),
    )
}

/// That the bag has too few scans for it.
fn too_few_scans(scans: usize) -> Finding {
    not_checked(&format!(
        "{LEAST_CYCLES} scans with a depth image during which the platform stands by its poses; there are {scans}"
    ))
}

/// The finding about the mount; or what is `unknown`, or why it is not checked, where the bag does not show it.
pub(super) fn finding(
    bag: &Bag,
    facts: &BagFacts,
    parameters: &DetectionParameters,
    (unknown, clocks_agree): (Option<Finding>, bool),
) -> Option<Finding> {
    let checked = if clocks_agree {
        checked(bag, facts, parameters)
    } else {
        Err(Some(not_checked("clocks that agree")))
    };
    checked.map_or_else(|not_checked| unknown.or(not_checked), Some)
}

/// What the check finds; or why there is none, if no other rule says so.
fn checked(
    bag: &Bag,
    facts: &BagFacts,
    parameters: &DetectionParameters,
) -> Result<Finding, Option<Finding>> {
    let inputs = facts.choice.as_ref().map_err(|_| None)?;
    let ViewTopics::Depth { image, camera_info } = &inputs.view else {
        return Err(Some(not_checked("depth images, and a run would read clouds")));
    };
    let config = &parameters.config;
    let choosing = Choosing {
        most_cycles: MOST_CYCLES,
        most_motion_m: MOST_MOTION_M,
        max_pose_gap_s: config.max_pose_gap_s,
        max_image_offset_s: config.max_cloud_offset_s,
        beam_order: config.free_space.beam_order,
    };
    let no_poses = || not_checked("poses around the scans, on a topic (--pose TOPIC) or by tf");
    let topics = Topics {
        scan: inputs.scan.clone(),
        image: image.clone(),
        camera_info: camera_info.clone(),
        poses: RigPoses::of(inputs, parameters).ok_or_else(|| Some(no_poses()))?,
    };
    let read = reader::read(bag, &facts.info, &topics, &choosing);
    let read = read.map_err(|_| Some(too_few_scans(0)))?;
    let (mut cycles, camera) = (read.cycles.cycles, read.camera.ok_or(None)?);
    let size_px = (camera.width_px, camera.height_px);
    cycles.retain(|cycle| (cycle.image.width_px(), cycle.image.height_px()) == size_px);
    if cycles.len() < LEAST_CYCLES {
        return Err(Some(too_few_scans(cycles.len())));
    }
    let rays = RayTable::new(&camera).map_err(|_| None)?;
    let optics = DepthOptics { camera: &camera, rays: &rays };
    let rig = &config.pipeline.rig;
    let limit_m = parameters.extrinsics_limit_m;
    let judged = |mounts: &[Option<RigMounts>]| Judged::of(&cycles, mounts, optics, limit_m);
    let by_tf = mounts_of_tf(bag, facts, (inputs, rig), &cycles)
        .map(|mounts| ByTf { judged: judged(&mounts), mounts: only_mounts(&mounts) });
    let by_parameters = judged(&vec![Some(rig.mounts()); cycles.len()]);
    let sensors = (image.as_str(), inputs.scan.as_str());
    finding_of(&by_parameters, by_tf.as_ref(), rig.extrinsics, sensors).map_err(Some)
}

/// What tf says of the mount.
struct ByTf {
    judged: Judged,
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

/// What the cycles of a bag show of mounts.
struct Judged {
    verdict: Extrinsics,
    seen: SeenDepths,
    cycles: usize,
}

impl Judged {
    /// With mounts one for each cycle; cycles without are left out.
    fn of(
        cycles: &[Cycle],
        mounts: &[Option<RigMounts>],
        optics: DepthOptics<'_>,
        limit_m: f64,
    ) -> Self {
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
        for (cycle, mounts) in &known {
            verdict = monitor.observe(&cycle.returns, &cycle.image, optics, mounts);
        }
        Self { verdict, seen: SeenDepths::of(&known, optics.camera), cycles: known.len() }
    }

    fn is_wrong(&self) -> bool {
        self.verdict.is_wrong() || self.seen.contradict()
    }

    /// The finding about the mount that is `by` something; or why it is not checked. `sensors` are the topics of image and scan.
    fn finding(
        &self,
        by: &str,
        (is_grave, fix): (bool, &str),
        sensors: (&str, &str),
    ) -> Result<Finding, Finding> {
        let is_wrong = self.verdict.is_wrong();
        // An offset says more than that beams contradict, but not where one of the sensors has another scale.
        let contradicted = self.seen.finding(sensors, by, fix);
        if let Some(found) = contradicted.filter(|found| found.check == Check::Units || !is_wrong) {
            return Ok(found);
        }
        let what = format!("{by} the scan lies {}", self.offset()?);
        Ok(if is_wrong {
            Finding::grave_if(is_grave, Check::Extrinsics, what, fix)
        } else {
            Finding::ok(Check::Extrinsics, what)
        })
    }

    /// The offset and its standard deviation, in words; or what is missing to know them.
    fn offset(&self) -> Result<String, Finding> {
        match self.verdict {
            Extrinsics::Unknown { returns } => Err(not_checked(&format!(
                "{} returns on such surfaces; of {} scans {returns} are",
                DriftConfig::default().min_returns,
                self.cycles
            ))),
            Extrinsics::Undetermined { returns } => Err(not_checked(&format!(
                "surfaces of several directions; the {returns} returns on those of {} scans do not determine where the scanner is",
                self.cycles
            ))),
            Extrinsics::Uncertain { offset_m, std_dev_m, limit_m } => Err(not_checked(&format!(
                "a surer estimate than that of {} scans: it lies {offset_m:.3} m (+- {std_dev_m:.3}, limit {limit_m:.3}) beside them",
                self.cycles
            ))),
            Extrinsics::Right { offset_m, std_dev_m, limit_m }
            | Extrinsics::Wrong { offset_m, std_dev_m, limit_m } => Ok(format!(
                "{offset_m:.3} m (+- {std_dev_m:.3}, limit {limit_m:.3}) beside the surfaces that the camera sees"
            )),
        }
    }
}

/// The finding about the mount by which a run would go; or why it is not checked.
fn finding_of(
    by_parameters: &Judged,
    by_tf: Option<&ByTf>,
    source: ExtrinsicsSource,
    sensors: (&str, &str),
) -> Result<Finding, Finding> {
    const BY_PARAMETER: &str = "by the parameter rig_from_lidar";
    let reads_tf = source != ExtrinsicsSource::Parameters;
    if let Some(ByTf { judged, mounts }) = by_tf {
        let is_better = !reads_tf && by_parameters.is_wrong() && !judged.is_wrong();
        if let (true, Ok(by_tf)) = (is_better, judged.offset()) {
            let by_parameter = by_parameters.offset().map_or_else(
                |_| "most beams contradict what the camera sees".to_owned(),
                |offset| format!("the scan lies {offset}"),
            );
            return Ok(Finding::error(
                Check::Extrinsics,
                format!("{BY_PARAMETER} {by_parameter}, and by tf {by_tf}"),
                by_tf_fix(mounts.as_ref()),
            ));
        }
        let fix = format!("{CALIBRATE}, and set the mount in the robot's description");
        let found = judged.finding("by tf", (reads_tf, &fix), sensors);
        if reads_tf || found.is_ok() {
            return found;
        }
    }
    by_parameters.finding(BY_PARAMETER, (true, CALIBRATE), sensors)
}

fn by_tf_fix(mounts: Option<&RigMounts>) -> String {
    const FIX: &str = "a --params-file with `extrinsics: tf` under detection: ros__parameters:";
    mounts.map_or(FIX.to_owned(), |mounts| {
        format!("{FIX}, or `rig_from_lidar: {:.4?}`", pose_vector(&mounts.rig_from_lidar))
    })
}
