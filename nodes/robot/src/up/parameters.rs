//! The parameters of all nodes of `stillmap up`, read and checked before one of them starts.

use std::collections::BTreeSet;

use detection::shell::DetectionParameters;
use lidar_odometry::shell::LidarOdometryParameters;
use node_shell::RosArguments;
use node_shell::arguments::ParameterSource;
use node_shell::parameters::{NodeParameters, ParameterError, nearest_name};
use pose::shell::PoseParameters;
use reconstruction::shell::ReconstructionParameters;
use segmentation::shell::SegmentationParameters;

use super::PoseNode;
use crate::failure::Failure;
use crate::known_parameters::KnownNames;
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
        check_named_nodes(arguments)?;
        known.check(arguments)?;
        let nodes = full_names(arguments)?;
        for source in &arguments.parameters {
            // A file that cannot be read is refused by the node that reads it.
            if let ParameterSource::File(file) = source
                && let Ok(misspelt) = known.misspelt(&nodes, file)
            {
                misspelt.iter().for_each(|misspelt| tracing::warn!("{misspelt}"));
            }
        }
        let reader = Reader { arguments, all: &known.all };
        let odometry = |pose: PoseNode| {
            Ok(match pose {
                PoseNode::Visual => {
                    let read = reader.read(pose.name(), &known.pose)?;
                    OdometryParameters::Visual(Box::new(read))
                }
                PoseNode::Lidar => {
                    let read = reader.read(pose.name(), &known.lidar_odometry)?;
                    OdometryParameters::Lidar(Box::new(read))
                }
            })
        };
        let read = Self {
            detection: reader.read(Stage::Detection.name(), &known.detection)?,
            segmentation: reader.read(Stage::Segmentation.name(), &known.segmentation)?,
            reconstruction: reader.read(Stage::Reconstruction.name(), &known.reconstruction)?,
            odometry: pose.map(odometry).transpose()?,
        };
        let [detection, segmentation, reconstruction] = [
            &read.detection.config.pipeline,
            &read.segmentation.config.pipeline,
            &read.reconstruction.config.pipeline,
        ];
        check_agreement(detection, segmentation, reconstruction).map_err(Failure::for_good)?;
        check_map_edge(map_edge_m, reconstruction).map_err(Failure::for_good)?;
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
    fn read<P: NodeParameters>(self, node: &str, own: &BTreeSet<String>) -> Result<P, Failure> {
        let arguments = self.for_one(own);
        arguments.parameters_of(node).map_err(|error| {
            let failure = Failure::new(format!("{node}: {error}"));
            if ParameterError::is_for_good_in(&error) { failure.for_good() } else { failure }
        })
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

/// The nodes that `stillmap up` can start, as the program calls them.
const NODES: [&str; 7] = [
    Stage::Detection.name(),
    Stage::Segmentation.name(),
    Stage::Reconstruction.name(),
    PoseNode::Visual.name(),
    PoseNode::Lidar.name(),
    live_view::shell::NODE,
    live_view::shell::FOXGLOVE_NODE,
];

/// The names of the nodes in their namespaces.
fn full_names(arguments: &RosArguments) -> Result<Vec<String>, Failure> {
    let full_name = |name: &&str| match arguments.identity(name) {
        Ok(identity) => Ok(identity.full_name()),
        Err(error) => Err(Failure::new(error.to_string()).for_good()),
    };
    NODES.iter().map(full_name).collect()
}

/// Refuses what is said of one node, by its name or by the one that it is given, where there is none of that name.
fn check_named_nodes(arguments: &RosArguments) -> Result<(), Failure> {
    let mut names: BTreeSet<String> = NODES.iter().map(|&name| name.to_owned()).collect();
    for name in NODES {
        let identity =
            arguments.identity(name).map_err(|error| Failure::new(error.to_string()).for_good())?;
        names.insert(identity.name().to_owned());
    }
    let Some(unknown) = arguments.named_nodes().find(|&name| !names.contains(name)) else {
        return Ok(());
    };
    let nearest = nearest_name(unknown, names.iter().map(String::as_str));
    let failure = Failure::new(format!("no node is called `{unknown}`")).for_good();
    Err(failure.fix(match nearest {
        Some(nearest) => format!("did you mean `{nearest}`?"),
        None => format!("the nodes are: {}", NODES.join(", ")),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: `-p reconstructoin:map_file:=map.ply` and `-r detecton:scan:=/laser` were without effect, in silence.
    #[test]
    fn a_node_that_is_none_is_refused() {
        let refusal = |words: &[&str]| {
            let arguments = RosArguments::parse([&["--ros-args"], words].concat()).unwrap();
            SuiteParameters::of(&arguments, None, None).err().map(|failure| failure.to_string())
        };
        let parameter = refusal(&["-p", "reconstructoin:map_file:=map.ply"]).unwrap();
        let wanted = "no node is called `reconstructoin`\n";
        assert!(parameter.starts_with(wanted), "{parameter}");
        assert!(parameter.contains("did you mean `reconstruction`?"), "{parameter}");
        let remapping = refusal(&["-r", "detecton:scan:=/laser/scan"]).unwrap();
        assert!(remapping.contains("did you mean `detection`?"), "{remapping}");
        let namespace = refusal(&["-r", "mapper:__ns:=/robot"]).unwrap();
        assert!(namespace.contains("the nodes are: detection, segmentation"), "{namespace}");
        let renamed = ["-r", "detection:__node:=left", "-p", "left:autostart:=false"];
        assert_eq!(refusal(&renamed), None);
        assert_eq!(refusal(&["-r", "live_view:scan:=/laser/scan"]), None);
    }

    /// Regression: a parameter that no node has was refused as one of detection.
    #[test]
    fn a_parameter_that_no_node_has_names_the_nodes_that_have_one_like_it() {
        let refusal = |assignment: &str| {
            let arguments = RosArguments::parse(["--ros-args", "-p", assignment]).unwrap();
            SuiteParameters::of(&arguments, None, None).err().map(|failure| failure.to_string())
        };
        let none = refusal("bogus:=1").unwrap();
        assert!(none.starts_with("no node has a parameter `bogus`\n"), "{none}");
        assert!(none.contains("`stillmap node NODE --help`"), "{none}");
        let like = refusal("max_voxel:=1").unwrap();
        assert!(like.contains("did you mean `max_voxels`, of reconstruction?"), "{like}");
        let shared = refusal("voxel_edge:=1").unwrap();
        let nodes = "`voxel_edge_m`, of detection, segmentation, reconstruction?";
        assert!(shared.contains(nodes), "{shared}");
        for known in ["max_voxels:=7", "use_sim_time:=true", "autostart:=false", "slam:=true"] {
            assert_eq!(refusal(known), None, "{known}");
        }
        // Of one node: as before.
        let own = refusal("detection:bogus:=1").unwrap();
        assert!(own.starts_with("detection: unknown parameter `bogus`"), "{own}");
    }
}
