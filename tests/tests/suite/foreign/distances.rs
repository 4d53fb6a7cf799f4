//! How far places are from the nearest obstacle of a saved map, asked by a peer as `ros2 service call` does.

use geometry::ply;
use msgs::RosMessage;
use msgs::rcl_interfaces::ParameterEvent;
use msgs::stillmap_msgs::{Distances, GetDistanceField, GetDistances};
use nalgebra::{Point3, Vector3};
use serde_json::{Value, json};

use super::build::Make;
use super::peer::Peer;
use super::place::Place;
use crate::program::Running;

/// Of the map, of which the file has a point in each voxel.
const EDGE_M: f64 = 0.05;
/// Half the diagonal of the lattice, and what the map may have the wall beside its place.
const MOST_ERROR_M: f64 = 0.0434 + 0.01;
/// The wall is there.
const WALL_X_M: f64 = 2.02;

/// A wall of 4 by 4 m that is seen from x = 0.
fn wall() -> Vec<u8> {
    let along = |step: i32| ((f64::from(step) + 0.5) * EDGE_M) as f32;
    let points: Vec<Point3<f32>> = (-40..40)
        .flat_map(|y| (-40..40).map(move |z| Point3::new(WALL_X_M as f32, along(y), along(z))))
        .collect();
    let normals = vec![-Vector3::x(); points.len()];
    ply::encode_with_normals(&points, &normals)
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn is_refused(answer: &Value, part: &str) {
    assert_eq!(answer["success"], false, "{answer}");
    assert!(answer["message"].as_str().unwrap().contains(part), "{answer}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_peer_asks_how_far_obstacles_are() {
    let place = Place::new().await;
    let topics = ["/parameter_events", ParameterEvent::TYPE_NAME];
    let Some(mut peer) = Peer::start(Make::CyclonePython, "call", &place, &topics).await else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("wall.ply");
    std::fs::write(&map, wall()).unwrap();
    let namespace = format!("__ns:={}", place.namespace());
    let parameters = [format!("map_file:={}", map.display()), format!("map_edge_m:={EDGE_M}")];
    let start = |parameters: &[String]| {
        let first = ["node", "reconstruction", "--ros-args", "-r", &namespace];
        let more = parameters.iter().flat_map(|one| ["-p", one]);
        Running::start_on(place.domain_id(), first.into_iter().chain(more))
    };
    let [places, field] = ["get_distances", "get_distance_field"]
        .map(|service| format!("{}/reconstruction/{service}", place.namespace()));

    let node = start(&parameters);
    let point = |x: f64, y: f64| json!({ "x": x, "y": y, "z": 0.13 });
    let asked = [0.3, 1.234, 1.9, 2.5];
    let request = json!({ "frame_id": "map", "points": asked.map(|x| point(x, -0.21)) });
    let answer = peer.call::<GetDistances>(&places, request).await;
    assert_eq!(answer["success"], true, "{answer}");
    let of_places = &answer["distances"];
    assert_eq!(of_places["header"]["frame_id"], "map");
    let gradients = numbers(&of_places["gradients"]);
    for ((x_m, distance_m), away) in
        asked.iter().zip(numbers(&of_places["distances"])).zip(gradients.chunks(3))
    {
        assert!((distance_m - (x_m - WALL_X_M).abs()).abs() < MOST_ERROR_M, "{x_m}: {distance_m}");
        assert!(away[0] * (x_m - WALL_X_M).signum() > 0.95, "{x_m}: {away:?}");
    }
    let [unknown, free] = [Distances::UNKNOWN, Distances::FREE].map(f64::from);
    // A loaded map has recorded the voxels of its points alone.
    let request = json!({ "frame_id": "map", "points": [point(0.3, -0.21), point(2.01, -0.21)] });
    let answer = peer.call::<GetDistances>(&places, request).await;
    assert_eq!(numbers(&answer["distances"]["states"]), [unknown, free]);

    let [least, most] = [point(0.3, -1.0), point(2.0, 1.0)];
    let slice = json!({ "frame_id": "", "least": least, "most": most });
    let answer = peer.call::<GetDistanceField>(&field, slice).await;
    assert_eq!(answer["success"], true, "{answer}");
    let slice = &answer["field"];
    let size = ["size_x", "size_y", "size_z"].map(|name| slice[name].as_u64().unwrap());
    assert_eq!(size, [35, 41, 1]);
    assert!((slice["origin"]["z"].as_f64().unwrap() - 0.15).abs() < 1e-9);
    for (index, distance_m) in numbers(&slice["distances"]).into_iter().enumerate() {
        let x_m = slice["origin"]["x"].as_f64().unwrap() + EDGE_M * (index % 35) as f64;
        // The points of the wall are half an edge beside the lattice along y and z.
        let true_m = (WALL_X_M - x_m).hypot(EDGE_M / f64::sqrt(2.0));
        assert!((distance_m - true_m).abs() < 0.01, "{x_m}: {distance_m}, not {true_m}");
    }

    let in_odom = json!({ "frame_id": "odom", "points": [point(0.0, 0.0)] });
    is_refused(&peer.call::<GetDistances>(&places, in_odom).await, "in frame \"odom\"");
    let turned = json!({ "frame_id": "map", "least": most, "most": least });
    is_refused(&peer.call::<GetDistanceField>(&field, turned).await, "ends before it begins");
    let large =
        json!({ "frame_id": "map", "least": point(-99.0, -99.0), "most": point(99.0, 99.0) });
    is_refused(&peer.call::<GetDistanceField>(&field, large).await, "at most 250000");
    assert!(node.interrupt());

    let node = start(&["method:=rec_hv".to_owned()]);
    let request = json!({ "frame_id": "map", "points": [point(0.0, 0.0)] });
    is_refused(&peer.call::<GetDistances>(&places, request).await, "rec_hv");
    assert!(node.interrupt());
}
