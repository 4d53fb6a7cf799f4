//! Values of parameters as messages, and back.

use msgs::rcl_interfaces::{ParameterType, ParameterValue};
use serde_json::{Number, Value};

/// The type of a parameter that has this value.
pub(super) fn type_of(value: &Value) -> u8 {
    match value {
        Value::Null | Value::Object(_) => ParameterType::PARAMETER_NOT_SET,
        Value::Bool(_) => ParameterType::PARAMETER_BOOL,
        Value::Number(number) if number.is_f64() => ParameterType::PARAMETER_DOUBLE,
        Value::Number(_) => ParameterType::PARAMETER_INTEGER,
        Value::String(_) => ParameterType::PARAMETER_STRING,
        Value::Array(elements) => match elements.first() {
            Some(Value::Bool(_)) => ParameterType::PARAMETER_BOOL_ARRAY,
            Some(Value::Number(number)) if number.is_f64() => ParameterType::PARAMETER_DOUBLE_ARRAY,
            Some(Value::Number(_)) => ParameterType::PARAMETER_INTEGER_ARRAY,
            _ => ParameterType::PARAMETER_STRING_ARRAY,
        },
    }
}

/// A value as a message, for a parameter of the type `kind`, one of [`ParameterType`].
#[must_use]
pub fn to_message(value: &Value, kind: u8) -> ParameterValue {
    let elements = value.as_array().map_or(&[][..], Vec::as_slice);
    let mut message = ParameterValue { r#type: kind, ..ParameterValue::default() };
    match kind {
        ParameterType::PARAMETER_BOOL => message.bool_value = value.as_bool().unwrap_or_default(),
        ParameterType::PARAMETER_INTEGER => message.integer_value = whole(value),
        ParameterType::PARAMETER_DOUBLE => {
            message.double_value = value.as_f64().unwrap_or_default();
        }
        ParameterType::PARAMETER_STRING => message.string_value = text(value),
        ParameterType::PARAMETER_BOOL_ARRAY => {
            message.bool_array_value = elements.iter().filter_map(Value::as_bool).collect();
        }
        ParameterType::PARAMETER_INTEGER_ARRAY => {
            message.integer_array_value = elements.iter().map(whole).collect();
        }
        ParameterType::PARAMETER_DOUBLE_ARRAY => {
            message.double_array_value = elements.iter().filter_map(Value::as_f64).collect();
        }
        ParameterType::PARAMETER_STRING_ARRAY => {
            message.string_array_value = elements.iter().map(text).collect();
        }
        _ => message.r#type = ParameterType::PARAMETER_NOT_SET,
    }
    message
}

/// The value that a message holds.
///
/// # Errors
/// With what no parameter can have.
pub fn of_message(message: &ParameterValue) -> Result<Value, &'static str> {
    fn list<T: Clone + Into<Value>>(elements: &[T]) -> Value {
        Value::Array(elements.iter().cloned().map(Into::into).collect())
    }
    Ok(match message.r#type {
        ParameterType::PARAMETER_NOT_SET => return Err("a parameter cannot be deleted"),
        ParameterType::PARAMETER_BOOL => message.bool_value.into(),
        ParameterType::PARAMETER_INTEGER => message.integer_value.into(),
        ParameterType::PARAMETER_DOUBLE => finite(message.double_value)?,
        ParameterType::PARAMETER_STRING => message.string_value.clone().into(),
        ParameterType::PARAMETER_BYTE_ARRAY => list(&message.byte_array_value),
        ParameterType::PARAMETER_BOOL_ARRAY => list(&message.bool_array_value),
        ParameterType::PARAMETER_INTEGER_ARRAY => list(&message.integer_array_value),
        ParameterType::PARAMETER_DOUBLE_ARRAY => {
            let numbers = message.double_array_value.iter().map(|number| finite(*number));
            Value::Array(numbers.collect::<Result<_, _>>()?)
        }
        ParameterType::PARAMETER_STRING_ARRAY => list(&message.string_array_value),
        _ => return Err("its type is none of rcl_interfaces/msg/ParameterType"),
    })
}

fn finite(number: f64) -> Result<Value, &'static str> {
    Number::from_f64(number).map(Value::Number).ok_or("it is not finite")
}

/// Whole numbers beyond 63 bits, which ROS 2 has none of, are the largest that it has.
fn whole(value: &Value) -> i64 {
    value.as_i64().unwrap_or(if value.is_u64() { i64::MAX } else { 0 })
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn values_of_every_type_come_back() {
        for (value, kind) in [
            (json!(true), ParameterType::PARAMETER_BOOL),
            (json!(-3), ParameterType::PARAMETER_INTEGER),
            (json!(0.25), ParameterType::PARAMETER_DOUBLE),
            (json!("x"), ParameterType::PARAMETER_STRING),
            (json!([true, false]), ParameterType::PARAMETER_BOOL_ARRAY),
            (json!([1, -2]), ParameterType::PARAMETER_INTEGER_ARRAY),
            (json!([1.0, -2.5]), ParameterType::PARAMETER_DOUBLE_ARRAY),
            (json!(["a", "b"]), ParameterType::PARAMETER_STRING_ARRAY),
        ] {
            assert_eq!(type_of(&value), kind);
            let message = to_message(&value, kind);
            assert_eq!(message.r#type, kind);
            assert_eq!(of_message(&message).unwrap(), value);
        }
    }

    #[test]
    fn a_fractional_parameter_with_a_whole_value_is_fractional() {
        let message = to_message(&json!(3), ParameterType::PARAMETER_DOUBLE);
        assert_eq!((message.r#type, message.double_value), (ParameterType::PARAMETER_DOUBLE, 3.0));
        let message = to_message(&json!([1, 2.5]), ParameterType::PARAMETER_DOUBLE_ARRAY);
        assert_eq!(message.double_array_value, [1.0, 2.5]);
    }

    #[test]
    fn what_no_parameter_can_have_is_refused() {
        let of_type = |kind| ParameterValue { r#type: kind, ..ParameterValue::default() };
        assert!(of_message(&of_type(ParameterType::PARAMETER_NOT_SET)).is_err());
        assert!(of_message(&of_type(200)).is_err());
        for number in [f64::NAN, f64::INFINITY] {
            let mut message = of_type(ParameterType::PARAMETER_DOUBLE);
            message.double_value = number;
            assert!(of_message(&message).is_err());
            message = of_type(ParameterType::PARAMETER_DOUBLE_ARRAY);
            message.double_array_value = vec![0.0, number];
            assert!(of_message(&message).is_err());
        }
        assert_eq!(whole(&json!(u64::MAX)), i64::MAX);
    }
}
