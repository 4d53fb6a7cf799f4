//! The configuration that the nodes of a pipeline must agree on: stated once for all of them, and carried with each cycle.

use std::fmt;

use nalgebra::Isometry3;

use crate::rig::mount_text;
use crate::{
    ExtrinsicsSource, Method, ParameterError, RigConfig, RigMounts, RobotBox, VoxelGrid,
    is_same_mount,
};

crate::parameters! {
    /// The configuration of a pipeline, as parameters: the same for detection, segmentation and reconstruction. A cycle carries
    /// what it was made with ([`CycleSetup`]), and a node refuses one that does not fit ([`PipelineConfig::check`]).
    #[derive(Clone, PartialEq, Debug)]
    pub struct PipelineConfig {
        /// How moving objects are found, cut out, and kept out of the map.
        // All improvements; the published method is there to be compared with.
        method: Method = Method::FreeSpace;
        /// Edge of the voxels in which moving objects are searched for: those that reduce the cloud, the cells of the depth
        /// histogram, and the evidence of free space. With the method rec_hv also the edge of the map's voxels.
        // t_vg. Rec-HV experiment 4 and section 5: the edge chosen out of 0.05 .. 0.16 m. Rec-HV 3.3.3.1 and 3.3.4: the
        // histogram and the map have the same.
        voxel_edge_m: f64 = 0.08, positive;
        /// Edge of the map's voxels. The map is made of the depth images: a surface, with a point and a normal a voxel.
        // Of the static scene of the demo a map at 3 cm keeps 97.5 %, at 2 cm 99.0 %, and a cycle takes 4 ms more. With edges
        // above 1 m the truncation, four edges, is beyond what a depth camera sees, and no map has a point.
        map_edge_m: f64 = 0.02, between(0.001, 1.0), read_with("method", "free_space");
        /// What moved and stays in its place counts as static after this time, for the scanner as for the camera.
        // Long enough for a talk; a chair that was moved is furniture again after a minute.
        max_stop_s: f64 = 60.0, above_to(0.0, LONGEST_S), read_with("method", "free_space"), formerly("stopped_object_s");
        /// Frames and mounts.
        rig: RigConfig as flatten;
    }
}

/// Evidence counts times in milliseconds of 32 bits.
const LONGEST_S: f64 = 1e6;

/// The setup a cycle was made with: the configuration of its pipeline, and the mounts as detection had them in that cycle, by its
/// parameters or by tf.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CycleSetup {
    /// The method.
    pub method: Method,
    /// The edge of the voxels that the cycle's points are means of.
    pub voxel_edge_m: f64,
    /// The edge of the voxels of a map of depth images; 0 with the method rec_hv, whose map is of the cycle's points.
    pub map_edge_m: f64,
    /// After how long what moved and stays in its place is static; 0 with the method rec_hv, which does not ask.
    pub max_stop_s: f64,
    /// Where camera and scanner were.
    pub mounts: RigMounts,
    /// Takes a point of the depth camera's optical frame to that of the colour camera, by detection's parameter; the identity
    /// without one. No node compares it: detection alone is told.
    pub colour_from_depth: Isometry3<f64>,
    /// The box around the robot itself, by detection's parameter. No node compares it, either.
    pub robot: Option<RobotBox>,
}

impl Default for CycleSetup {
    fn default() -> Self {
        PipelineConfig::default().setup()
    }
}

/// A cycle was made with another configuration than that of the node that received it.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[error(
    "{}: the nodes of a pipeline have one configuration; state it once for all of them, in a section /** of a parameter file \
     (config/pipeline.yaml)",
    Differences(differences)
)]
pub struct PipelineMismatch {
    /// At least one.
    pub differences: Vec<PipelineDifference>,
}

/// A parameter on which two nodes differ.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PipelineDifference {
    /// The parameter.
    pub parameter: &'static str,
    /// The value the cycle was made with.
    pub of_cycle: String,
    /// The value of the node.
    pub own: String,
}

/// The differences of a mismatch, in one line.
struct Differences<'a>(&'a [PipelineDifference]);

impl fmt::Display for Differences<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, PipelineDifference { parameter, of_cycle, own }) in self.0.iter().enumerate() {
            let separator = if index == 0 { "" } else { "; " };
            write!(formatter, "{separator}{parameter} is {of_cycle} in the cycle and {own} here")?;
        }
        Ok(())
    }
}

impl PipelineConfig {
    /// A pipeline by a method and with an edge, on the default rig.
    #[must_use]
    pub fn new(method: Method, voxel_edge_m: f64) -> Self {
        Self { method, voxel_edge_m, ..Self::default() }
    }

    /// The voxels.
    ///
    /// # Errors
    /// When their edge is no length.
    pub fn voxel_grid(&self) -> Result<VoxelGrid, ParameterError> {
        let edge_m = self.voxel_edge_m;
        VoxelGrid::new(edge_m).map_err(|_| ParameterError {
            name: "voxel_edge_m".into(),
            accepted: "above 0".into(),
            value: edge_m,
        })
    }

    /// Whether each cycle carries a depth image: its own, or one that is made of its cloud.
    #[must_use]
    pub fn needs_depth(&self) -> bool {
        self.method == Method::FreeSpace
    }

    /// The edge of the voxels of a map of depth images; `None` where the map is of the means of the reduced clouds.
    #[must_use]
    pub fn depth_map_edge_m(&self) -> Option<f64> {
        self.needs_depth().then_some(self.map_edge_m)
    }

    /// The setup of a cycle whose mounts are those of the parameters.
    #[must_use]
    pub fn setup(&self) -> CycleSetup {
        CycleSetup {
            method: self.method,
            voxel_edge_m: self.voxel_edge_m,
            map_edge_m: self.depth_map_edge_m().unwrap_or(0.0),
            max_stop_s: if self.method == Method::FreeSpace { self.max_stop_s } else { 0.0 },
            mounts: self.rig.mounts(),
            colour_from_depth: Isometry3::identity(),
            robot: None,
        }
    }

    /// Whether a cycle in the rig's frame `rig_frame_id` was made with this configuration. A mount that comes from tf is not
    /// compared: the cycle's is the one there is.
    ///
    /// # Errors
    /// When it was made with another, with both values of each parameter that differs.
    pub fn check(&self, setup: &CycleSetup, rig_frame_id: &str) -> Result<(), PipelineMismatch> {
        let mut differences = Vec::new();
        let mut differ = |parameter, of_cycle: String, own: String| {
            differences.push(PipelineDifference { parameter, of_cycle, own });
        };
        if setup.method != self.method {
            differ("method", setup.method.to_string(), self.method.to_string());
        }
        if setup.voxel_edge_m != self.voxel_edge_m {
            differ("voxel_edge_m", setup.voxel_edge_m.to_string(), self.voxel_edge_m.to_string());
        }
        let own = self.setup();
        // Another method has said so already.
        if setup.method == self.method {
            if setup.map_edge_m != own.map_edge_m {
                differ("map_edge_m", setup.map_edge_m.to_string(), own.map_edge_m.to_string());
            }
            if setup.max_stop_s != own.max_stop_s {
                differ("max_stop_s", setup.max_stop_s.to_string(), own.max_stop_s.to_string());
            }
        }
        if rig_frame_id != self.rig.rig_frame_id {
            differ("rig_frame_id", rig_frame_id.to_owned(), self.rig.rig_frame_id.clone());
        }
        let (of_cycle, own) = (&setup.mounts, own.mounts);
        if self.rig.extrinsics != ExtrinsicsSource::TfFromRig
            && !is_same_mount(&of_cycle.rig_from_camera, &own.rig_from_camera)
        {
            let (of_cycle, own) = (&of_cycle.rig_from_camera, &own.rig_from_camera);
            differ("rig_from_camera", mount_text(of_cycle), mount_text(own));
        }
        if self.rig.extrinsics == ExtrinsicsSource::Parameters
            && !is_same_mount(&of_cycle.rig_from_lidar, &own.rig_from_lidar)
        {
            let (of_cycle, own) = (&of_cycle.rig_from_lidar, &own.rig_from_lidar);
            differ("rig_from_lidar", mount_text(of_cycle), mount_text(own));
        }
        if differences.is_empty() { Ok(()) } else { Err(PipelineMismatch { differences }) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_is_named_with_both_values() {
        let config = PipelineConfig::default();
        let setup = config.setup();
        assert_eq!(config.check(&setup, "rig"), Ok(()));
        let mut other = PipelineConfig::new(Method::RecHv, 0.05);
        other.rig.rig_from_camera[0] = 0.1;
        other.rig.rig_from_lidar[2] = -0.8;
        let said = other.check(&setup, "base_link").unwrap_err().to_string();
        for both in [
            "method is free_space in the cycle and rec_hv here",
            "voxel_edge_m is 0.08 in the cycle and 0.05 here",
            "rig_frame_id is base_link in the cycle and rig here",
            "rig_from_camera is [0.000, 0.000, 0.000, -1.5708, 0.0000, -1.5708] in the cycle and [0.100, ",
            "rig_from_lidar is [0.000, 0.000, -0.050, 0.0000, 0.0000, 0.0000] in the cycle and [0.000, 0.000, -0.800, ",
        ] {
            assert!(said.contains(both), "{said}");
        }
        let finer = PipelineConfig { map_edge_m: 0.01, ..PipelineConfig::default() };
        let said = finer.check(&setup, "rig").unwrap_err().to_string();
        assert!(said.contains("map_edge_m is 0.02 in the cycle and 0.01 here"), "{said}");
        let sooner = PipelineConfig { max_stop_s: 10.0, ..PipelineConfig::default() };
        let said = sooner.check(&setup, "rig").unwrap_err().to_string();
        assert!(said.contains("max_stop_s is 60 in the cycle and 10 here"), "{said}");
        // rec_hv has no such edge, and no such time.
        let rec_hv = PipelineConfig::new(Method::RecHv, 0.08);
        let other = PipelineConfig { map_edge_m: 0.01, max_stop_s: 10.0, ..rec_hv.clone() };
        let setup = rec_hv.setup();
        assert_eq!(
            (other.check(&setup, "rig"), setup.map_edge_m, setup.max_stop_s),
            (Ok(()), 0.0, 0.0)
        );
    }

    #[test]
    fn a_mount_that_tf_gives_is_taken_as_it_is() {
        let mut by_tf = PipelineConfig::default();
        by_tf.rig.extrinsics = ExtrinsicsSource::Tf;
        let mut setup = by_tf.setup();
        setup.mounts.rig_from_lidar.translation.z = -0.8;
        assert_eq!(by_tf.check(&setup, "rig"), Ok(()));
        assert!(PipelineConfig::default().check(&setup, "rig").is_err());

        setup.mounts.rig_from_camera.translation.z = 1.1;
        assert!(by_tf.check(&setup, "rig").is_err(), "the camera's mount is a parameter");
        by_tf.rig.extrinsics = ExtrinsicsSource::TfFromRig;
        assert_eq!(by_tf.check(&setup, "rig"), Ok(()));
    }

    #[test]
    fn the_place_of_the_colour_camera_is_taken_as_the_cycle_has_it() {
        let config = PipelineConfig::default();
        let colour_from_depth = Isometry3::translation(-0.05, 0.0, 0.0);
        assert_eq!(
            config.check(&CycleSetup { colour_from_depth, ..config.setup() }, "rig"),
            Ok(())
        );
    }

    #[test]
    fn a_parameter_that_means_nothing_is_named() {
        let mut config = PipelineConfig { voxel_edge_m: 0.0, ..PipelineConfig::default() };
        assert!(config.validate().unwrap_err().to_string().contains("voxel_edge_m"));
        config.voxel_edge_m = 0.08;
        assert_eq!(config.validate(), Ok(()));
        for map_edge_m in [-0.02, 0.0, 0.0009, 2.0, f64::NAN, f64::INFINITY] {
            config.map_edge_m = map_edge_m;
            assert!(config.validate().unwrap_err().to_string().contains("map_edge_m"));
        }
        config.map_edge_m = 0.02;
        for max_stop_s in [-1.0, 0.0, 1.1e6, f64::NAN] {
            config.max_stop_s = max_stop_s;
            assert!(config.validate().unwrap_err().to_string().contains("max_stop_s"));
        }
        config = PipelineConfig::default();
        assert_eq!(config.validate(), Ok(()));
        config.rig.rig_from_lidar[0] = f64::NAN;
        assert!(config.validate().unwrap_err().to_string().contains("rig_from_lidar"));
        config.rig = RigConfig::default();
        config.rig.rig_from_camera[3] = f64::INFINITY;
        assert!(config.validate().unwrap_err().to_string().contains("rig_from_camera"));
    }
}
