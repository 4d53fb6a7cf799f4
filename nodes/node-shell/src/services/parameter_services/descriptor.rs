//! The descriptor of each parameter: its type, its range, its meaning, whether it may change.

use std::collections::BTreeMap;
use std::ops::Bound;

use geometry::parameter::{Kind, Range};
use msgs::rcl_interfaces::{FloatingPointRange, IntegerRange, ParameterDescriptor, ParameterType};

use crate::settings::parameters::{self, DeclaredParameter, NodeParameters, ParameterError};

/// The descriptors of all parameters by their names.
pub(super) fn descriptors<P: NodeParameters>()
-> Result<BTreeMap<String, ParameterDescriptor>, ParameterError> {
    let declared = parameters::declared::<P>()?;
    Ok(declared.iter().map(|one| (one.name.clone(), descriptor(one))).collect())
}

fn descriptor(one: &DeclaredParameter) -> ParameterDescriptor {
    let declaration = &one.declaration;
    let mut descriptor = ParameterDescriptor {
        name: one.name.clone(),
        r#type: match declaration.kind {
            Kind::Truth => ParameterType::PARAMETER_BOOL,
            Kind::Whole => ParameterType::PARAMETER_INTEGER,
            Kind::Real => ParameterType::PARAMETER_DOUBLE,
            Kind::Text | Kind::Choice(_) => ParameterType::PARAMETER_STRING,
            Kind::Reals(_) => ParameterType::PARAMETER_DOUBLE_ARRAY,
            Kind::Group { .. } => ParameterType::PARAMETER_NOT_SET,
        },
        description: parameters::meaning(declaration),
        read_only: !declaration.is_changeable,
        ..ParameterDescriptor::default()
    };
    let range = declaration.range;
    match declaration.kind {
        Kind::Whole => {
            let from_value = match range.from {
                Bound::Included(least) => least as i64,
                Bound::Excluded(bound) => bound as i64 + 1,
                Bound::Unbounded => i64::MIN,
            };
            let to_value = match range.to {
                Bound::Included(most) => most as i64,
                Bound::Excluded(bound) => bound as i64 - 1,
                Bound::Unbounded => i64::MAX,
            };
            descriptor.integer_range = vec![IntegerRange { from_value, to_value, step: 0 }];
        }
        Kind::Real if range != Range::FINITE => {
            let from_value = match range.from {
                Bound::Included(least) => least,
                Bound::Excluded(bound) => bound.next_up(),
                Bound::Unbounded => f64::MIN,
            };
            let to_value = match range.to {
                Bound::Included(most) => most,
                Bound::Excluded(bound) => bound.next_down(),
                Bound::Unbounded => f64::MAX,
            };
            descriptor.floating_point_range =
                vec![FloatingPointRange { from_value, to_value, step: 0.0 }];
        }
        Kind::Reals(length) => {
            descriptor.additional_constraints = format!("an array of length {length}");
        }
        Kind::Choice(choices) => {
            let texts: Vec<_> = choices.iter().map(|choice| format!("`{}`", choice.text)).collect();
            descriptor.additional_constraints = match texts.as_slice() {
                [one, other] => format!("{one} or {other}"),
                texts => format!("one of {}", texts.join(", ")),
            };
        }
        _ => {}
    }
    descriptor
}
