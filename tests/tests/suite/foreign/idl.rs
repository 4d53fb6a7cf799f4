//! All messages as one IDL file, in the way ROS 2 maps them: what the foreign generators read.

use super::definitions::{Arity, Definitions, Element, Field};

/// The IDL of every message.
pub(super) fn idl(definitions: &Definitions) -> String {
    let mut text = String::new();
    for name in definitions.inner_first() {
        let (package, base) = package_and_base(name);
        text += &format!(
            "module {package} {{ module msg {{ module dds_ {{\n@final struct {base}_ {{\n"
        );
        for field in definitions.fields(name) {
            text += &member(field);
        }
        text += "};\n}; }; };\n";
    }
    text
}

/// A line `MESSAGE(package, Name)` for each message: the peers' tables of types.
pub(super) fn table(definitions: &Definitions) -> String {
    definitions
        .names()
        .map(|name| {
            let (package, base) = package_and_base(name);
            format!("MESSAGE({package}, {base})\n")
        })
        .collect()
}

/// A member. ROS 2 ends the names with an underscore, which the wire does not carry; here that would
/// make `pose_` of type `Pose_`, and IDL does not tell large letters from small ones.
fn member(Field { element, arity, name }: &Field) -> String {
    let element = match element {
        Element::Text => "string".to_owned(),
        Element::Message(inner) => {
            let (package, base) = package_and_base(inner);
            format!("{package}::msg::dds_::{base}_")
        }
        Element::Number(number) => match number.as_str() {
            "bool" => "boolean",
            // A signed byte is an octet on the wire, and older generators have no word of its own for it.
            "byte" | "char" | "int8" | "uint8" => "octet",
            "int16" => "short",
            "uint16" => "unsigned short",
            "int32" => "long",
            "uint32" => "unsigned long",
            "int64" => "long long",
            "uint64" => "unsigned long long",
            "float32" => "float",
            "float64" => "double",
            other => panic!("{other} has no place in the IDL yet"),
        }
        .to_owned(),
    };
    match arity {
        Arity::One => format!("    {element} {name};\n"),
        Arity::Array(length) => format!("    {element} {name}[{length}];\n"),
        Arity::Sequence => format!("    sequence<{element}> {name};\n"),
    }
}

fn package_and_base(name: &str) -> (&str, &str) {
    name.split_once("/msg/").unwrap()
}

#[test]
fn an_inner_message_stands_before_its_outer_one() {
    let text = idl(&Definitions::read());
    let at = |part: &str| text.find(part).unwrap_or_else(|| panic!("{part} in {text}"));
    let header = "    std_msgs::msg::dds_::Header_ header;\n";
    assert!(at("struct Time_ {") < at("struct Header_ {") && at("struct Header_ {") < at(header));
    at("    sequence<float> ranges;\n");
    at("    double covariance[36];\n");
    at("    sequence<octet> data;\n");
    assert_eq!(text.matches("struct Header_ {").count(), 1);
}
