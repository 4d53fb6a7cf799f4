//! What an image says, and what two of them say together.

use super::*;

/// Regression: a scanner that is faster than the camera makes several cycles of an image, and three of them made a place free, or
/// noise a surface.
#[test]
fn an_image_of_several_cycles_is_seen_once() {
    let wall = upright(4.52, [-0.6, 0.6], [-0.6, 0.6]);
    let body = upright(3.0, [-0.24, 0.24], [-0.36, 0.36]);
    let mut random = Random::new(1);
    let view = look(&furnished(), 0, &rig_at(0.0, 0.0, 0.0), Isometry3::identity(), &mut random);
    let cut_after = |images: [u32; 10]| {
        let mut segmenter = Segmenter::new(config()).unwrap();
        let mut cut = |index: u32, points_m: Vec<Point3<f32>>| {
            let cycle = with_points(&view.cycle, index, points_m);
            segmenter.step(&cycle, |_| ()).unwrap().cycle.dynamic_cloud.points_m.len()
        };
        for index in images {
            cut(index, wall.clone());
        }
        cut(20, [wall.clone(), body.clone()].concat())
    };
    assert_eq!(cut_after([0; 10]), 0);
    assert_eq!(cut_after([0, 1, 2, 3, 4, 5, 6, 7, 8, 9]), body.len());
}

/// Regression: an arm over a desk has fewer points than an object needs in an image. It was none in any, and became background.
#[test]
fn a_small_thing_that_moves_is_an_object_by_two_images() {
    let wall = upright(4.52, [-1.0, 1.0], [-0.6, 0.6]);
    let mut random = Random::new(1);
    let view = look(&furnished(), 0, &rig_at(0.0, 0.0, 0.0), Isometry3::identity(), &mut random);
    let tracks_after = |images: &[u32]| {
        let mut segmenter = Segmenter::new(config()).unwrap();
        let mut step = |index: u32, points_m: Vec<Point3<f32>>| {
            segmenter.step(&with_points(&view.cycle, index, points_m), |_| ()).unwrap()
        };
        for index in 0..10 {
            step(index, wall.clone());
        }
        let tracks = images.iter().map(|index| {
            let from_y_m = 0.4 * *index as f32 - 4.64;
            let arm = upright(2.2, [from_y_m, from_y_m + 0.4], [-0.2, 0.04]);
            step(*index, [wall.clone(), arm].concat()).tracks.len()
        });
        tracks.max()
    };
    assert_eq!(tracks_after(&[10, 11, 12, 13]), Some(1));
    // One image of several cycles counts once.
    assert_eq!(tracks_after(&[10, 10, 10, 10]), Some(0));
}
