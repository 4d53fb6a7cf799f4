//! The method of the whole pipeline.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize};

use crate::parameter::{Choice, Declaration, Kind, Parameter, ParameterError};

/// How moving objects are found, cut out, and kept out of the map. One method is for detection, segmentation and
/// reconstruction alike: each builds on what the node before it made.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The method as Rec-HV publishes it: one zone a cycle by the variability of the ranges, cut out by angle and depth, and
    /// a map that keeps what was put into it.
    RecHv,
    /// Objects in observed free space are moving: several zones a cycle, on a platform that may move, objects grown from
    /// them and tracked, and a map of surfaces that is cleared by what is seen behind.
    #[default]
    FreeSpace,
}

/// The former name of [`Method::FreeSpace`]; parameter files may still say so.
const FORMER_NAME_OF_FREE_SPACE: &str = "stillmap";

impl Method {
    /// Both methods.
    pub const ALL: [Self; 2] = [Self::RecHv, Self::FreeSpace];

    /// The name in parameters, messages and reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::RecHv => "rec_hv",
            Self::FreeSpace => "free_space",
        }
    }

    /// The method of a name; `stillmap` is a former name of `free_space`.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        if name == FORMER_NAME_OF_FREE_SPACE {
            return Some(Self::FreeSpace);
        }
        Self::ALL.into_iter().find(|method| method.name() == name)
    }
}

impl fmt::Display for Method {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Method {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // The former name is accepted, and not offered.
        const NAMES: &[&str] = &[Method::RecHv.name(), Method::FreeSpace.name()];
        let name = String::deserialize(deserializer)?;
        Self::of_name(&name).ok_or_else(|| serde::de::Error::unknown_variant(&name, NAMES))
    }
}

impl Parameter for Method {
    const KIND: Kind = Kind::Choice(&[
        Choice {
            text: Self::RecHv.name(),
            doc: "The method as Rec-HV publishes it: one zone a cycle, cut out by angle and depth, and a map that keeps what was \
                  put into it.",
        },
        Choice {
            text: Self::FreeSpace.name(),
            doc: "What is in observed free space, on a platform that may move: several zones a cycle, objects that are tracked, \
                  and a map of surfaces that is cleared by what is seen behind.",
        },
    ]);

    fn check(&self, _: &'static Declaration) -> Result<(), ParameterError> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use serde::de::IntoDeserializer;
    use serde::de::value::Error;

    use super::*;

    fn read(name: &str) -> Result<Method, Error> {
        Method::deserialize(name.into_deserializer())
    }

    #[test]
    fn a_method_has_one_name_and_may_be_called_by_its_former_one() {
        for method in Method::ALL {
            assert_eq!(read(method.name()), Ok(method));
        }
        assert_eq!(read("stillmap"), Ok(Method::FreeSpace));
        let error = read("rec-hv").unwrap_err().to_string();
        assert!(error.contains("expected `rec_hv` or `free_space`"), "{error}");
    }
}
