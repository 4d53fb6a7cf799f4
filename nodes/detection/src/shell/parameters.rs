//! What the node says of its parameters to those outside.

use node_shell::parameters::NodeParameters;

use super::DetectionParameters;

impl NodeParameters for DetectionParameters {}
