//! Values as NumPy arrays, and back. By NumPy's own functions: its C interface, and the crates for it, are not needed for that.

use nalgebra::Isometry3;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyByteArray, PyBytes};
use zerocopy::{Immutable, IntoBytes};

/// A number that NumPy has, too.
pub(crate) trait Number: Copy + IntoBytes + Immutable {
    /// NumPy's name of it.
    const DTYPE: &str;
    /// The size of its bytes.
    const BYTES: usize = size_of::<Self>();

    /// The number of so many bytes of this machine.
    fn of_bytes(bytes: &[u8]) -> Option<Self>;
}

macro_rules! number {
    ($type:ty, $dtype:literal) => {
        impl Number for $type {
            const DTYPE: &str = $dtype;

            fn of_bytes(bytes: &[u8]) -> Option<Self> {
                bytes.try_into().ok().map(Self::from_ne_bytes)
            }
        }
    };
}

number!(u8, "uint8");
number!(f32, "float32");
number!(f64, "float64");

/// An array of its own memory, row by row.
pub(crate) fn array<'py, T: Number, const DIMENSIONS: usize>(
    py: Python<'py>,
    numbers: &[T],
    shape: [usize; DIMENSIONS],
) -> PyResult<Bound<'py, PyAny>> {
    of_bytes(py, numbers.as_bytes(), shape.to_vec(), T::DTYPE)
}

/// An array of truth values, row by row.
pub(crate) fn mask<'py>(
    py: Python<'py>,
    values: &[bool],
    shape: [usize; 2],
) -> PyResult<Bound<'py, PyAny>> {
    of_bytes(py, values.as_bytes(), shape.to_vec(), "bool")
}

fn of_bytes<'py>(
    py: Python<'py>,
    bytes: &[u8],
    shape: Vec<usize>,
    dtype: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let memory = PyByteArray::new(py, bytes);
    py.import("numpy")?.call_method1("ndarray", (shape, dtype, memory))
}

/// An array of N columns.
pub(crate) fn rows<'py, T: Number, const N: usize>(
    py: Python<'py>,
    rows: impl ExactSizeIterator<Item = [T; N]>,
) -> PyResult<Bound<'py, PyAny>> {
    let count = rows.len();
    let flat: Vec<T> = rows.flatten().collect();
    array(py, &flat, [count, N])
}

/// A transform as a matrix of 4 x 4.
pub(crate) fn transform<'py>(
    py: Python<'py>,
    to_from: &Isometry3<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let matrix = to_from.to_homogeneous();
    rows(py, matrix.row_iter().map(|row| [row[0], row[1], row[2], row[3]]))
}

/// The rows of whatever NumPy can make an array of N columns of. `wanted` says so where it cannot.
pub(crate) fn rows_of<T: Number, const N: usize>(
    values: &Bound<'_, PyAny>,
    wanted: &str,
) -> PyResult<Vec<[T; N]>> {
    let numpy = values.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (values, T::DTYPE))?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    if shape.len() != 2 || shape.get(1) != Some(&N) {
        return Err(PyValueError::new_err(format!(
            "an array of {shape:?} is given, where {wanted} is wanted"
        )));
    }
    let bytes = array.call_method0("tobytes")?;
    let bytes = bytes.cast::<PyBytes>()?.as_bytes();
    let numbers: Vec<T> = bytes.chunks_exact(T::BYTES).filter_map(T::of_bytes).collect();
    Ok(numbers.as_chunks().0.to_vec())
}

/// The rows of whatever NumPy can make an array of N columns of integers from 0 to 255 of. NumPy itself would take 0.9 for 0, and 300
/// for 44.
pub(crate) fn bytes_of<const N: usize>(
    values: &Bound<'_, PyAny>,
    wanted: &str,
) -> PyResult<Vec<[u8; N]>> {
    /// NumPy's kinds of integers: with a sign, and without.
    const INTEGERS: [&str; 2] = ["i", "u"];
    let array = values.py().import("numpy")?.call_method1("asarray", (values,))?;
    if array.getattr("size")?.extract::<usize>()? > 0 {
        let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
        if !INTEGERS.contains(&kind.as_str()) {
            let given = array.getattr("dtype")?;
            return Err(PyValueError::new_err(format!(
                "{given} is given, where {wanted} of integers from 0 to 255 are wanted; of values from 0 to 1: \
                 (255 * values).round().astype('uint8')"
            )));
        }
        let (least, most) = (array.call_method0("min")?, array.call_method0("max")?);
        if least.lt(0)? || most.gt(u8::MAX)? {
            return Err(PyValueError::new_err(format!(
                "{least} to {most} are given, where {wanted} of integers from 0 to 255 are wanted"
            )));
        }
    }
    rows_of(&array, wanted)
}

/// An attribute that is made when it is first asked for, and is the same object from then on.
pub(crate) struct Kept(PyOnceLock<Py<PyAny>>);

impl Default for Kept {
    fn default() -> Self {
        Self(PyOnceLock::new())
    }
}

impl Kept {
    /// The object.
    pub(crate) fn get<'py>(
        &self,
        py: Python<'py>,
        make: impl FnOnce() -> PyResult<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let kept = self.0.get_or_try_init(py, || make().map(Bound::unbind))?;
        Ok(kept.bind(py).clone())
    }
}
