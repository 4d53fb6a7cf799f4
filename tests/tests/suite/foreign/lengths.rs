//! Which lengths modulo 4 the encoding of a message can have at all: a claim about CDR that owes
//! nothing to the code that encodes.

use std::collections::BTreeSet;

use super::definitions::{Arity, Definitions, Element, Field};

/// The largest alignment of plain CDR.
const LARGEST_ALIGNMENT: usize = 8;

/// Where a field may start or end, modulo the largest alignment.
type Places = BTreeSet<usize>;

/// The lengths modulo 4 that a body of this message can have.
pub(super) fn possible_remainders(definitions: &Definitions, name: &str) -> BTreeSet<usize> {
    message(definitions, name, &Places::from([0])).into_iter().map(|place| place % 4).collect()
}

/// Whether the message can be of any size.
pub(super) fn can_grow(definitions: &Definitions, name: &str) -> bool {
    definitions.fields(name).iter().any(|Field { element, arity, .. }| {
        *arity == Arity::Sequence
            || match element {
                Element::Text => true,
                Element::Number(_) => false,
                Element::Message(inner) => can_grow(definitions, inner),
            }
    })
}

fn message(definitions: &Definitions, name: &str, start: &Places) -> Places {
    definitions.fields(name).iter().fold(start.clone(), |start, Field { element, arity, .. }| {
        let one = |start: &Places| one_element(definitions, element, start);
        match arity {
            Arity::One => one(&start),
            Arity::Array(length) => (0..*length).fold(start, |start, _| one(&start)),
            Arity::Sequence => {
                let mut ends = number(4, &start);
                loop {
                    let more: Places = ends.union(&one(&ends)).copied().collect();
                    if more == ends {
                        break ends;
                    }
                    ends = more;
                }
            }
        }
    })
}

fn one_element(definitions: &Definitions, element: &Element, start: &Places) -> Places {
    match element {
        // A count, then any number of bytes.
        Element::Text => (0..LARGEST_ALIGNMENT).collect(),
        Element::Message(inner) => message(definitions, inner, start),
        Element::Number(kind) => number(
            match kind.as_str() {
                "bool" | "byte" | "char" | "int8" | "uint8" => 1,
                "int16" | "uint16" => 2,
                "int32" | "uint32" | "float32" => 4,
                "int64" | "uint64" | "float64" => 8,
                other => panic!("{other} is no number"),
            },
            start,
        ),
    }
}

fn number(size: usize, start: &Places) -> Places {
    start.iter().map(|place| (place.next_multiple_of(size) + size) % LARGEST_ALIGNMENT).collect()
}

#[test]
fn lengths_follow_from_the_fields() {
    let definitions = Definitions::read();
    let check = |name: &str, remainders: &[usize], grows: bool| {
        let expected: BTreeSet<usize> = remainders.iter().copied().collect();
        assert_eq!(possible_remainders(&definitions, name), expected, "{name}");
        assert_eq!(can_grow(&definitions, name), grows, "{name}");
    };
    check("std_msgs/msg/Bool", &[1], false);
    check("builtin_interfaces/msg/Time", &[0], false);
    check("std_msgs/msg/Header", &[0, 1, 2, 3], true);
    check("sensor_msgs/msg/PointCloud2", &[0, 1, 2, 3], true);
    check("sensor_msgs/msg/LaserScan", &[0], true);
    // A flag after whole numbers.
    check("sensor_msgs/msg/CameraInfo", &[1], true);
}
