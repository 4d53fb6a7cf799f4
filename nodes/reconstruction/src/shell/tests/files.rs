//! Saving of the map, and loading at the next start.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::*;
use crate::shell::map_file::{MapFile, Snapshot};
use crate::surface_map::tests::scene;
use crate::{Map, StaticMap};

/// Longer than any period of saving.
const FOREVER: Duration = Duration::from_secs(1 << 20);

#[test]
fn a_file_that_cannot_be_saved_is_an_error_at_the_start() {
    for (path, part) in
        [("map.obj", ".ply, .pcd or"), ("map", "or .bt"), ("/no/such/m.ply", "folder")]
    {
        let error = MapFile::new("map_file", path).err().unwrap().to_string();
        assert!(error.contains(part) && error.contains("map_file"), "{path}: {error}");
    }
    assert!(MapFile::new("map_file", "").unwrap().is_none());
    assert!(MapFile::new("map_file", "map.PLY").unwrap().is_some());
}

/// A container mounts only a file that is there: the first start failed with it.
#[test]
fn a_file_that_was_made_empty_has_no_map_yet() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.ply");
    std::fs::write(&path, "").unwrap();
    let file = MapFile::new("map_file", path.to_str().unwrap()).unwrap().unwrap();
    assert!(!file.exists());
    assert_eq!(save(&file, &map_of(0.08, 10)), 0);
    assert!(file.exists());
}

fn map_of(voxel_edge_m: f64, max_voxels: usize) -> Map {
    let config = ReconstructionConfig {
        pipeline: PipelineConfig::new(Method::RecHv, voxel_edge_m),
        max_voxels,
        ..ReconstructionConfig::default()
    };
    StaticMap::new(config).unwrap().into()
}

#[test]
fn a_map_that_was_saved_is_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let points = [[-0.03_f32, 0.5, 0.02], [1.0, -2.0, 0.3], [0.07, 0.07, 9.0]].map(Point3::from);
    let mut map = map_of(0.08, 10);
    map.replace(&points, &[], "map").unwrap();
    let keys =
        |map: &Map| -> Vec<_> { map.points().iter().map(|point| map.grid().key(point)).collect() };
    for name in ["m.ply", "m.pcd", "m.bt"] {
        let path = folder.path().join(name);
        let file = MapFile::new("map_file", path.to_str().unwrap()).unwrap().unwrap();
        assert_eq!(save(&file, &map), 3);
        let mut loaded = map_of(0.08, 3);
        loaded.replace(&[Point3::origin()], &[], "map").unwrap();
        assert_eq!(file.load(&mut loaded, "odom").unwrap(), 3);
        assert_eq!((keys(&loaded), loaded.frame_id()), (keys(&map), Some("odom")));
        if name != "m.bt" {
            assert_eq!(loaded.points(), map.points());
        }
        // Too many points: the error has the path and the cause, and the map is unchanged.
        let mut small = map_of(0.08, 2);
        small.replace(&points[..1], &[], "map").unwrap();
        let error = file.load(&mut small, "map").unwrap_err().to_string();
        assert!(error.contains(name) && error.contains('2'), "{error}");
        assert_eq!(small.points(), points[..1]);
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3, "nothing temporary is left");
    let path = folder.path().join("m.bt");
    let file = MapFile::new("map_file", path.to_str().unwrap()).unwrap().unwrap();
    let error = file.load(&mut map_of(0.05, 10), "map").unwrap_err().to_string();
    assert!(error.contains("0.08") && error.contains("0.05"), "{error}");
    std::fs::remove_file(&path).unwrap();
    let error = file.load(&mut map, "map").unwrap_err().to_string();
    assert!(error.contains("m.bt"), "{error}");
    assert_eq!(map.points(), {
        let mut sorted = map_of(0.08, 10);
        sorted.replace(&points, &[], "map").unwrap();
        sorted.points()
    });
}

/// Regression: a map of depth images was loaded from files of such a map alone.
#[test]
fn any_file_is_loaded_into_a_map_of_depth_images() {
    let folder = tempfile::tempdir().unwrap();
    let floor = (0..900_i32).map(|n| Point3::new((n / 30) as f32, (n % 30) as f32, 0.5) * 0.1);
    let mut means = map_of(0.1, 1000);
    means.replace(&floor.collect::<Vec<_>>(), &[], "map").unwrap();
    for name in ["m.ply", "m.pcd", "m.bt"] {
        let path = folder.path().join(name);
        let file = MapFile::new("map_file", path.to_str().unwrap()).unwrap().unwrap();
        save(&file, &means);
        let mut map = Map::new(ReconstructionConfig::default(), None).unwrap();
        file.load(&mut map, "map").unwrap();
        // 3 m by 3 m at 2 cm, without gaps.
        let points = map.points();
        assert!(points.len() > 22_000, "{name}: {}", points.len());
        assert!(points.iter().all(|point| (point.z - 0.05).abs() < 0.011), "{name}");
        // And its own file.
        assert_eq!(save(&file, &map), points.len());
        let mut again = Map::new(ReconstructionConfig::default(), None).unwrap();
        file.load(&mut again, "map").unwrap();
        assert!(again.points().len() > 22_000, "{name}: {}", again.points().len());
    }
}

fn save(file: &MapFile, map: &Map) -> usize {
    file.write(Snapshot::of(map).unwrap(), false).unwrap().points
}

/// Successive starts of a node, without a network, with one folder of files.
struct Starts {
    test: Place,
    host: Host,
    folder: tempfile::TempDir,
}

/// One start of the node.
struct Start {
    stage: Stage,
    saving: Saving<'static>,
    stamp_ns: i64,
}

impl Starts {
    fn new(test: &str) -> Self {
        let (test, host) = (Place::new(test), Host::in_process());
        Self { test, host, folder: tempfile::tempdir().unwrap() }
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("map.ply")
    }

    fn parameters(&self) -> ReconstructionParameters {
        ReconstructionParameters {
            map_file: self.path().to_str().unwrap().to_owned(),
            config: ReconstructionConfig {
                pipeline: pipeline(),
                ..ReconstructionConfig::default()
            },
            ..ReconstructionParameters::default()
        }
    }

    fn start(&self) -> Result<Start, NodeFailure> {
        let node = self.test.node(&self.host, "reconstruction");
        let parameters = self.parameters();
        let settings = Settings::of(&parameters)?;
        let mut stage = Stage::new(&node, &parameters)?;
        stage.begin_with(settings.file.as_ref())?;
        let saving = Saving::new(&settings, node.counters());
        Ok(Start { stage, saving, stamp_ns: 0 })
    }

    /// The points of the file and of its versions, by ascending name of the version.
    fn points(&self) -> (usize, Vec<usize>) {
        let entries = std::fs::read_dir(self.folder.path()).unwrap();
        let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
        paths.sort();
        let points =
            |path: &Path| geometry::ply::decode(&std::fs::read(path).unwrap()).unwrap().len();
        let is_map = |path: &PathBuf| *path == self.path();
        let versions = paths.iter().filter(|path| !is_map(path)).map(|path| points(path)).collect();
        (points(&self.path()), versions)
    }
}

impl Start {
    /// A cloud with a point in each of these voxels of a row.
    fn take(&mut self, frame_id: &str, voxels: std::ops::Range<u8>) {
        let points: Vec<[f32; 3]> = voxels.map(|x| [f32::from(x) + 0.5, 0.5, 0.5]).collect();
        self.stamp_ns += 1;
        let message = cloud(self.stamp_ns, frame_id, &points);
        self.stage.take(&node_shell::Arrived::Message(std::sync::Arc::new(message)));
    }

    async fn save(&mut self) -> Option<String> {
        self.saving.save_now(&mut self.stage).await.unwrap()
    }
}

#[tokio::test]
async fn a_map_is_continued_after_each_start_and_an_unchanged_one_is_not_written() {
    let starts = Starts::new("growing");
    let mut first = starts.start().unwrap();
    first.take("map", 0..3);
    assert!(first.save().await.unwrap().contains("3 points"));
    first.take("map", 3..4);
    first.save().await.unwrap();
    assert_eq!(starts.points(), (4, vec![]), "continued in one run: no version is kept");

    let before = std::fs::metadata(starts.path()).unwrap().modified().unwrap();
    let mut blind = starts.start().unwrap();
    assert_eq!(blind.stage.map.len(), 4);
    assert_eq!(blind.save().await, None);
    assert_eq!(std::fs::metadata(starts.path()).unwrap().modified().unwrap(), before);

    let mut third = starts.start().unwrap();
    third.take("robot/map", 2..6);
    assert_eq!(third.stage.map.frame_id(), Some("robot/map"));
    let done = third.save().await.unwrap();
    assert!(done.contains("a map of 6 points"), "{done}");
    assert!(
        done.contains("the file had 4 points, and is kept as") && done.contains("version-1"),
        "{done}"
    );
    third.take("robot/map", 6..7);
    third.save().await.unwrap();
    assert_eq!(starts.points(), (7, vec![4]), "one version for each start");
}

/// Regression: a start without sensors left a map of 0 points, which the next start kept as a former version.
#[tokio::test]
async fn a_start_without_sensors_leaves_no_file() {
    let starts = Starts::new("blind");
    let mut blind = starts.start().unwrap();
    assert_eq!(blind.save().await, None);
    blind.stage.reset();
    blind.saving.look(&mut blind.stage, tokio::time::Instant::now() + FOREVER);
    assert!(blind.saving.is_idle(), "nor while it runs");
    assert_eq!(blind.save().await, None);
    assert!(!starts.path().exists());
    let mut next = starts.start().unwrap();
    next.take("map", 0..3);
    next.save().await.unwrap();
    assert_eq!(starts.points(), (3, vec![]), "and no version");
}

#[tokio::test]
async fn poses_in_another_frame_begin_a_new_map_and_the_former_is_kept() {
    let starts = Starts::new("origin");
    let mut first = starts.start().unwrap();
    first.take("odom", 0..5);
    first.save().await.unwrap();
    let mut second = starts.start().unwrap();
    assert_eq!(second.stage.map.len(), 5, "shown until the frame of the poses is known");
    second.take("odom", 10..12);
    assert_eq!((second.stage.map.len(), second.stage.map.frame_id()), (2, Some("odom")));
    let done = second.save().await.unwrap();
    assert!(done.contains("a map of 2 points") && done.contains("the file had 5 points"), "{done}");
    assert_eq!(starts.points(), (2, vec![5]));
}

#[tokio::test]
async fn an_emptied_map_and_one_of_less_than_half_keep_the_former_as_a_version() {
    let starts = Starts::new("emptied");
    let mut start = starts.start().unwrap();
    start.take("map", 0..9);
    start.save().await.unwrap();
    start.stage.reset();
    let done = start.save().await.unwrap();
    assert!(done.contains("a map of 0 points") && done.contains("the file had 9 points"), "{done}");
    assert_eq!(starts.points(), (0, vec![9]));
    start.take("map", 0..9);
    start.save().await.unwrap();
    // As after clearing: the same map with fewer voxels. Five are more than half of nine, four are not.
    for (voxels, versions) in [(5, vec![9]), (4, vec![9, 5])] {
        let row = |x: u8| Point3::new(f32::from(x) + 0.5, 0.5, 0.5);
        let points: Vec<Point3<f32>> = (0..voxels).map(row).collect();
        start.stage.map.replace(&points, &[], "map").unwrap();
        start.stage.unsaved.is_changed = true;
        start.save().await.unwrap();
        assert_eq!(starts.points(), (usize::from(voxels), versions));
    }
}

#[tokio::test]
async fn a_file_that_is_no_map_is_an_error_at_the_start_and_is_kept() {
    let starts = Starts::new("no_map");
    std::fs::write(starts.path(), "dear diary").unwrap();
    let error = starts.start().err().unwrap();
    assert!(node_shell::is_for_good(&error), "the service started it again for ever");
    let error = error.to_string();
    assert!(error.contains("map.ply") && error.contains("moved away"), "{error}");
    assert_eq!(std::fs::read(starts.path()).unwrap(), b"dear diary");
}

#[tokio::test]
async fn a_node_that_was_cleaned_up_begins_with_its_map_again() {
    let starts = Starts::new("cleaned");
    let mut start = starts.start().unwrap();
    start.take("map", 0..3);
    start.save().await.unwrap();
    start.stage.clean_up();
    assert!(start.stage.map.is_empty());
    assert_eq!(start.save().await, None, "what was cleaned up is no map to save");
    let file = start.saving.file().cloned();
    start.stage.begin_with(file.as_ref()).unwrap();
    assert_eq!(start.stage.map.len(), 3);
    // Only once: the present map is not replaced by the file's.
    start.take("map", 3..4);
    start.stage.begin_with(file.as_ref()).unwrap();
    assert_eq!(start.stage.map.len(), 4);
}

/// A period that has passed already, so that no test waits for it.
const SOON: Duration = Duration::from_secs(31);

#[tokio::test]
async fn a_changed_map_is_saved_once_in_a_period_in_the_background() {
    let starts = Starts::new("period");
    let mut start = starts.start().unwrap();
    start.saving.look(&mut start.stage, Instant::now() + SOON);
    assert!(start.saving.is_idle(), "nothing has changed");
    start.take("map", 0..2);
    start.saving.look(&mut start.stage, Instant::now());
    assert!(start.saving.is_idle(), "not due");
    start.saving.look(&mut start.stage, Instant::now() + SOON);
    assert!(!start.saving.is_idle());
    // The map changes while it is being written.
    start.take("map", 2..3);
    let saved = start.saving.finish().await;
    start.saving.finished(saved, &mut start.stage);
    assert_eq!(starts.points(), (2, vec![]));
    assert!(start.saving.is_idle() && start.stage.unsaved.is_changed);
    // If it cannot be written, it is tried again.
    std::fs::remove_file(starts.path()).unwrap();
    std::fs::create_dir(starts.path()).unwrap();
    start.saving.look(&mut start.stage, Instant::now() + SOON);
    let saved = start.saving.finish().await;
    assert!(saved.as_ref().is_ok_and(|done| done.map_failed()));
    start.saving.finished(saved, &mut start.stage);
    assert!(start.saving.is_idle() && start.stage.unsaved.is_changed);
    std::fs::remove_dir(starts.path()).unwrap();
    assert!(start.save().await.is_some());
    assert_eq!(starts.points(), (3, vec![]));
}

/// The service started a node again for ever whose map was larger than its bound.
#[tokio::test]
async fn a_saved_map_that_does_not_fit_is_a_failure_for_good() {
    let starts = Starts::new("too_large");
    let mut first = starts.start().unwrap();
    first.take("map", 0..3);
    first.save().await.unwrap();
    for parameters in [
        ReconstructionParameters {
            config: ReconstructionConfig { max_voxels: 2, ..starts.parameters().config },
            ..starts.parameters()
        },
        ReconstructionParameters {
            config: ReconstructionConfig { max_map_blocks: 2, ..ReconstructionConfig::default() },
            ..starts.parameters()
        },
    ] {
        let node = starts.test.node(&starts.host, "reconstruction");
        let mut stage = Stage::new(&node, &parameters).unwrap();
        let file = Settings::of(&parameters).unwrap().file;
        let refused = stage.begin_with(file.as_ref()).unwrap_err();
        assert!(node_shell::is_for_good(&refused), "{refused}");
    }
}

/// Two nodes with one file replaced each other's map in turns, and nobody was told.
#[tokio::test]
async fn a_second_node_with_the_same_file_is_refused_for_good() {
    let starts = Starts::new("two");
    let node = || starts.test.node(&Host::in_process(), "reconstruction");
    let (first, second) = (node(), node());
    let claim = ClaimedFile::at(&starts.path(), &first.shutdown_signal()).await.unwrap();
    // It waits for the other one to end, but not when it is to end itself.
    second.shutdown_signal().trigger();
    let refused = serve(&second, starts.parameters()).await.unwrap_err();
    assert!(node_shell::is_for_good(&refused) && refused.to_string().contains("map.ply"));
    drop(claim);
    serve(&second, starts.parameters()).await.unwrap();
}

/// Anybody on the network may set parameters, and could have any file of the node's user written over.
#[test]
fn where_files_are_written_cannot_be_set_while_the_node_runs() {
    let descriptors = node_shell::descriptors::<ReconstructionParameters>().unwrap();
    let names = ["map_file", "grid_file", "mesh_file", "spill_folder"];
    let found = descriptors.iter().filter(|one| names.contains(&one.name.as_str()));
    assert!(found.clone().all(|one| one.read_only) && found.count() == names.len());
}

#[test]
fn a_saved_map_of_depth_images_has_the_views_that_it_was_seen_from_and_gets_them_back() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| {
        let path = folder.path().join(name);
        (MapFile::new("map_file", path.to_str().unwrap()).unwrap().unwrap(), path)
    };
    let empty = || Map::new(ReconstructionConfig::default(), None).unwrap();
    let mut map = empty();
    for (index, shift_m) in [(0, 0.0), (1, 0.8)] {
        let rig = scene::rig_at(shift_m, 0.0);
        map.integrate(&scene::cycle(&scene::Scene::room(), index, &rig, None)).unwrap();
    }
    let views_of = |name: &str| {
        let (file, path) = file(name);
        file.write(Snapshot::of(&map).unwrap(), false).unwrap();
        let mut loaded = empty();
        file.load(&mut loaded, "map").unwrap();
        (loaded.whole().views, std::fs::read(path).unwrap())
    };
    let (views, bytes) = views_of("map.ply");
    assert_eq!(views, geometry::ply::views_of(&bytes).unwrap());
    assert_eq!(views.len(), map.whole().views.len());
    assert_eq!(views.len(), 2);
    // The other formats have no place for them.
    assert_eq!(views_of("map.pcd").0, []);
}

/// Where nothing comes back any more, what has gone by the next start is told by it.
#[test]
fn a_saved_map_of_depth_images_says_how_it_was_seen_last_and_gets_it_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.ply");
    let file = MapFile::new("map_file", path.to_str().unwrap()).unwrap().unwrap();
    let config = ReconstructionConfig::default();
    let mut map = Map::new(config.clone(), None).unwrap();
    let rig = scene::rig_at(0.0, 0.0);
    for index in [1, 700] {
        map.integrate(&scene::cycle(&scene::Scene::room(), index, &rig, None)).unwrap();
    }
    let sights = map.whole().sights;
    assert!(sights.iter().any(|sight| sight.lasted_s > 99.0) && sights.len() > 100);
    file.write(Snapshot::of(&map).unwrap(), false).unwrap();
    let load = |map_edge_m: f64| {
        let mut config = config.clone();
        config.pipeline.map_edge_m = map_edge_m;
        let mut loaded = Map::new(config, None).unwrap();
        file.load(&mut loaded, "map").unwrap();
        loaded.whole().sights
    };
    let at_least_s = config.pipeline.max_stop_s as f32;
    let loaded = load(config.pipeline.map_edge_m);
    // A block at the border of what is seen may have no point in a file.
    assert!(10 * loaded.len() > 9 * sights.len(), "{} of {}", loaded.len(), sights.len());
    for sight in &loaded {
        let before = sights.iter().find(|before| before.middle_m == sight.middle_m).unwrap();
        let lasted_s = before.lasted_s.max(at_least_s);
        assert_eq!(*sight, geometry::LastSight { lasted_s, ..*before });
    }
    assert_eq!(load(0.03), [], "blocks of another edge are others");
}
