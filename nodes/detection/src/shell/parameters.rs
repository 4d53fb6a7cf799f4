//! The description of the node's parameters for parameter services.

use node_shell::parameters::NodeParameters;

use super::DetectionParameters;

impl NodeParameters for DetectionParameters {}
