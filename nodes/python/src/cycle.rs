//! What a cycle has found.

use geometry::{DepthFrame, MaskedDepth, Stamp, ZoneSource};
use nalgebra::{Isometry3, Point3};
use pyo3::prelude::*;
use robot::run::cycles::CycleFinding;

use crate::arrays::{self, Kept};

/// One cycle: a scan, the depth image beside it, and what moves in both.
#[pyclass(frozen, module = "stillmap")]
pub(crate) struct Cycle {
    found: CycleFinding,
    depth: Kept,
    moving: Kept,
    colours: Kept,
    static_points: Kept,
    dynamic_points: Kept,
    map_from_rig: Kept,
    map_from_camera: Kept,
}

impl Cycle {
    pub(crate) fn new(found: CycleFinding) -> Self {
        Self {
            found,
            depth: Kept::default(),
            moving: Kept::default(),
            colours: Kept::default(),
            static_points: Kept::default(),
            dynamic_points: Kept::default(),
            map_from_rig: Kept::default(),
            map_from_camera: Kept::default(),
        }
    }

    fn masked(&self) -> Option<&MaskedDepth> {
        self.found.segmented.depth.as_ref()
    }

    fn frame(&self) -> Option<&DepthFrame> {
        self.masked().map(|masked| &**masked.frame())
    }

    fn stamp(&self) -> Stamp {
        self.found.segmented.static_cloud.stamp
    }

    fn camera_pose(&self) -> Isometry3<f64> {
        self.found.segmented.map_from_rig * self.found.segmented.setup.mounts.rig_from_camera
    }
}

#[pymethods]
impl Cycle {
    /// The number of the cycle, from 0.
    #[getter]
    fn index(&self) -> u32 {
        self.found.segmented.index
    }

    /// When the depth image, or cloud, was measured, in seconds of the bag's clock.
    #[getter]
    fn stamp_s(&self) -> f64 {
        seconds(self.stamp())
    }

    /// The same in nanoseconds, exactly.
    #[getter]
    fn stamp_ns(&self) -> i64 {
        self.stamp().as_nanos()
    }

    /// When the scan was measured, in seconds of the bag's clock.
    #[getter]
    fn scan_stamp_s(&self) -> f64 {
        seconds(self.found.scan_stamp)
    }

    /// The depth image: H x W, float32, metres along the camera's z axis, NaN where nothing was measured. None with the method rec_hv.
    #[getter]
    fn depth<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(frame) = self.frame() else { return Ok(None) };
        let image = frame.image();
        let make = || {
            let metres = |depth_mm: &u16| match depth_mm {
                0 => f32::NAN,
                measured => f32::from(*measured) / 1e3,
            };
            let metres: Vec<f32> = frame.depths_mm().iter().map(metres).collect();
            arrays::array(py, &metres, [image.height_px(), image.width_px()])
        };
        self.depth.get(py, make).map(Some)
    }

    /// Whether a pixel of the depth image shows something that moves, or may: H x W, bool. None with the method rec_hv.
    #[getter]
    fn moving<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(masked) = self.masked() else { return Ok(None) };
        let image = masked.frame().image();
        let make = || arrays::mask(py, masked.is_moving(), [image.height_px(), image.width_px()]);
        self.moving.get(py, make).map(Some)
    }

    /// The colours of the depth image's pixels: H x W x 3, uint8, red, green, blue, and 0, 0, 0 where the colour camera does not see
    /// it. None where the cycle has no colour image.
    #[getter]
    fn colours<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(frame) = self.frame() else { return Ok(None) };
        let (image, Some(colours)) = (frame.image(), frame.colours()) else { return Ok(None) };
        let make = || {
            let shape = [image.height_px(), image.width_px(), 3];
            arrays::array(py, colours.as_flattened(), shape)
        };
        self.colours.get(py, make).map(Some)
    }

    /// The camera of the depth image as its matrix K: 3 x 3, float64, pixels. None with the method rec_hv.
    #[getter]
    fn camera_matrix<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(frame) = self.frame() else { return Ok(None) };
        let camera = frame.camera();
        let matrix =
            [[camera.fx_px, 0.0, camera.cx_px], [0.0, camera.fy_px, camera.cy_px], [0.0, 0.0, 1.0]];
        arrays::rows(py, matrix.into_iter()).map(Some)
    }

    /// The distortion of the camera's lens, in the order of CameraInfo: float64, none at all for a rectified image. None with the
    /// method rec_hv.
    #[getter]
    fn camera_distortion<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(frame) = self.frame() else { return Ok(None) };
        let coefficients = frame.camera().distortion.coefficients();
        arrays::array(py, coefficients, [coefficients.len()]).map(Some)
    }

    /// The static points of the reduced cloud: N x 3, float32, metres, in the frame of the map.
    #[getter]
    fn static_points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let points_m = &self.found.segmented.static_cloud.points_m;
        self.static_points.get(py, || arrays::rows(py, points_m.iter().map(coordinates)))
    }

    /// The points that move, of the reduced cloud: N x 3, float32, metres, in the frame of the map.
    #[getter]
    fn dynamic_points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let segmented = &self.found.segmented;
        let in_map = |point_m: &Point3<f32>| {
            coordinates(&(segmented.map_from_rig * point_m.cast::<f64>()).cast())
        };
        let points_m = &segmented.dynamic_cloud.points_m;
        self.dynamic_points.get(py, || arrays::rows(py, points_m.iter().map(in_map)))
    }

    /// The pose of the rig in the map: 4 x 4, float64, metres. As it was in this cycle, before corrections of later ones.
    #[getter]
    fn map_from_rig<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let pose = self.found.segmented.map_from_rig;
        self.map_from_rig.get(py, || arrays::transform(py, &pose))
    }

    /// The pose of the camera (z forward) in the map: 4 x 4, float64, metres. As `map_from_rig`.
    #[getter]
    fn map_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.map_from_camera.get(py, || arrays::transform(py, &self.camera_pose()))
    }

    /// The name of the map's frame.
    #[getter]
    fn map_frame(&self) -> &str {
        &self.found.segmented.static_cloud.frame_id
    }

    /// The objects that move.
    #[getter]
    fn tracks(&self) -> Vec<Track> {
        self.found.tracks.iter().copied().map(Track).collect()
    }

    /// The directions in which the scan moves.
    #[getter]
    fn zones(&self) -> Vec<Zone> {
        self.found.zones.iter().copied().map(Zone).collect()
    }

    fn __repr__(&self) -> String {
        let (tracks, zones) = (self.found.tracks.len(), self.found.zones.len());
        format!(
            "<stillmap.Cycle {} at {:.3} s: {tracks} tracks, {zones} zones>",
            self.index(),
            self.stamp_s()
        )
    }
}

/// An object that moves, as a cycle knows it.
#[pyclass(frozen, module = "stillmap")]
pub(crate) struct Track(geometry::Track);

#[pymethods]
impl Track {
    /// The object's number, of no other object of the run.
    #[getter]
    fn id(&self) -> u32 {
        self.0.id
    }

    /// Its centre: 3, float64, metres, in the frame of the map.
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::array(py, self.0.position_m.coords.as_slice(), [3])
    }

    /// Its velocity: 3, float64, m/s, in the frame of the map.
    #[getter]
    fn velocity_m_per_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::array(py, self.0.velocity_m_per_s.as_slice(), [3])
    }

    /// Its edge lengths along the axes of the map: 3, float64, metres.
    #[getter]
    fn extent_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::array(py, self.0.extent_m.as_slice(), [3])
    }

    /// The covariance of position and velocity: 6 x 6, float64, in m and m/s.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        // Symmetric: its columns are its rows.
        let columns = self.0.covariance.column_iter();
        let columns = columns.map(|c| [c[0], c[1], c[2], c[3], c[4], c[5]]);
        arrays::rows(py, columns)
    }

    /// Seconds since it was first seen.
    #[getter]
    fn age_s(&self) -> f64 {
        self.0.age_s
    }

    /// Cycles since it was last seen; 0 when this cycle saw it.
    #[getter]
    fn unseen_cycles(&self) -> u32 {
        self.0.unseen_cycles
    }

    fn __repr__(&self) -> String {
        let [x, y, z] = self.0.position_m.coords.into();
        format!("<stillmap.Track {} at ({x:.2}, {y:.2}, {z:.2}) m>", self.0.id)
    }
}

/// A wedge of directions around the rig's z axis in which something moves. Azimuths are from the rig's x axis towards its y axis.
#[pyclass(frozen, module = "stillmap")]
pub(crate) struct Zone(geometry::DynamicZone);

#[pymethods]
impl Zone {
    /// The right-hand bound, radians, from -pi to pi.
    #[getter]
    fn azimuth_min_rad(&self) -> f64 {
        self.0.azimuth_min_rad
    }

    /// The left-hand bound, radians; above pi where the zone crosses the rear.
    #[getter]
    fn azimuth_max_rad(&self) -> f64 {
        self.0.azimuth_max_rad
    }

    /// The distance of the nearest return that moves, metres; None where the method does not know it.
    #[getter]
    fn nearest_m(&self) -> Option<f32> {
        self.0.returns.map(|returns| returns.nearest_m)
    }

    /// The distance of the farthest return that moves, metres; None where the method does not know it.
    #[getter]
    fn farthest_m(&self) -> Option<f32> {
        self.0.returns.map(|returns| returns.farthest_m)
    }

    /// Cycles since it was measured; 0 when it was in this one.
    #[getter]
    fn held_cycles(&self) -> u32 {
        match self.0.source {
            ZoneSource::Measured => 0,
            ZoneSource::Held { cycles } => cycles,
        }
    }

    fn __repr__(&self) -> String {
        let (min_rad, max_rad) = (self.0.azimuth_min_rad, self.0.azimuth_max_rad);
        format!("<stillmap.Zone from {min_rad:.3} to {max_rad:.3} rad>")
    }
}

pub(crate) fn coordinates(point_m: &Point3<f32>) -> [f32; 3] {
    point_m.coords.into()
}

/// Seconds, to a quarter of a microsecond for a clock of today.
pub(crate) fn seconds(stamp: Stamp) -> f64 {
    stamp.seconds_since(Stamp::default())
}
