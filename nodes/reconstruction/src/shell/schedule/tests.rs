use super::*;

const PERIODS: Periods =
    Periods { map: Duration::from_secs(10), updates: Duration::from_millis(500) };
const NOBODY: Subscribers = Subscribers { map: 0, updates: 0 };
const ONE: Subscribers = Subscribers { map: 1, updates: 0 };
const ONE_OF_EACH: Subscribers = Subscribers { map: 1, updates: 1 };

/// A schedule on a clock of milliseconds; whole maps that are due are published.
struct Clock {
    start: Instant,
    schedule: Schedule,
}

impl Clock {
    fn new() -> Self {
        Self { start: Instant::now(), schedule: Schedule::new(PERIODS) }
    }

    fn at(&self, milliseconds: u64) -> Instant {
        self.start + Duration::from_millis(milliseconds)
    }

    fn cloud(&mut self, milliseconds: u64) {
        self.schedule.cloud_added(self.at(milliseconds));
    }

    fn look(&mut self, milliseconds: u64, subscribers: Subscribers) -> Due {
        let due = self.schedule.look(self.at(milliseconds), subscribers);
        if due.map {
            self.schedule.map_tried(self.at(milliseconds), true);
        }
        due
    }

    /// The times at which maps are due while clouds come every 100 ms.
    fn maps_while_clouds_come(
        &mut self,
        times: std::ops::Range<u64>,
        subscribers: Subscribers,
    ) -> Vec<u64> {
        let mut maps = Vec::new();
        for time in times.step_by(100) {
            self.cloud(time);
            if self.look(time, subscribers).map {
                maps.push(time);
            }
        }
        maps
    }
}

#[test]
fn the_first_map_is_published_at_once_and_the_next_ones_by_the_period() {
    let mut clock = Clock::new();
    assert!(!clock.look(0, ONE).map, "there is no map yet");
    assert_eq!(clock.maps_while_clouds_come(100..25_000, ONE), [100, 10_100, 20_100]);
}

#[test]
fn when_the_input_pauses_the_map_is_published_once() {
    let mut clock = Clock::new();
    clock.maps_while_clouds_come(0..2_000, ONE);
    assert!(!clock.look(2_399, ONE).map);
    assert!(clock.look(2_400, ONE).map);
    assert!(!clock.look(60_000, ONE).map, "there is nothing new");
    clock.cloud(60_000);
    assert!(clock.look(60_000, ONE).map, "longer ago than the period");
}

#[test]
fn a_new_subscriber_gets_the_map_at_once() {
    let mut clock = Clock::new();
    assert_eq!(clock.maps_while_clouds_come(0..3_000, NOBODY), [] as [u64; 0]);
    assert!(clock.look(3_000, ONE).map);
    assert_eq!(clock.maps_while_clouds_come(3_100..5_000, ONE), [] as [u64; 0]);
    assert!(clock.look(5_000, Subscribers { map: 2, updates: 0 }).map);
    assert_eq!(clock.maps_while_clouds_come(5_100..7_000, ONE), [] as [u64; 0]);
    assert!(clock.look(7_000, ONE_OF_EACH).map, "updates have to start from a map");
    // The latched map is already that of the last cloud, but only those that ask for it are served by the history.
    assert!(clock.look(9_000, Subscribers { map: 3, updates: 1 }).map);
}

#[test]
fn subscribers_that_come_and_go_do_not_cause_too_many_maps() {
    let mut clock = Clock::new();
    let mut maps = 0;
    for time in (0..10_000_u64).step_by(50) {
        clock.cloud(time);
        let subscribers = if time % 100 == 0 { ONE } else { NOBODY };
        maps += usize::from(clock.look(time, subscribers).map);
    }
    assert!(maps <= 20, "{maps} maps in ten seconds");
}

/// Who came when the input had ended, and is not served by the history of the publisher, got no map.
#[test]
fn who_comes_after_the_last_cloud_gets_a_map_at_once() {
    let mut clock = Clock::new();
    assert_eq!(clock.maps_while_clouds_come(0..1_000, ONE), [0]);
    assert!(clock.look(1_500, ONE).map, "the input has paused");
    assert!(!clock.look(20_000, ONE).map, "nothing has changed");
    assert!(clock.look(20_050, Subscribers { map: 2, updates: 0 }).map);
    assert!(!clock.look(20_600, Subscribers { map: 2, updates: 0 }).map);
}

#[test]
fn updates_are_published_by_their_period_while_there_are_subscribers() {
    let mut clock = Clock::new();
    assert_eq!(clock.look(0, NOBODY), Due::default());
    let due = clock.look(50, ONE_OF_EACH);
    assert_eq!((due.following, due.update), (Some(Following::Starts), true));
    for (time, update) in [(100, false), (549, false), (550, true), (600, false), (1_050, true)] {
        let due = clock.look(time, ONE_OF_EACH);
        assert_eq!((due.following, due.update), (None, update), "{time}");
    }
    let due = clock.look(2_000, ONE);
    assert_eq!((due.following, due.update), (Some(Following::Ends), false));
}

#[test]
fn a_map_that_failed_is_tried_again_but_not_at_once() {
    let mut clock = Clock::new();
    clock.cloud(0);
    assert!(clock.schedule.look(clock.at(0), ONE).map);
    clock.schedule.map_tried(clock.at(0), false);
    assert!(!clock.schedule.look(clock.at(450), ONE).map);
    assert!(clock.schedule.look(clock.at(500), ONE).map);
}

#[test]
fn a_lost_update_is_corrected_by_a_map() {
    let mut clock = Clock::new();
    clock.maps_while_clouds_come(0..2_000, ONE_OF_EACH);
    clock.schedule.update_failed();
    assert_eq!(clock.maps_while_clouds_come(2_000..4_000, ONE_OF_EACH), [2_000]);
}

#[test]
fn after_a_removal_the_next_map_is_published_earlier_once() {
    let mut clock = Clock::new();
    clock.maps_while_clouds_come(0..1_000, ONE);
    clock.schedule.voxels_removed();
    assert_eq!(clock.maps_while_clouds_come(1_000..15_000, ONE), [2_500, 12_500]);
}

#[test]
fn a_replaced_map_is_published_at_once() {
    let mut clock = Clock::new();
    assert!(!clock.look(0, ONE).map);
    clock.schedule.map_replaced(clock.at(100));
    assert!(clock.look(100, ONE).map);
    assert!(!clock.look(5_000, ONE).map);
}
