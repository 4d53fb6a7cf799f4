//! The map as triangles, in its file and on its topic.

use std::collections::BTreeMap;
use std::path::Path;

use msgs::visualization_msgs::{Marker, MarkerArray};

use super::*;
use crate::ReconstructionConfig;
use crate::shell::mesh_file::MeshFile;
use crate::shell::saving::Saving;
use crate::surface_map::tests::scene::{Scene, cycle, rig_at};

fn parameters() -> ReconstructionParameters {
    let mut config = ReconstructionConfig::default();
    config.pipeline.map_edge_m = 0.05;
    ReconstructionParameters { config, ..ReconstructionParameters::default() }
}

fn message(scene: &Scene, index: u32) -> SegmentedCloud {
    let mut cycle = cycle(scene, index, &rig_at(0.0, 0.0), None);
    cycle.setup = parameters().config.pipeline.setup();
    convert::message_from_segmented_cycle(&cycle)
}

fn take(stage: &mut Stage, index: u32) {
    let cycle = message(&Scene::room(), index);
    stage.take(&node_shell::Arrived::Message(std::sync::Arc::new(cycle)));
}

#[tokio::test]
async fn the_mesh_is_saved_at_the_end() {
    let test = Place::new("mesh_file");
    let folder = tempfile::tempdir().unwrap();
    for name in ["house.ply", "house.obj", "house.glb"] {
        let path = folder.path().join(name);
        let mesh_file = path.to_str().unwrap().to_owned();
        let parameters = ReconstructionParameters { mesh_file, ..parameters() };
        let node = test.node(&Host::in_process(), "reconstruction");
        let mut stage = Stage::new(&node, &parameters).unwrap();
        let mut saving = Saving::new(&Settings::of(&parameters).unwrap(), node.counters());
        // Nothing is there yet: the node ends all the same, and leaves no file.
        saving.save_now(&mut stage).await.unwrap();
        assert!(!path.exists());
        take(&mut stage, 0);
        let done = saving.save_now(&mut stage).await.unwrap().unwrap();
        let triangles = stage.mesh().unwrap().triangles.len();
        assert!(
            triangles > 1_000 && done.contains(&format!("a mesh of {triangles} triangles")),
            "{done}"
        );
        assert!(std::fs::metadata(&path).unwrap().len() > 20 * triangles as u64);
        assert_eq!(saving.save_now(&mut stage).await.unwrap(), None, "nothing has changed");
    }
}

#[test]
fn a_mesh_that_cannot_be_saved_is_an_error_at_the_start() {
    for (path, part) in [("map.pcd", ".glb"), ("map", ".obj"), ("/no/such/m.ply", "folder")] {
        let error = MeshFile::new("mesh_file", path).err().unwrap().to_string();
        assert!(error.contains(part) && error.contains("mesh_file"), "{path}: {error}");
    }
    let error =
        |parameters: ReconstructionParameters| Settings::of(&parameters).err().unwrap().to_string();
    let mut of_means = ReconstructionParameters { mesh_file: "m.glb".to_owned(), ..parameters() };
    of_means.config.pipeline = PipelineConfig::new(Method::RecHv, 0.08);
    assert!(error(of_means).contains("free_space"));
    let (mesh_file, map_file) = ("m.ply".to_owned(), "m.ply".to_owned());
    assert!(
        error(ReconstructionParameters { mesh_file, map_file, ..parameters() })
            .contains("one file")
    );
}

#[tokio::test]
async fn a_mesh_that_cannot_be_written_leaves_the_former_file_and_the_map() {
    let test = Place::new("mesh_refused");
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    // So long a name is a file's, and that of the file beside it is too long.
    let mesh = format!("{}.glb", "house".repeat(49));
    let (mesh_file, map_file) = (path(&mesh), path("map.ply"));
    std::fs::write(&mesh_file, "before").unwrap();
    let parameters = ReconstructionParameters { mesh_file, map_file, ..parameters() };
    let node = test.node(&Host::in_process(), "reconstruction");
    let mut stage = Stage::new(&node, &parameters).unwrap();
    let mut saving = Saving::new(&Settings::of(&parameters).unwrap(), node.counters());
    take(&mut stage, 0);
    let error = saving.save_now(&mut stage).await.unwrap_err().to_string();
    assert!(error.contains("the mesh could not be saved to") && error.contains(&mesh), "{error}");
    assert_eq!(std::fs::read(path(&mesh)).unwrap(), b"before");
    assert!(Path::new(&path("map.ply")).exists());
}

/// The triangles that a viewer has, by the names of their markers.
#[derive(Default)]
struct Viewer(BTreeMap<(String, i32), Vec<[u32; 3]>>);

impl Viewer {
    fn hear(&mut self, message: &MarkerArray) {
        for marker in &message.markers {
            let name = (marker.ns.clone(), marker.id);
            match marker.action {
                Marker::DELETEALL => self.0.clear(),
                Marker::DELETE => drop(self.0.remove(&name)),
                _ => {
                    assert_eq!(marker.r#type, Marker::TRIANGLE_LIST);
                    let bits = |along: f64| (along as f32).to_bits();
                    let corners =
                        marker.points.iter().map(|at| [bits(at.x), bits(at.y), bits(at.z)]);
                    self.0.insert(name, corners.collect());
                }
            }
        }
    }

    fn triangles(&self) -> usize {
        self.0.values().map(|corners| corners.len() / 3).sum()
    }

    /// The corners of all triangles in an order that does not depend on the markers.
    fn corners(&self) -> Vec<[[u32; 3]; 3]> {
        let mut all: Vec<_> =
            self.0.values().flat_map(|corners| corners.as_chunks().0.iter().copied()).collect();
        all.sort_unstable();
        all
    }
}

/// The same of the map itself.
fn corners_of(stage: &Stage) -> Vec<[[u32; 3]; 3]> {
    let mesh = stage.mesh().unwrap();
    let corners = (0..mesh.triangles.len()).map(|index| {
        mesh.corners_m(index).unwrap().map(|corner| corner.coords.map(f32::to_bits).into())
    });
    let mut all: Vec<_> = corners.collect();
    all.sort_unstable();
    all
}

/// Lets the stage publish until nothing is due. Returns the most triangles of a message.
fn publish_all(
    stage: &mut Stage,
    viewers: &mut [(&Subscription<MarkerArray>, &mut Viewer)],
) -> usize {
    let mut most = 0;
    for _ in 0..1000 {
        stage.publish_what_is_due();
        let mut has_heard = false;
        for (subscription, viewer) in viewers.iter_mut() {
            while let Some(received) = subscription.try_next() {
                has_heard = true;
                let triangles =
                    received.message.markers.iter().map(|marker| marker.points.len() / 3);
                most = most.max(triangles.sum());
                viewer.hear(&received.message);
            }
        }
        if !has_heard {
            return most;
        }
    }
    panic!("it publishes without end");
}

#[tokio::test]
async fn a_viewer_has_the_mesh_whenever_it_comes_and_whatever_happens_to_the_map() {
    const MOST: usize = 500;
    let (test, host) = (Place::new("mesh_viewer"), Host::in_process());
    let parameters = ReconstructionParameters {
        mesh_update_period_s: SHORTEST_S,
        mesh_update_max_triangles: MOST,
        ..parameters()
    };
    let (node, peer) = (test.node(&host, "reconstruction"), test.node(&host, "peer"));
    let mut stage = Stage::new(&node, &parameters).unwrap();
    take(&mut stage, 0);
    let first = peer.subscription::<MarkerArray>("mesh", &Qos::reliable(5000)).unwrap();
    let mut seen = Viewer::default();
    let most = publish_all(&mut stage, &mut [(&first, &mut seen)]);
    assert!((1..=MOST).contains(&most), "{most}");
    assert!(seen.triangles() > 4 * MOST);
    assert_eq!(seen.corners(), corners_of(&stage));
    // A second viewer has all, too, while the map goes on.
    let second = peer.subscription::<MarkerArray>("mesh", &Qos::reliable(5000)).unwrap();
    let mut later = Viewer::default();
    take(&mut stage, 1);
    publish_all(&mut stage, &mut [(&first, &mut seen), (&second, &mut later)]);
    assert_eq!(later.corners(), corners_of(&stage));
    assert_eq!(seen.corners(), later.corners());
    // An empty map, and another one.
    stage.reset();
    publish_all(&mut stage, &mut [(&first, &mut seen), (&second, &mut later)]);
    assert_eq!((seen.triangles(), later.triangles()), (0, 0));
    let cycle = message(&Scene::room().with_person(0.0), 2);
    stage.take(&node_shell::Arrived::Message(std::sync::Arc::new(cycle)));
    publish_all(&mut stage, &mut [(&first, &mut seen), (&second, &mut later)]);
    assert_eq!(seen.corners(), corners_of(&stage));
    // Nobody listens: nothing is kept for listeners.
    let with_listeners = stage.map().memory_bytes();
    drop((first, second));
    stage.publish_what_is_due();
    assert!(stage.map().memory_bytes() < with_listeners);
}

/// Over DDS, also who subscribes after the last cycle.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn over_dds_a_late_subscriber_has_the_whole_mesh() {
    let test = Place::new("mesh_dds");
    let host = test.host();
    let (own, peer) = (test.node(&host, "reconstruction"), test.node(&test.host(), "peer"));
    let served = serving(own, parameters());
    {
        let clouds =
            peer.publisher::<SegmentedCloud>("segmented_cloud", &Qos::reliable(50)).unwrap();
        soon("the node", clouds.wait_for_subscribers(1)).await;
        let early = peer.subscription::<MarkerArray>("mesh", &Qos::reliable(1000)).unwrap();
        soon("its mesh", early.wait_for_publishers(1)).await;
        clouds.publish(message(&Scene::room(), 0)).unwrap();
        let mut stage = Stage::new(&test.node(&Host::in_process(), "twin"), &parameters()).unwrap();
        take(&mut stage, 0);
        let expected = corners_of(&stage);
        for subscription in
            [early, peer.subscription::<MarkerArray>("mesh", &Qos::reliable(1000)).unwrap()]
        {
            let mut viewer = Viewer::default();
            soon("the whole mesh", async {
                while viewer.triangles() < expected.len() {
                    viewer.hear(&subscription.next().await.message);
                }
            })
            .await;
            assert_eq!(viewer.corners(), expected);
        }
    }
    host.shutdown_signal().trigger();
    soon("the end", served).await.unwrap().unwrap();
    peer.close().await;
}
