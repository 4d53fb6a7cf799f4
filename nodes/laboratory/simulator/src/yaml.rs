//! Scenarios in YAML.

use crate::{MeshError, Scenario, ScenarioError};

/// A text is not a scenario.
#[derive(Debug, thiserror::Error)]
pub enum YamlError {
    /// It is not YAML.
    #[error("{0}")]
    Unreadable(String),
    /// A key or a value is invalid.
    #[error("{path}: {reason}")]
    Refused {
        /// The path of the key, such as `rig.lidar.beams` or `scene.bodies[2].shape`.
        path: String,
        /// The error, with line and column.
        reason: String,
    },
    /// The file of a mesh cannot be read.
    #[error("the mesh {file}: {reason}")]
    MeshFile {
        /// The file, as named in the scenario.
        file: String,
        /// The error.
        reason: String,
    },
    /// The triangles of a mesh are invalid.
    #[error("a mesh of the scene: {0}")]
    Mesh(#[from] MeshError),
    /// It can be read, but not simulated.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

/// Vertices, and triangles by the indices of their corners.
pub type Triangles = (Vec<[f64; 3]>, Vec<[u32; 3]>);

impl Scenario {
    /// A scenario from YAML. Missing keys have the values of [`Scenario::default`], those of sensors the values of
    /// [`crate::Lidar::rplidar_a1`] and [`crate::DepthCamera::kinect_v1`]. `scenes/example.yaml` shows and
    /// explains the keys.
    ///
    /// # Errors
    /// When the text is not YAML, has an invalid key or value, or describes a scenario that cannot be simulated.
    pub fn from_yaml(text: &str) -> Result<Self, YamlError> {
        Self::from_yaml_with_meshes(text, |_| Err("mesh files cannot be read here".to_owned()))
    }

    /// The same with meshes from files: `read` returns the vertices and triangles of a file, or a text of the error.
    ///
    /// # Errors
    /// As [`Scenario::from_yaml`], and when a file cannot be read.
    pub fn from_yaml_with_meshes(
        text: &str,
        mut read: impl FnMut(&str) -> Result<Triangles, String>,
    ) -> Result<Self, YamlError> {
        let scenario: Self = parse(text)?;
        let scenario = scenario.with_meshes(|file| {
            read(file).map_err(|reason| YamlError::MeshFile { file: file.to_owned(), reason })
        })?;
        scenario.validate()?;
        Ok(scenario)
    }
}

fn parse(text: &str) -> Result<Scenario, YamlError> {
    // Only the deserialiser knows the path of the key, and only the parser the line.
    let mut path = None;
    let scenario = serde_saphyr::with_deserializer_from_str(text, |deserializer| {
        serde_path_to_error::deserialize(deserializer).map_err(|error| {
            path = error.path().iter().next().map(|_| error.path().to_string());
            error.into_inner()
        })
    });
    scenario.map_err(|error| {
        let reason = error.without_snippet().to_string();
        match path {
            Some(path) => YamlError::Refused { path, reason },
            None => YamlError::Unreadable(reason),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Figure, Sample};

    const EXAMPLE: &str = include_str!("../scenes/example.yaml");

    #[test]
    fn the_example_is_a_scenario_and_shows_its_objects_to_both_sensors() {
        let scenario = Scenario::from_yaml(EXAMPLE).unwrap();
        assert_eq!(scenario.name, "example");
        assert!(scenario.scene.objects.iter().any(|o| matches!(o.figure, Figure::Walker(_))));
        let mut seen = std::collections::BTreeSet::new();
        let mut met = std::collections::BTreeSet::new();
        for sample in scenario.with_depth_size(80, 60).samples().unwrap() {
            match sample {
                Sample::Depth { labels, .. } => seen.extend(labels.object_ids().iter().copied()),
                Sample::Scan { labels, .. } => met.extend(labels),
                _ => {}
            }
        }
        assert_eq!(seen.into_iter().collect::<Vec<_>>(), [0, 1, 2]);
        assert_eq!(met.into_iter().collect::<Vec<_>>(), [0, 1, 2]);
    }

    #[test]
    fn what_is_left_out_is_as_by_default() {
        let text = "duration_s: 2.0\nrig:\n  lidar:\n    turn_rate_hz: 5.5\n";
        let scenario = Scenario::from_yaml(text).unwrap();
        let mut expected = Scenario::default().with_duration_s(2.0);
        expected.rig.lidar.turn_rate_hz = 5.5;
        assert_eq!(scenario, expected);
    }

    #[test]
    fn the_example_has_every_key_of_the_sensors_with_its_default() {
        let example = Scenario::from_yaml(EXAMPLE).unwrap().rig;
        let (lidar, depth_camera) = (crate::Lidar::default(), crate::DepthCamera::default());
        let stamps = (example.lidar.stamps, example.depth_camera.stamps);
        assert_eq!(example.lidar, crate::Lidar { stamps: stamps.0, ..lidar.clone() });
        let expected = crate::DepthCamera { stamps: stamps.1, ..depth_camera.clone() };
        assert_eq!(example.depth_camera, expected);
        let json = |value: serde_json::Result<serde_json::Value>| value.unwrap();
        let defaults = [
            ("lidar:", json(serde_json::to_value(&lidar))),
            ("depth_camera:", json(serde_json::to_value(&depth_camera))),
        ];
        for (section, keys) in defaults {
            let (_, text) = EXAMPLE.split_once(&format!("\n  {section}\n")).unwrap();
            // Up to the next key of the rig.
            let end = text.find("\n  c").into_iter().chain(text.find("\n  d")).min().unwrap();
            for key in keys.as_object().unwrap().keys() {
                assert!(text[..end].contains(&format!("\n    {key}:")), "{section} {key}");
            }
        }
    }

    #[test]
    fn errors_name_the_path_of_the_key() {
        let error = |text: &str| Scenario::from_yaml(text).unwrap_err().to_string();
        let beams = error("rig:\n  lidar:\n    beams: many\n");
        assert!(beams.starts_with("rig.lidar.beams: ") && beams.contains("line 3"), "{beams}");
        let misspelt = error("rig:\n  lidar:\n    bems: 4\n");
        assert!(
            misspelt.starts_with("rig.lidar.bems: ") && misspelt.contains("line 3"),
            "{misspelt}"
        );
        let width = error("rig:\n  depth_camera:\n    camera: {width_px: -4}\n");
        assert!(width.starts_with("rig.depth_camera.camera.width_px: "), "{width}");
        let pose = "scene:\n  bodies:\n    - name: wall\n      pose: [1, 2, x, 0, 0, 0]\n";
        assert!(error(pose).starts_with("scene.bodies[0].pose[2]: "), "{}", error(pose));
        // A text that is not YAML may have no key to name.
        assert!(error("a: [1\n").contains("line"), "{}", error("a: [1\n"));
    }

    #[test]
    fn errors_name_the_line_and_the_key() {
        let error = |text: &str| Scenario::from_yaml(text).unwrap_err().to_string();
        let misspelt = error("name: x\nscene:\n  bodys: []\n");
        assert!(misspelt.contains("bodys") && misspelt.contains("line 3"), "{misspelt}");
        let no_number = error("seed: 1\nduration_s: long\n");
        assert!(no_number.contains("line 2"), "{no_number}");
        let both = error(
            "rig:\n  path:\n    waypoints: []\n    spline: {start_s: 0, through_m: [], speed_m_per_s: 1}\n",
        );
        assert!(both.contains("either `waypoints` or a `spline`"), "{both}");
        assert_eq!(error("duration_s: -1.0\n"), "duration_s is -1, but must be 0 to 86400");
        assert!(error("- 1\n- 2\n").contains("line 1"));
    }
}
