//! The tables of `config/README.md` say what the nodes say of their parameters to others: made from the same
//! descriptors, with the structs' defaults. `STILLMAP_WRITE_TABLES=1 cargo test -p stillmap-tests parameter_table`
//! writes them anew.

use std::fmt::Write;
use std::path::Path;

use compression::CompressionParameters;
use detection::shell::DetectionParameters;
use lidar_odometry::shell::LidarOdometryParameters;
use msgs::rcl_interfaces::{ParameterDescriptor, ParameterType};
use node_shell::parameters::NodeParameters;
use pose::shell::PoseParameters;
use reconstruction::shell::ReconstructionParameters;
use segmentation::shell::SegmentationParameters;
use serde_json::Value;

const WRITE: &str = "STILLMAP_WRITE_TABLES";
const PAGE: &str = "../config/README.md";
/// What stands above the tables is written by hand.
const BEGIN: &str = "<!-- tables -->\n";

/// The value of a parameter, of groups by `group.name`.
fn value<'a>(values: &'a Value, name: &str) -> &'a Value {
    name.split('.').fold(values, |group, part| &group[part])
}

fn type_name(kind: u8) -> &'static str {
    match kind {
        ParameterType::PARAMETER_BOOL => "bool",
        ParameterType::PARAMETER_INTEGER => "int",
        ParameterType::PARAMETER_DOUBLE => "double",
        ParameterType::PARAMETER_STRING => "string",
        ParameterType::PARAMETER_DOUBLE_ARRAY => "double[]",
        ParameterType::PARAMETER_INTEGER_ARRAY => "int[]",
        ParameterType::PARAMETER_STRING_ARRAY => "string[]",
        ParameterType::PARAMETER_BOOL_ARRAY => "bool[]",
        other => panic!("there is no type {other}"),
    }
}

fn accepted(one: &ParameterDescriptor) -> String {
    let of_real = one.floating_point_range.first().map(|r| real_range(r.from_value, r.to_value));
    let of_whole = one.integer_range.first().map(|r| whole_range(r.from_value, r.to_value));
    let parts = [of_real.or(of_whole), Some(one.additional_constraints.clone())];
    parts.into_iter().flatten().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("; ")
}

/// Ends that are left out are told by the numbers next to them.
fn real_range(least: f64, most: f64) -> String {
    let from = if least > 0.0 && least.next_down() == 0.0 {
        "above 0".to_owned()
    } else {
        format!("{least} or more")
    };
    match most {
        f64::MAX => from,
        _ if most.next_up().fract() == 0.0 && most.fract() != 0.0 => {
            format!("{from}, below {}", most.next_up())
        }
        _ => format!("{from}, to {most}"),
    }
}

fn whole_range(least: i64, most: i64) -> String {
    match most {
        i64::MAX => format!("{least} or more"),
        _ => format!("{least} to {most}"),
    }
}

fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}

fn table<P: NodeParameters>(node: &str) -> String {
    let defaults = serde_json::to_value(P::default()).unwrap();
    let mut table = format!(
        "\n## {node}\n\n| parameter | type | default | accepted | set at run time | meaning |\n|---|---|---|---|---|---|\n"
    );
    for one in node_shell::descriptors::<P>().unwrap() {
        writeln!(
            table,
            "| `{}` | {} | `{}` | {} | {} | {} |",
            one.name,
            type_name(one.r#type),
            value(&defaults, &one.name),
            cell(&accepted(&one)),
            if one.read_only { "no" } else { "yes" },
            cell(&one.description)
        )
        .unwrap();
    }
    table
}

#[test]
fn the_tables_of_parameters_are_current() {
    let tables = [
        table::<DetectionParameters>("detection"),
        table::<SegmentationParameters>("segmentation"),
        table::<ReconstructionParameters>("reconstruction"),
        table::<PoseParameters>("pose"),
        table::<LidarOdometryParameters>("lidar_odometry"),
        table::<CompressionParameters>("compression"),
    ]
    .concat();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(PAGE);
    let page = std::fs::read_to_string(&path).unwrap();
    let (above, written) = page.split_once(BEGIN).unwrap();
    if std::env::var_os(WRITE).is_some() {
        std::fs::write(&path, format!("{above}{BEGIN}{tables}")).unwrap();
        return;
    }
    assert!(
        written == tables,
        "config/README.md is not current: {WRITE}=1 cargo test -p stillmap-tests parameter_table"
    );
}
