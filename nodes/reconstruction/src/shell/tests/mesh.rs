//! The map as triangles, in its file.

use std::path::Path;

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
    let (mesh_file, map_file) = (path("house.glb"), path("map.ply"));
    let parameters = ReconstructionParameters { mesh_file, map_file, ..parameters() };
    let node = test.node(&Host::in_process(), "reconstruction");
    let mut stage = Stage::new(&node, &parameters).unwrap();
    let mut saving = Saving::new(&Settings::of(&parameters).unwrap(), node.counters());
    take(&mut stage, 0);
    saving.save_now(&mut stage).await.unwrap();
    let before = std::fs::read(path("house.glb")).unwrap();
    // A folder is in the way of its temporary name.
    std::fs::create_dir(path("house.glb.part")).unwrap();
    take(&mut stage, 1);
    std::fs::remove_file(path("map.ply")).unwrap();
    let error = saving.save_now(&mut stage).await.unwrap_err().to_string();
    assert!(
        error.contains("the mesh could not be saved to") && error.contains("house.glb"),
        "{error}"
    );
    assert_eq!(std::fs::read(path("house.glb")).unwrap(), before);
    assert!(Path::new(&path("map.ply")).exists());
}
