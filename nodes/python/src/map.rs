//! Maps and their files.

use std::path::PathBuf;
use std::sync::Arc;

use geometry::OrientedPoints;
use nalgebra::{Point3, Vector3};
use pyo3::exceptions::{PyFileExistsError, PyValueError};
use pyo3::prelude::*;
use robot::map_file::MapFile;

use crate::arrays::{self, Kept, bytes_of, rows_of};
use crate::cycle::coordinates;
use crate::errors::{computed, error, error_of_file};

/// The static map of a place: points, and where they are known their normals and colours.
#[pyclass(frozen, module = "stillmap")]
pub(crate) struct Map {
    file: Arc<MapFile>,
    points: Kept,
    normals: Kept,
    colours: Kept,
}

impl From<MapFile> for Map {
    fn from(file: MapFile) -> Self {
        let file = Arc::new(file);
        Self { file, points: Kept::default(), normals: Kept::default(), colours: Kept::default() }
    }
}

#[pymethods]
impl Map {
    /// A map of points: N x 3, metres; with unit normals N x 3, and colours N x 3, red, green, blue, integers from 0 to 255.
    #[new]
    #[pyo3(signature = (points, normals=None, colours=None))]
    fn new(
        points: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
        colours: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let points: Vec<[f32; 3]> = rows_of(points, "points N x 3")?;
        let normals = normals.map(|normals| rows_of(normals, "normals N x 3")).transpose()?;
        let colours = colours.map(|colours| bytes_of(colours, "colours N x 3")).transpose()?;
        check_count("normals", normals.as_ref(), points.len())?;
        check_count("colours", colours.as_ref(), points.len())?;
        let points = OrientedPoints {
            points_m: points.into_iter().map(Point3::from).collect(),
            normals: normals.unwrap_or_default().into_iter().map(Vector3::from).collect(),
            colours: colours.unwrap_or_default(),
        };
        Ok(Self::from(MapFile { points, ..MapFile::default() }))
    }

    /// The points: N x 3, float32, metres, in the frame of the map.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let points_m = &self.file.points.points_m;
        self.points.get(py, || arrays::rows(py, points_m.iter().map(coordinates)))
    }

    /// The normals, towards where the points were seen from: N x 3, float32, of length 1. None where they are not known.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let normals = &self.file.points.normals;
        if normals.is_empty() {
            return Ok(None);
        }
        let normal = |normal: &Vector3<f32>| <[f32; 3]>::from(*normal);
        self.normals.get(py, || arrays::rows(py, normals.iter().map(normal))).map(Some)
    }

    /// The colours: N x 3, uint8, red, green, blue, and 0, 0, 0 where none was seen. None where they are not known.
    #[getter]
    fn colours<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let colours = &self.file.points.colours;
        if colours.is_empty() {
            return Ok(None);
        }
        self.colours.get(py, || arrays::rows(py, colours.iter().copied())).map(Some)
    }

    fn __len__(&self) -> usize {
        self.file.points.points_m.len()
    }

    fn __repr__(&self) -> String {
        format!("<stillmap.Map of {} points>", self.__len__())
    }

    /// Writes the map to a .ply or .pcd file. `overwrite` replaces one that is there.
    #[pyo3(signature = (path, *, overwrite=false))]
    fn save(&self, py: Python<'_>, path: PathBuf, overwrite: bool) -> PyResult<()> {
        if !overwrite && path.exists() {
            return Err(PyFileExistsError::new_err(format!("{} already exists", path.display())));
        }
        computed(py, || self.file.write(&path).map_err(error))
    }
}

/// Reads a map: a .ply, .pcd or octomap .bt file.
#[pyfunction]
pub(crate) fn read_map(py: Python<'_>, path: PathBuf) -> PyResult<Map> {
    computed(py, || {
        let file = MapFile::read(&path).map_err(|failure| error_of_file(&path, failure))?;
        Ok(Map::from(file))
    })
}

/// There is one for each point.
fn check_count<T>(name: &str, rows: Option<&Vec<[T; 3]>>, points: usize) -> PyResult<()> {
    match rows {
        Some(rows) if rows.len() != points => {
            let count = rows.len();
            Err(PyValueError::new_err(format!("{count} {name} are given for {points} points")))
        }
        _ => Ok(()),
    }
}
