use image::codecs::png::PngDecoder;
use image::{AnimationDecoder, RgbImage};
use proptest::prelude::*;

use super::*;
use crate::pictures::canvas::BACKGROUND;
use crate::run_record::tests::{cycle, run};
use crate::{CycleRecord, CycleView, cloud_steps};

const EDGE_M: f64 = 0.1;

/// The middle of a voxel along an axis.
fn middle(cell: i32) -> f32 {
    (cell as f32 + 0.5) * EDGE_M as f32
}

/// A wall at x = 2.05 m, 1 m wide and 1 m high.
fn wall() -> Vec<Point3<f32>> {
    let at = |y: i32, z: i32| Point3::new(middle(20), middle(y), middle(z));
    (0..10).flat_map(|y| (0..10).map(move |z| at(y, z))).collect()
}

/// A run that saw points from the origin, looking along x, some in each cycle.
fn seen(by_cycle: &[Vec<Point3<f32>>]) -> RunRecord {
    let of = |(index, points): (usize, &Vec<Point3<f32>>)| {
        let cloud = points.iter().filter_map(cloud_steps).collect();
        CycleRecord {
            view: Some(CycleView { cloud, ..CycleView::default() }),
            ..cycle(index as u32)
        }
    };
    let mut run = run(by_cycle.iter().enumerate().map(of).collect());
    run.static_map = by_cycle.concat();
    run
}

fn decoded(png: &[u8]) -> RgbImage {
    image::load_from_memory(png).unwrap().into_rgb8()
}

/// Left, upper, right and lower ends of what is drawn in a colour that is wanted.
fn box_of(picture: &RgbImage, wanted: impl Fn(Colour) -> bool) -> [u32; 4] {
    let drawn = || picture.enumerate_pixels().filter(|(_, _, pixel)| wanted(pixel.0));
    let (x, y) = (|| drawn().map(|(x, _, _)| x), || drawn().map(|(_, y, _)| y));
    [x().min().unwrap(), y().min().unwrap(), x().max().unwrap() + 1, y().max().unwrap() + 1]
}

fn is_drawn(colour: Colour) -> bool {
    colour != BACKGROUND && colour != PATH
}

#[test]
fn a_wall_is_where_its_projection_is() {
    let mut run = seen(&[wall()]);
    run.map_edge_m = Some(EDGE_M / 2.0);
    let map = MapDrawing::of(&run, &[]).unwrap();
    let [left, upper, right, lower] =
        box_of(&decoded(&map.map_png().unwrap()), is_drawn).map(f64::from);
    let px_per_m = map.projection(Eye::Oblique, &map.path, PICTURE_PX).px_per_m();
    // The view is 0.5 rad to the left of x and looks down by 0.87 rad: y runs to the left and up, z up. From the first to the last
    // point there are 0.9 m, and a point has 0.075 m.
    let (aside, down) = (0.5_f64, 0.87_f64);
    let width_m = 0.9 * aside.cos() + 0.075;
    let height_m = 0.9 * (aside.sin() * down.sin() + down.cos()) + 0.075;
    assert!(((right - left) / px_per_m - width_m).abs() < 0.02, "{} px", right - left);
    assert!(((lower - upper) / px_per_m - height_m).abs() < 0.02, "{} px", lower - upper);
    // The rig, the lowest place of the map, is 2.05 m before the wall's foot.
    let rig = box_of(&decoded(&map.map_png().unwrap()), |colour| colour == PATH).map(f64::from);
    let before_m = 2.05 * aside.cos() * down.sin();
    let middle_of_rig = f64::midpoint(rig[1], rig[3]);
    assert!(((lower - middle_of_rig) / px_per_m + before_m - 0.04).abs() < 0.1, "{rig:?}");
}

#[test]
fn of_a_surface_the_side_that_the_rig_saw_is_drawn() {
    let ceiling: Vec<_> = (0..10)
        .flat_map(|x| (-5..5).map(move |y| Point3::new(middle(x), middle(y), 2.05)))
        .collect();
    let run = seen(std::slice::from_ref(&ceiling));
    let drawn = |normals: &[Vector3<f32>]| {
        let map = MapDrawing::of(&run, normals).unwrap();
        decoded(&map.map_png().unwrap()).pixels().any(|pixel| is_drawn(pixel.0))
    };
    // Whichever of the two normals is given.
    assert!(!drawn(&vec![Vector3::z(); ceiling.len()]));
    assert!(!drawn(&vec![-Vector3::z(); ceiling.len()]));
    assert!(drawn(&[]), "it is not known from where it is to be seen");
    assert!(drawn(&vec![Vector3::zeros(); ceiling.len()]));
    assert!(drawn(&vec![Vector3::x(); ceiling.len()]), "edgewise");
}

#[test]
fn what_was_removed_is_orange_before_and_gone_after() {
    let mut run = seen(&[wall()]);
    run.cycles[0].dynamic_points_m = vec![Point3::new(1.0, 0.5, 0.5)];
    let map = MapDrawing::of(&run, &[]).unwrap();
    let pair = decoded(&map.before_after_png().unwrap());
    let is_orange = |colour: Colour| colour == REMOVED;
    let [_, _, right, _] = box_of(&pair, is_orange);
    assert!(right < pair.width() / 2, "{right} of {}", pair.width());
    assert!(decoded(&map.map_png().unwrap()).pixels().any(|pixel| is_orange(pixel.0)));
}

#[test]
fn a_coloured_map_has_its_colours_and_a_dark_one_lighter_ones() {
    let mut run = seen(&[wall()]);
    for (given, drawn) in [([40, 80, 100], [80, 160, 200]), ([240, 20, 10], [240, 20, 10])] {
        run.map_colours = vec![given; run.static_map.len()];
        let map = MapDrawing::of(&run, &[]).unwrap();
        let picture = decoded(&map.map_png().unwrap());
        assert!(picture.pixels().any(|pixel| pixel.0 == drawn), "{given:?}");
    }
}

#[test]
fn a_room_is_its_walls_in_characters() {
    let edge = |cell: i32| [[cell, 0], [cell, 40], [0, cell], [40, cell]];
    let floor = (0..=40).flat_map(|x| (0..=40).map(move |y| [x, y]));
    let at = |[x, y]: [i32; 2], z_m: f32| Point3::new(middle(x), middle(y), z_m);
    let walls = (0..=40).flat_map(edge).flat_map(|cell| (0..20).map(move |z| at(cell, middle(z))));
    let mut points: Vec<_> = floor.map(|cell| at(cell, 0.0)).chain(walls).collect();
    // A post, 1 m behind the left wall and 1 m before the far one.
    points.push(at([10, 30], 1.0));
    let mut run = seen(&[points]);
    run.map_edge_m = Some(EDGE_M);
    let map = MapDrawing::of(&run, &[]).unwrap();
    let lines = thumbnail(&map, 16, TerminalColours::None);
    assert_eq!(
        lines,
        [
            "█▀▀▀▀▀▀▀▀▀▀▀▀▀▀█",
            "█              █",
            "█   ▀          █",
            "█              █",
            "█              █",
            "█              █",
            "█              █",
            "█▄▄▄▄▄▄▄▄▄▄▄▄▄▄█",
        ]
    );
}

#[test]
fn colours_of_a_terminal_end_with_the_line() {
    let map = MapDrawing::of(&seen(&[wall()]), &[]).unwrap();
    for (colours, code) in [(TerminalColours::True, "8;2;"), (TerminalColours::Indexed, "8;5;")] {
        let lines = thumbnail(&map, 20, colours);
        assert!(lines.iter().any(|line| line.contains(code)));
        assert!(
            lines.iter().filter(|line| line.contains('\x1b')).all(|line| line.ends_with("\x1b[0m"))
        );
    }
    assert!(thumbnail(&map, 20, TerminalColours::None).iter().all(|line| !line.contains('\x1b')));
}

fn frames(png: &[u8]) -> Vec<RgbImage> {
    let decoder = PngDecoder::new(std::io::Cursor::new(png)).unwrap().apng().unwrap();
    let frames = decoder.into_frames().collect_frames().unwrap();
    frames
        .into_iter()
        .map(|frame| image::DynamicImage::from(frame.into_buffer()).into_rgb8())
        .collect()
}

#[test]
fn an_animation_shows_the_map_as_it_forms_and_what_is_removed_on_its_way() {
    // A half of the wall a second, at ten frames for two seconds.
    let (near, far): (Vec<_>, Vec<_>) = wall().into_iter().partition(|point_m| point_m.y < 0.5);
    let mut run = seen(&[near, Vec::new(), far, Vec::new()]);
    for (index, cycle) in run.cycles.iter_mut().enumerate() {
        cycle.scan_stamp = geometry::Stamp::from_nanos(index as i64 * 1_000_000_000);
    }
    run.cycles[1].dynamic_points_m = vec![Point3::new(1.0, -0.5, 0.5)];
    let map = MapDrawing::of(&run, &[]).unwrap();
    let bytes = map.animation_png().unwrap();
    let frames = frames(&bytes);
    assert_eq!(frames.len(), 16);
    let right_half = frames[0].width() / 2 + GAP_PX as u32 / 2;
    let count = |frame: &RgbImage, is_after: bool, wanted: fn(&Colour) -> bool| {
        let in_half = frame.enumerate_pixels().filter(|(x, _, _)| (*x >= right_half) == is_after);
        in_half.filter(|(_, _, pixel)| wanted(&pixel.0)).count()
    };
    let is_light = |[_, g, _]: &Colour| *g > 60;
    let is_orange = |[r, g, b]: &Colour| *r > 200 && *g < 160 && *b < 100;
    for is_after in [false, true] {
        let of_wall: Vec<usize> =
            frames.iter().map(|frame| count(frame, is_after, is_light)).collect();
        assert!(of_wall[10] > of_wall[5] + 1000 && of_wall[15] >= of_wall[10], "{of_wall:?}");
    }
    let orange = |frame: usize, is_after| count(&frames[frame], is_after, is_orange) > 0;
    assert_eq!([0, 7, 12, 15].map(|frame| orange(frame, false)), [false, true, true, true]);
    assert_eq!([0, 7, 12, 15].map(|frame| orange(frame, true)), [false, true, false, false]);
    // Without its animation it is the whole map.
    let still = decoded(&bytes);
    assert!(count(&still, true, is_orange) == 0 && count(&still, false, is_orange) > 0);
}

#[test]
fn nothing_and_one_point_are_drawn() {
    for points in [vec![], vec![Point3::new(1.0, 2.0, 3.0)]] {
        let map = MapDrawing::of(&run(vec![]), &[]).unwrap();
        assert!(map.map_png().is_ok() && map.animation_png().is_ok());
        assert_eq!(thumbnail(&map, 60, TerminalColours::True), Vec::<String>::new());
        let map = MapDrawing::of(&seen(std::slice::from_ref(&points)), &[]).unwrap();
        assert_eq!(thumbnail(&map, 60, TerminalColours::True).is_empty(), points.is_empty());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Whatever the points, the drawings are of a bounded size and nothing panics.
    #[test]
    fn any_points_give_drawings_of_bounded_size(
        points in prop::collection::vec(
            prop::array::uniform3(prop_oneof![-20.0_f32..20.0, Just(1e30), Just(f32::NAN), any::<f32>()]), 0..20),
        normals in prop::collection::vec(prop::array::uniform3(any::<f32>()), 0..20),
        columns in 0_usize..70,
        at_m in prop_oneof![Just(0.0), any::<f64>()],
        edge_m in prop_oneof![Just(0.08), 1e-6..1e3_f64],
    ) {
        let points: Vec<_> = points.iter().map(|&[x, y, z]| Point3::new(x, y, z)).collect();
        let mut run = seen(&[points.clone(), Vec::new()]);
        run.voxel_edge_m = edge_m;
        run.cycles[1].map_from_rig.translation.x = at_m;
        run.cycles[1].dynamic_points_m = points;
        let normals: Vec<_> = normals.iter().map(|&[x, y, z]| Vector3::new(x, y, z)).collect();
        let map = MapDrawing::of(&run, &normals).unwrap();
        let picture = decoded(&map.map_png().unwrap());
        prop_assert!(picture.width() <= 1200 && picture.height() <= 900);
        let frames = frames(&map.animation_png().unwrap());
        prop_assert!(!frames.is_empty() && frames.iter().all(|frame| frame.width() <= 800 && frame.height() <= 420));
        for colours in [TerminalColours::None, TerminalColours::True] {
            prop_assert!(thumbnail(&map, columns, colours).len() <= 30);
        }
    }
}
