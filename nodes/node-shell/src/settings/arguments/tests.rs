use super::*;

fn parse(line: &str) -> Result<RosArguments, ArgumentError> {
    RosArguments::parse(line.split_whitespace())
}

#[test]
fn arguments_outside_belong_to_the_program() {
    let parsed =
        parse("bag.mcap --rate 2 --ros-args -r a:=b -- --loop --ros-args -p x:=1").unwrap();
    assert_eq!(parsed.own, ["bag.mcap", "--rate", "2", "--loop"]);
    assert_eq!(parsed.remappings.len(), 1);
    assert_eq!(parsed.parameters.len(), 1);
}

#[test]
fn nothing_is_taken_outside_ros_args() {
    let parsed = parse("-r a:=b -p x:=1 __node:=z").unwrap();
    assert_eq!(parsed.own.len(), 5);
    assert!(parsed.remappings.is_empty() && parsed.parameters.is_empty());
    assert_eq!(parsed.identity("detection").unwrap().full_name(), "/detection");
}

#[test]
fn remappings_name_topics_the_node_and_its_namespace() {
    let parsed = parse(
        "--ros-args -r scan:=/laser/scan --remap other:scan:=x -r __node:=left -r __ns:=/robot \
         -r rostopic://points:=cloud -r other:rosservice://~/reset:=rosservice:///empty",
    )
    .unwrap();
    let rule = |kind, node: Option<&str>, from: &str, to: &str| RemapRule {
        kind,
        node: node.map(str::to_owned),
        from: from.to_owned(),
        to: to.to_owned(),
    };
    assert_eq!(
        parsed.remappings,
        [
            rule(RemapKind::Any, None, "scan", "/laser/scan"),
            rule(RemapKind::Any, Some("other"), "scan", "x"),
            rule(RemapKind::Topic, None, "points", "cloud"),
            rule(RemapKind::Service, Some("other"), "~/reset", "/empty")
        ]
    );
    let identity = parsed.identity("detection").unwrap();
    assert_eq!(identity.full_name(), "/robot/left");
    assert_eq!(identity.resolve(&parsed.remappings, "scan").unwrap(), "/laser/scan");
}

#[test]
fn a_name_for_another_node_is_not_taken() {
    let parsed = parse("--ros-args -r other:__node:=x -r detection:__ns:=/a").unwrap();
    assert_eq!(parsed.identity("detection").unwrap().full_name(), "/a/detection");
}

/// rcl renames a node before it looks for its namespace.
#[test]
fn a_namespace_is_for_the_name_after_renaming() {
    let by_new_name = parse("--ros-args -r __node:=left -r left:__ns:=/a").unwrap();
    assert_eq!(by_new_name.identity("detection").unwrap().full_name(), "/a/left");
    let by_old_name = parse("--ros-args -r detection:__node:=left -r detection:__ns:=/a").unwrap();
    assert_eq!(by_old_name.identity("detection").unwrap().full_name(), "/left");
}

#[test]
fn what_has_no_effect_is_accepted_and_kept() {
    let parsed =
        parse("--ros-args --enclave /robot -e /other --log-config-file a.yaml -r a:=b").unwrap();
    let expected = ["--enclave /robot", "-e /other", "--log-config-file a.yaml"];
    assert_eq!(parsed.without_effect, expected);
    assert_eq!(parsed.remappings.len(), 1);
}

#[test]
fn the_log_goes_where_it_is_to_go() {
    let outputs = |line: &str| parse(&format!("--ros-args {line}")).unwrap().outputs;
    assert_eq!(outputs(""), LogOutputs::default());
    let all_off = "--disable-stdout-logs --disable-rosout-logs --disable-external-lib-logs";
    let expected = LogOutputs { stderr: false, rosout: false, file: false, file_name: None };
    assert_eq!(outputs(all_off), expected);
    let all_on = "--enable-stdout-logs --enable-rosout-logs --enable-external-lib-logs";
    assert_eq!(outputs(&format!("{all_off} {all_on}")), LogOutputs::default());
    assert_eq!(outputs("--log-file-name mapping").file_name.as_deref(), Some("mapping"));
}

#[test]
fn the_arguments_may_begin_and_end_several_times() {
    let parsed = parse("--ros-args -r a:=b --ros-args -r c:=d -- x --ros-args -r e:=f").unwrap();
    assert_eq!(parsed.own, ["x"]);
    let from: Vec<_> = parsed.remappings.iter().map(|rule| rule.from.as_str()).collect();
    assert_eq!(from, ["a", "c", "e"]);
}

#[test]
fn parameters_keep_their_order() {
    let parsed = parse(
        "--ros-args -p a.b:=1 --params-file f.yaml --param node:c:=[1,2] --params-file g.yaml",
    )
    .unwrap();
    let assignment = |node: Option<&str>, name: &str, value: &str| ParameterSource::Assignment {
        node: node.map(str::to_owned),
        name: name.to_owned(),
        value: value.to_owned(),
    };
    assert_eq!(
        parsed.parameters,
        [
            assignment(None, "a.b", "1"),
            ParameterSource::File("f.yaml".into()),
            assignment(Some("node"), "c", "[1,2]"),
            ParameterSource::File("g.yaml".into()),
        ]
    );
}

#[test]
fn a_value_may_hold_what_separates_names() {
    let parsed = parse("--ros-args -p frame:=a:=b").unwrap();
    let ParameterSource::Assignment { name, value, .. } = &parsed.parameters[0] else { panic!() };
    assert_eq!((name.as_str(), value.as_str()), ("frame", "a:=b"));
}

#[test]
fn log_levels_are_for_all_or_for_one() {
    let parsed = parse("--ros-args --log-level DEBUG --log-level rustdds:=warn").unwrap();
    assert_eq!(
        parsed.log,
        [
            LogDirective { logger: None, level: LogLevel::Debug },
            LogDirective { logger: Some("rustdds".into()), level: LogLevel::Warn }
        ]
    );
}

#[test]
fn each_mistake_says_what_is_accepted() {
    for (line, part) in [
        ("--ros-args -r", "FROM:=TO"),
        ("--ros-args -r --", "FROM:=TO"),
        ("--ros-args -r a=b", "FROM:=TO"),
        ("--ros-args -r a:=", "FROM:=TO"),
        ("--ros-args -r :=b", "empty"),
        ("--ros-args -r a:=1b", "digit"),
        ("--ros-args -r __node:=a/b", "underscores"),
        ("--ros-args -r __ns:=robot", "FROM:=TO"),
        ("--ros-args -r __ns:=/robot/", "empty"),
        ("--ros-args -r rosservice://a:=rostopic://b", "FROM:=TO"),
        ("--ros-args -r rosservice://__ns:=/b", "FROM:=TO"),
        ("--ros-args -r rostopic://:=b", "empty"),
        ("--ros-args -r http://a:=b", "only letters"),
        ("--ros-args -p a", "NAME:=VALUE"),
        ("--ros-args -p :=1", "NAME:=VALUE"),
        ("--ros-args -p a..b:=1", "NAME:=VALUE"),
        ("--ros-args --params-file", "YAML"),
        ("--ros-args --log-level loud", "debug, info"),
        ("--ros-args --log-level :=info", "debug, info"),
        ("--ros-args --log-level a=b:=info", "debug, info"),
        ("--ros-args --log-level", "debug, info"),
        ("--ros-args --log-file-name ../a", "the name of a file"),
        ("--ros-args --log-file-name", "the name of a file"),
        ("--ros-args a:=b", "unknown"),
        ("--ros-args --enclave", "an enclave"),
        ("--ros-args --enclave x", "an enclave"),
        ("--ros-args --enclaves /x", "unknown"),
    ] {
        let error = parse(line).unwrap_err().to_string();
        assert!(error.contains(part), "{line}: {error}");
    }
}
