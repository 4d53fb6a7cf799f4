//! What people read of the nodes' parameters is made of their declarations: the files in `config/`, the tables of
//! `config/README.md`, and that of `nodes/README.md` with those that may change. `STILLMAP_WRITE_TABLES=1 cargo test -p
//! stillmap-tests parameter_table` writes all of them anew.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use compression::CompressionParameters;
use detection::shell::DetectionParameters;
use geometry::PipelineConfig;
use geometry::parameter::{Declaration, Kind, all_parameters};
use lidar_odometry::shell::LidarOdometryParameters;
use node_shell::parameters::{self, DeclaredParameter, NodeParameters, SharedParameters};
use pose::shell::PoseParameters;
use reconstruction::shell::ReconstructionParameters;
use segmentation::shell::SegmentationParameters;

use crate::program::succeed;

const WRITE: &str = "STILLMAP_WRITE_TABLES";
/// Above the lines of the parameters that may change.
const CHANGEABLE: &str = "| node | parameters |\n|---|---|\n";

/// Above what the nodes of the pipeline share.
const OF_PIPELINE: &str = "\
# What detection, segmentation and reconstruction must agree on, each parameter with its default: stated once, in a section for
# all nodes. Each cycle carries what it was made with, and a node refuses one that does not fit its own setting, with both
# values in its log and on /diagnostics.
#   detection --ros-args --params-file config/pipeline.yaml --params-file config/detection.yaml
# The node `pose` reads rig_from_camera here, too, where its own section does not say otherwise. Others ignore this section.
";

/// What is written of a node's parameters.
struct Pages {
    node: &'static str,
    declarations: &'static [Declaration],
    declared: Vec<DeclaredParameter>,
    file: String,
}

fn pages() -> [Pages; 6] {
    fn of<P: NodeParameters>(node: &'static str, shared: Option<SharedParameters<'_>>) -> Pages {
        Pages {
            node,
            declarations: P::DECLARATIONS,
            declared: parameters::declared::<P>().unwrap(),
            file: parameters::parameter_file::<P>(node, shared).unwrap(),
        }
    }
    let pipeline = Some(SharedParameters {
        file: "pipeline.yaml",
        declarations: PipelineConfig::DECLARATIONS,
    });
    [
        of::<DetectionParameters>("detection", pipeline),
        of::<SegmentationParameters>("segmentation", pipeline),
        of::<ReconstructionParameters>("reconstruction", pipeline),
        of::<PoseParameters>("pose", None),
        of::<LidarOdometryParameters>("lidar_odometry", None),
        of::<CompressionParameters>("compression", None),
    ]
}

/// What a parameter may be, in its unit.
fn accepted(declaration: &Declaration) -> String {
    let unit = declaration.unit().map(|unit| format!("in {unit}"));
    let form = match declaration.kind {
        Kind::Choice(choices) => {
            let texts: Vec<_> = choices.iter().map(|choice| format!("`{}`", choice.text)).collect();
            Some(texts.join(", "))
        }
        Kind::Reals(length) => Some(format!("{length} numbers")),
        _ => parameters::accepted_numbers(declaration),
    };
    form.into_iter().chain(unit).collect::<Vec<_>>().join(", ")
}

fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

fn table(pages: &Pages) -> String {
    let mut table = format!(
        "\n## {}\n\n| parameter | type | default | accepted | set at run time | meaning |\n|---|---|---|---|---|---|\n",
        pages.node
    );
    for DeclaredParameter { name, declaration, default } in &pages.declared {
        writeln!(
            table,
            "| `{name}` | {} | `{default}` | {} | {} | {} |",
            parameters::type_name(declaration.kind),
            cell(&accepted(declaration)),
            if declaration.is_changeable { "yes" } else { "no" },
            cell(&parameters::meaning(declaration))
        )
        .unwrap();
    }
    table
}

fn changeable(pages: &Pages) -> String {
    let all = pages.declared.iter().filter(|one| one.declaration.is_changeable);
    let names: Vec<_> = all.map(|one| format!("`{}`", one.name)).collect();
    if names.is_empty() {
        return String::new();
    }
    format!("| {} | {} |\n", pages.node, names.join(", "))
}

/// Holds a page to what its written part is to be; writes it where that was asked for.
fn hold(path: &str, current: impl Fn(&str) -> Option<String>) {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    let current = current(&written).unwrap_or_else(|| panic!("{}: no table", path.display()));
    if std::env::var_os(WRITE).is_some() {
        std::fs::write(&path, current).unwrap();
        return;
    }
    let line = written.lines().zip(current.lines()).position(|(is, should)| is != should);
    assert!(
        written == current,
        "{} is not current from line {} on: {WRITE}=1 cargo test -p stillmap-tests parameter_table",
        path.display(),
        line.map_or(written.lines().count(), |line| line) + 1
    );
}

#[test]
fn the_parameter_files_are_current() {
    for pages in pages() {
        hold(&format!("config/{}.yaml", pages.node), |_| Some(pages.file.clone()));
    }
    hold("config/pipeline.yaml", |_| {
        parameters::shared_parameter_file::<PipelineConfig>(OF_PIPELINE).ok()
    });
}

#[test]
fn the_tables_of_parameters_are_current() {
    for pages in pages() {
        let table = table(&pages);
        let heading = format!("\n## {}\n", pages.node);
        hold("config/README.md", |page| {
            let begin = page.find(&heading)?;
            let after = begin + heading.len();
            let end = page[after..].find("\n## ").map_or(page.len(), |end| after + end);
            Some(format!("{}{table}{}", &page[..begin], &page[end..]))
        });
    }
}

#[test]
fn the_table_of_parameters_that_may_change_is_current() {
    for pages in pages() {
        let line = changeable(&pages);
        let begin = format!("| {} | `", pages.node);
        hold("nodes/README.md", |page| {
            let (above, below) = page.split_once(CHANGEABLE)?;
            let (lines, below) = below.split_once("\n\n")?;
            let with = |old: &str| match old.starts_with(&begin) {
                true => line.clone(),
                false => format!("{old}\n"),
            };
            let lines: String = lines.lines().map(with).collect();
            Some(format!("{above}{CHANGEABLE}{lines}\n{below}"))
        });
    }
}

/// What is declared of one parameter by the name and the value of another is there.
#[test]
fn a_parameter_is_read_with_one_that_there_is() {
    for pages in pages() {
        let all = all_parameters(pages.declarations);
        for one in &all {
            assert!(!one.declaration.doc.is_empty(), "{}: {} has no meaning", pages.node, one.name);
            let Some(setting) = one.declaration.read_with else { continue };
            let of = |name: &str| all.iter().find(|other| other.name == name);
            let other = of(setting.name).unwrap_or_else(|| panic!("there is no {}", setting.name));
            let texts: Vec<&str> = match other.declaration.kind {
                Kind::Choice(choices) => choices.iter().map(|choice| choice.text).collect(),
                Kind::Truth => vec!["true", "false"],
                _ => Vec::new(),
            };
            assert!(texts.contains(&setting.value), "{}: {setting:?}", one.name);
        }
    }
}

#[test]
fn the_help_of_each_node_says_what_its_parameters_mean() {
    for pages in pages() {
        let help = succeed(["node", &pages.node.replace('_', "-"), "--help"]);
        let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
        for DeclaredParameter { name, declaration, .. } in &pages.declared {
            assert!(help.contains(&format!(" {name} (")), "{}: no {name}", pages.node);
            let doc = declaration.doc.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(help.contains(&doc), "{}: {name}: {doc}", pages.node);
        }
    }
}
