use std::io::Read as _;

use flate2::read::DeflateDecoder;
use geometry::{DynamicZone, Stamp, ZoneSource};

use super::*;
use crate::cycle_view::cloud_steps;
use crate::run_record::tests::{cycle, run};
use crate::{CycleRecord, CycleView, ScanView};

fn points(of: &[[f32; 3]]) -> Vec<Point3<f32>> {
    of.iter().map(|point| Point3::from(*point)).collect()
}

fn page_of(run: &RunRecord, limits: &PageLimits) -> String {
    let summary = Summary::of_run(run, None, false).unwrap();
    scene(run, &summary, limits).unwrap().into_string()
}

fn block_of(page: &str, name: &str) -> Vec<u8> {
    let start = format!("<script type=\"text/plain\" id=\"scene-{name}\">");
    let from = page.find(&start).unwrap() + start.len();
    let text = &page[from..from + page[from..].find('<').unwrap()];
    let mut bytes = Vec::new();
    DeflateDecoder::new(&*crate::payload::bytes_of(text)).read_to_end(&mut bytes).unwrap();
    bytes
}

fn header_of(page: &str) -> Value {
    let start = "id=\"scene-header\">";
    let from = page.find(start).unwrap() + start.len();
    serde_json::from_str(&page[from..from + page[from..].find('<').unwrap()]).unwrap()
}

#[test]
fn the_points_come_back_to_a_step_over_more_than_a_block() {
    let map = [[0.0123, -700.5, 1.0], [0.0, 0.0, 0.0], [1000.25, 3.5, -0.001]];
    let run = RunRecord { static_map: points(&map), ..run(vec![cycle(0)]) };
    let page = page_of(&run, &PageLimits::default());
    let header = header_of(&page);
    let set = &header["points"]["map"];
    let step_m = set["step_m"].as_f64().unwrap();
    assert!((step_m - run.map_spacing_m() / 10.0).abs() < 1e-9, "{step_m}");
    let bytes = block_of(&page, "map");
    let mut read = Vec::new();
    let mut at = 0;
    for block in set["blocks"].as_array().unwrap() {
        let count = block["count"].as_u64().unwrap() as usize;
        let mut plane = || {
            let (low, high) = (&bytes[at..at + count], &bytes[at + count..at + 2 * count]);
            at += 2 * count;
            let mut value = 0_u16;
            let folded = low.iter().zip(high).map(|(low, high)| u16::from_le_bytes([*low, *high]));
            let steps = folded.map(|folded| {
                value = value.wrapping_add((folded >> 1) ^ (folded & 1).wrapping_neg());
                value
            });
            steps.collect::<Vec<_>>()
        };
        let [x, y, z, _moment] = [plane(), plane(), plane(), plane()];
        for n in 0..count {
            let steps = [x[n], y[n], z[n]];
            read.push([0, 1, 2].map(|axis: usize| {
                block["origin_m"][axis].as_f64().unwrap() + f64::from(steps[axis]) * step_m
            }));
        }
    }
    assert_eq!((at, read.len()), (bytes.len(), map.len()));
    for point in map {
        let is_near = |other: &[f64; 3]| {
            (0..3).all(|axis| (other[axis] - f64::from(point[axis])).abs() <= 1.1 * step_m)
        };
        assert!(read.iter().any(is_near), "{point:?} of {read:?}");
    }
}

#[test]
fn a_map_that_is_too_large_is_thinned_and_says_so() {
    let map: Vec<[f32; 3]> = (0..1000).map(|n| [n as f32 * 0.01, 0.0, 0.0]).collect();
    let run = RunRecord { static_map: points(&map), ..run(vec![cycle(0)]) };
    let limits = PageLimits { map_points: 100, ..PageLimits::default() };
    let set = header_of(&page_of(&run, &limits))["points"]["map"].clone();
    assert_eq!(
        (set["total"].as_u64(), set["blocks"][0]["count"].as_u64()),
        (Some(1000), Some(100))
    );
}

#[test]
fn no_text_ends_the_script_or_begins_another() {
    let run = RunRecord {
        bag_name: "</script><script>alert(1)</script><!--".to_owned(),
        map_frame_id: "\"'</SCRIPT >\u{2028}".to_owned(),
        ..run(vec![cycle(0)])
    };
    let page = page_of(&run, &PageLimits::default());
    assert!(!page.contains("alert(1)<") && !page.contains("</SCRIPT"));
    assert_eq!(header_of(&page)["title"], run.bag_name);
    assert_eq!(header_of(&page)["frame"], run.map_frame_id);
}

#[test]
fn the_script_can_stand_in_a_page() {
    for end in ["</script", "<!--"] {
        assert!(!BUNDLE.to_ascii_lowercase().contains(end), "{end}");
    }
    assert!(BUNDLE_HASH.starts_with("sha256-") && BUNDLE_HASH.trim() == BUNDLE_HASH);
    assert!(BUNDLE.contains("Three.js Authors"), "the notice of the library's licence");
}

#[test]
fn a_cycle_has_its_pose_zones_tracks_and_view() {
    let zone = DynamicZone {
        azimuth_min_rad: -0.5,
        azimuth_max_rad: 0.25,
        peak_std_dev_m: 1.0,
        source: ZoneSource::Held { cycles: 2 },
        returns: None,
    };
    let with_view = CycleRecord {
        zones: vec![zone],
        tracks_m: [(7, [1.0, 2.0, 3.0].into())].into(),
        map_from_rig: Isometry3::translation(0.5, 0.0, 0.0),
        view: Some(CycleView::default()),
        ..cycle(4)
    };
    let read = cycles::encode(&run(vec![cycle(0), with_view]));
    assert_eq!(read["cycles"][0]["view"], Value::Null);
    let second = &read["cycles"][1];
    assert_eq!(
        (&second["view"], &second["t_s"], &second["index"]),
        (&json!(0), &json!(0.4), &json!(4))
    );
    assert_eq!(second["pose"], json!([0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]));
    assert_eq!(second["tracks"], json!([[7.0, 1.0, 2.0, 3.0]]));
    assert_eq!(
        (&second["zones"][0]["from_rad"], &second["zones"][0]["held"]),
        (&json!(-0.5), &json!(2))
    );
}

#[test]
fn moving_points_come_last_in_a_view() {
    let at = [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]].map(Point3::from);
    let scan = ScanView { first_azimuth_rad: 0.0, azimuth_step_rad: 0.1, ranges: vec![5, 6] };
    let view = CycleView {
        scan: Some(scan),
        cloud: at.iter().filter_map(cloud_steps).collect(),
        depth: None,
    };
    let viewed = CycleRecord { view: Some(view), dynamic_points_m: vec![at[0]], ..cycle(0) };
    let bytes = &views::encode(&run(vec![viewed])).unwrap()[0];
    let head = 2 + 4 + 4 + 2 * 2;
    assert_eq!(bytes[..2], [2, 0], "beams");
    assert_eq!(
        bytes[head..head + 8],
        [3, 0, 0, 0, 1, 0, 0, 0],
        "points, and how many of them move"
    );
    // The differences along x: 250, 125 more, and 250 less.
    let folded: [u16; 3] = [500, 250, 499];
    let low = &bytes[head + 8..head + 11];
    assert_eq!(low, folded.map(|steps| steps.to_le_bytes()[0]));
    assert_eq!(bytes[bytes.len() - 4..], [0; 4], "no depth image");
}

#[test]
fn a_place_is_shown_from_the_cycle_on_in_which_it_was_seen() {
    let seen = |x_m: f32| CycleView {
        cloud: cloud_steps(&Point3::new(x_m, 0.05, 0.05)).into_iter().collect(),
        ..CycleView::default()
    };
    let mut second = CycleRecord { view: Some(seen(2.05)), ..cycle(1) };
    second.scan_stamp = Stamp::from_nanos(1);
    let first = CycleRecord { view: Some(seen(1.05)), ..cycle(0) };
    let moments = Moments::of(&run(vec![first, second, cycle(2)])).unwrap();
    let at = |x_m: f32| moments.first_seen(&Point3::new(x_m, 0.05, 0.05));
    assert_eq!([at(1.05), at(2.05), at(2.15), at(9.05)], [0, 1, 1, 2]);
}

#[test]
fn colours_are_carried_where_the_map_has_them() {
    let map = points(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]);
    let map_colours = vec![[250, 20, 10], geometry::NO_COLOUR, [1, 2, 3]];
    let coloured = RunRecord { static_map: map, map_colours, ..run(vec![cycle(0)]) };
    let page = page_of(&coloured, &PageLimits::default());
    assert_eq!(header_of(&page)["points"]["map"]["has"], json!(["moment", "colour"]));
    let bytes = block_of(&page, "map");
    // Three coordinates and a moment of 16 bits each, and three colours.
    assert_eq!(bytes.len(), 3 * (4 * 2 + 3));
    let plane = |part: usize| {
        let mut value = 0_u8;
        bytes[24 + 3 * part..][..3].iter().map(move |difference| {
            value = value.wrapping_add(*difference);
            value
        })
    };
    let shade = |green: u8, more: u8| green.wrapping_add(more);
    let mut colours: Vec<_> = plane(0)
        .zip(plane(1))
        .zip(plane(2))
        .map(|((green, red), blue)| [shade(green, red), green, shade(green, blue)])
        .collect();
    colours.sort_unstable();
    assert_eq!(colours, [[0, 0, 0], [27, 27, 27], [62, 5, 2]]);
    let plain = RunRecord { map_colours: Vec::new(), ..coloured };
    let header = header_of(&page_of(&plain, &PageLimits::default()));
    assert_eq!(header["points"]["map"]["has"], json!(["moment"]));
}
