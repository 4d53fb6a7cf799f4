use geometry::parameter::{Kind, Parameter};
use serde::Deserialize;

use super::*;

#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Input {
    Depth,
    Points,
}

#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
struct Voxel {
    edge_m: f64,
    least_points: u32,
}

#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
struct Parameters {
    input: Input,
    frame: String,
    hold: bool,
    window: u32,
    tolerance_rad: f32,
    rig_from_lidar: [f64; 6],
    topics: Vec<String>,
    save_to: Option<String>,
    voxel: Voxel,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            input: Input::Depth,
            frame: "map".to_owned(),
            hold: true,
            window: 3,
            tolerance_rad: 0.0175,
            rig_from_lidar: [0.0, 0.0, -0.05, 0.0, 0.0, 0.0],
            topics: vec!["scan".to_owned()],
            save_to: None,
            voxel: Voxel { edge_m: 0.08, least_points: 1 },
        }
    }
}

/// What these tests load is not declared: its form alone counts.
macro_rules! undeclared {
    ($struct:ty) => {
        impl Parameter for $struct {
            const KIND: Kind = Kind::Group { members: &[], is_flat: false };

            fn check(&self, _: &'static Declaration) -> Result<(), geometry::ParameterError> {
                Ok(())
            }
        }

        impl geometry::parameter::Parameters for $struct {
            const DECLARATIONS: &'static [Declaration] = &[];

            fn validate(&self) -> Result<(), geometry::ParameterError> {
                Ok(())
            }
        }
    };
}

undeclared!(Parameters);

fn assigned(assignments: &[(&str, &str)]) -> Result<Parameters, ParameterError> {
    let assignments: Vec<_> = assignments
        .iter()
        .map(|(name, value)| Assignment { name: (*name).to_owned(), value: (*value).to_owned() })
        .collect();
    load("/detection", &[] as &[&Path], &assignments)
}

fn from_file(node_name: &str, text: &str) -> Result<Parameters, ParameterError> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    load(node_name, &[file.path()], &[])
}

#[test]
fn without_sources_the_defaults_stand() {
    assert_eq!(assigned(&[]).unwrap(), Parameters::default());
}

#[test]
fn every_type_of_value_is_read() {
    let read = assigned(&[
        ("input", "points"),
        ("frame", "\"2\""),
        ("hold", "false"),
        ("window", "5"),
        ("tolerance_rad", "1e-2"),
        ("rig_from_lidar", "[1, 2.5, 0, 0, 0, -1]"),
        ("topics", "[a, b]"),
        ("save_to", "out.ply"),
        ("voxel.edge_m", "1"),
    ])
    .unwrap();
    let expected = Parameters {
        input: Input::Points,
        frame: "2".to_owned(),
        hold: false,
        window: 5,
        tolerance_rad: 0.01,
        rig_from_lidar: [1.0, 2.5, 0.0, 0.0, 0.0, -1.0],
        topics: vec!["a".to_owned(), "b".to_owned()],
        save_to: Some("out.ply".to_owned()),
        voxel: Voxel { edge_m: 1.0, least_points: 1 },
    };
    assert_eq!(read, expected);
}

#[test]
fn a_later_value_wins_and_null_takes_one_back() {
    assert_eq!(assigned(&[("window", "5"), ("window", "7")]).unwrap().window, 7);
    assert_eq!(assigned(&[("save_to", "a"), ("save_to", "null")]).unwrap().save_to, None);
}

#[test]
fn yes_and_no_are_true_and_false_as_in_ros_2() {
    assert!(!assigned(&[("hold", "no")]).unwrap().hold);
    assert!(assigned(&[("hold", "false"), ("hold", "yes")]).unwrap().hold);
}

#[test]
fn each_mistake_names_the_key_and_what_is_accepted() {
    for (name, value, parts) in [
        ("windw", "5", &["`windw`", "on the command line", "did you mean `window`"][..]),
        ("completely_other", "5", &["`completely_other`", "accepted are", "voxel.edge_m"]),
        ("voxel.edge", "5", &["did you mean `voxel.edge_m`"]),
        ("voxel", "5", &["`voxel`", "a group", "`voxel.edge_m`"]),
        ("window", "0.5", &["`window`", "a whole number, as 3", "not 0.5"]),
        ("window", "-1", &["`window`", "invalid value"]),
        ("hold", "1", &["true or false", "not 1"]),
        ("hold", "maybe", &["true or false", "not \"maybe\""]),
        ("frame", "no", &["text, as \"map\"", "not false"]),
        ("topics.0", "x", &["unknown parameter `topics.0`"]),
        ("frame", "2", &["`frame`", "text, as \"map\"", "not 2"]),
        ("tolerance_rad", "wide", &["a number", "not \"wide\""]),
        ("input", "cloud", &["`input`", "`depth` or `points`"]),
        ("rig_from_lidar", "[1, 2]", &["`rig_from_lidar`", "length"]),
        ("rig_from_lidar", "3", &["a list, as [0.0,"]),
        ("save_to", "3", &["`save_to`", "string"]),
        ("window", "[1", &["`window`", "YAML"]),
        ("tolerance_rad", ".inf", &["`tolerance_rad`"]),
        ("use_sim_time", "3", &["true or false"]),
        ("a~/b", "3", &["unknown parameter"]),
    ] {
        let error = assigned(&[(name, value)]).unwrap_err().to_string();
        for part in parts {
            assert!(error.contains(part), "{name}:={value} should say {part:?}: {error}");
        }
    }
    assert!(assigned(&[("use_sim_time", "false"), ("use_sim_time", "true")]).is_ok());
}

#[test]
fn a_file_has_sections_for_nodes() {
    let text = "
detection:
  ros__parameters:
    window: 7
/**:
  ros__parameters:
    window: 4
    frame: world
    voxel: {edge_m: 0.1}
    voxel.least_points: 2
/robot:
  detection:
    ros__parameters: {hold: false}
";
    let root = from_file("/detection", text).unwrap();
    assert_eq!((root.window, root.frame.as_str(), root.hold), (7, "world", true));
    assert_eq!(root.voxel, Voxel { edge_m: 0.1, least_points: 2 });
    let robot = from_file("/robot/detection", text).unwrap();
    assert_eq!((robot.window, robot.frame.as_str(), robot.hold), (4, "world", false));
    let other = from_file("/other", text).unwrap();
    assert_eq!((other.window, other.hold), (4, true));
}

#[test]
fn an_empty_file_or_section_changes_nothing() {
    for text in
        ["", "---\n", "detection:\n  ros__parameters:\n", "other: {ros__parameters: {x: 1}}"]
    {
        assert_eq!(from_file("/detection", text).unwrap(), Parameters::default(), "{text:?}");
    }
}

#[test]
fn mistakes_in_a_file_name_the_file() {
    for (text, part) in [
        ("a: [", "no valid YAML"),
        ("- 1\n- 2\n", "no mapping"),
        ("window: 3\n", "`window`"),
        ("ros__parameters: {window: 3}\n", "ros__parameters"),
        ("detection: {ros__parameters: 3}\n", "ros__parameters"),
        ("detection: {window: 3}\n", "`window`"),
        ("detection: {ros__parameters: {windw: 3}}\n", "did you mean `window`"),
        ("detection: {ros__parameters: {window: x}}\n", "a whole number"),
        ("detection: {ros__parameters: {window: 3, window: 4}}\n", "no valid YAML"),
        ("/**: {ros__parameters: {use_sim_time: 1}}\n", "true or false"),
        ("/**: {ros__parameters: {window: x}}\n", "a whole number"),
        ("detection: {ros__parameters: {window: 3}, window: 4}\n", "`window`"),
        ("/**/detection: {ros__parameters: {windw: 3}}\n", "did you mean `window`"),
    ] {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let error = load::<Parameters>("/detection", &[file.path()], &[]).unwrap_err().to_string();
        assert!(error.contains(part), "{text}: {error}");
        assert!(error.contains(file.path().to_str().unwrap()), "{text}: {error}");
    }
    let error = load::<Parameters>("/x", &["/no/such/file.yaml"], &[]).unwrap_err().to_string();
    assert!(error.contains("/no/such/file.yaml"), "{error}");
}

#[test]
fn a_mistake_in_a_file_has_its_line() {
    let section =
        "# a comment\nother:\n  ros__parameters: {x: 1}\ndetection:\n  ros__parameters:\n";
    for (text, line) in [
        (format!("{section}    hold: false\n    windw: 3\n"), 7),
        (format!("{section}    voxel:\n      edge: 1.0\n"), 7),
        (format!("{section}    frame: &f x\n    window: *f\n"), 7),
        (format!("{section}    window: 3\nrobot: 7\n"), 7),
    ] {
        let error = from_file("/detection", &text).unwrap_err().to_string();
        assert!(error.contains(&format!(", line {line}")), "{text}: {error}");
    }
}

/// A node with many parameters does not bury the message in their names.
#[test]
fn a_message_lists_few_parameters_and_refers_to_the_help_for_many() {
    #[derive(Clone, Serialize, Deserialize)]
    struct Gains<const COUNT: usize>(std::collections::BTreeMap<String, f64>);
    impl<const COUNT: usize> Default for Gains<COUNT> {
        fn default() -> Self {
            Self((0..COUNT).map(|index| (format!("gain_{index}"), 0.0)).collect())
        }
    }
    fn message<const COUNT: usize>() -> String {
        let parameters = Overlay::<Gains<COUNT>>::new().unwrap();
        parameters.unknown("completely_other", ValueOrigin::CommandLine).to_string()
    }
    let (few, many) = (message::<20>(), message::<21>());
    assert!(few.contains("accepted are gain_0, gain_1, "), "{few}");
    assert!(many.ends_with("--help lists the 21 that the node has"), "{many}");
}

/// What a section for several nodes says is for those that know it.
/// Regression: a launch file that sets these for all of its nodes (`SetParameter`, which is `-p`) ended the suite's nodes.
#[test]
fn what_every_node_of_rclcpp_has_is_accepted_and_without_effect() {
    let assign = |name: &str| {
        let assignment = Assignment { name: name.to_owned(), value: "false".to_owned() };
        load::<Parameters>("/detection", &[] as &[&Path], &[assignment])
    };
    for name in [
        "start_type_description_service",
        "qos_overrides./tf.subscription.reliability",
        "qos_overrides./parameter_events.publisher.depth",
    ] {
        assert_eq!(assign(name).unwrap(), Parameters::default(), "{name}");
    }
    for name in ["qos_overrides", "start_type_description", "qos_override./tf.depth"] {
        assert!(matches!(assign(name), Err(ParameterError::Unknown { .. })), "{name}");
    }
}

#[test]
fn a_section_for_several_nodes_may_hold_what_others_know() {
    for section in ["/**", "/*", "/robot/*", "/robot/**", "/**/*"] {
        let text = format!("{section}: {{ros__parameters: {{others: [1, 2], window: 5}}}}");
        let node = if section == "/*" { "/detection" } else { "/robot/detection" };
        assert_eq!(from_file(node, &text).unwrap().window, 5, "{section}");
    }
    for section in ["/*/detection", "/**/detection", "/robot/detection"] {
        let text = format!("{section}: {{ros__parameters: {{others: [1, 2]}}}}");
        let error = from_file("/robot/detection", &text).unwrap_err().to_string();
        assert!(error.contains("`others`") && error.contains("accepted are"), "{section}: {error}");
    }
}

#[test]
fn a_node_may_stand_beside_the_nodes_of_its_name_as_namespace() {
    let text = "
robot:
  ros__parameters: {window: 9}
  detection:
    ros__parameters: {window: 8}
  left/detection:
    ros__parameters: {window: 7}
";
    assert_eq!(from_file("/robot", text).unwrap().window, 9);
    assert_eq!(from_file("/robot/detection", text).unwrap().window, 8);
    assert_eq!(from_file("/robot/left/detection", text).unwrap().window, 7);
}

#[test]
fn sections_of_one_node_add_up_and_its_own_wins() {
    let text = "
/robot/*: {ros__parameters: {window: 4, hold: false}}
/**/detection: {ros__parameters: {window: 5, frame: a}}
/robot/detection: {ros__parameters: {window: 6}}
/**: {ros__parameters: {window: 7, topics: [a, b, 'true']}}
";
    let read = from_file("/robot/detection", text).unwrap();
    assert_eq!((read.window, read.hold, read.frame.as_str()), (6, false, "a"));
    assert_eq!(read.topics, ["a", "b", "true"]);
}

/// A parameter that has another name now is taken by its former one, from files and from the command line.
#[test]
fn a_former_name_is_accepted() {
    geometry::parameters! {
        #[derive(Clone, PartialEq, Debug)]
        struct Stop {
            /// A time.
            max_stop_s: f64 = 60.0, formerly("stopped_object_s");
        }
    }
    let stop = |name: &str| {
        let assignments = [Assignment { name: name.to_owned(), value: "10".to_owned() }];
        load::<Stop>("/n", &[] as &[&Path], &assignments).map(|read| read.max_stop_s)
    };
    assert_eq!((stop("max_stop_s").unwrap(), stop("stopped_object_s").unwrap()), (10.0, 10.0));
    assert!(stop("stopped_s").is_err());
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), "/**: {ros__parameters: {stopped_object_s: 20.0}}").unwrap();
    assert_eq!(load::<Stop>("/n", &[file.path()], &[]).unwrap().max_stop_s, 20.0);
}

#[test]
fn lists_are_of_every_type() {
    #[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
    struct Lists {
        flags: Vec<bool>,
        counts: Vec<i64>,
        lengths: Vec<f64>,
        names: Vec<String>,
    }
    undeclared!(Lists);
    let file = tempfile::NamedTempFile::new().unwrap();
    let text = "n:\n  ros__parameters:\n    flags: [true, no]\n    counts:\n    - 1\n    - -2\n    \
                lengths: [1, 2.5, 1e3]\n    names: []\n";
    std::fs::write(file.path(), text).unwrap();
    let read: Lists = load("/n", &[file.path()], &[]).unwrap();
    let expected = Lists {
        flags: vec![true, false],
        counts: vec![1, -2],
        lengths: vec![1.0, 2.5, 1000.0],
        names: Vec::new(),
    };
    assert_eq!(read, expected);
}

#[test]
fn several_files_and_assignments_are_taken_in_their_order() {
    let file = |text: &str| {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        file
    };
    let own = file("detection: {ros__parameters: {window: 5, hold: false}}");
    let all = file("/**: {ros__parameters: {window: 6}}");
    let node = NodeIdentity::new("/", "detection").unwrap();
    let source = |file: &tempfile::NamedTempFile| ParameterSource::File(file.path().to_owned());
    let assignment = ParameterSource::Assignment {
        node: None,
        name: "window".to_owned(),
        value: "7".to_owned(),
    };
    let window =
        |sources: &[ParameterSource]| of_node::<Parameters>(&node, sources).unwrap().window;
    assert_eq!(window(&[source(&own), source(&all)]), 6);
    assert_eq!(window(&[source(&all), source(&own)]), 5);
    assert_eq!(window(&[assignment.clone(), source(&own)]), 5);
    assert_eq!(window(&[source(&own), assignment]), 7);
}

#[test]
fn simulated_time_is_every_nodes_parameter() {
    let node = NodeIdentity::new("/", "detection").unwrap();
    let text = |yaml: &str| ParameterSource::Text { name: "x".to_owned(), yaml: yaml.to_owned() };
    let wanted = |sources: &[ParameterSource]| switches(&node, sources).unwrap().use_sim_time;
    let on = text("/**: {ros__parameters: {use_sim_time: true, others: 1}}");
    let off = text("detection: {ros__parameters: {use_sim_time: false}}");
    assert!(!wanted(&[]));
    assert!(wanted(std::slice::from_ref(&on)));
    assert!(!wanted(&[on, off]));
    assert!(switches(&node, &[text("/**: {ros__parameters: {use_sim_time: 1}}")]).is_err());
}

#[test]
fn an_assignment_may_be_for_another_node() {
    let sources = |node: &str| {
        [ParameterSource::Assignment {
            node: Some(node.to_owned()),
            name: "window".to_owned(),
            value: "9".to_owned(),
        }]
    };
    let node = NodeIdentity::new("/robot", "detection").unwrap();
    assert_eq!(of_node::<Parameters>(&node, &sources("detection")).unwrap().window, 9);
    assert_eq!(of_node::<Parameters>(&node, &sources("other")).unwrap().window, 3);
}

#[test]
fn parameters_describe_themselves() {
    let described = describe::<Parameters>().unwrap();
    assert!(described.contains(&("voxel.edge_m".to_owned(), "0.08".to_owned())));
    assert!(described.contains(&("input".to_owned(), "\"depth\"".to_owned())));
    assert_eq!(described.len(), 10);
}
