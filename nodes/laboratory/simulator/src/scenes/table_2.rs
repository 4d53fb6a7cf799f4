//! Table 2 of Rec-HV, row by row. Sizes and positions are chosen here: the table gives only the kind of scene and its
//! depth.

use super::SceneName;
use super::furniture::{block, curtain, plant, post, rack, sheet, sofa, table};
use super::shell::{Opening, Shell};
use crate::{Body, Material};

/// The rig stands half a metre before the rear wall, so a depth of 4 m is a room of 4.5 m.
const BEFORE_REAR_WALL_M: f64 = 0.5;

/// The room itself.
pub(super) fn shell(name: SceneName) -> Shell {
    let room = |depth_m: f64| Shell { depth_m: depth_m + BEFORE_REAR_WALL_M, ..Shell::default() };
    match name {
        SceneName::A | SceneName::B => room(4.0),
        SceneName::C => Shell { walls: Material::DARK, floor: Material::matt(0.25), ..room(4.0) },
        SceneName::D => {
            // The scanner's plane is 1.15 m up: it meets the parapet (Rec-HV 5, on scene D).
            let opening = Opening { y_m: (0.3, 2.2), z_m: (1.35, 2.3) };
            Shell { opening: Some(opening), ..room(6.0) }
        }
        SceneName::E => {
            // On the right, and in the scanner's plane (Rec-HV 5, on scene E).
            let opening = Opening { y_m: (-2.4, -0.7), z_m: (0.0, 2.2) };
            Shell { opening: Some(opening), floor: Material::VARNISH, ..room(5.0) }
        }
        SceneName::F => Shell { width_m: 7.0, ..room(8.0) },
        SceneName::G => {
            let opening = Opening { y_m: (-2.4, -0.9), z_m: (0.9, 2.2) };
            Shell { opening: Some(opening), ..room(6.0) }
        }
        SceneName::H => Shell {
            width_m: 5.0,
            height_m: 2.4,
            walls: Material::matt(0.2),
            floor: Material::matt(0.15),
            ..room(4.0)
        },
    }
}

/// Its furniture.
pub(super) fn furniture(name: SceneName) -> Vec<Body> {
    match name {
        SceneName::A => Vec::new(),
        SceneName::B => reflecting_much(),
        SceneName::C => reflecting_little(),
        SceneName::D => open_above(),
        SceneName::E => open_and_bright(),
        SceneName::F => at_all_depths(),
        SceneName::G => behind_glass(),
        SceneName::H => dark(),
    }
}

fn reflecting_much() -> Vec<Body> {
    let mut bodies = vec![
        // At an angle at which its front reflects a part of the light away.
        block("steel cabinet", [4.1, -1.55], 0.05, (0.0, 1.8), [0.5, 0.9], Material::VARNISH),
        block("fridge", [4.1, 1.7], 0.3, (0.0, 1.7), [0.6, 0.6], Material::VARNISH),
        block(
            "fridge door",
            [3.79, 1.605],
            0.3,
            (0.05, 1.65),
            [0.04, 0.55],
            Material::POLISHED_METAL,
        ),
        block("whiteboard", [4.47, -0.35], 0.0, (0.9, 1.9), [0.03, 1.2], Material::VARNISH),
        post("floor lamp", [4.1, 0.45], 0.06, (0.0, 1.6), Material::POLISHED_METAL),
        block("locker", [4.25, 0.9], 0.1, (0.0, 1.5), [0.3, 0.35], Material::POLISHED_METAL),
    ];
    bodies.extend(table([4.15, -0.35], [0.5, 1.1], 0.75, Material::POLISHED_METAL));
    bodies
}

fn reflecting_little() -> Vec<Body> {
    let mut bodies = vec![
        block("wardrobe", [4.2, -1.5], 0.0, (0.0, 2.0), [0.5, 1.0], Material::BLACK),
        block("speaker", [4.25, 0.0], 0.2, (0.0, 1.3), [0.35, 0.3], Material::BLACK),
    ];
    bodies.extend(table([4.2, -0.6], [0.5, 0.9], 0.75, Material::DARK_PLASTIC));
    bodies.extend(sofa([4.05, 1.0], 1.5, Material::BLACK));
    bodies.extend(curtain(4.4, (1.9, 2.8), 2.3, Material::DARK_PLASTIC));
    bodies
}

fn open_above() -> Vec<Body> {
    let mut bodies = vec![
        post("column", [5.3, -0.5], 0.15, (0.0, 2.6), Material::matt(0.6)),
        block("panel", [5.9, -1.9], 0.6, (0.0, 1.9), [0.08, 1.2], Material::WOOD),
        block("chest", [4.4, -1.7], 0.3, (0.0, 0.9), [0.5, 0.9], Material::WOOD),
        block("steel cabinet", [6.1, 2.6], -0.4, (0.0, 1.8), [0.5, 0.7], Material::VARNISH),
    ];
    // Below the scanner's plane, and in front of what crosses.
    bodies.extend(table([1.45, 0.1], [0.4, 0.9], 0.85, Material::WOOD));
    bodies.extend(sofa([5.2, 1.0], 1.8, Material::matt(0.3)));
    bodies.extend(plant([4.4, 1.9]));
    bodies.extend(plant([5.8, -1.0]));
    bodies.extend(curtain(6.4, (-0.9, 0.1), 2.3, Material::matt(0.6)));
    bodies
}

fn open_and_bright() -> Vec<Body> {
    let mut bodies = vec![
        sheet("glass front", [5.5, -1.95], 0.0, (0.0, 2.2), 0.9, Material::GLASS),
        post("door frame", [5.5, -1.5], 0.03, (0.0, 2.2), Material::POLISHED_METAL),
        block("counter", [5.0, 1.4], 0.0, (0.0, 1.1), [0.6, 2.0], Material::VARNISH),
        block("steel cabinet", [5.1, 0.1], -0.2, (0.0, 1.9), [0.5, 0.6], Material::VARNISH),
    ];
    bodies.push(post("chrome rail", [4.5, -0.3], 0.04, (0.0, 1.3), Material::POLISHED_METAL));
    bodies
}

fn at_all_depths() -> Vec<Body> {
    let wood = Material::WOOD;
    let mut bodies = vec![
        post("column", [4.5, 1.35], 0.15, (0.0, 2.6), Material::PLASTER),
        post("column", [6.9, 0.55], 0.2, (0.0, 2.6), Material::PLASTER),
        post("pipe", [4.1, -1.6], 0.03, (0.0, 2.6), Material::matt(0.5)),
        post("pipe", [4.9, 0.55], 0.025, (0.0, 2.0), Material::DARK_PLASTIC),
        post("coat stand", [5.9, 0.15], 0.03, (0.0, 1.8), wood),
        block("crates", [4.7, -0.35], 0.25, (0.0, 1.4), [0.5, 0.5], Material::matt(0.45)),
        block("crates", [5.7, -1.3], -0.4, (0.0, 1.3), [0.6, 0.8], Material::matt(0.55)),
        block("blackboard", [7.4, -0.9], 0.1, (0.5, 1.9), [0.05, 1.4], Material::BLACK),
        block("cabinet", [8.1, 2.4], 0.0, (0.0, 1.9), [0.6, 1.0], Material::VARNISH),
        block("crates", [8.1, -2.3], 0.2, (0.0, 1.6), [0.6, 0.9], Material::CLOTH),
    ];
    bodies.extend(rack([5.2, 2.5], 1.0, wood));
    bodies.extend(rack([6.4, -2.5], 1.2, wood));
    bodies.extend(rack([7.7, 1.4], 1.0, Material::DARK));
    bodies.extend(plant([6.1, 1.5]));
    // Below the scanner's plane, and in front of what crosses.
    bodies.extend(table([1.45, -0.2], [0.4, 0.8], 0.85, wood));
    bodies
}

fn behind_glass() -> Vec<Body> {
    let glass = Material::GLASS;
    let mut bodies = vec![
        sheet("window", [6.5, -1.65], 0.0, (0.9, 2.2), 1.5, glass),
        block("television", [6.4, 0.9], 0.0, (0.8, 1.6), [0.06, 1.4], Material::BLACK_GLASS),
        block("cupboard", [6.25, 0.9], 0.0, (0.0, 0.7), [0.4, 1.6], Material::WOOD),
        sheet("glass screen", [4.4, -0.2], 0.0, (0.0, 1.9), 1.0, glass),
        // At a grazing angle from the rig: it reflects the light away.
        sheet("glass door", [4.9, 1.65], 1.75, (0.0, 2.1), 0.9, glass),
        block("chest behind the screen", [5.3, -0.3], 0.3, (0.0, 1.4), [0.4, 0.5], Material::WOOD),
        post("frame", [4.4, -0.7], 0.02, (0.0, 1.9), Material::POLISHED_METAL),
        post("frame", [4.4, 0.3], 0.02, (0.0, 1.9), Material::POLISHED_METAL),
    ];
    bodies.extend(table([4.4, -1.5], [0.7, 1.0], 0.7, glass));
    bodies
}

fn dark() -> Vec<Body> {
    let mut bodies = vec![
        block("wardrobe", [4.2, 1.7], 0.0, (0.0, 2.0), [0.5, 0.8], Material::BLACK),
        block("television", [4.42, -0.1], 0.0, (0.8, 1.4), [0.06, 0.9], Material::BLACK_GLASS),
        block("bookcase", [4.2, -1.4], 0.15, (0.0, 1.7), [0.4, 0.8], Material::DARK_PLASTIC),
    ];
    bodies.extend(table([4.2, -0.1], [0.4, 1.2], 0.6, Material::DARK_PLASTIC));
    bodies.extend(curtain(4.42, (0.7, 1.1), 2.2, Material::DARK_PLASTIC));
    bodies
}
