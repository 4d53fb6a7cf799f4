//! Validation of scenarios.

mod appearance;
mod inertial;
mod ranging;

use std::f64::consts::FRAC_PI_2;

use crate::{Body, Figure, Material, MovingObject, Path, Scenario, Shape};
use appearance::{check_colour_camera, check_lighting, check_paint};
use inertial::{check_imu, check_wheels};
use ranging::{MAX_BEAMS, MAX_PIXELS, check_depth_camera, check_lidar, check_velodyne};

/// A scenario that cannot be simulated.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum ScenarioError {
    /// A number is out of range.
    #[error("{what} is {value}, but must be {accepted}")]
    Number {
        /// The name of the number and its part.
        what: String,
        /// Its value.
        value: f64,
        /// The accepted values.
        accepted: &'static str,
    },
    /// A path has no waypoint.
    #[error("the path of {of} has no waypoint; give it at least one")]
    EmptyPath {
        /// The owner of the path.
        of: String,
    },
    /// The waypoints of a path go back in time.
    #[error(
        "waypoint {index} of the path of {of}, at {time_s} s, is not later than the one before it"
    )]
    WaypointOrder {
        /// The owner of the path.
        of: String,
        /// The index of the waypoint.
        index: usize,
        /// Its time.
        time_s: f64,
    },
    /// An object has the label of the static scene.
    #[error("the object \"{name}\" has the id 0, which means static; give it 1 or more")]
    StaticId {
        /// The object's name.
        name: String,
    },
    /// Two objects have the same label.
    #[error("two objects have the id {id}; every object needs its own")]
    DuplicateId {
        /// The label.
        id: u16,
    },
    /// The images have more pixels than this simulator supports.
    #[error(
        "an image of {width_px} x {height_px} pixels cannot be drawn: 1 to {MAX_PIXELS} pixels can"
    )]
    ImageSize {
        /// Columns.
        width_px: usize,
        /// Rows.
        height_px: usize,
    },
    /// The camera has a lens distortion.
    #[error("a camera has a lens distortion; only rectified images (distortion None) are drawn")]
    Distorted,
    /// A mesh has no triangles.
    #[error("the mesh of {of} has no triangles{}", missing(.file))]
    EmptyMesh {
        /// The body.
        of: String,
        /// The file of the triangles.
        file: Option<String>,
    },
    /// The scanner has too many beams.
    #[error("the scanner has {beams} beams; it can have 1 to {MAX_BEAMS}")]
    Beams {
        /// The number of beams.
        beams: usize,
    },
}

/// The file that was not read.
fn missing(file: &Option<String>) -> String {
    file.as_ref().map_or_else(String::new, |file| format!(": {file} has not been read"))
}

/// The longest scenario.
const MAX_DURATION_S: f64 = 86_400.0;
/// The fastest sensor.
const MAX_RATE_HZ: f64 = 1000.0;
/// The errors of so long ago are summed for each pose.
const MAX_NOISE_TIME_S: f64 = 60.0;
/// The largest length, so that nothing overflows in 32-bit floats.
const MAX_LENGTH_M: f64 = 1e6;

type Checked = Result<(), ScenarioError>;

impl Scenario {
    /// Checks whether the scenario can be simulated; [`Scenario::samples`] calls it first.
    ///
    /// # Errors
    /// The first error, with its numbers.
    pub fn validate(&self) -> Checked {
        number(
            "duration_s",
            self.duration_s,
            |v| (0.0..=MAX_DURATION_S).contains(&v),
            "0 to 86400",
        )?;
        for body in &self.scene.bodies {
            check_body(body, "the scene")?;
        }
        for (index, object) in self.scene.objects.iter().enumerate() {
            check_object(object)?;
            if self.scene.objects[..index].iter().any(|other| other.id == object.id) {
                return Err(ScenarioError::DuplicateId { id: object.id });
            }
        }
        check_path(&self.rig.path, "the rig")?;
        check_lidar(&self.rig.lidar)?;
        check_depth_camera(&self.rig.depth_camera)?;
        if let Some(colour) = &self.rig.colour_camera {
            check_colour_camera(colour, &self.rig.depth_camera)?;
        }
        check_lighting(&self.scene.lighting)?;
        self.rig.velodyne.as_ref().map_or(Ok(()), check_velodyne)?;
        self.rig.imu.as_ref().map_or(Ok(()), check_imu)?;
        self.rig.wheels.as_ref().map_or(Ok(()), check_wheels)?;
        let source = &self.rig.pose_source;
        rate("pose_source.rate_hz", source.rate_hz)?;
        not_negative("pose_source.position_noise_m", source.position_noise_m)?;
        not_negative("pose_source.rotation_noise_rad", source.rotation_noise_rad)?;
        let holds = |time_s: f64| (0.0..=MAX_NOISE_TIME_S).contains(&time_s);
        number("pose_source.noise_time_s", source.noise_time_s, holds, "0 to 60")
    }
}

fn check_object(object: &MovingObject) -> Checked {
    let name = &object.name;
    if object.id == 0 {
        return Err(ScenarioError::StaticId { name: name.clone() });
    }
    check_path(&object.path, name)?;
    for bound_s in object.label_span_s.into_iter().flatten() {
        number(&format!("label_span_s of {name}"), bound_s, f64::is_finite, "finite")?;
    }
    match &object.figure {
        Figure::Rigid(bodies) => bodies.iter().try_for_each(|body| check_body(body, name)),
        Figure::Walker(walker) => {
            positive(format!("height_m of {name}"), walker.height_m)?;
            positive(format!("stride_m of {name}"), walker.stride_m)?;
            number(
                &format!("gait_phase_rad of {name}"),
                walker.gait_phase_rad,
                |v| v.abs() <= MAX_LENGTH_M,
                "-1e6 to 1e6",
            )?;
            check_material(&walker.clothes, name)?;
            check_material(&walker.skin, name)
        }
    }
}

fn check_body(body: &Body, of: &str) -> Checked {
    let name = format!("{} of {of}", body.name);
    let sizes: &[f64] = match &body.shape {
        Shape::Box { size_m } => size_m,
        Shape::Cylinder { radius_m, height_m } => &[*radius_m, *height_m],
        Shape::Capsule { radius_m, length_m } => {
            not_negative(&format!("length_m of {name}"), *length_m)?;
            &[*radius_m]
        }
        Shape::Sphere { radius_m } => &[*radius_m],
        Shape::Rectangle { size_m } => size_m,
        Shape::Mesh(mesh) if mesh.triangles() == 0 => {
            let file = mesh.missing_file().map(str::to_owned);
            return Err(ScenarioError::EmptyMesh { of: name, file });
        }
        Shape::Mesh(_) => &[],
    };
    sizes.iter().try_for_each(|&size_m| positive(format!("a size of {name}"), size_m))?;
    check_pose(&body.pose, &name)?;
    check_material(&body.material, &name)
}

fn check_material(material: &Material, of: &str) -> Checked {
    number(
        &format!("reflectivity of {of}"),
        material.reflectivity,
        |v| (0.0..=1.0).contains(&v),
        "0 to 1",
    )?;
    number(
        &format!("max_incidence_rad of {of}"),
        material.max_incidence_rad,
        |v| v > 0.0 && v < FRAC_PI_2,
        "above 0 and below pi/2",
    )?;
    ratio(&format!("transmission of {of}"), material.transmission)?;
    material.paint.as_ref().map_or(Ok(()), |paint| check_paint(paint, of))
}

fn check_path(path: &Path, of: &str) -> Checked {
    if path.waypoints.is_empty() {
        return Err(ScenarioError::EmptyPath { of: of.to_owned() });
    }
    let mut before_s = f64::NEG_INFINITY;
    for (index, waypoint) in path.waypoints.iter().enumerate() {
        let time_s = waypoint.time_s;
        number(&format!("a waypoint's time_s of {of}"), time_s, f64::is_finite, "finite")?;
        if time_s <= before_s {
            return Err(ScenarioError::WaypointOrder { of: of.to_owned(), index, time_s });
        }
        before_s = time_s;
        check_pose(&waypoint.pose, of)?;
    }
    Ok(())
}

fn check_pose(pose: &[f64; 6], of: &str) -> Checked {
    pose.iter().try_for_each(|&value| {
        number(&format!("the pose of {of}"), value, |v| v.abs() <= MAX_LENGTH_M, "-1e6 to 1e6")
    })
}

fn number(
    what: &str,
    value: f64,
    accepts: impl Fn(f64) -> bool,
    accepted: &'static str,
) -> Checked {
    if accepts(value) {
        Ok(())
    } else {
        Err(ScenarioError::Number { what: what.to_owned(), value, accepted })
    }
}

fn positive(what: impl AsRef<str>, value: f64) -> Checked {
    number(what.as_ref(), value, |v| v > 0.0 && v <= MAX_LENGTH_M, "positive, at most 1e6")
}

fn not_negative(what: &str, value: f64) -> Checked {
    number(what, value, |v| (0.0..=MAX_LENGTH_M).contains(&v), "0 to 1e6")
}

fn rate(what: &str, value: f64) -> Checked {
    number(what, value, |v| v > 0.0 && v <= MAX_RATE_HZ, "above 0, at most 1000")
}

fn ratio(what: &str, value: f64) -> Checked {
    number(what, value, |v| (0.0..=1.0).contains(&v), "0 to 1")
}

#[cfg(test)]
mod tests;
