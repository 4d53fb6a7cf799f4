use super::*;

/// An object whose centroid and ends are at `x_m`, from a platform at `platform_m`.
fn sighting(index: usize, x_m: f64, platform_m: f64) -> Sighting {
    let place_m = Point2::new(x_m, 0.0);
    Sighting {
        now_ms: 140 * index as u32,
        centroid_m: place_m,
        ends_m: [place_m; 2],
        sides: [Side::Open; 2],
        platform_m: Point2::new(platform_m, 0.0),
        error_m: 0.05,
        returns: 5,
        space: Space::Unknown,
    }
}

fn history(sightings: impl IntoIterator<Item = Sighting>) -> History {
    let mut sightings = sightings.into_iter();
    let mut history = History::new(sightings.next().unwrap());
    sightings.for_each(|sighting| history.push(sighting));
    history
}

/// Regression: behind a robot that drove away, successive parts of a far wall became visible and counted as one that travels.
#[test]
fn on_a_moving_platform_a_single_leap_is_not_travel() {
    let does_travel = |x_m: [f64; 6]| {
        let seen = x_m.into_iter().enumerate();
        travels(&history(seen.map(|(index, x_m)| sighting(index, x_m, 0.04 * index as f64))), true)
    };
    assert!(does_travel([2.0, 2.12, 2.24, 2.36, 2.48, 2.6]));
    assert!(!does_travel([2.0, 2.0, 2.0, 2.6, 2.6, 2.6]));
}

/// A nearer surface at one side uncovers another part of a static object as the platform moves.
#[test]
fn an_object_partly_hidden_by_background_travels_only_on_a_static_platform() {
    let does_travel = |platform_moves: bool, space: Space| {
        let seen = (0..6).map(|index| {
            let mut seen = sighting(index, 2.0 + 0.16 * index as f64, 0.0);
            seen.space = space;
            if index == 2 {
                seen.sides[1] = Side::BehindBackground;
            }
            seen
        });
        travels(&history(seen), platform_moves)
    };
    assert!(does_travel(false, Space::Unknown) && !does_travel(true, Space::Unknown));
    assert!(does_travel(true, Space::Free), "in free space nothing static is uncovered");
}

/// The centroid of an object that another one uncovers moves; its visible end does not.
#[test]
fn an_object_that_another_uncovers_does_not_travel() {
    let uncovered = |end_moves: bool| {
        let seen = (0..6).map(|index| {
            let mut seen = sighting(index, 2.0 + 0.16 * index as f64, 0.0);
            seen.sides[1] = Side::BehindOther;
            if !end_moves {
                seen.ends_m[0] = Point2::new(2.0, 0.0);
            }
            seen
        });
        travels(&history(seen), false)
    };
    assert!(uncovered(true) && !uncovered(false));
}

/// A robot that follows a person sees the same side all the time; one that passes a static object sees another side of it.
#[test]
fn the_motion_of_the_platform_counts_across_its_line_of_sight_alone() {
    let does_travel = |across: bool| {
        let seen = (0..7).map(|index| {
            let gone_m = 0.08 * index as f64;
            let mut seen = sighting(index, 2.0 + gone_m, gone_m);
            if across {
                seen.platform_m = Point2::new(0.0, gone_m);
            }
            seen
        });
        travels(&history(seen), true)
    };
    assert!(does_travel(false) && !does_travel(true));
}

/// Regression: far segments of changing visible width travelled by their errors.
#[test]
fn a_displacement_within_the_errors_is_not_travel() {
    let does_travel = |error_m: f64| {
        let seen = (0..7)
            .map(|index| Sighting { error_m, ..sighting(index, 9.0 + 0.08 * index as f64, 0.0) });
        travels(&history(seen), false)
    };
    assert!(does_travel(0.1) && !does_travel(0.3));
}

#[test]
fn background_does_not_travel() {
    let seen = (0..7).map(|index| Sighting {
        space: Space::Background,
        ..sighting(index, 2.0 + 0.1 * index as f64, 0.0)
    });
    assert!(!travels(&history(seen), false));
}
