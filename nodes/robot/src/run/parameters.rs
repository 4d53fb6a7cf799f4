//! The parameters of the three nodes, read as the nodes themselves would read them.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use detection::DetectionConfig;
use detection::shell::{ColourInput, DetectionParameters, PoseInput};
use geometry::parameter::Parameters;
use geometry::{ExtrinsicsSource, Method, PipelineConfig, RigMounts};
use node_shell::parameters::{self, Assignment, ParameterError};
use pose::shell::PoseParameters;
use reconstruction::shell::ReconstructionParameters;
use reconstruction::{GridSource, ReconstructionConfig};
use segmentation::shell::{FilterParameters, SegmentationParameters};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::recorder::Stage;
use super::tf_frames::TfFrames;
use crate::console;
use crate::failure::Failure;
use crate::known_parameters::KnownNames;
use crate::visual;

/// Where parameters come from.
#[derive(Args, Clone, Debug, Default)]
pub struct ParameterArgs {
    /// A ROS 2 parameter file for the nodes; later ones override earlier ones
    #[arg(long = "params-file", value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// The method of all three nodes, whatever the files say (default: what they say, or free_space)
    #[arg(long, value_parser = method_parser())]
    pub method: Option<Method>,
    /// Edge of the map's voxels, in metres; of the method free_space (default: map_edge_m of the files, or 0.02)
    #[arg(long, value_name = "METRES")]
    pub map_edge: Option<f64>,
    /// Make the occupancy grid for navigation, too: of the scans alone, or of the map between two heights above the floor
    #[arg(long, value_name = "SOURCE", value_parser = grid_parser())]
    pub grid: Option<GridSource>,
}

impl ParameterArgs {
    /// What the files have for all nodes and is likely misspelt.
    ///
    /// # Errors
    /// When a file cannot be read as a parameter file.
    pub(crate) fn misspelt(&self) -> Result<Vec<String>, Failure> {
        let failed = |error: ParameterError| Failure::of_parameters(&error);
        let known = KnownNames::all().map_err(failed)?;
        let nodes = NODES.map(|node| format!("/{node}"));
        let said = self.files.iter().map(|file| known.misspelt(&nodes, file));
        Ok(said.collect::<Result<Vec<_>, _>>().map_err(failed)?.concat())
    }
}

/// Reads the source of a grid off the command line.
fn grid_parser() -> impl TypedValueParser<Value = GridSource> {
    let sources = [GridSource::None, GridSource::Scan, GridSource::HeightBand];
    let named = sources.map(|source| (source.name(), source));
    PossibleValuesParser::new(named.map(|(name, _)| name)).map(move |text| {
        let found = named.into_iter().find(|(name, _)| *name == text);
        found.map(|(_, source)| source).unwrap_or_default()
    })
}

/// Reads a method off the command line; its former name is accepted, with a note.
pub fn method_parser() -> impl TypedValueParser<Value = Method> {
    const RENAMED: &str = "stillmap";
    let names = [
        PossibleValue::new(Method::RecHv.name()).help("Rec-HV as published"),
        PossibleValue::new(Method::FreeSpace.name())
            .help("Free space, tracks and rays")
            .alias(RENAMED),
    ];
    PossibleValuesParser::new(names).try_map(|name| {
        if name == RENAMED {
            console::note(format_args!("--method {name} is called {} now", Method::FreeSpace));
        }
        Method::of_name(&name).ok_or(UnknownMethod)
    })
}

/// A name of no method.
#[derive(Clone, Copy, Debug, thiserror::Error)]
#[error("no such method")]
pub struct UnknownMethod;

impl ParameterArgs {
    /// The parameter files.
    pub(crate) fn files(&self) -> &[PathBuf] {
        &self.files
    }
}

/// The parameter that says where the mounts come from.
const EXTRINSICS: &str = "extrinsics";

/// The parameters of the whole pipeline.
pub struct PipelineParameters {
    detection: DetectionParameters,
    segmentation: SegmentationParameters,
    reconstruction: ReconstructionParameters,
    pose: PoseParameters,
    states_extrinsics: bool,
}

impl PipelineParameters {
    /// The parameters of the files, with the method and the edge of the map that the command line names.
    ///
    /// # Errors
    /// When a file cannot be read, is for none of the nodes, or has a parameter that is refused.
    pub fn load(args: &ParameterArgs) -> Result<Self, Failure> {
        for file in &args.files {
            check_sections(file)?;
        }
        let detection = format!("/{}", Stage::Detection.name());
        let states_extrinsics = parameters::is_given(&detection, &args.files, EXTRINSICS)
            .map_err(|error| Failure::of_parameters(&error))?;
        let mut parameters = Self {
            states_extrinsics,
            detection: load(Stage::Detection.name(), &args.files)?,
            segmentation: load(Stage::Segmentation.name(), &args.files)?,
            reconstruction: load(Stage::Reconstruction.name(), &args.files)?,
            pose: load(visual::NODE, &args.files)?,
        };
        for pipeline in parameters.pipelines_mut() {
            pipeline.method = args.method.unwrap_or(pipeline.method);
            pipeline.map_edge_m = args.map_edge.unwrap_or(pipeline.map_edge_m);
        }
        check_map_edge(args.map_edge, parameters.pipeline())?;
        let grid = &mut parameters.reconstruction.config.grid;
        grid.grid = args.grid.unwrap_or(grid.grid);
        // The map of a run is that of its bag alone, and is written to the folder of the run.
        parameters.reconstruction.map_file = String::new();
        parameters.reconstruction.grid_file = String::new();
        parameters.reconstruction.mesh_file = String::new();
        let checked = parameters.reconstruction.config.validate();
        checked.map_err(|error| Failure::unusable(error.to_string()))?;
        let [segmentation, reconstruction] =
            [&parameters.segmentation.config.pipeline, &parameters.reconstruction.config.pipeline];
        check_agreement(parameters.pipeline(), segmentation, reconstruction)?;
        Ok(parameters)
    }

    /// The defaults of one method, with another edge of the voxels where one is given.
    pub fn of_method(method: Method, voxel_edge_m: Option<f64>) -> Self {
        let edge_m = voxel_edge_m.unwrap_or(PipelineConfig::default().voxel_edge_m);
        let mut parameters = Self {
            detection: DetectionParameters::default(),
            segmentation: SegmentationParameters::default(),
            reconstruction: ReconstructionParameters::default(),
            pose: PoseParameters::default(),
            states_extrinsics: false,
        };
        for pipeline in parameters.pipelines_mut() {
            *pipeline = PipelineConfig::new(method, edge_m);
        }
        parameters
    }

    fn pipelines_mut(&mut self) -> [&mut PipelineConfig; 3] {
        [
            &mut self.detection.config.pipeline,
            &mut self.segmentation.config.pipeline,
            &mut self.reconstruction.config.pipeline,
        ]
    }

    /// Whether an occupancy grid is to be made.
    pub(super) fn wants_grid(&self) -> bool {
        self.reconstruction.config.grid.grid != GridSource::None
    }

    /// Takes the poses from another source than the files say.
    pub(super) fn set_pose_source(&mut self, source: PoseInput) {
        self.detection.pose_source = source;
    }

    /// Takes the colours of the map from another source than the files say.
    pub(crate) fn set_colour(&mut self, source: ColourInput) {
        self.detection.colour = source;
    }

    /// Takes the frames of a bag's tf, and the mounts from where they are.
    pub(super) fn set_tf_frames(&mut self, frames: &TfFrames, extrinsics: ExtrinsicsSource) {
        self.detection.map_frame_id.clone_from(&frames.map);
        for pipeline in self.pipelines_mut() {
            pipeline.rig.rig_frame_id.clone_from(&frames.robot);
            pipeline.rig.extrinsics = extrinsics;
        }
    }

    /// Whether the files say how the sensors are mounted, or where that is to be read.
    pub(super) fn say_mounts(&self) -> bool {
        let rig = &self.pipeline().rig;
        self.states_extrinsics
            || rig.extrinsics != ExtrinsicsSource::Parameters
            || rig.mounts() != RigMounts::default()
    }

    /// The parameters that the nodes share.
    pub fn pipeline(&self) -> &PipelineConfig {
        &self.detection.config.pipeline
    }

    /// The parameters of the node detection.
    pub fn detection_node(&self) -> &DetectionParameters {
        &self.detection
    }

    /// The parameters of the node segmentation.
    pub fn segmentation_node(&self) -> &SegmentationParameters {
        &self.segmentation
    }

    /// Those of the filtered topics.
    pub(crate) fn filter_mut(&mut self) -> &mut FilterParameters {
        &mut self.segmentation.filter
    }

    /// The parameters of the node reconstruction.
    pub fn reconstruction_node(&self) -> &ReconstructionParameters {
        &self.reconstruction
    }

    pub(crate) fn pose_node(&self) -> &PoseParameters {
        &self.pose
    }

    /// The parameters of the detector.
    pub fn detection(&self) -> &DetectionConfig {
        &self.detection.config
    }

    /// The parameters of the map.
    pub fn reconstruction(&self) -> &ReconstructionConfig {
        &self.reconstruction.config
    }

    /// All parameters as a ROS 2 parameter file for the three nodes, in whatever namespace. A node in a
    /// process of its own gets this file and not the user's: a section `/detection` does not apply to a node in a namespace.
    pub(crate) fn to_yaml(&self) -> Result<String, Failure> {
        let mut yaml = String::from("# The parameters of this run.\n");
        yaml.push_str(&section(Stage::Detection.name(), &self.detection)?);
        yaml.push_str(&section(Stage::Segmentation.name(), &self.segmentation)?);
        yaml.push_str(&section(Stage::Reconstruction.name(), &self.reconstruction)?);
        yaml.push_str(&section(visual::NODE, &self.pose)?);
        Ok(yaml)
    }
}

/// Refuses an edge of the map that the method does not use.
///
/// # Errors
/// When an edge is given with the method `rec_hv`.
pub(crate) fn check_map_edge(
    map_edge_m: Option<f64>,
    pipeline: &PipelineConfig,
) -> Result<(), Failure> {
    if map_edge_m.is_some() && pipeline.depth_map_edge_m().is_none() {
        let method = pipeline.method;
        return Err(Failure::unusable(format!(
            "--map-edge is of the method free_space: the map of {method} has the edge voxel_edge_m"
        ))
        .fix("leave it out, or choose --method free_space"));
    }
    Ok(())
}

/// Refuses nodes that differ in parameters that must be equal, before they refuse each other's cycles.
///
/// # Errors
/// With both values of each parameter that differs.
pub(crate) fn check_agreement(
    detection: &PipelineConfig,
    segmentation: &PipelineConfig,
    reconstruction: &PipelineConfig,
) -> Result<(), Failure> {
    let others = [
        (Stage::Segmentation.name(), segmentation),
        (Stage::Reconstruction.name(), reconstruction),
    ];
    for (node, own) in others {
        let found = own.check(&detection.setup(), &detection.rig.rig_frame_id);
        let mut differences: Vec<String> = found
            .err()
            .into_iter()
            .flat_map(|mismatch| mismatch.differences)
            .map(|one| {
                format!(
                    "{} is {} of detection and {} of {node}",
                    one.parameter, one.of_cycle, one.own
                )
            })
            .collect();
        if detection.rig.extrinsics != own.rig.extrinsics {
            differences.push(format!("extrinsics of detection is not that of {node}"));
        }
        if !differences.is_empty() {
            return Err(Failure::unusable(differences.join("; ")).fix(
                "set it once, in a section /** of the parameter file (config/pipeline.yaml)",
            ));
        }
    }
    Ok(())
}

/// The nodes that take their parameters from the files.
const NODES: [&str; 4] = [
    Stage::Detection.name(),
    Stage::Segmentation.name(),
    Stage::Reconstruction.name(),
    visual::NODE,
];

/// A file without a section for any of the nodes is an error: its sections are misspelt.
fn check_sections(file: &Path) -> Result<(), Failure> {
    for node in NODES {
        let is_for = parameters::is_for(&format!("/{node}"), file)
            .map_err(|error| Failure::of_parameters(&error))?;
        if is_for {
            return Ok(());
        }
    }
    Err(Failure::unusable(format!("the parameter file {} is for none of the nodes", file.display()))
        .fix("its sections must be named detection, segmentation, reconstruction or pose (or /**/detection, ...)"))
}

/// The section of a node. JSON is YAML.
fn section(node: &str, parameters: &impl Serialize) -> Result<String, Failure> {
    let json = serde_json::to_string_pretty(parameters)
        .map_err(|error| Failure::new(format!("cannot write the parameters: {error}")))?;
    let indented = json.replace('\n', "\n    ");
    Ok(format!("/**/{node}:\n  ros__parameters:\n    {indented}\n"))
}

fn load<P>(node: &str, files: &[PathBuf]) -> Result<P, Failure>
where
    P: Parameters + Serialize + DeserializeOwned + Default,
{
    parameters::load(&format!("/{node}"), files, &[] as &[Assignment])
        .map_err(|error| Failure::of_parameters(&error))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: a misspelt parameter in a section `/**`, as the shipped file has it, was without effect, in silence.
    #[test]
    fn a_misspelt_parameter_for_all_nodes_is_said() {
        let said_of = |key: &str| {
            let file = tempfile::NamedTempFile::new().unwrap();
            let yaml = format!("/**:\n  ros__parameters:\n    voxel_edge_m: 0.08\n    {key}\n");
            std::fs::write(file.path(), yaml).unwrap();
            let args = ParameterArgs { files: vec![file.path().to_owned()], ..Default::default() };
            // It may be for another node of the graph.
            PipelineParameters::load(&args).unwrap();
            args.misspelt().unwrap()
        };
        let said = said_of("max_stop: 20.0");
        assert_eq!(said.len(), 1, "{said:?}");
        for wanted in [
            "line 4",
            "no node of stillmap has a parameter `max_stop`",
            "`max_stop_s`, of detection",
        ] {
            assert!(said[0].contains(wanted), "{wanted}: {said:?}");
        }
        // Of other nodes of the same graph, of every node, of a node that `run` does not start, and by a former name.
        for known in [
            "robot_description: x",
            "use_sim_time: true",
            "loop_closing: true",
            "stopped_object_s: 9.0",
            "odom_frame: odom",
            "base_frame: base_link",
            "publish_rate: 9.0",
        ] {
            assert_eq!(said_of(known), Vec::<String>::new(), "{known}");
        }
    }
}
