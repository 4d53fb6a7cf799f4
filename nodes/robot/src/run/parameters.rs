//! The parameters of the three nodes, read as the nodes themselves would read them.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use detection::DetectionConfig;
use detection::shell::DetectionParameters;
use node_shell::parameters::{self, Assignment};
use pose::shell::PoseParameters;
use reconstruction::ReconstructionConfig;
use reconstruction::shell::ReconstructionParameters;
use segmentation::shell::SegmentationParameters;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::recorder::Stage;
use crate::failure::Failure;
use crate::visual;

/// Where parameters come from.
#[derive(Args, Clone, Debug, Default)]
pub struct ParameterArgs {
    /// A ROS 2 parameter file for the nodes; later ones override earlier ones
    #[arg(long = "params-file", value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The method of all three nodes, whatever the files say
    #[arg(long, value_enum)]
    method: Option<MethodName>,
}

/// The method of all three nodes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, ValueEnum, Serialize)]
#[value(rename_all = "snake_case")]
#[serde(rename_all = "snake_case")]
pub enum MethodName {
    /// Rec-HV as published
    RecHv,
    /// Free space, tracks and rays
    Stillmap,
}

impl MethodName {
    /// As the parameter files have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::RecHv => "rec_hv",
            Self::Stillmap => "stillmap",
        }
    }
}

impl ParameterArgs {
    /// The parameter files.
    pub(crate) fn files(&self) -> &[PathBuf] {
        &self.files
    }
}

/// The parameters of the whole pipeline.
pub struct PipelineParameters {
    detection: DetectionParameters,
    segmentation: SegmentationParameters,
    reconstruction: ReconstructionParameters,
    pose: PoseParameters,
}

impl PipelineParameters {
    /// The parameters of the files, with the method that the command line names.
    ///
    /// # Errors
    /// When a file cannot be read, is for none of the nodes, or has a parameter that is refused.
    pub fn load(args: &ParameterArgs) -> Result<Self, Failure> {
        for file in &args.files {
            check_addressees(file)?;
        }
        let mut parameters = Self {
            detection: load(Stage::Detection.name(), &args.files)?,
            segmentation: load(Stage::Segmentation.name(), &args.files)?,
            reconstruction: load(Stage::Reconstruction.name(), &args.files)?,
            pose: load(visual::NODE, &args.files)?,
        };
        if let Some(method) = args.method {
            parameters.set_method(method);
        }
        Ok(parameters)
    }

    /// The defaults of one method, with another edge of the voxels of the reduction and of the map where one
    /// is given.
    pub fn of_method(method: MethodName, voxel_edge_m: Option<f64>) -> Self {
        let mut parameters = Self {
            detection: DetectionParameters::default(),
            segmentation: SegmentationParameters::default(),
            reconstruction: ReconstructionParameters::default(),
            pose: PoseParameters::default(),
        };
        parameters.set_method(method);
        if let Some(edge_m) = voxel_edge_m {
            parameters.detection.config.voxel_edge_m = edge_m;
            // Rec-HV 3.2.6: the histogram's cells are those of the voxel grid.
            parameters.segmentation.config.depth_cell_m = edge_m;
            parameters.reconstruction.config.voxel_edge_m = edge_m;
        }
        parameters
    }

    fn set_method(&mut self, method: MethodName) {
        let (detection, segmentation, reconstruction) = match method {
            MethodName::RecHv => (
                detection::Method::RecHv,
                segmentation::Method::RecHv,
                reconstruction::Method::RecHv,
            ),
            MethodName::Stillmap => (
                detection::Method::Stillmap,
                segmentation::Method::Stillmap,
                reconstruction::Method::Stillmap,
            ),
        };
        self.detection.config.method = detection;
        self.segmentation.config.method = segmentation;
        self.reconstruction.config.method = reconstruction;
    }

    /// The method by its name, for the report. Each node has its own; where they differ, the report says so.
    pub fn method_name(&self) -> &'static str {
        let of_stillmap = [
            self.detection.config.method == detection::Method::Stillmap,
            self.segmentation.config.method == segmentation::Method::Stillmap,
            self.reconstruction.config.method == reconstruction::Method::Stillmap,
        ];
        match of_stillmap {
            [true, true, true] => MethodName::Stillmap.name(),
            [false, false, false] => MethodName::RecHv.name(),
            _ => "mixed",
        }
    }

    /// The parameters of the node detection.
    pub fn detection_node(&self) -> &DetectionParameters {
        &self.detection
    }

    /// The parameters of the node segmentation.
    pub fn segmentation_node(&self) -> &SegmentationParameters {
        &self.segmentation
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

    /// All parameters as a ROS 2 parameter file for the three nodes, in whatever namespace. A node of its own
    /// is given this and not the user's files: a section `/detection` would not be for one in a namespace.
    pub(crate) fn to_yaml(&self) -> Result<String, Failure> {
        let mut yaml = String::from("# The parameters of this run.\n");
        yaml.push_str(&section(Stage::Detection.name(), &self.detection)?);
        yaml.push_str(&section(Stage::Segmentation.name(), &self.segmentation)?);
        yaml.push_str(&section(Stage::Reconstruction.name(), &self.reconstruction)?);
        yaml.push_str(&section(visual::NODE, &self.pose)?);
        Ok(yaml)
    }
}

/// A file that is for none of the nodes is a mistake: its sections are misspelt.
fn check_addressees(file: &Path) -> Result<(), Failure> {
    for node in Stage::ALL.map(Stage::name).into_iter().chain([visual::NODE]) {
        let is_for = parameters::is_for(&format!("/{node}"), file)
            .map_err(|error| Failure::new(error.to_string()))?;
        if is_for {
            return Ok(());
        }
    }
    Err(Failure::new(format!("the parameter file {} is for none of the nodes", file.display()))
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
    P: Serialize + DeserializeOwned + Default,
{
    parameters::load(&format!("/{node}"), files, &[] as &[Assignment])
        .map_err(|error| Failure::new(error.to_string()))
}
