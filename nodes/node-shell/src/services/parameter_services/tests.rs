use msgs::rcl_interfaces::{IntegerRange, ListParametersRequest, ParameterType, ParameterValue};
use serde_json::{Value, json};

use super::*;
use crate::settings::parameters::Switches;

geometry::choices! {
    /// Where clouds come from.
    enum Input {
        /// From depth images.
        Depth = "depth",
        /// From a driver.
        Points = "points",
    }
}

geometry::parameters! {
    /// Voxels.
    #[derive(Clone, PartialEq, Debug)]
    struct Voxel {
        /// Its edge.
        edge_m: f64 = 0.08;
        /// How many there may be.
        most: u32 = 7, at_least(1.0), changeable;
    }
}

geometry::parameters! {
    /// Those of a node.
    #[derive(Clone, PartialEq, Debug)]
    struct Parameters {
        /// Where clouds come from.
        input: Input = Input::Depth, changeable;
        /// Shorter is noise, in s.
        least_s: f64 = 1.0, positive, changeable;
        /// Longer is noise, in s.
        most_s: f64 = 2.0, changeable;
        /// Where it is.
        mount: [f64; 3] = [0.0, 0.5, 1.0];
        /// Voxels.
        voxel: Voxel;
    }
    check = Self::check_order;
}

impl Parameters {
    fn check_order(&self) -> Result<(), geometry::ParameterError> {
        let (least_s, most_s) = (self.least_s, self.most_s);
        let accepted = ("at most most_s", most_s);
        geometry::parameter::check("least_s", accepted, least_s, least_s <= most_s)
    }
}

impl NodeParameters for Parameters {}

fn store() -> Store<Parameters> {
    let switches = Switches { use_sim_time: true, ..Switches::default() };
    Store::new(&Parameters::default(), switches).unwrap()
}

fn parameter(name: &str, value: &Value) -> Parameter {
    Parameter { name: name.to_owned(), value: value::to_message(value, value::type_of(value)) }
}

fn set(store: &mut Store<Parameters>, wanted: &[(&str, Value)]) -> Result<Vec<Parameter>, String> {
    let wanted: Vec<_> = wanted.iter().map(|(name, value)| parameter(name, value)).collect();
    store.set(&wanted)
}

fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

#[test]
fn what_a_parameter_is_comes_from_its_declaration() {
    let described = store().describe(&names(&["least_s", "voxel.most", "input", "mount", "other"]));
    let [least, most, input, mount, other] = described.as_slice() else { panic!() };
    assert_eq!(least.r#type, ParameterType::PARAMETER_DOUBLE);
    assert_eq!(least.description, "Shorter is noise, in s.");
    assert!(!least.read_only && least.integer_range.is_empty());
    assert!(least.floating_point_range.is_empty() && !least.additional_constraints.is_empty());
    assert_eq!(most.r#type, ParameterType::PARAMETER_INTEGER);
    assert!(most.integer_range.is_empty());
    assert_eq!(input.additional_constraints, "`depth` or `points`");
    assert!(mount.read_only && mount.additional_constraints.contains("length 3"), "{mount:?}");
    let unset = ParameterType::PARAMETER_NOT_SET;
    assert_eq!((other.name.as_str(), other.r#type), ("other", unset));
}

geometry::parameters! {
    /// Numbers that a person sets by a slider.
    #[derive(Clone, PartialEq, Debug)]
    struct Sliders {
        /// With bounds.
        few: u32 = 3, whole(1, 100), changeable;
        /// Without an upper one.
        many: usize = 7, at_least(1.0), changeable;
        /// Without any.
        any: u32 = 7, changeable;
        /// A fraction with bounds.
        share: f64 = 0.5, between(0.0, 1.0), changeable;
        /// A fraction without an upper one.
        reach_m: f64 = 0.5, not_negative, changeable;
    }
}

impl NodeParameters for Sliders {}

/// Regression: rqt_reconfigure opened no node of the suite but compression. It makes a slider of each range, whose ends have 32 bits, and
/// ended with an OverflowError at 2^63 - 1; a range of fractions up to 1.8e308 had one on which each step was 1.8e306.
#[test]
fn a_range_has_no_ends_that_a_slider_cannot_have() {
    let described = descriptor::descriptors::<Sliders>().unwrap();
    let of = |name: &str| {
        let one = &described[name];
        let ends = |one: &IntegerRange| (one.from_value, one.to_value);
        (one.integer_range.first().map(ends), one.additional_constraints.as_str())
    };
    assert_eq!(of("few"), (Some((1, 100)), ""));
    assert_eq!(of("many").0, None);
    assert!(of("many").1.starts_with('1'), "{}", of("many").1);
    assert_eq!(of("any").0, None);
    let range = &described["share"].floating_point_range[0];
    assert_eq!((range.from_value, range.to_value), (0.0, 1.0));
    assert!(described["reach_m"].floating_point_range.is_empty());
    assert!(of("reach_m").1.starts_with('0'), "{}", of("reach_m").1);
}

#[test]
fn values_and_types_are_those_of_the_struct() {
    let asked = names(&["least_s", "voxel.most", "input", "mount", "use_sim_time", "other"]);
    let store = store();
    let types = store.types(&asked);
    assert_eq!(types, [3, 2, 4, 8, 1, 0]);
    let values = store.values(&asked);
    assert_eq!(values.iter().map(|value| value.r#type).collect::<Vec<_>>(), types);
    assert_eq!((values[0].double_value, values[1].integer_value), (1.0, 7));
    assert_eq!((values[2].string_value.as_str(), values[4].bool_value), ("depth", true));
    assert_eq!(values[3].double_array_value, [0.0, 0.5, 1.0]);
    assert_eq!(values[5], ParameterValue::default());
    assert!(store.line().contains("most_s: 2.0, mount: [0.0,0.5,1.0]"), "{}", store.line());
}

#[test]
fn names_are_listed_by_prefix_and_depth() {
    let list = |prefixes: &[&str], depth| {
        let result = store().list(&ListParametersRequest { prefixes: names(prefixes), depth });
        (result.names.join(" "), result.prefixes.join(" "))
    };
    let all = "autostart input least_s most_s mount use_sim_time voxel.edge_m voxel.most";
    assert_eq!(list(&[], 0), (all.to_owned(), "voxel".to_owned()));
    assert_eq!(list(&[], 2).0, all);
    assert_eq!(list(&[], 1), (all.split(" voxel").next().unwrap().to_owned(), String::new()));
    let voxel = ("voxel.edge_m voxel.most".to_owned(), "voxel".to_owned());
    assert_eq!(list(&["voxel"], 1), voxel);
    assert_eq!(list(&["voxel", "mount"], 0).0, "mount voxel.edge_m voxel.most");
    assert_eq!(list(&["vox"], 0).0, "");
    assert_eq!(list(&["voxel.most"], 1).0, "voxel.most");
}

#[test]
fn what_is_set_is_read_back() {
    let mut store = store();
    let changed = set(
        &mut store,
        &[("least_s", json!(1.5)), ("most_s", json!(3)), ("input", json!("points"))],
    )
    .unwrap();
    // A whole number for a fractional one is taken, and is fractional from then on.
    assert_eq!(changed[1].value.r#type, ParameterType::PARAMETER_DOUBLE);
    assert_eq!(changed[1].value.double_value, 3.0);
    let expected =
        Parameters { input: Input::Points, least_s: 1.5, most_s: 3.0, ..Parameters::default() };
    assert_eq!(*store.parameters(), expected);
    assert_eq!(store.values(&names(&["input"]))[0].string_value, "points");
}

#[test]
fn what_is_refused_changes_nothing_and_says_why() {
    let mut store = store();
    for (wanted, part) in [
        (vec![("voxel.edge_m", json!(0.1))], "cannot change while the node runs"),
        (vec![("use_sim_time", json!(false))], "cannot change while the node runs"),
        (vec![("least_s", json!(2.5))], "least_s must be at most most_s (2), not 2.5"),
        (vec![("least_s", json!("x"))], "a number"),
        (vec![("least_s", Value::Null)], "deleted"),
        (vec![("input", json!("cloud"))], "`depth` or `points`"),
        (vec![("voxel.most", json!(-1))], "invalid value"),
        (vec![("voxel.most", json!(0))], "parameter voxel.most must be 1 to 4294967295, not 0"),
        (vec![("leastt_s", json!(1.0))], "did you mean `least_s`"),
        (vec![("most_s", json!(9.0)), ("least_s", json!("x"))], "a number"),
        (vec![("most_s", json!(9.0)), ("mount", json!([1.0, 2.0, 3.0]))], "cannot change"),
    ] {
        let reason = set(&mut store, &wanted).unwrap_err();
        assert!(reason.contains(part), "{wanted:?}: {reason}");
        assert_eq!(*store.parameters(), Parameters::default(), "{wanted:?}");
    }
    // Together they are accepted, one after the other they would not be.
    set(&mut store, &[("least_s", json!(2.5)), ("most_s", json!(2.75))]).unwrap();
    assert_eq!((store.parameters().least_s, store.parameters().most_s), (2.5, 2.75));
}

#[test]
fn setting_nothing_is_no_mistake() {
    assert_eq!(set(&mut store(), &[]), Ok(Vec::new()));
}
