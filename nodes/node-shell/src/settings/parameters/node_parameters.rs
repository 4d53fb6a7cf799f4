//! The requirements of a struct that holds a node's parameters.

use geometry::parameter::{Declaration, Kind, Parameter, ParameterError, Parameters};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::process::failure::NodeFailure;

/// The parameters of a node, as [`geometry::parameters!`] declares them.
pub trait NodeParameters:
    Parameters + Serialize + DeserializeOwned + Default + Clone + Send + Sync + 'static
{
    /// Whether the node is managed: see [`Lifecycle`](crate::Lifecycle).
    const IS_MANAGED: bool = true;

    /// Checks what is declared, and what only a node can check, as whether a folder exists.
    ///
    /// # Errors
    /// With the parameter that does not hold, and what is accepted.
    fn validate_node(&self) -> Result<(), NodeFailure> {
        Ok(self.validate()?)
    }
}

/// The parameters of a node that has none of its own.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, serde::Deserialize)]
pub struct NoParameters {}

impl Parameter for NoParameters {
    const KIND: Kind = Kind::Group { members: &[], is_flat: false };

    fn check(&self, _: &'static Declaration) -> Result<(), ParameterError> {
        Ok(())
    }
}

impl Parameters for NoParameters {
    const DECLARATIONS: &'static [Declaration] = &[];

    fn validate(&self) -> Result<(), ParameterError> {
        Ok(())
    }
}

impl NodeParameters for NoParameters {
    const IS_MANAGED: bool = false;
}
