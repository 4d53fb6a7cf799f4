//! Places of random looks, seen again with some bits changed.

use std::sync::Arc;

use nalgebra::Point2;

use super::*;
use crate::feature::points::{Corner, Descriptor};
use crate::frame::Frame;
use crate::map::testing::{World, around, blank_frame, blank_map};
use crate::solve::testing::Random;

/// A frame whose corners look like this.
fn frame_of(looks: impl IntoIterator<Item = Descriptor>) -> Arc<Frame> {
    let corner = |descriptor| Corner {
        pixel: Point2::origin(),
        level: 0,
        angle_rad: 0.0,
        response: 1.0,
        descriptor,
    };
    let corners = looks.into_iter().map(corner).collect();
    Arc::new(Frame { corners, ..Frame::clone(&blank_frame(0, 0)) })
}

/// A descriptor with each bit changed by this chance.
fn seen_again(descriptor: &Descriptor, share: f64, random: &mut Random) -> Descriptor {
    let mut again = *descriptor;
    for bit in 0..256 {
        if random.between(0.0, 1.0) < share {
            again.0[bit / 64] ^= 1 << (bit % 64);
        }
    }
    again
}

#[test]
fn a_place_is_known_again_among_many() {
    let mut random = Random::new(1);
    let (_, ids) = blank_map(200);
    let places: Vec<Vec<Descriptor>> = (0..200)
        .map(|_| (0..200).map(|_| Descriptor(std::array::from_fn(|_| random.bits()))).collect())
        .collect();
    let mut database = PlaceDatabase::new(PlaceConfig::default());
    for (id, place) in ids.iter().zip(&places) {
        database.insert(*id, &frame_of(place.iter().copied()));
    }
    // A third of the corners are seen again, with an eighth of the bits changed; the rest is new.
    let (mut known, mut strangers) = (0, 0);
    for (id, place) in ids.iter().zip(&places).step_by(10) {
        let frame: Vec<Descriptor> = place
            .iter()
            .enumerate()
            .map(|(index, descriptor)| match index % 3 {
                0 => seen_again(descriptor, 0.125, &mut random),
                _ => Descriptor(std::array::from_fn(|_| random.bits())),
            })
            .collect();
        let scores = database.query(&frame);
        known += usize::from(scores[0].keyframe == *id && scores[0].votes >= 40);
        strangers += usize::from(scores.get(1).is_some_and(|second| second.votes > 2));
    }
    println!("{known} of 20 places known again, {strangers} strangers with more than two votes");
    assert_eq!((known, strangers), (20, 0));
    // A place that was never seen has no votes.
    let nowhere: Vec<Descriptor> =
        (0..200).map(|_| Descriptor(std::array::from_fn(|_| random.bits()))).collect();
    assert!(database.query(&nowhere).iter().all(|score| score.votes < 3));
}

#[test]
fn what_is_everywhere_says_nothing() {
    let mut random = Random::new(2);
    let (_, ids) = blank_map(20);
    let common: Vec<Descriptor> =
        (0..50).map(|_| Descriptor(std::array::from_fn(|_| random.bits()))).collect();
    let mut database = PlaceDatabase::new(PlaceConfig::default());
    let mut own = Vec::new();
    for id in &ids {
        let rare: [Descriptor; 5] =
            std::array::from_fn(|_| Descriptor(std::array::from_fn(|_| random.bits())));
        own.push(rare);
        database.insert(*id, &frame_of(common.iter().copied().chain(rare)));
    }
    let frame: Vec<Descriptor> = common.iter().copied().chain(own[7]).collect();
    let scores = database.query(&frame);
    assert_eq!((scores[0].keyframe, scores[0].votes), (ids[7], 55));
    assert!(scores[1].votes == 50 && scores[0].score > 5.0 * scores[1].score);
    // Of equal ones the newest.
    assert_eq!(scores[1].keyframe, ids[19]);
    // What is many times in one place says nothing of it either.
    let many = vec![common[0]; 30];
    database.remove(ids[19]);
    database.insert(ids[19], &frame_of(many.iter().copied()));
    let votes =
        |id| database.query(&many).iter().find(|score| score.keyframe == id).map(|s| s.votes);
    assert_eq!((votes(ids[19]), votes(ids[3])), (None, Some(1)));
    database.remove(ids[7]);
    assert_eq!(database.len(), 19);
    assert!(database.query(&frame).iter().all(|score| score.keyframe != ids[7]));
    for id in &ids {
        database.remove(*id);
    }
    assert!(database.is_empty() && database.query(&frame).is_empty());
}

#[test]
fn a_rebuilt_database_answers_as_one_that_never_held_the_removed_keyframes() {
    let mut random = Random::new(3);
    let (_, ids) = blank_map(12);
    let frames: Vec<Arc<Frame>> = (0..12)
        .map(|_| frame_of((0..30).map(|_| Descriptor(std::array::from_fn(|_| random.bits())))))
        .collect();
    let mut database = PlaceDatabase::new(PlaceConfig::default());
    let mut fresh = PlaceDatabase::new(PlaceConfig::default());
    for (id, frame) in ids.iter().zip(&frames) {
        database.insert(*id, frame);
    }
    // Every third one stays.
    for (index, id) in ids.iter().enumerate() {
        if index % 3 == 0 {
            fresh.insert(*id, &frames[index]);
        } else {
            database.remove(*id);
            // The features of a frame are held no longer than its keyframe.
            assert_eq!(Arc::strong_count(&frames[index]), 1);
        }
    }
    for frame in &frames {
        let looks: Vec<Descriptor> = frame
            .corners
            .iter()
            .map(|corner| seen_again(&corner.descriptor, 0.1, &mut random))
            .collect();
        assert_eq!(database.query(&looks), fresh.query(&looks));
    }
    let looks: Vec<Descriptor> = frames[3].corners.iter().map(|corner| corner.descriptor).collect();
    assert_eq!(database.query(&looks)[0].keyframe, ids[3]);
}

#[test]
fn a_keyframe_that_sees_the_beginning_again_is_a_candidate_for_a_loop() {
    // A wall that the camera passes, and passes again without knowing it.
    let world = World::wall(1500, 0, 40.0, 1.0, 3);
    let along = around(40, 0.5);
    let (mut map, mut ids) = world.map(&along, 4);
    let (other, _) = world.map(&along[..6], 5);
    for (_, keyframe) in other.keyframes().iter() {
        let new = crate::map::NewKeyframe {
            camera: *keyframe.camera(),
            camera_from_map: *keyframe.camera_from_map(),
            frame: std::sync::Arc::clone(keyframe.frame()),
            points: &[],
            lines: &[],
            by_odometry: None,
        };
        let id = map.insert_keyframe(new).unwrap();
        // Its points are new ones: nothing is shared with the beginning.
        for (corner, point) in keyframe.points().iter().enumerate() {
            let Some(point) = point.and_then(|point| other.points().get(point)) else { continue };
            map.insert_point(id, corner, point.position_m()).unwrap();
        }
        ids.push(id);
    }
    let mut database = PlaceDatabase::new(PlaceConfig::default());
    for id in &ids {
        database.insert(*id, map.keyframes().get(*id).unwrap().frame());
    }
    let config = CandidateConfig::default();
    let mut consistency = Consistency::default();
    let mut accepted = 0;
    for (step, id) in ids[40..].iter().enumerate() {
        let candidates = loop_candidates(&database, &map, *id, &config);
        // The other passes over the end look alike too, but they are not what the loop is closed with.
        let best = candidates.first().unwrap();
        let nearest = ids[..40].iter().position(|other| *other == best.keyframe);
        let own = ids[40..].iter().position(|other| *other == best.keyframe);
        assert!(nearest.is_some_and(|nearest| nearest < 12) || own.is_some(), "{step}: {best:?}");
        accepted += usize::from(!consistency.filter(&candidates, &map, &config).is_empty());
    }
    assert_eq!(accepted, 4);
    // In the middle of the first pass there is no loop.
    let database = {
        let mut first = PlaceDatabase::new(PlaceConfig::default());
        for id in &ids[..40] {
            first.insert(*id, map.keyframes().get(*id).unwrap().frame());
        }
        first
    };
    for id in &ids[..40] {
        let candidates = loop_candidates(&database, &map, *id, &config);
        assert!(candidates.is_empty(), "{candidates:?}");
    }
    // A lost camera is where it looks most alike.
    let frame = map.keyframes().get(ids[20]).unwrap().frame();
    let corners: Vec<Descriptor> = frame.corners.iter().map(|corner| corner.descriptor).collect();
    let found = lost_candidates(&database, &map, &corners, &config);
    assert_eq!(found[0].keyframe, ids[20]);
}
