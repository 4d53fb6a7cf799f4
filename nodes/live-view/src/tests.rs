//! What a browser has decoded is what is there, whatever came between.

mod decoded;
mod mesh;

use std::collections::BTreeMap;

use geometry::{Cloud, ColouredCloud, Stamp, VoxelGrid, VoxelKey};
use nalgebra::Point3;
use proptest::prelude::*;

use super::*;
use decoded::DecodedPage;

const EDGE_M: f64 = 0.5;
const MANY: usize = 1_000_000;

fn cloud(stamp: i64, points: &[[f32; 3]]) -> ColouredCloud {
    let points_m = points.iter().map(|point| Point3::from(*point)).collect();
    let stamp = Stamp::from_nanos(stamp);
    let cloud = Cloud { stamp, frame_id: "map".to_owned(), points_m };
    ColouredCloud { cloud, colours: Vec::new() }
}

fn state() -> LiveState {
    LiveState::new(EDGE_M, MANY, MANY).unwrap()
}

/// Sends the browser all it lacks.
fn drain(browser: &mut Browser, state: &LiveState, page: &mut DecodedPage) {
    while let Some(message) = browser.next_message(state) {
        page.take(&message);
    }
}

/// The rule of the topics, written down plainly: of each voxel the latest message.
#[derive(Default)]
struct PlainMap {
    voxels: BTreeMap<VoxelKey, (i64, Option<Point3<f32>>)>,
    whole: Option<i64>,
}

impl PlainMap {
    fn key(point_m: &Point3<f32>) -> VoxelKey {
        VoxelGrid::new(EDGE_M).unwrap().key(point_m)
    }

    fn set(&mut self, stamp: i64, point: &Point3<f32>, is_there: bool) {
        let entry = self.voxels.entry(Self::key(point)).or_insert((i64::MIN, None));
        if entry.0 <= stamp {
            *entry = (stamp, is_there.then_some(*point));
        }
    }

    fn replace(&mut self, whole: &ColouredCloud) {
        let stamp = whole.cloud.stamp.as_nanos();
        let begins_anew = self.whole.replace(stamp).is_some_and(|before| before > stamp);
        self.voxels.retain(|_, (known, _)| *known > stamp && !begins_anew);
        for point_m in &whole.cloud.points_m {
            self.set(stamp, point_m, true);
        }
    }

    fn points(&self) -> Vec<Point3<f32>> {
        self.voxels.values().filter_map(|(_, point)| *point).collect()
    }
}

/// Whether the page shows these points and no others, each within half a step.
fn check_shows(page: &DecodedPage, expected: &[Point3<f32>], step_m: f64) -> Result<(), String> {
    let grid = VoxelGrid::new(EDGE_M).unwrap();
    let shown: BTreeMap<VoxelKey, Point3<f64>> = page.points().collect();
    if shown.len() != expected.len() {
        return Err(format!("{} points are shown of {}", shown.len(), expected.len()));
    }
    for point_m in expected {
        let at_m = shown.get(&grid.key(point_m)).ok_or(format!("{point_m} is not shown"))?;
        let off_m = (at_m - point_m.cast::<f64>()).amax();
        if off_m > step_m / 2.0 + 1e-5 {
            return Err(format!("{point_m} is shown {off_m} m beside"));
        }
    }
    Ok(())
}

#[derive(Clone, Debug)]
enum Step {
    Replace(i64, Vec<[f32; 3]>),
    Update(i64, Vec<[f32; 3]>),
    Remove(i64, Vec<[f32; 3]>),
    /// A browser takes a message.
    Send(usize),
    /// Its connection breaks, with what was on its way.
    Break(usize),
}

const BROWSERS: usize = 3;

/// Coordinates of a few blocks around the origin, away from the faces of the voxels: a step of the positions must not lead into
/// another one.
fn coordinate() -> impl Strategy<Value = f32> {
    ((-40..40_i32), (0.02..0.98_f32))
        .prop_map(|(cell, share)| (cell as f32 + share) * EDGE_M as f32)
}

fn points() -> impl Strategy<Value = Vec<[f32; 3]>> {
    // Few along y and z, so that voxels are met again.
    let point = (coordinate(), 0..3_i32, -2..1_i32, 0.1..0.9_f32);
    let point = point.prop_map(|(x, y, z, share)| {
        [x, (y as f32 + share) * EDGE_M as f32, (z as f32 + share) * EDGE_M as f32]
    });
    prop::collection::vec(point, 0..12)
}

fn step() -> impl Strategy<Value = Step> {
    // Stamps in any order: messages of different topics overtake each other.
    let stamp = 0..12_i64;
    prop_oneof![
        1 => (stamp.clone(), points()).prop_map(|(stamp, points)| Step::Replace(stamp, points)),
        4 => (stamp.clone(), points()).prop_map(|(stamp, points)| Step::Update(stamp, points)),
        3 => (stamp, points()).prop_map(|(stamp, points)| Step::Remove(stamp, points)),
        6 => (0..BROWSERS).prop_map(Step::Send),
        1 => (0..BROWSERS).prop_map(Step::Break),
    ]
}

proptest! {
    #[test]
    fn every_browser_shows_the_map_in_the_end(steps in prop::collection::vec(step(), 0..60)) {
        let (mut state, mut plain) = (state(), PlainMap::default());
        let mut browsers: [(Browser, DecodedPage); BROWSERS] = Default::default();
        for step in &steps {
            match step {
                Step::Replace(stamp, points) => {
                    let whole = cloud(*stamp, points);
                    state.map_mut().replace(&whole);
                    plain.replace(&whole);
                }
                Step::Update(stamp, points) => {
                    let updated = cloud(*stamp, points);
                    state.map_mut().update(&updated);
                    updated.cloud.points_m.iter().for_each(|point_m| plain.set(*stamp, point_m, true));
                }
                Step::Remove(stamp, points) => {
                    let removed = cloud(*stamp, points);
                    state.map_mut().remove(removed.cloud.stamp, &removed.cloud.points_m);
                    removed.cloud.points_m.iter().for_each(|point_m| plain.set(*stamp, point_m, false));
                }
                Step::Send(of) => {
                    let (browser, page) = &mut browsers[*of];
                    if let Some(message) = browser.next_message(&state) {
                        page.take(&message);
                    }
                }
                Step::Break(of) => {
                    let _lost = browsers[*of].0.next_message(&state);
                    browsers[*of] = Default::default();
                }
            }
        }
        let expected = plain.points();
        prop_assert_eq!(state.map().len(), expected.len());
        for (browser, page) in &mut browsers {
            drain(browser, &state, page);
            prop_assert!(browser.has_map(state.map()));
            check_shows(page, &expected, state.map().step_m()).map_err(TestCaseError::fail)?;
            prop_assert_eq!(page.total as usize, expected.len());
        }
    }
}

#[test]
fn a_browser_that_has_all_gets_nothing_and_then_only_what_changes() {
    let (mut state, mut browser, mut page) = (state(), Browser::default(), DecodedPage::default());
    state.map_mut().replace(&cloud(1, &[[0.1, 0.1, 0.1], [30.1, 0.1, 0.1]]));
    drain(&mut browser, &state, &mut page);
    assert!(browser.next_message(&state).is_none());
    assert_eq!(page.last_blocks, 2);
    // The same map again, and an update that says nothing new.
    state.map_mut().replace(&cloud(2, &[[0.1, 0.1, 0.1], [30.1, 0.1, 0.1]]));
    drain(&mut browser, &state, &mut page);
    assert!(page.last_blocks == 0 || browser.next_message(&state).is_none());
    state.map_mut().update(&cloud(3, &[[30.2, 0.1, 0.1]]));
    drain(&mut browser, &state, &mut page);
    assert_eq!(page.last_blocks, 1, "the block that has changed alone");
}

#[test]
fn a_large_map_comes_in_parts_between_which_the_moment_comes() {
    let (mut state, mut browser) = (state(), Browser::default());
    let points: Vec<[f32; 3]> = (0..400)
        .flat_map(|x| (0..400).map(move |y| [x as f32 * 0.5 + 0.2, y as f32 * 0.5 + 0.2, 0.2]))
        .collect();
    state.map_mut().replace(&cloud(1, &points));
    let mut kinds = Vec::new();
    for _ in 0..8 {
        state.set_status("{}");
        kinds.push(browser.next_message(&state).unwrap()[0]);
    }
    let of = |kind: message::Kind| kinds.iter().filter(|one| **one == kind as u8).count();
    assert_eq!((of(message::Kind::Map), of(message::Kind::Status)), (4, 4), "{kinds:?}");
}

#[test]
fn a_map_is_bounded_and_says_so() {
    let mut map = LiveMap::new(EDGE_M, 3).unwrap();
    let points: Vec<[f32; 3]> = (0..5).map(|n| [n as f32 + 0.2, 0.2, 0.2]).collect();
    map.update(&cloud(1, &points));
    assert_eq!((map.len(), map.refused()), (3, 2));
    map.replace(&cloud(2, &points[..2]));
    assert_eq!((map.len(), map.refused()), (2, 0));
}

#[test]
fn another_grid_begins_an_empty_map_and_the_page_clears() {
    let (mut state, mut browser, mut page) = (state(), Browser::default(), DecodedPage::default());
    state.map_mut().replace(&cloud(1, &[[0.1, 0.1, 0.1]]));
    drain(&mut browser, &state, &mut page);
    assert_eq!(page.points().count(), 1);
    assert!(!state.map_mut().set_voxel_edge(EDGE_M).unwrap());
    assert!(state.map_mut().set_voxel_edge(0.02).unwrap());
    assert!(state.map_mut().set_voxel_edge(0.0).is_err());
    drain(&mut browser, &state, &mut page);
    assert_eq!(page.points().count(), 0);
}

/// Regression: of a recording that began anew the page showed the map over that of the first time.
#[test]
fn a_whole_map_that_is_older_than_the_one_before_begins_anew() {
    let mut map = LiveMap::new(EDGE_M, MANY).unwrap();
    map.replace(&cloud(5, &[[0.1, 0.1, 0.1]]));
    map.update(&cloud(8, &[[1.1, 0.1, 0.1]]));
    map.replace(&cloud(6, &[[2.1, 0.1, 0.1]]));
    assert_eq!(map.len(), 2, "an update that is newer stays");
    map.replace(&cloud(1, &[[3.1, 0.1, 0.1]]));
    assert_eq!(map.len(), 1);
}

#[test]
fn points_that_are_none_are_left_out() {
    let mut map = LiveMap::new(EDGE_M, MANY).unwrap();
    let far = f32::MAX;
    map.update(&cloud(1, &[[f32::NAN, 0.0, 0.0], [f32::INFINITY, 0.0, 0.0], [far, -far, 0.0]]));
    assert_eq!(map.len(), 1);
    map.remove(
        Stamp::from_nanos(2),
        &[Point3::new(f32::NAN, 0.0, 0.0), Point3::new(far, -far, 0.0)],
    );
    assert!(map.is_empty());
}

#[test]
fn a_moment_says_what_moves_and_where_the_rig_is() {
    let segmented = geometry::SegmentedCycle {
        index: 7,
        setup: geometry::CycleSetup::default(),
        static_cloud: cloud(2_000_000_000, &[[3.0, 0.0, 0.0]]).cloud,
        dynamic_cloud: cloud(2_000_000_000, &[[1.0, 0.0, 0.0]]).cloud,
        map_from_rig: nalgebra::Isometry3::translation(1.0, 0.0, 0.0),
        depth: None,
        scan_rays: std::sync::Arc::default(),
        retracted_m: Vec::new(),
    };
    let moment =
        Moment { segmented: &segmented, detected: None, scan: None, tracks: &[], map_points: 5 };
    let body = decoded::body(&of_moment(&moment));
    let length = u32::from_le_bytes(body[..4].try_into().unwrap()) as usize;
    let json: serde_json::Value = serde_json::from_slice(&body[4..4 + length]).unwrap();
    assert_eq!((json["index"].as_u64(), json["t_s"].as_f64()), (Some(7), Some(2.0)));
    assert_eq!(
        (json["counts"]["reduced"].as_u64(), json["counts"]["map"].as_u64()),
        (Some(2), Some(5))
    );
    assert_eq!(json["pose"][0].as_f64(), Some(1.0));
    // No beam; two points, the moving one last, both 2 m and 1 m ahead of the rig.
    let scan = 2 + 4 + 4;
    assert_eq!(body[4 + length..][..2], [0, 0]);
    assert_eq!(body[4 + length + scan..][..8], [2, 0, 0, 0, 1, 0, 0, 0]);
}
