use proptest::prelude::*;

use super::*;

fn ms(count: u64) -> Duration {
    Duration::from_millis(count)
}

fn at_ms(count: i64) -> Stamp {
    Stamp::from_nanos(1_000_000_000_000 + count * 1_000_000)
}

fn on_time() -> Decision {
    Decision::Publish { late: Duration::ZERO }
}

/// Plays messages with a clock that moves only by the waits; returns when each was published.
fn play(schedule: &mut Schedule, start: Duration, stamps: &[Stamp]) -> Vec<Duration> {
    let mut now = start;
    let mut published = Vec::new();
    for stamp in stamps {
        loop {
            match schedule.decide(now, Some(*stamp)) {
                Decision::Publish { .. } => {
                    published.push(now);
                    break;
                }
                Decision::Wait(wait) => now += wait,
                other => panic!("{other:?} while playing"),
            }
        }
    }
    published
}

#[test]
fn messages_keep_their_distances_at_the_rate() -> Result<(), RateError> {
    let stamps = [at_ms(0), at_ms(100), at_ms(100), at_ms(400)];
    let published = play(&mut Schedule::new(2.0, false)?, ms(7), &stamps);
    assert_eq!(published, [ms(7), ms(57), ms(57), ms(207)]);
    Ok(())
}

#[test]
fn a_late_message_does_not_delay_the_next() -> Result<(), RateError> {
    let mut schedule = Schedule::new(1.0, false)?;
    assert_eq!(schedule.decide(ms(0), Some(at_ms(0))), on_time());
    assert_eq!(schedule.decide(ms(130), Some(at_ms(100))), Decision::Publish { late: ms(30) });
    assert_eq!(schedule.decide(ms(130), Some(at_ms(200))), Decision::Wait(ms(70)));
    Ok(())
}

#[test]
fn what_is_held_back_shifts_what_follows_and_never_sets_the_time_back() -> Result<(), RateError> {
    let mut schedule = Schedule::new(0.5, false)?;
    assert_eq!(schedule.decide(ms(0), Some(at_ms(0))), on_time());
    assert_eq!(schedule.bag_time(ms(220)), Some(at_ms(110)));
    schedule.stand(ms(1000));
    assert_eq!(schedule.bag_time(ms(1220)), Some(at_ms(110)));
    assert_eq!(schedule.decide(ms(1220), Some(at_ms(100))), Decision::Publish { late: ms(20) });
    assert_eq!(schedule.decide(ms(1220), Some(at_ms(200))), Decision::Wait(ms(180)));
    schedule.pause(ms(1220));
    schedule.stand(ms(500));
    assert_eq!(schedule.bag_time(ms(2000)), Some(at_ms(110)));
    Ok(())
}

#[test]
fn a_pause_shifts_what_follows() -> Result<(), RateError> {
    let mut schedule = Schedule::new(1.0, false)?;
    assert_eq!(schedule.decide(ms(0), Some(at_ms(0))), on_time());
    schedule.pause(ms(40));
    assert!(schedule.is_paused());
    assert_eq!(schedule.decide(ms(5000), Some(at_ms(100))), Decision::Paused);
    assert_eq!(schedule.bag_time(ms(5000)), Some(at_ms(40)));
    schedule.resume(ms(5000));
    assert_eq!(schedule.decide(ms(5000), Some(at_ms(100))), Decision::Wait(ms(60)));
    assert_eq!(schedule.decide(ms(5060), Some(at_ms(100))), on_time());
    Ok(())
}

#[test]
fn a_step_publishes_one_message_and_stays_paused() -> Result<(), RateError> {
    let mut schedule = Schedule::new(1.0, false)?;
    assert_eq!(schedule.decide(ms(0), Some(at_ms(0))), on_time());
    schedule.step();
    assert_eq!(schedule.decide(ms(1), Some(at_ms(100))), Decision::Wait(ms(99)), "not paused");
    schedule.pause(ms(10));
    schedule.step();
    assert_eq!(schedule.decide(ms(10), Some(at_ms(100))), on_time());
    assert_eq!(schedule.decide(ms(10), Some(at_ms(200))), Decision::Paused);
    assert_eq!(schedule.bag_time(ms(99)), Some(at_ms(100)), "the time of the message stepped to");
    schedule.resume(ms(50));
    assert_eq!(schedule.decide(ms(50), Some(at_ms(200))), Decision::Wait(ms(100)));
    Ok(())
}

#[test]
fn a_step_to_an_overdue_message_does_not_set_the_time_back() -> Result<(), RateError> {
    let mut schedule = Schedule::new(1.0, false)?;
    assert_eq!(schedule.decide(ms(0), Some(at_ms(0))), on_time());
    schedule.pause(ms(40));
    schedule.step();
    assert_eq!(schedule.decide(ms(40), Some(at_ms(30))), on_time());
    assert_eq!(schedule.bag_time(ms(40)), Some(at_ms(40)));
    Ok(())
}

#[test]
fn paused_before_the_first_message_it_waits_for_a_step() -> Result<(), RateError> {
    let mut schedule = Schedule::new(1.0, false)?;
    schedule.pause(ms(0));
    assert_eq!(schedule.decide(ms(3), Some(at_ms(0))), Decision::Paused);
    assert_eq!(schedule.bag_time(ms(3)), None);
    schedule.step();
    assert_eq!(schedule.decide(ms(4), Some(at_ms(0))), on_time());
    assert_eq!(schedule.decide(ms(4), Some(at_ms(1))), Decision::Paused);
    Ok(())
}

#[test]
fn a_loop_rewinds_and_keeps_its_distances() -> Result<(), RateError> {
    let mut schedule = Schedule::new(1.0, true)?;
    assert_eq!(play(&mut schedule, ms(0), &[at_ms(0), at_ms(50)]), [ms(0), ms(50)]);
    assert_eq!(schedule.decide(ms(50), None), Decision::Rewind);
    assert_eq!(play(&mut schedule, ms(50), &[at_ms(0), at_ms(50)]), [ms(50), ms(100)]);
    Ok(())
}

#[test]
fn a_loop_over_nothing_ends() -> Result<(), RateError> {
    assert_eq!(Schedule::new(1.0, true)?.decide(ms(0), None), Decision::Finished);
    Ok(())
}

#[test]
fn rates_that_are_no_rates_are_refused() {
    for rate in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(Schedule::new(rate, false).is_err(), "{rate}");
    }
}

proptest! {
    /// Whatever the distances and the rate: all are published in order, none early, and none more
    /// than a rounding late.
    #[test]
    fn nothing_is_early(
        gaps_ns in proptest::collection::vec(0_i64..5_000_000_000, 1..40),
        rate in 0.01_f64..100.0,
    ) {
        let mut nanos = 0;
        let mut stamps = vec![Stamp::from_nanos(0)];
        for gap in gaps_ns {
            nanos += gap;
            stamps.push(Stamp::from_nanos(nanos));
        }
        let mut schedule = Schedule::new(rate, false).unwrap();
        let published = play(&mut schedule, ms(1), &stamps);
        for (stamp, published) in stamps.iter().zip(&published) {
            let due_s = 1e-3 + stamp.as_nanos() as f64 * 1e-9 / rate;
            let off_s = published.as_secs_f64() - due_s;
            prop_assert!(off_s > -1e-6 && off_s < 1e-6, "off by {off_s} s");
        }
    }

    /// Any order of keys and calls: no panic, and the time of the bag never runs backwards
    /// within a pass.
    #[test]
    fn the_time_of_the_bag_never_runs_backwards(
        keys in proptest::collection::vec((0_u8..4, 0_u64..200), 0..60),
    ) {
        let mut schedule = Schedule::new(1.5, false).unwrap();
        let mut now = ms(0);
        let mut next = 0;
        let mut latest = None;
        for (key, pass_ms) in keys {
            now += ms(pass_ms);
            match key {
                0 => schedule.pause(now),
                1 => schedule.resume(now),
                2 => schedule.step(),
                _ => {}
            }
            if matches!(schedule.decide(now, Some(at_ms(next))), Decision::Publish { .. }) {
                next += 30;
            }
            let time = schedule.bag_time(now);
            prop_assert!(time >= latest, "{time:?} after {latest:?}");
            latest = time;
        }
    }
}
