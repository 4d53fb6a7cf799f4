//! The parameters of the three nodes, read as the nodes themselves would read them.

use std::path::PathBuf;

use clap::Args;
use detection::DetectionConfig;
use detection::shell::DetectionParameters;
use node_shell::parameters::{self, Assignment};
use reconstruction::ReconstructionConfig;
use reconstruction::shell::ReconstructionParameters;
use segmentation::SegmentationConfig;
use segmentation::shell::SegmentationParameters;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::recorder::Stage;
use crate::failure::Failure;

/// Where parameters come from.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct ParameterArgs {
    /// A ROS 2 parameter file for the nodes; later ones override earlier ones
    #[arg(long = "params-file", value_name = "FILE")]
    files: Vec<PathBuf>,
}

impl ParameterArgs {
    /// The same with one file before all others.
    pub(crate) fn after(&self, first: PathBuf) -> Self {
        Self { files: std::iter::once(first).chain(self.files.iter().cloned()).collect() }
    }
}

/// The parameters of the whole pipeline.
pub(crate) struct PipelineParameters {
    files: Vec<PathBuf>,
    detection: DetectionParameters,
    segmentation: SegmentationParameters,
    reconstruction: ReconstructionParameters,
}

impl PipelineParameters {
    pub(crate) fn load(args: &ParameterArgs) -> Result<Self, Failure> {
        Ok(Self {
            detection: load(Stage::Detection, &args.files)?,
            segmentation: load(Stage::Segmentation, &args.files)?,
            reconstruction: load(Stage::Reconstruction, &args.files)?,
            files: args.files.clone(),
        })
    }

    pub(crate) fn detection(&self) -> &DetectionConfig {
        &self.detection.config
    }

    pub(crate) fn segmentation(&self) -> &SegmentationConfig {
        &self.segmentation.config
    }

    pub(crate) fn reconstruction(&self) -> &ReconstructionConfig {
        &self.reconstruction.config
    }

    /// The arguments that give a node of its own these parameters.
    pub(crate) fn node_arguments(&self) -> Vec<String> {
        self.files
            .iter()
            .flat_map(|file| ["--params-file".to_owned(), file.display().to_string()])
            .collect()
    }
}

fn load<P>(stage: Stage, files: &[PathBuf]) -> Result<P, Failure>
where
    P: Serialize + DeserializeOwned + Default,
{
    parameters::load(&format!("/{}", stage.name()), files, &[] as &[Assignment])
        .map_err(|error| Failure::new(error.to_string()))
}
