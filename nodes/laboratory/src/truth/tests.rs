use std::path::{Path, PathBuf};

use clap::Parser;
use robot::run::inputs::TopicArgs;
use robot::run::{HowArgs, TransportName, run_bag};
use robot::{Interrupt, Outcome};
use serde_json::Value;

use super::*;
use crate::eval::map::{self, MapArgs};
use crate::simulate::{self, SimulateArgs};

#[derive(Parser)]
struct Simulate {
    #[command(flatten)]
    args: SimulateArgs,
}

#[derive(Parser)]
struct Run {
    #[command(flatten)]
    topics: TopicArgs,
    #[command(flatten)]
    how: HowArgs,
}

#[derive(Parser)]
struct Map {
    #[command(flatten)]
    args: MapArgs,
}

/// Two seconds of the small room, with a colour camera.
fn small_room(folder: &Path) -> PathBuf {
    let bag = folder.join("small.mcap");
    let line = ["simulate", "small", "--colour", "--seconds", "2", "-o", bag.to_str().unwrap()];
    let args = Simulate::parse_from(line).args;
    assert_eq!(simulate::run(&args, &Interrupt::default()).unwrap(), Outcome::Complete);
    bag
}

/// The report of `run` on a bag with ground truth.
fn truth_of_run(bag: &Path, out: &Path, arguments: &[&str]) -> Value {
    let run = Run::parse_from([&["run", "--no-timing"], arguments].concat());
    let how = (&run.how, TransportName::Local);
    run_bag(bag, out, &run.topics, how, Some(score), &Interrupt::default()).unwrap();
    let summary = std::fs::read(out.join("summary.json")).unwrap();
    serde_json::from_slice::<Value>(&summary).unwrap()["truth"].clone()
}

#[test]
fn the_map_is_compared_with_the_surface_as_eval_map_does_and_only_in_its_frame() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let out = folder.path().join("of_bag");
    let truth = truth_of_run(&bag, &out, &[]);
    let map = out.join("map.ply");
    let line = ["map", map.to_str().unwrap(), "--ref", bag.to_str().unwrap(), "--edge", "0.05"];
    let same = map::score(&Map::parse_from(line).args).unwrap().distance;
    assert_eq!(truth["map"]["surface"], serde_json::to_value(same).unwrap());
    assert!(same.recall > 0.5 && same.accuracy_m < 0.05, "{same:?}");
    // Another topic of poses may use another map frame.
    let bag_of_room = Bag::open(&bag).unwrap();
    assert!(surface_in("map", &bag_of_room).unwrap().is_some());
    assert!(surface_in("odom", &bag_of_room).unwrap().is_none());
    // The map begins at the first camera, while the surface is in the frame of the bag's poses; they were compared all the
    // same. The name of the frame is the user's choice, so it proves nothing.
    let parameters = folder.path().join("pose.yaml");
    std::fs::write(&parameters, "pose:\n  ros__parameters:\n    odom_frame_id: map\n").unwrap();
    let named = ["--params-file", parameters.to_str().unwrap()];
    let visual = [&["--pose", "visual"], &named[..]].concat();
    let visual = truth_of_run(&bag, &folder.path().join("visual"), &visual);
    assert!(visual["cycles_scored"].as_u64().unwrap() > 10, "{visual}");
    assert_eq!(visual["map"]["surface"], Value::Null);
}
