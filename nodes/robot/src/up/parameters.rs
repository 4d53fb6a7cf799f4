//! The parameters of all nodes of `stillmap up`, read and checked before one of them starts.

use std::collections::BTreeSet;

use detection::shell::DetectionParameters;
use lidar_odometry::shell::LidarOdometryParameters;
use node_shell::RosArguments;
use node_shell::arguments::ParameterSource;
use node_shell::parameters::{self, NodeParameters, ParameterError};
use pose::shell::PoseParameters;
use reconstruction::shell::ReconstructionParameters;
use segmentation::shell::SegmentationParameters;
use tracing::Span;

use super::{PoseNode, span};
use crate::failure::Failure;
use crate::run::Stage;
use crate::run::parameters::{check_agreement, check_map_edge};

/// The parameters of the nodes.
pub(super) struct SuiteParameters {
    pub(super) detection: DetectionParameters,
    pub(super) segmentation: SegmentationParameters,
    pub(super) reconstruction: ReconstructionParameters,
    pub(super) odometry: Option<OdometryParameters>,
}

/// The parameters of the node that publishes the pose.
pub(super) enum OdometryParameters {
    Visual(Box<PoseParameters>),
    Lidar(Box<LidarOdometryParameters>),
}

impl OdometryParameters {
    /// Whose they are.
    pub(super) fn node(&self) -> PoseNode {
        match self {
            Self::Visual(_) => PoseNode::Visual,
            Self::Lidar(_) => PoseNode::Lidar,
        }
    }
}

impl SuiteParameters {
    /// What the arguments say, with a further node for the pose. `map_edge_m` is the option's, which is among the arguments.
    ///
    /// # Errors
    /// When a file or a value cannot be used, a parameter does not hold, or nodes differ that must not.
    pub(super) fn of(
        arguments: &RosArguments,
        pose: Option<PoseNode>,
        map_edge_m: Option<f64>,
    ) -> Result<Self, Failure> {
        let known = KnownNames::all().map_err(|error| Failure::new(error.to_string()))?;
        let reader = Reader { arguments, all: &known.all };
        let of_stage = |stage: Stage| (stage.name(), span(stage));
        let of_pose = |pose: PoseNode| (pose.name(), pose.span());
        let odometry = |pose: PoseNode| {
            Ok(match pose {
                PoseNode::Visual => {
                    let read = reader.read(of_pose(pose), &known.pose)?;
                    OdometryParameters::Visual(Box::new(read))
                }
                PoseNode::Lidar => {
                    let read = reader.read(of_pose(pose), &known.lidar_odometry)?;
                    OdometryParameters::Lidar(Box::new(read))
                }
            })
        };
        let read = Self {
            detection: reader.read(of_stage(Stage::Detection), &known.detection)?,
            segmentation: reader.read(of_stage(Stage::Segmentation), &known.segmentation)?,
            reconstruction: reader.read(of_stage(Stage::Reconstruction), &known.reconstruction)?,
            odometry: pose.map(odometry).transpose()?,
        };
        let [detection, segmentation, reconstruction] = [
            &read.detection.config.pipeline,
            &read.segmentation.config.pipeline,
            &read.reconstruction.config.pipeline,
        ];
        check_agreement(detection, segmentation, reconstruction)?;
        check_map_edge(map_edge_m, reconstruction)?;
        Ok(read)
    }
}

/// Reads the parameters of one node after the other.
#[derive(Clone, Copy)]
struct Reader<'a> {
    arguments: &'a RosArguments,
    /// The parameters of any node.
    all: &'a BTreeSet<String>,
}

impl Reader<'_> {
    fn read<P: NodeParameters>(
        self,
        (node, span): (&str, Span),
        own: &BTreeSet<String>,
    ) -> Result<P, Failure> {
        let _named = span.entered();
        let arguments = self.for_one(own);
        arguments.parameters_of(node).map_err(|error| Failure::new(format!("{node}: {error}")))
    }

    /// The arguments for one node, without parameters that are given for no node in particular and that only other nodes have.
    fn for_one(self, own: &BTreeSet<String>) -> RosArguments {
        let mut arguments = self.arguments.clone();
        arguments.parameters.retain(|source| match source {
            ParameterSource::Assignment { node: None, name, .. } => {
                own.contains(name) || !self.all.contains(name)
            }
            _ => true,
        });
        arguments
    }
}

/// The parameters that each node knows.
struct KnownNames {
    detection: BTreeSet<String>,
    segmentation: BTreeSet<String>,
    reconstruction: BTreeSet<String>,
    pose: BTreeSet<String>,
    lidar_odometry: BTreeSet<String>,
    all: BTreeSet<String>,
}

impl KnownNames {
    fn all() -> Result<Self, ParameterError> {
        fn names<P: NodeParameters>() -> Result<BTreeSet<String>, ParameterError> {
            Ok(parameters::describe::<P>()?.into_iter().map(|(name, _)| name).collect())
        }
        let mut known = Self {
            detection: names::<DetectionParameters>()?,
            segmentation: names::<SegmentationParameters>()?,
            reconstruction: names::<ReconstructionParameters>()?,
            pose: names::<PoseParameters>()?,
            lidar_odometry: names::<LidarOdometryParameters>()?,
            all: BTreeSet::new(),
        };
        let each = [
            &known.detection,
            &known.segmentation,
            &known.reconstruction,
            &known.pose,
            &known.lidar_odometry,
        ];
        known.all = each.into_iter().flatten().cloned().collect();
        Ok(known)
    }
}
