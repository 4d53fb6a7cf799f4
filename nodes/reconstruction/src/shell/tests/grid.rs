//! The occupancy grid on its topics and in its files.

use std::path::Path;

use geometry::OccupancyGrid;
use msgs::map_msgs::OccupancyGridUpdate;
use msgs::nav_msgs;

use super::*;
use crate::GridConfig;
use crate::shell::grid_output::GridFile;
use crate::surface_map::tests::scene::{Scene, cycle, rig_at};
use crate::{GridSource, ReconstructionConfig};

fn parameters(grid: GridSource) -> ReconstructionParameters {
    let grid = GridConfig { grid, ..GridConfig::default() };
    let mut config = ReconstructionConfig { grid, ..ReconstructionConfig::default() };
    config.pipeline.map_edge_m = 0.05;
    ReconstructionParameters { grid_period_s: 0.05, config, ..ReconstructionParameters::default() }
}

fn message(scene: &Scene, index: u32) -> SegmentedCloud {
    let mut cycle = cycle(scene, index, &rig_at(0.0, 0.0), None);
    cycle.setup = parameters(GridSource::HeightBand).config.pipeline.setup();
    convert::message_from_segmented_cycle(&cycle)
}

/// Publishes cycles of the room until the node has reported five of them: a cell is free after three. Reports are lost until the
/// node has found their subscriber. Returns the index of the next cycle.
async fn see_the_room(
    clouds: &Publisher<SegmentedCloud>,
    reports: &Subscription<StageReport>,
) -> u32 {
    let (mut index, mut done, mut wait) = (0, 0, AGAIN);
    soon("the reports", async {
        while done < 5 {
            clouds.publish(message(&Scene::room(), index)).unwrap();
            index += 1;
            let heard = tokio::time::timeout(wait, reports.next()).await.is_ok();
            (done, wait) = if heard { (done + 1, AGAIN) } else { (done, 2 * wait) };
        }
    })
    .await;
    index
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_subscriber_gets_the_grid_and_then_what_changes_in_it() {
    let test = Place::new("grid");
    let host = test.host();
    let (own, peer) = (test.node(&host, "reconstruction"), test.node(&test.host(), "peer"));
    let mut parameters = parameters(GridSource::HeightBand);
    parameters.map_publish_period_s = 1e6;
    let served = serving(own, parameters);
    {
        let clouds =
            peer.publisher::<SegmentedCloud>("segmented_cloud", &Qos::reliable(50)).unwrap();
        let reports =
            peer.subscription::<StageReport>("reconstruction/report", &Qos::reliable(50)).unwrap();
        soon("the node", clouds.wait_for_subscribers(1)).await;
        soon("its reports", reports.wait_for_publishers(1)).await;
        let mut index = see_the_room(&clouds, &reports).await;
        let grids = peer.subscription::<nav_msgs::OccupancyGrid>("map", &Qos::latched()).unwrap();
        let updates =
            peer.subscription::<OccupancyGridUpdate>("map_updates", &Qos::reliable(50)).unwrap();
        let grid = soon("the grid", grids.next()).await.message;
        assert_eq!(grid.header.frame_id, "map");
        let (width, height) = (grid.info.width as usize, grid.info.height as usize);
        assert_eq!(grid.data.len(), width * height);
        assert!(grid.data.contains(&0) && grid.data.contains(&100) && grid.data.contains(&-1));
        let aligned = grid.info.origin.position.x / f64::from(grid.info.resolution);
        assert!((aligned - aligned.round()).abs() < 1e-3);
        // Something comes to stand there, until the update with it.
        let scene = Scene::room().with_person(0.0);
        let update = soon("an update", async {
            let mut wait = AGAIN;
            loop {
                clouds.publish(message(&scene, index)).unwrap();
                index += 1;
                match tokio::time::timeout(wait, updates.next()).await {
                    Ok(update) if update.message.data.contains(&100) => return update.message,
                    Ok(_) => {}
                    Err(_) => wait *= 2,
                }
            }
        })
        .await;
        let (x, y) = (update.x as usize, update.y as usize);
        assert!(x + update.width as usize <= width && y + update.height as usize <= height);
        assert_eq!(update.data.len(), (update.width * update.height) as usize);
    }
    host.shutdown_signal().trigger();
    soon("the end", served).await.unwrap().unwrap();
}

/// A grid that could not be written made each save of the map count as one of another map: versions took the place of all older ones.
#[tokio::test]
async fn a_grid_that_cannot_be_written_does_not_concern_the_map() {
    let test = Place::new("grid_refused");
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    // A folder in place of the image cannot be replaced by a file.
    std::fs::create_dir(path("house.pgm")).unwrap();
    let mut parameters = parameters(GridSource::HeightBand);
    (parameters.grid_file, parameters.map_file) = (path("house.yaml"), path("map.ply"));
    let node = test.node(&test.host(), "reconstruction");
    let settings = Settings::of(&parameters).unwrap();
    let mut stage = Stage::new(&node, &parameters).unwrap();
    let mut saving = Saving::new(&settings, node.counters());
    for index in 0..6 {
        let cycle = message(&Scene::room(), index);
        stage.take(&node_shell::Arrived::Message(std::sync::Arc::new(cycle)));
        let error = saving.save_now(&mut stage).await.unwrap_err().to_string();
        assert!(error.contains("the grid could not be saved"), "{error}");
    }
    let mut names: Vec<_> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["house.pgm", "map.ply"]);
}

/// The plan of the day before was overwritten with what was seen since the start.
#[tokio::test]
async fn a_grid_of_scans_of_a_former_start_is_kept_as_a_version() {
    let test = Place::new("grid_former");
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    for (source, versions) in [(GridSource::Scan, 1), (GridSource::HeightBand, 0)] {
        let name = format!("{source:?}");
        let mut parameters = parameters(source);
        parameters.grid_file = path(&format!("{name}.yaml"));
        let image = folder.path().join(format!("{name}.pgm"));
        let mut images = Vec::new();
        for start in 0..2 {
            let node = test.node(&test.host(), "reconstruction");
            let mut stage = Stage::new(&node, &parameters).unwrap();
            let mut saving = Saving::new(&Settings::of(&parameters).unwrap(), node.counters());
            for index in 0..6 {
                let mut cycle = cycle(&Scene::room(), index, &rig_at(0.0, 0.0), None);
                cycle.setup = parameters.config.pipeline.setup();
                // The second start has seen less.
                let rays = crate::grid::tests::rays();
                let seen = rays.len() / (start + 1);
                cycle.scan_rays = std::sync::Arc::new(rays.into_iter().take(seen).collect());
                stage.take(&node_shell::Arrived::Value(std::sync::Arc::new(cycle)));
                // Each changes it; the first one alone keeps what was there.
                saving.save_now(&mut stage).await.unwrap();
            }
            images.push(std::fs::read(&image).unwrap());
        }
        let versions_of = |ending: &str| -> Vec<_> {
            (1..9)
                .filter_map(|n| std::fs::read(path(&format!("{name}.version-{n}.{ending}"))).ok())
                .collect()
        };
        assert_eq!((versions_of("pgm").len(), versions_of("yaml").len()), (versions, versions));
        assert!(versions_of("pgm").iter().all(|version| *version == images[0]));
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_grid_is_saved_at_the_end_with_or_without_the_map() {
    let test = Place::new("grid_file");
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    for (source, map_file) in
        [(GridSource::HeightBand, String::new()), (GridSource::None, path("map.ply"))]
    {
        let host = test.host();
        let (own, peer) = (test.node(&host, "reconstruction"), test.node(&test.host(), "peer"));
        let mut parameters = parameters(source);
        (parameters.grid_file, parameters.map_file) = (path("house.yaml"), map_file.clone());
        let served = serving(own, parameters);
        {
            let reports = peer
                .subscription::<StageReport>("reconstruction/report", &Qos::reliable(50))
                .unwrap();
            let clouds =
                peer.publisher::<SegmentedCloud>("segmented_cloud", &Qos::reliable(50)).unwrap();
            soon("the node", clouds.wait_for_subscribers(1)).await;
            soon("its reports", reports.wait_for_publishers(1)).await;
            see_the_room(&clouds, &reports).await;
        }
        host.shutdown_signal().trigger();
        soon("the end", served).await.unwrap().unwrap();
        let has_grid = source != GridSource::None;
        assert_eq!(Path::new(&path("house.yaml")).exists(), has_grid);
        assert_eq!(Path::new(&path("house.pgm")).exists(), has_grid);
        if has_grid {
            let yaml = std::fs::read_to_string(path("house.yaml")).unwrap();
            assert!(yaml.contains("image: \"house.pgm\""), "{yaml}");
            std::fs::remove_file(path("house.yaml")).unwrap();
            std::fs::remove_file(path("house.pgm")).unwrap();
        } else {
            assert!(Path::new(&map_file).exists());
        }
    }
}

#[test]
fn a_grid_that_cannot_be_saved_is_an_error_and_the_former_file_is_whole() {
    for (path, part) in [("map.pgm", ".yaml"), ("map", ".yaml"), ("/no/such/m.yaml", "folder")] {
        let error = GridFile::new("grid_file", path).err().unwrap().to_string();
        assert!(error.contains(part) && error.contains("grid_file"), "{path}: {error}");
    }
    assert!(GridFile::new("grid_file", "").unwrap().is_none());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("house.yaml");
    let file = GridFile::new("grid_file", path.to_str().unwrap()).unwrap().unwrap();
    let grid =
        OccupancyGrid { resolution_m: 0.05, width: 1, height: 1, ..OccupancyGrid::default() };
    let grid = OccupancyGrid { cells: vec![geometry::GridCell::Free], ..grid };
    file.write(&grid, false).unwrap();
    let before = std::fs::read(&path).unwrap();
    // The image cannot be replaced: a folder has its name.
    std::fs::remove_file(folder.path().join("house.pgm")).unwrap();
    std::fs::create_dir(folder.path().join("house.pgm")).unwrap();
    let moved = OccupancyGrid { least: [7, 7], ..grid };
    let error = file.write(&moved, false).unwrap_err().to_string();
    assert!(error.contains("house.pgm"), "{error}");
    assert_eq!(std::fs::read(&path).unwrap(), before);
}
