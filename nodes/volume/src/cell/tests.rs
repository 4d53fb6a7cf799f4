use super::*;

fn after(steps: &[(bool, u32)]) -> Cell {
    let mut cell = Cell::default();
    let mut now = 0;
    for &(is_hit, cycles) in steps {
        for _ in 0..cycles {
            now += 1;
            if is_hit { cell.hit(now) } else { cell.pass(now) }
        }
    }
    cell
}

#[test]
fn it_is_what_it_was_seen_to_be_three_times() {
    for (steps, state) in [
        (&[(false, 2)][..], CellState::Unknown),
        (&[(false, 3)], CellState::Free),
        (&[(true, 2)], CellState::Unknown),
        (&[(true, 3)], CellState::Occupied),
        (&[(false, 30), (true, 2)], CellState::Free),
        (&[(false, 30), (true, 3)], CellState::Unknown),
        (&[(true, 4), (false, 20)], CellState::Occupied),
    ] {
        assert_eq!(after(steps).state(), state, "{steps:?}");
    }
}

/// Without hits nothing faded, and the sum of the runs overflowed.
#[test]
fn cells_without_hits_may_be_joined_any_number_of_times() {
    let mut cell = after(&[(true, 1), (false, 400)]);
    assert_eq!((cell.hits(), cell.runs), (0, 1));
    for now in 1000..1020 {
        cell = cell.joined(cell);
        assert_eq!(cell.state(), CellState::Free);
        let mut hit = cell;
        hit.hit(now);
        assert_eq!(hit.state(), CellState::Free);
    }
}

#[test]
fn it_knows_since_when() {
    let cell = after(&[(false, 20), (true, 1), (false, 5)]);
    assert_eq!((cell.state(), cell.last_hit()), (CellState::Free, 21));
    let cell = after(&[(false, 5), (true, 100)]);
    assert_eq!(
        (cell.state(), cell.occupied_since(), cell.last_hit()),
        (CellState::Occupied, 6, 105)
    );
}

#[test]
fn it_counts_once_a_cycle_and_a_hit_outweighs_the_passes() {
    let mut cell = Cell::default();
    for now in 1..=10 {
        cell.hit(now);
        cell.hit(now);
        cell.pass(now);
    }
    assert_eq!((cell.hits(), cell.passes()), (10, 0));
    cell.pass(11);
    cell.pass(11);
    assert_eq!((cell.hits(), cell.passes()), (10, 1));
}

#[test]
fn what_moves_has_been_there_since_the_last_pass() {
    let mut cell = after(&[(false, 4), (true, 1)]);
    for now in (10..30).chain(50..60) {
        assert_eq!(cell.hold_moving(now), 10);
    }
    assert_eq!((cell.hits(), cell.passes()), (1, 4));
    cell.pass(59);
    assert_eq!(cell.passes(), 4, "something is there in this cycle");
    cell.pass(60);
    assert_eq!(cell.hold_moving(61), 61);
    assert_eq!((cell.hits(), cell.passes()), (1, 5));
}

#[test]
fn what_was_left_is_so_until_a_pass_and_what_has_stopped_until_it_is_gone() {
    let mut cell = after(&[(false, 4)]);
    cell.leave();
    assert!(!cell.is_left(), "nothing is here");
    for now in 5..8 {
        cell.hold_moving(now);
        cell.leave();
        assert_eq!((cell.hold_moving(now), cell.is_left()), (5, true));
    }
    cell.take_for_occupied(5, 8);
    assert_eq!((cell.is_left(), cell.has_stopped()), (false, true));
    cell.hit(9);
    assert!(cell.has_stopped());
    cell.pass(10);
    assert!(cell.has_stopped(), "a single pass may be an error");
    (11..300).for_each(|now| cell.pass(now));
    assert!(!cell.has_stopped());
}

#[test]
fn a_thing_that_comes_and_goes_is_told_from_errors_of_single_cycles() {
    let thing = after(&[(false, 8), (true, 6), (false, 4), (true, 3)]);
    assert!(thing.comes_and_goes());
    let put_down = after(&[(false, 60), (true, 30)]);
    assert!(!put_down.comes_and_goes());
    for share in [0.1, 0.3, 0.5, 0.7, 0.9] {
        let mut random = estimation::Random::new(1);
        let mut cell = Cell::default();
        let wrong = (1..2000).filter(|&now| {
            if random.uniform() < share {
                cell.hit(now)
            } else {
                cell.pass(now)
            }
            cell.comes_and_goes()
        });
        let wrong = wrong.count();
        assert!(wrong < 20, "{wrong} of 2000 with a share of {share}");
    }
}

#[test]
fn a_cell_that_holds_what_moves_is_not_merged_with_its_neighbours() {
    let mut cell = after(&[(false, 100)]);
    assert!(cell.is_free_for_long());
    cell.hold_moving(101);
    assert!(!cell.is_free_for_long());
    cell.pass(102);
    assert!(cell.is_free_for_long());
}

#[test]
fn what_was_not_renewed_is_forgotten() {
    let mut cell = after(&[(false, 4)]);
    cell.forget_after(100, 104);
    assert_eq!(cell.passes(), 4);
    cell.forget_after(100, 105);
    assert_eq!(cell, Cell::default());
}

#[test]
fn it_changes_its_state_in_time_however_long_it_had_it() {
    for is_hit in [false, true] {
        let (from, to) = if is_hit {
            (CellState::Occupied, CellState::Free)
        } else {
            (CellState::Free, CellState::Occupied)
        };
        let mut cell = after(&[(is_hit, 10_000)]);
        assert_eq!(cell.state(), from);
        let cycles = (10_001..10_400).find(|now| {
            if is_hit {
                cell.pass(*now)
            } else {
                cell.hit(*now)
            }
            cell.state() == to
        });
        assert!(cycles.is_some_and(|now| now < 10_180), "{cycles:?}");
    }
}

#[test]
fn it_may_be_told_what_it_is() {
    let mut cell = after(&[(true, 40)]);
    cell.take_for_free();
    assert_eq!(cell.state(), CellState::Free);
    cell.take_for_occupied(20, 60);
    assert_eq!(
        (cell.state(), cell.occupied_since(), cell.last_hit()),
        (CellState::Occupied, 20, 60)
    );
}
