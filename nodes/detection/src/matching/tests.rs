use geometry::{PoseLookupError, UnusablePose};
use nalgebra::Isometry3;
use proptest::prelude::*;

use super::*;

type Event = MatchEvent<&'static str, u32>;

fn at(milliseconds: i64) -> Stamp {
    Stamp::from_nanos(milliseconds * 1_000_000)
}

fn pose(milliseconds: i64, x_m: f64) -> StampedPose {
    StampedPose {
        stamp: at(milliseconds),
        frame_id: "map".to_owned(),
        map_from_rig: Isometry3::translation(x_m, 0.0, 0.0),
    }
}

fn matcher() -> Matcher<&'static str, u32> {
    Matcher::new(&DetectionConfig { max_cloud_offset_s: 0.05, ..DetectionConfig::default() })
}

#[track_caller]
fn matched(events: Vec<Event>) -> Matched<&'static str, u32> {
    match <[Event; 1]>::try_from(events) {
        Ok([MatchEvent::Matched(matched)]) => matched,
        other => panic!("one match expected, not {other:?}"),
    }
}

#[track_caller]
fn dropped(events: Vec<Event>) -> Dropped {
    match <[Event; 1]>::try_from(events) {
        Ok([MatchEvent::Dropped(dropped)]) => dropped,
        other => panic!("one drop expected, not {other:?}"),
    }
}

#[test]
fn the_nearest_cloud_and_the_pose_at_its_stamp() {
    let mut matcher = matcher();
    assert_eq!(matcher.push_pose(pose(0, 0.0)), []);
    assert_eq!(matcher.push_cloud(at(70), 70), []);
    assert_eq!(matcher.push_scan(at(100), "scan"), []);
    // 110 is nearer than 70; only now is that known. The pose at 110 is not.
    assert_eq!(matcher.push_cloud(at(110), 110), []);
    assert_eq!(matcher.push_pose(pose(105, 1.05)), []);
    let matched = matched(matcher.push_pose(pose(125, 1.25)));
    assert_eq!((matched.scan, matched.scan_stamp), ("scan", at(100)));
    assert_eq!((matched.cloud, matched.cloud_stamp), (110, at(110)));
    let pose = matched.pose.unwrap();
    assert_eq!(pose.stamp, at(110));
    assert!((pose.map_from_rig.translation.x - 1.10).abs() < 1e-9);
    assert_eq!(matcher.waiting_scans(), 0);
}

#[test]
fn a_matcher_without_poses_leaves_them_to_its_caller() {
    let mut matcher = Matcher::without_poses(&DetectionConfig::default());
    assert_eq!(matcher.push_cloud(at(70), 70), []);
    assert_eq!(matcher.push_scan(at(100), "scan"), []);
    let matched = matched(matcher.push_cloud(at(110), 110));
    assert_eq!((matched.scan, matched.cloud, matched.pose), ("scan", 110, None));
    // A pose that comes all the same decides nothing.
    assert_eq!(matcher.push_scan(at(200), "next"), []);
    assert_eq!(matcher.push_pose(pose(300, 0.0)), []);
}

#[test]
fn of_two_equally_near_clouds_the_earlier() {
    let mut matcher = matcher();
    matcher.push_cloud(at(90), 90);
    matcher.push_cloud(at(110), 110);
    matcher.push_pose(pose(0, 0.0));
    matcher.push_pose(pose(200, 0.0));
    assert_eq!(matched(matcher.push_scan(at(100), "scan")).cloud, 90);
}

#[test]
fn a_cloud_may_serve_two_scans() {
    let mut matcher = matcher();
    matcher.push_pose(pose(0, 0.0));
    matcher.push_scan(at(90), "first");
    matcher.push_scan(at(110), "second");
    matcher.push_cloud(at(100), 100);
    assert_eq!(matched(matcher.push_pose(pose(100, 0.0))).scan, "first");
    // The second waits for what could be nearer.
    let second = matched(matcher.push_cloud(at(140), 140));
    assert_eq!((second.scan, second.cloud), ("second", 100));
}

#[test]
fn no_cloud_near_is_known_at_once() {
    let mut matcher = matcher();
    matcher.push_cloud(at(40), 40);
    matcher.push_scan(at(100), "scan");
    let dropped = dropped(matcher.push_cloud(at(151), 151));
    assert_eq!((dropped.stamp, dropped.missing), (at(100), vec![Input::Cloud]));
    assert_eq!(dropped.cause, DropCause::NoCloudNear { offset_s: 0.051 });
}

#[test]
fn a_pose_that_came_too_late_to_the_recording() {
    let mut matcher = matcher();
    matcher.push_cloud(at(100), 100);
    matcher.push_scan(at(100), "scan");
    let dropped = dropped(matcher.push_pose(pose(120, 0.0)));
    assert_eq!(dropped.missing, [Input::Pose]);
    assert_eq!(dropped.cause, DropCause::NoPose(PoseLookupError::BeforeOldest { by_s: 0.02 }));
}

#[test]
fn a_gap_between_the_poses_is_not_interpolated() {
    let mut matcher = matcher();
    matcher.push_pose(pose(0, 0.0));
    matcher.push_cloud(at(500), 500);
    matcher.push_scan(at(500), "scan");
    let dropped = dropped(matcher.push_pose(pose(801, 0.0)));
    assert_eq!(dropped.missing, [Input::Pose]);
    assert_eq!(
        dropped.cause,
        DropCause::NoPose(PoseLookupError::Gap { gap_s: 0.801, max_gap_s: 0.7 })
    );
}

#[test]
fn an_invalid_pose_is_refused_and_the_scan_still_waits() {
    let mut matcher = matcher();
    matcher.push_pose(pose(90, 0.0));
    matcher.push_cloud(at(100), 100);
    matcher.push_scan(at(100), "scan");
    let events = matcher.push_pose(pose(105, f64::NAN));
    assert_eq!(
        events,
        [MatchEvent::PoseRefused(PosePushError::Unusable {
            stamp: at(105),
            source: UnusablePose::NotFinite
        })]
    );
    assert_eq!(matched(matcher.push_pose(pose(110, 0.0))).scan, "scan");
}

#[test]
fn another_frame_of_the_poses_is_reported_and_used() {
    let mut matcher = matcher();
    matcher.push_pose(pose(0, 0.0));
    let other =
        |milliseconds| StampedPose { frame_id: "odom".to_owned(), ..pose(milliseconds, 0.0) };
    let expected = MatchEvent::PoseFrameChanged { from: "map".to_owned(), to: "odom".to_owned() };
    assert_eq!(matcher.push_pose(other(90)), [expected]);
    assert_eq!(matcher.push_pose(other(120)), []);
    matcher.push_cloud(at(100), 100);
    assert_eq!(matched(matcher.push_scan(at(100), "scan")).pose.unwrap().frame_id, "odom");
}

#[test]
fn waiting_is_bounded_in_time_and_names_what_was_missing() {
    let mut matcher = matcher();
    matcher.push_scan(at(100), "scan");
    assert_eq!(matcher.push_pose(pose(600, 0.0)), []);
    // The message that shows that the time is up comes too late, be it the missing one.
    let dropped = dropped(matcher.push_cloud(at(601), 601));
    assert_eq!(dropped.missing, [Input::Cloud]);
    assert_eq!(dropped.cause, DropCause::WaitedTooLong { waited_s: 0.501 });

    let mut matcher = self::matcher();
    matcher.push_scan(at(100), "scan");
    matcher.push_cloud(at(120), 120);
    matcher.push_pose(pose(90, 0.0));
    assert_eq!(self::dropped(matcher.push_scan(at(700), "next")).missing, [Input::Pose]);
    assert_eq!(matcher.waiting_scans(), 1);

    let mut matcher = self::matcher();
    matcher.push_scan(at(100), "scan");
    let both = self::dropped(matcher.push_scan(at(700), "next"));
    assert_eq!(both.missing, [Input::Cloud, Input::Pose]);
    assert_eq!(both.to_string(), "missing cloud and pose: it waited 0.600 s");
}

#[test]
fn a_late_scan_is_dropped() {
    let mut matcher = matcher();
    matcher.push_pose(pose(0, 0.0));
    matcher.push_cloud(at(100), 100);
    matcher.push_pose(pose(700, 0.0));
    let dropped = dropped(matcher.push_scan(at(100), "scan"));
    assert_eq!(dropped.missing, [Input::Scan]);
    assert_eq!(dropped.cause, DropCause::CameLate { late_s: 0.6 });
    // Of the stamps, not of the time on the way.
    let said = dropped.to_string();
    assert!(
        said.starts_with("scan is behind the other inputs: its stamp is 0.600 s before"),
        "{said}"
    );
}

#[test]
fn waiting_is_bounded_in_number() {
    let config = DetectionConfig {
        max_waiting_scans: 2,
        max_waiting_clouds: 3,
        ..DetectionConfig::default()
    };
    let mut matcher: Matcher<u32, u32> = Matcher::new(&config);
    assert_eq!(matcher.push_scan(at(1), 1), []);
    assert_eq!(matcher.push_scan(at(2), 2), []);
    let events = matcher.push_scan(at(3), 3);
    let [MatchEvent::Dropped(dropped)] = &*events else { panic!("{events:?}") };
    assert_eq!((dropped.stamp, dropped.cause), (at(1), DropCause::TooManyWaiting { waiting: 3 }));
    for millisecond in 3..10 {
        matcher.push_cloud(at(millisecond), 0);
    }
    assert_eq!((matcher.waiting_scans(), matcher.waiting_clouds()), (2, 3));
}

#[test]
fn clouds_that_no_scan_can_match_are_dropped() {
    let mut matcher = matcher();
    for millisecond in (0..10_000).step_by(33) {
        matcher.push_cloud(at(millisecond), 0);
    }
    // Those of the last 0.55 s are kept for scans that may still come.
    assert_eq!(matcher.waiting_clouds(), 17);
}

/// Regression: with images at 90 Hz and poses that come 0.45 s late the images of waiting scans were dropped for newer ones, and
/// the scans matched with images of other moments, or not at all.
#[test]
fn a_fast_camera_keeps_the_images_of_scans_that_wait_for_late_poses() {
    let mut matcher = matcher();
    let mut matched = Vec::new();
    let mut take = |events: Vec<Event>| {
        for event in events {
            let MatchEvent::Matched(one) = event else { panic!("{event:?}") };
            matched.push(one.cloud_stamp.seconds_since(one.scan_stamp).abs());
        }
    };
    let mut most = 0;
    for millisecond in 1..10_000 {
        if millisecond % 11 == 0 {
            take(matcher.push_cloud(at(millisecond), 0));
        }
        if millisecond % 100 == 50 {
            take(matcher.push_scan(at(millisecond), "scan"));
        }
        if millisecond % 20 == 10 && millisecond > 450 {
            take(matcher.push_pose(pose(millisecond - 450, 0.0)));
        }
        most = most.max(matcher.waiting_clouds());
    }
    assert!(matched.len() > 90, "{}", matched.len());
    assert!(matched.iter().all(|offset_s| *offset_s <= 0.006), "{matched:?}");
    // One for each of the five scans that wait, and those that the next one may take.
    assert!(most <= 26, "{most}");
}

#[test]
fn the_end_of_the_input_drops_waiting_scans() {
    let mut matcher = matcher();
    matcher.push_pose(pose(0, 0.0));
    matcher.push_scan(at(100), "first");
    matcher.push_scan(at(200), "second");
    matcher.push_cloud(at(110), 110);
    let events = matcher.flush();
    let expected: Vec<_> = events
        .iter()
        .map(|event| match event {
            MatchEvent::Dropped(dropped) => (dropped.stamp, dropped.cause, dropped.missing.clone()),
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(
        expected,
        [
            (at(100), DropCause::EndOfInput, vec![Input::Pose]),
            (at(200), DropCause::EndOfInput, vec![Input::Cloud, Input::Pose]),
        ]
    );
    assert_eq!((matcher.waiting_scans(), matcher.waiting_clouds()), (0, 0));
    // After the reset an earlier stamp is not out of order.
    assert_eq!(matcher.push_scan(at(50), "again"), []);
}

#[test]
fn a_message_out_of_order_is_ignored() {
    let mut matcher = matcher();
    matcher.push_scan(at(100), "first");
    for stamp in [at(100), at(60)] {
        let events = matcher.push_scan(stamp, "second");
        assert_eq!(events, [MatchEvent::Ignored { input: Input::Scan, stamp, latest: at(100) }]);
    }
    assert_eq!(matcher.waiting_scans(), 1);
}

#[test]
fn a_jump_of_the_clock_resets_the_matcher() {
    let mut matcher = matcher();
    matcher.push_pose(pose(9_000, 0.0));
    matcher.push_cloud(at(9_990), 9_990);
    matcher.push_scan(at(10_000), "last");
    let events = matcher.push_scan(at(100), "first");
    let [MatchEvent::Dropped(dropped), MatchEvent::ClockJumpedBack { input, from, to }] = &*events
    else {
        panic!("{events:?}")
    };
    assert_eq!((dropped.stamp, dropped.cause), (at(10_000), DropCause::ClockJumpedBack));
    assert_eq!((*input, *from, *to), (Input::Scan, at(10_000), at(100)));
    // No message of the time before is left to match.
    matcher.push_pose(pose(90, 0.0));
    matcher.push_cloud(at(110), 110);
    let first = matched(matcher.push_pose(pose(120, 0.0)));
    assert_eq!((first.scan, first.cloud), ("first", 110));
}

/// A message by its input and stamp.
type Message = (Input, i64);

/// Streams of the three inputs with jittered periods, and two orders of arrival: each message with a
/// delay of its own, in the order of the stamps within its input. No delay is longer than a scan waits:
/// the messages that a scan needs are stamped at most 0.16 s after it.
fn two_arrivals() -> impl Strategy<Value = (Vec<Message>, Vec<Message>)> {
    let stream = |input: Input, period_ms: i64| {
        prop::collection::vec((0..period_ms, 0i64..300, 0i64..300), 20..60).prop_map(
            move |jitters| {
                let stamps = jitters.iter().enumerate();
                stamps
                    .map(|(index, (jitter, first, second))| {
                        (input, index as i64 * period_ms + jitter + 1, *first, *second)
                    })
                    .collect::<Vec<_>>()
            },
        )
    };
    (stream(Input::Scan, 140), stream(Input::Cloud, 50), stream(Input::Pose, 30)).prop_map(
        |(scans, clouds, poses)| {
            let arrivals = |delay: fn(&(Input, i64, i64, i64)) -> i64| {
                let mut arrivals: Vec<(i64, Message)> = Vec::new();
                for stream in [&scans, &clouds, &poses] {
                    let mut latest = 0;
                    for message in stream {
                        latest = latest.max(message.1 + delay(message));
                        arrivals.push((latest, (message.0, message.1)));
                    }
                }
                // Stable: within an input the order stays.
                arrivals.sort_by_key(|(arrival, _)| *arrival);
                arrivals.into_iter().map(|(_, message)| message).collect::<Vec<_>>()
            };
            (arrivals(|message| message.2), arrivals(|message| message.3))
        },
    )
}

/// The outcome of each scan, in order.
fn outcomes(messages: &[Message]) -> Vec<(Stamp, Option<(i64, f64)>)> {
    let mut matcher: Matcher<(), i64> = Matcher::new(&DetectionConfig::default());
    let mut events = Vec::new();
    for &(input, milliseconds) in messages {
        events.extend(match input {
            Input::Scan => matcher.push_scan(at(milliseconds), ()),
            Input::Cloud => matcher.push_cloud(at(milliseconds), milliseconds),
            Input::Pose => {
                // Not linear in time, so that another pair of poses would give another one.
                let x_m = (milliseconds * milliseconds) as f64 * 1e-4;
                matcher.push_pose(pose(milliseconds, x_m))
            }
        });
    }
    events.extend(matcher.flush());
    events
        .into_iter()
        .map(|event| match event {
            MatchEvent::Matched(matched) => {
                let x_m = matched.pose.as_ref().unwrap().map_from_rig.translation.x;
                (matched.scan_stamp, Some((matched.cloud, x_m)))
            }
            MatchEvent::Dropped(dropped) => {
                assert!(!dropped.missing.is_empty(), "{dropped:?}");
                (dropped.stamp, None)
            }
            other => panic!("{other:?}"),
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn the_cycles_do_not_depend_on_how_the_inputs_interleave((one, other) in two_arrivals()) {
        let one = outcomes(&one);
        prop_assert!(one.windows(2).all(|pair| pair[0].0 < pair[1].0));
        prop_assert!(one.iter().any(|(_, matched)| matched.is_some()));
        prop_assert_eq!(one, outcomes(&other));
    }
}

/// A jump that the stamps have shown already does not reset the matcher a second time.
#[test]
fn a_clock_that_is_set_back_drops_scans_of_the_time_after_it() {
    let mut matcher = matcher();
    assert_eq!(matcher.set_back(at(0)), None, "there is nothing");
    let _ = matcher.push_scan(at(10_000), "scan");
    let _ = matcher.push_cloud(at(10_010), 1);
    assert_eq!(matcher.set_back(at(9_800)), None, "it may still be on its way");
    assert_eq!((matcher.waiting_scans(), matcher.waiting_clouds()), (1, 1));
    let dropped = dropped(matcher.set_back(at(100)).unwrap());
    assert_eq!((dropped.stamp, dropped.cause), (at(10_000), DropCause::ClockJumpedBack));
    assert_eq!((matcher.waiting_scans(), matcher.waiting_clouds()), (0, 0));
    let _ = matcher.push_scan(at(120), "scan of the next pass");
    assert_eq!(matcher.set_back(at(110)), None);
    assert_eq!(matcher.waiting_scans(), 1);
}
