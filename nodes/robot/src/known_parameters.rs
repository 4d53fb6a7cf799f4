//! The parameters that the nodes have by name: what is given for none in particular is known to one of them, or is misspelt.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use detection::shell::DetectionParameters;
use geometry::parameter::all_parameters;
use lidar_odometry::shell::LidarOdometryParameters;
use node_shell::RosArguments;
use node_shell::arguments::ParameterSource;
use node_shell::parameters::{
    self, NodeParameters, ParameterError, nearest_name, nearest_name_within,
};
use pose::shell::PoseParameters;
use reconstruction::shell::ReconstructionParameters;
use segmentation::shell::SegmentationParameters;

use crate::failure::Failure;
use crate::run::Stage;
use crate::up::PoseNode;

/// What `node_shell` adds to the parameters of each node.
const OF_EVERY_NODE: [&str; 2] = ["use_sim_time", "autostart"];

/// By more letters, names of the drivers and of other nodes of a graph are like those of the suite: a unit is left out with two.
const MOST_LETTERS_MISSPELT: usize = 2;

/// The parameters that each node knows.
pub(crate) struct KnownNames {
    pub(crate) detection: BTreeSet<String>,
    pub(crate) segmentation: BTreeSet<String>,
    pub(crate) reconstruction: BTreeSet<String>,
    pub(crate) pose: BTreeSet<String>,
    pub(crate) lidar_odometry: BTreeSet<String>,
    pub(crate) all: BTreeSet<String>,
    /// What parameters were called before.
    former: BTreeSet<&'static str>,
}

impl KnownNames {
    /// Those of all nodes.
    ///
    /// # Errors
    /// When the parameters of a node cannot be written.
    pub(crate) fn all() -> Result<Self, ParameterError> {
        fn names<P: NodeParameters>() -> Result<BTreeSet<String>, ParameterError> {
            Ok(parameters::describe::<P>()?.into_iter().map(|(name, _)| name).collect())
        }
        fn former<P: NodeParameters>() -> impl Iterator<Item = &'static str> {
            all_parameters(P::DECLARATIONS)
                .into_iter()
                .filter_map(|one| one.declaration.former_name)
        }
        let mut known = Self {
            detection: names::<DetectionParameters>()?,
            segmentation: names::<SegmentationParameters>()?,
            reconstruction: names::<ReconstructionParameters>()?,
            pose: names::<PoseParameters>()?,
            lidar_odometry: names::<LidarOdometryParameters>()?,
            all: BTreeSet::new(),
            former: former::<DetectionParameters>()
                .chain(former::<SegmentationParameters>())
                .chain(former::<ReconstructionParameters>())
                .chain(former::<PoseParameters>())
                .chain(former::<LidarOdometryParameters>())
                .collect(),
        };
        known.all = known.by_node().into_iter().flat_map(|(_, names)| names).cloned().collect();
        Ok(known)
    }

    fn by_node(&self) -> [(&'static str, &BTreeSet<String>); 5] {
        [
            (Stage::Detection.name(), &self.detection),
            (Stage::Segmentation.name(), &self.segmentation),
            (Stage::Reconstruction.name(), &self.reconstruction),
            (PoseNode::Visual.name(), &self.pose),
            (PoseNode::Lidar.name(), &self.lidar_odometry),
        ]
    }

    /// Refuses a parameter that is given for no node in particular, and that none has.
    pub(crate) fn check(&self, arguments: &RosArguments) -> Result<(), Failure> {
        for source in &arguments.parameters {
            let ParameterSource::Assignment { node: None, name, .. } = source else { continue };
            // A group is refused with its parameters by the node that has it.
            let is_in = |known: &String| {
                known
                    .strip_prefix(name.as_str())
                    .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
            };
            if OF_EVERY_NODE.contains(&name.as_str()) || self.all.iter().any(is_in) {
                continue;
            }
            return Err(self.unknown(name, self.nearest(name)).for_good());
        }
        Ok(())
    }

    /// What to say of the parameters that a file has for nodes of any name, and that no node of the suite has, where one is called nearly
    /// so. They are not refused: a file with a section `/**` is for all nodes that are started with it, and another may have them. `nodes`
    /// are full names.
    ///
    /// # Errors
    /// When the file cannot be read as a parameter file.
    pub(crate) fn misspelt(
        &self,
        nodes: &[String],
        file: &Path,
    ) -> Result<Vec<String>, ParameterError> {
        let mut shared: BTreeMap<u64, String> = BTreeMap::new();
        for node in nodes {
            shared.extend(
                parameters::shared(node, file)?.into_iter().map(|one| (one.line, one.name)),
            );
        }
        let said = shared.into_iter().filter_map(|(line, name)| {
            let is_known = OF_EVERY_NODE.contains(&name.as_str())
                || self.all.contains(&name)
                || self.former.contains(name.as_str());
            let known = self.all.iter().map(String::as_str).filter(|_| !is_known);
            let nearest = nearest_name_within(&name, known, MOST_LETTERS_MISSPELT)?;
            Some(format!(
                "{}, line {line}: no node of stillmap has a parameter `{name}`, if it is none of another node: {}",
                file.display(),
                self.proposal(nearest)
            ))
        });
        Ok(said.collect())
    }

    fn nearest(&self, name: &str) -> Option<&str> {
        nearest_name(name, self.all.iter().map(String::as_str))
    }

    fn proposal(&self, nearest: &str) -> String {
        let of = self.by_node().into_iter().filter(|(_, names)| names.contains(nearest));
        let nodes: Vec<&str> = of.map(|(node, _)| node).collect();
        format!("did you mean `{nearest}`, of {}?", nodes.join(", "))
    }

    fn unknown(&self, name: &str, nearest: Option<&str>) -> Failure {
        Failure::new(format!("no node has a parameter `{name}`")).fix(match nearest {
            Some(nearest) => self.proposal(nearest),
            None => "`stillmap node NODE --help` lists those of a node: detection, segmentation, reconstruction, pose, \
                     lidar-odometry"
                .to_owned(),
        })
    }
}
