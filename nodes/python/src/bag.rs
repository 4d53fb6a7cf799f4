//! What is in a bag.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use bag_player::{BagInfo, BagMessage, Selection};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::cycle::seconds;
use crate::errors::{computed, error, error_of_file};

/// A recording: MCAP, sqlite3 or ROS 1, or a rosbag2 folder.
#[pyclass(frozen, module = "stillmap")]
pub(crate) struct Bag {
    bag: bag_player::Bag,
    info: BagInfo,
}

#[pymethods]
impl Bag {
    /// Opens a bag: a file of MCAP, sqlite3 or ROS 1, recognised by its content, or a rosbag2 folder.
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        computed(py, || {
            let bag = bag_player::Bag::open(&path)
                .map_err(|failed| error_of_file(&path, robot::bag_refused(&path, &failed)))?;
            let info = bag.info().map_err(error)?;
            Ok(Self { bag, info })
        })
    }

    /// The path that was opened.
    #[getter]
    fn path(&self) -> PathBuf {
        self.info.path.clone()
    }

    /// The topics, by name.
    #[getter]
    fn topics(&self) -> Vec<Topic> {
        let topic = |topic: &bag_player::TopicInfo| Topic {
            name: topic.topic.clone(),
            type_name: topic.type_name.clone(),
            message_count: topic.message_count,
            rate_hz: topic.rate_hz,
        };
        self.info.topics.iter().map(topic).collect()
    }

    /// All messages of all topics.
    #[getter]
    fn message_count(&self) -> u64 {
        self.info.message_count
    }

    /// When the first message was recorded, in seconds since the epoch; None for a bag without messages.
    #[getter]
    fn start_s(&self) -> Option<f64> {
        self.info.start.map(seconds)
    }

    /// Seconds from the first message to the last.
    #[getter]
    fn duration_s(&self) -> f64 {
        self.info.duration_s
    }

    /// The parts of the bag that cannot be read.
    #[getter]
    fn problems(&self) -> Vec<String> {
        self.info.losses.iter().map(ToString::to_string).collect()
    }

    /// The messages of these topics, or of all, in the order in which they were recorded.
    #[pyo3(signature = (topics=None))]
    fn messages(&self, topics: Option<Vec<String>>) -> PyResult<Messages> {
        let selection = Selection { topics, ..Selection::default() };
        let messages = self.bag.messages(&selection).map_err(error)?;
        Ok(Messages { messages: Mutex::new(messages) })
    }

    fn __repr__(&self) -> String {
        let BagInfo { path, message_count, topics, .. } = &self.info;
        let path = path.display();
        format!("<stillmap.Bag {path}: {message_count} messages of {} topics>", topics.len())
    }
}

/// A topic of a bag.
#[pyclass(frozen, module = "stillmap", get_all)]
pub(crate) struct Topic {
    /// Its name.
    name: String,
    /// The name of its type, as sensor_msgs/msg/LaserScan; empty if the bag has none.
    type_name: String,
    /// How many messages it has.
    message_count: u64,
    /// Their mean rate; None for fewer than two.
    rate_hz: Option<f64>,
}

#[pymethods]
impl Topic {
    fn __repr__(&self) -> String {
        let Self { name, type_name, message_count, .. } = self;
        format!("<stillmap.Topic {name} ({type_name}): {message_count} messages>")
    }
}

/// An iterator of the messages of a bag.
#[pyclass(frozen, module = "stillmap")]
pub(crate) struct Messages {
    messages: Mutex<bag_player::Messages>,
}

#[pymethods]
impl Messages {
    fn __iter__(own: Py<Self>) -> Py<Self> {
        own
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Message>> {
        computed(py, || {
            // A panic of the reader leaves nothing that a later message depends on but its place.
            let mut messages = self.messages.lock().unwrap_or_else(PoisonError::into_inner);
            messages.next().transpose().map_err(error).map(|next| next.map(Message))
        })
    }
}

/// A message of a bag.
#[pyclass(frozen, module = "stillmap")]
pub(crate) struct Message(BagMessage);

#[pymethods]
impl Message {
    /// Its topic.
    #[getter]
    fn topic(&self) -> &str {
        &self.0.topic
    }

    /// The name of its type, as sensor_msgs/msg/LaserScan.
    #[getter]
    fn type_name(&self) -> &str {
        &self.0.type_name
    }

    /// When it was recorded, in nanoseconds since the epoch.
    #[getter]
    fn log_time_ns(&self) -> i64 {
        self.0.log_time.as_nanos()
    }

    /// The message in CDR, with the 4 bytes of its encapsulation.
    #[getter]
    fn data<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.0.data)
    }

    fn __repr__(&self) -> String {
        format!("<stillmap.Message on {}: {} bytes>", self.0.topic, self.0.data.len())
    }
}
