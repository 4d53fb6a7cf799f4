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
        Kind::Whole => descriptor.integer_range.extend(whole_range(range)),
        Kind::Real => descriptor.floating_point_range.extend(real_range(range)),
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
    if descriptor.integer_range.is_empty()
        && descriptor.floating_point_range.is_empty()
        && let Some(accepted) = parameters::accepted_numbers(declaration)
        && matches!(declaration.kind, Kind::Whole | Kind::Real)
    {
        descriptor.additional_constraints = accepted;
    }
    descriptor
}

/// The range of a whole number; `None` where an end is beyond 32 bits: rqt_reconfigure has a slider for each range, whose ends have 32
/// bits, and shows no parameter of a node one of whose ranges has others.
fn whole_range(range: Range) -> Option<IntegerRange> {
    let within = |end: i64| i32::try_from(end).ok().map(i64::from);
    let from_value = match range.from {
        Bound::Included(least) => within(least as i64)?,
        Bound::Excluded(bound) => within(bound as i64 + 1)?,
        Bound::Unbounded => return None,
    };
    let to_value = match range.to {
        Bound::Included(most) => within(most as i64)?,
        Bound::Excluded(bound) => within(bound as i64 - 1)?,
        Bound::Unbounded => return None,
    };
    Some(IntegerRange { from_value, to_value, step: 0 })
}

/// The range of a fraction; `None` where an end is open: a slider has two.
fn real_range(range: Range) -> Option<FloatingPointRange> {
    let from_value = match range.from {
        Bound::Included(least) => least,
        Bound::Excluded(bound) => bound.next_up(),
        Bound::Unbounded => return None,
    };
    let to_value = match range.to {
        Bound::Included(most) => most,
        Bound::Excluded(bound) => bound.next_down(),
        Bound::Unbounded => return None,
    };
    Some(FloatingPointRange { from_value, to_value, step: 0.0 })
}
