use proptest::prelude::*;

use super::*;

fn identity(namespace: &str) -> NodeIdentity {
    NodeIdentity::new(namespace, "detection").unwrap()
}

#[test]
fn names_expand_as_ros_2_says() {
    for (namespace, name, absolute) in [
        ("/", "scan", "/scan"),
        ("", "scan", "/scan"),
        ("/robot", "scan", "/robot/scan"),
        ("robot", "depth/image", "/robot/depth/image"),
        ("/robot", "/scan", "/scan"),
        ("/", "~/report", "/detection/report"),
        ("/a/b", "~/report", "/a/b/detection/report"),
        ("/a/b", "~", "/a/b/detection"),
        ("/a/b", "{node}/x", "/a/b/detection/x"),
        ("/a/b", "/{ns}/{node}", "/a/b/detection"),
    ] {
        assert_eq!(identity(namespace).expand(name).unwrap(), absolute, "{namespace} {name}");
    }
}

#[test]
fn names_that_ros_2_refuses_are_refused() {
    for name in [
        "",
        "/",
        "a//b",
        "/a/",
        "a/",
        "1scan",
        "a/2b",
        "sc an",
        "scan!",
        "~report",
        "a~/b",
        "{node",
        "{other}/x",
        "a-b",
        "a/~/b",
        "ä",
    ] {
        assert!(identity("/").expand(name).is_err(), "{name:?} was accepted");
    }
    assert!(identity("/").expand(&"a".repeat(247)).is_err());
    assert!(identity("/").expand(&"a".repeat(246)).is_ok());
    for (namespace, name) in [("/", ""), ("/", "a/b"), ("//", "a"), ("/a/", "b"), ("/", "1a")] {
        assert!(NodeIdentity::new(namespace, name).is_err(), "{namespace:?} {name:?}");
    }
}

fn rule(node: Option<&str>, from: &str, to: &str) -> RemapRule {
    let (from, to) = (from.to_owned(), to.to_owned());
    RemapRule { kind: RemapKind::Any, node: node.map(str::to_owned), from, to }
}

#[test]
fn the_first_rule_that_fits_remaps() {
    let node = identity("/robot");
    let rules = [
        rule(Some("other"), "scan", "/never"),
        rule(None, "scan", "/laser/scan"),
        rule(None, "/robot/scan", "/too_late"),
        rule(None, "~/report", "report"),
    ];
    assert_eq!(node.resolve(&rules, "scan").unwrap(), "/laser/scan");
    assert_eq!(node.resolve(&rules, "/robot/scan").unwrap(), "/laser/scan");
    assert_eq!(node.resolve(&rules, "/scan").unwrap(), "/scan");
    assert_eq!(node.resolve(&rules, "~/report").unwrap(), "/robot/report");
}

#[test]
fn a_rule_with_a_scheme_is_for_topics_or_services_alone() {
    let node = identity("/robot");
    let of_kind = |kind, to| RemapRule { kind, ..rule(None, "~/reset", to) };
    let rules = [
        of_kind(RemapKind::Topic, "topic"),
        of_kind(RemapKind::Service, "service"),
        of_kind(RemapKind::Any, "any"),
    ];
    assert_eq!(node.resolve(&rules, "~/reset").unwrap(), "/robot/topic");
    assert_eq!(node.resolve_service(&rules, "~/reset").unwrap(), "/robot/service");
    assert_eq!(node.resolve_service(&rules[..1], "~/reset").unwrap(), "/robot/detection/reset");
    assert_eq!(node.resolve(&rules[2..], "~/reset").unwrap(), "/robot/any");
    assert_eq!(node.resolve_service(&rules[2..], "~/reset").unwrap(), "/robot/any");
}

#[test]
fn a_logger_has_the_nodes_name_with_dots() {
    assert_eq!(identity("/").logger_name(), "detection");
    assert_eq!(identity("/a/b").logger_name(), "a.b.detection");
}

#[test]
fn a_rule_is_not_applied_twice() {
    let rules = [rule(None, "a", "b"), rule(None, "b", "a")];
    assert_eq!(identity("/").resolve(&rules, "a").unwrap(), "/b");
    assert_eq!(identity("/").resolve(&rules, "b").unwrap(), "/a");
}

#[test]
fn types_have_the_names_of_other_middlewares() {
    assert_eq!(
        dds_type_name("sensor_msgs/msg/LaserScan").unwrap(),
        "sensor_msgs::msg::dds_::LaserScan_"
    );
    assert_eq!(ros_type_name("sensor_msgs::msg::dds_::LaserScan_"), "sensor_msgs/msg/LaserScan");
    for bad in ["LaserScan", "sensor_msgs/LaserScan", "a/msg/b/c", "a//b", "a/msg/"] {
        assert!(dds_type_name(bad).is_err(), "{bad:?}");
    }
}

proptest! {
    #[test]
    fn what_expands_is_absolute_and_stays_as_it_is(name in "[a-z_/~{}0-9]{0,12}") {
        let node = identity("/robot");
        if let Ok(absolute) = node.expand(&name) {
            prop_assert!(absolute.starts_with('/'));
            prop_assert!(!absolute.contains("//") && !absolute.ends_with('/'));
            prop_assert_eq!(node.expand(&absolute).unwrap(), absolute);
        }
    }
}
