//! The colours of a map.

use geometry::{DepthFrame, NO_COLOUR, OrientedPoints};

use super::spilling::{MOST, drive, spilling};
use super::*;

const RED: [u8; 3] = [200, 30, 20];
const BLUE: [u8; 3] = [10, 40, 220];
const GREEN: [u8; 3] = [20, 250, 20];
const EDGE_M: f64 = 0.03;

/// The cycle with a colour of its own for each pixel.
fn coloured(cycle: SegmentedCycle, colour: impl Fn(usize) -> [u8; 3]) -> SegmentedCycle {
    let masked = cycle.depth.unwrap();
    let frame = masked.frame();
    let colours = (0..frame.image().pixels().len()).map(colour).collect();
    let frame = DepthFrame::clone(frame).with_colours(colours).unwrap();
    let is_moving = masked.is_moving().to_vec();
    SegmentedCycle { depth: MaskedDepth::new(Arc::new(frame), is_moving).ok(), ..cycle }
}

/// A cycle that sees a red room and something before its far wall in a colour.
fn red_room(scene: &Scene, index: u32, colour: [u8; 3]) -> SegmentedCycle {
    let rig = rig_at(0.0, 0.0);
    let cycle = cycle(scene, index, &rig, None);
    let shown = scene.shows_person(cycle.depth.as_ref().unwrap().frame(), &rig);
    coloured(cycle, |pixel| if shown[pixel] { colour } else { RED })
}

fn is_nearly(colour: [u8; 3], expected: [u8; 3]) -> bool {
    colour.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 40)
}

#[test]
fn a_red_wall_and_what_is_blue_before_it_are_red_and_blue_in_the_map() {
    let scene = Scene::room().with_person(0.0);
    let mut map = map(EDGE_M);
    for index in 0..5 {
        map.integrate(&red_room(&scene, index, BLUE)).unwrap();
    }
    let OrientedPoints { points_m, colours, .. } = map.whole().points;
    assert_eq!(points_m.len(), colours.len());
    let (mut red, mut blue, mut wrong) = (0, 0, 0);
    for (point, colour) in points_m.iter().zip(colours) {
        let from_middle_m = (point - Point3::new(1.8, 0.0, 0.0)).norm();
        let is_of_room = scene.nearest(&point.cast()).0 < 0.02;
        // At the border, and in the shadow beside it, both are seen.
        match (from_middle_m < 0.31, is_of_room) {
            (true, _) => blue += usize::from(is_nearly(colour, BLUE)),
            (_, true) => red += usize::from(is_nearly(colour, RED)),
            _ => continue,
        }
        let expected = if from_middle_m < 0.31 { BLUE } else { RED };
        wrong += usize::from(!is_nearly(colour, expected));
    }
    assert!(red > 3_000 && blue > 100, "{red} red, {blue} blue");
    assert!(wrong <= (red + blue) / 50, "{wrong} of {} have another colour", red + blue);
}

#[test]
fn the_colour_of_a_moving_person_does_not_come_in() {
    let mut map = map(EDGE_M);
    for index in 0..20 {
        let scene = Scene::room().with_person(-1.0 + 0.1 * f64::from(index));
        let cycle = red_room(&scene, index, GREEN);
        map.integrate(&masked(&scene, cycle, &rig_at(0.0, 0.0))).unwrap();
    }
    let colours = map.whole().points.colours;
    assert!(colours.iter().filter(|colour| is_nearly(**colour, RED)).count() > 3_000);
    let green = colours.iter().filter(|[red, green, _]| green > red).count();
    assert_eq!(green, 0, "of {} points", colours.len());
}

/// Without a colour image everything is as it was: no colours, the same points, the same memory.
#[test]
fn a_map_without_colours_has_none() {
    let (mut plain, mut red) = (map(EDGE_M), map(EDGE_M));
    plain.follow_changes();
    red.follow_changes();
    for index in 0..3 {
        let cycle = cycle(&Scene::room(), index, &rig_at(0.0, 0.0), None);
        plain.integrate(&cycle).unwrap();
        red.integrate(&coloured(cycle, |_| RED)).unwrap();
    }
    let (without, with) = (plain.whole(), red.whole());
    assert!(without.points.colours.is_empty());
    assert_eq!(
        (&without.points.points_m, &without.points.normals),
        (&with.points.points_m, &with.points.normals)
    );
    assert!(with.points.colours.iter().all(|colour| *colour == RED));
    assert!(red.memory_bytes() > plain.memory_bytes());
    let changes = [plain.take_changes(usize::MAX), red.take_changes(usize::MAX)];
    assert!(changes[0].updated_colours.is_empty());
    assert_eq!(changes[1].updated_colours, vec![RED; changes[1].updated.points_m.len()]);
    assert!(plain.cloud_for_listeners().unwrap().colours.is_empty());
    assert_eq!(red.cloud_for_listeners().unwrap().colours, with.points.colours);
}

#[test]
fn tiles_that_are_spilled_keep_their_colours() {
    let ((mut spilled, _store), mut twin) = (spilling(MOST), map(0.05));
    for (index, cycle) in drive().into_iter().enumerate() {
        let colour = [40 + 2 * index as u8, 100, 255 - 2 * index as u8];
        let cycle = coloured(cycle, |_| colour);
        spilled.integrate(&cycle).unwrap();
        twin.integrate(&cycle).unwrap();
    }
    let (whole, expected) = (spilled.whole(), twin.whole());
    assert!(spilled.spill_counts().unwrap().tiles_in_store > 20);
    assert_eq!(whole.points.colours.len(), whole.points.points_m.len());
    assert!(whole == expected);
}

#[test]
fn a_saved_map_is_loaded_with_its_colours() {
    let scene = Scene::room().with_person(0.0);
    let mut seen = map(EDGE_M);
    for index in 0..3 {
        seen.integrate(&red_room(&scene, index, BLUE)).unwrap();
    }
    let OrientedPoints { points_m, normals, colours } = seen.whole().points;
    let saved = OrientedPoints { points_m, normals, colours };
    for map in [&mut map(EDGE_M), &mut spilling(MOST).0] {
        map.replace_coloured(&saved, "map").unwrap();
        let loaded = map.whole();
        assert_eq!(loaded.points.colours.len(), loaded.points.points_m.len());
        let of =
            |colour| loaded.points.colours.iter().filter(|own| is_nearly(**own, colour)).count();
        let (red, blue) = (of(RED), of(BLUE));
        assert!(red > 10 * blue && blue > 30, "{red} red, {blue} blue");
        assert!(
            red + blue > loaded.points.colours.len() * 9 / 10,
            "of {}",
            loaded.points.colours.len()
        );
    }
    let mut plain = map(EDGE_M);
    let none = vec![NO_COLOUR; saved.points_m.len()];
    plain.replace_coloured(&OrientedPoints { colours: none, ..saved }, "map").unwrap();
    assert!(plain.whole().points.colours.is_empty());
}
