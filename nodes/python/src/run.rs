//! A bag through the pipeline.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard};

use geometry::Method;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use robot::run::cycles::{CycleFinding, CycleRun};
use robot::run::inputs::TopicArgs;
use robot::run::parameters::ParameterArgs;

use crate::cycle::Cycle;
use crate::errors::{computed, error, error_of_file};
use crate::map::Map;

/// A bag on its way through the pipeline: an iterator of its cycles. `stillmap.run` makes one.
#[pyclass(frozen, module = "stillmap")]
pub(crate) struct Run {
    run: Mutex<CycleRun>,
}

/// What a message of the bag has brought.
enum Step {
    Cycle(Box<CycleFinding>),
    Nothing,
    End,
}

impl Run {
    fn lock(&self) -> PyResult<MutexGuard<'_, CycleRun>> {
        self.run.lock().map_err(|_poisoned| {
            PyRuntimeError::new_err("the run has failed by a defect of stillmap")
        })
    }

    fn step(&self) -> PyResult<Step> {
        let mut run = self.lock()?;
        if let Some(found) = run.next_found() {
            return Ok(Step::Cycle(Box::new(found)));
        }
        let is_going = run.advance().map_err(error)?;
        Ok(match run.next_found() {
            Some(found) => Step::Cycle(Box::new(found)),
            None if is_going => Step::Nothing,
            None => Step::End,
        })
    }
}

#[pymethods]
impl Run {
    fn __iter__(own: Py<Self>) -> Py<Self> {
        own
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Cycle>> {
        loop {
            match computed(py, || self.step())? {
                Step::Cycle(found) => return Ok(Some(Cycle::new(*found))),
                Step::End => return Ok(None),
                // Ctrl-C.
                Step::Nothing => py.check_signals()?,
            }
        }
    }

    /// Processes what is left of the bag, and returns the map.
    fn finish(&self, py: Python<'_>) -> PyResult<Map> {
        while !matches!(computed(py, || self.step())?, Step::End) {
            py.check_signals()?;
        }
        self.map(py)
    }

    /// The map so far; at the end of the bag the one that `stillmap run` writes.
    fn map(&self, py: Python<'_>) -> PyResult<Map> {
        computed(py, || Ok(Map::from(self.lock()?.map())))
    }

    /// Where the poses come from, where it is not a topic of PoseStamped.
    #[getter]
    fn note(&self) -> PyResult<Option<String>> {
        Ok(self.lock()?.note())
    }

    /// What was lost of the input, and what is wrong with it, as `stillmap run` prints it. Complete at the end of the bag, and before
    /// it empty.
    #[getter]
    fn problems(&self) -> PyResult<Vec<String>> {
        Ok(self.lock()?.findings().iter().map(ToString::to_string).collect())
    }
}

/// Opens a bag and returns an iterator of its cycles.
#[pyfunction]
#[pyo3(signature = (bag, *, method=None, map_edge_m=None, pose=None, scan=None, depth=None, camera_info=None, points=None, params_files=Vec::new(), colour=true))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub(crate) fn run(
    py: Python<'_>,
    bag: PathBuf,
    method: Option<&str>,
    map_edge_m: Option<f64>,
    pose: Option<String>,
    scan: Option<String>,
    depth: Option<String>,
    camera_info: Option<String>,
    points: Option<String>,
    params_files: Vec<PathBuf>,
    colour: bool,
) -> PyResult<Run> {
    let mut topics = TopicArgs::default();
    if points.is_some() && (depth.is_some() || camera_info.is_some()) {
        return Err(PyValueError::new_err("points are read in place of depth and camera_info"));
    }
    (topics.scan, topics.depth, topics.camera_info) = (scan, depth, camera_info);
    (topics.points, topics.pose) = (points, pose);
    let of_name = |name| {
        let names = Method::ALL.map(Method::name).join(" or ");
        Method::of_name(name)
            .ok_or_else(|| PyValueError::new_err(format!("method is {name}, and not {names}")))
    };
    let method = method.map(of_name).transpose()?;
    let parameters =
        ParameterArgs { files: params_files, method, map_edge: map_edge_m, grid: None };
    computed(py, || {
        let begun = CycleRun::begin(&bag, &topics, &parameters, !colour);
        let missing = parameters.files.iter().find(|file| !file.exists()).unwrap_or(&bag);
        let run = begun.map_err(|failure| error_of_file(missing, failure))?;
        Ok(Run { run: Mutex::new(run) })
    })
}
