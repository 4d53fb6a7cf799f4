//! A fixed budget of each target, and what the budget finds.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;

/// The seed of the gate; `.ci/explore fuzz` draws others.
const SEED: u64 = 26;

/// What takes the process down names no case: `cargo run -p stillmap-fuzz -- --seed 26 --cases 20000` does.
#[test]
fn no_reader_panics_or_takes_more_memory_than_its_input_warrants() {
    let targets = targets();
    let next = AtomicUsize::new(0);
    let failures = || {
        let mut failures = Vec::new();
        while let Some(target) = targets.get(next.fetch_add(1, Ordering::Relaxed)) {
            let mutator = Mutator::new(SEED, (target.seeds)(), target.words);
            failures.extend((0..target.gate_cases).find_map(|case| {
                let failed = run(target, &mutator.input(case)).err()?;
                Some(format!(
                    "{}: {failed}; again: cargo run -p stillmap-fuzz -- {0} --seed {SEED} --case {case}",
                    target.name
                ))
            }));
        }
        failures
    };
    let failures: Vec<String> = std::thread::scope(|scope| {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(failures)).collect();
        threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
    });
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_case_is_the_same_whenever_it_is_asked_for() {
    let mutator = |seed| Mutator::new(seed, vec![b"size 12 of the map".to_vec()], &[b"word"]);
    let inputs: Vec<Vec<u8>> = (0..500).map(|case| mutator(1).input(case)).collect();
    assert_eq!(inputs[0], b"size 12 of the map");
    assert!((0..500).rev().all(|case| mutator(1).input(case) == inputs[case as usize]));
    assert!(
        (1..500).filter(|case| mutator(2).input(*case) != inputs[*case as usize]).count() > 450
    );
    assert!(inputs.iter().all(|input| input.len() <= MOST_BYTES));
}

const fn target(body: fn(&[u8])) -> Target {
    let memory = MemoryBound { base_bytes: 1000, per_byte: 10 };
    Target { name: "planted", body, seeds: Vec::new, words: &[], memory, gate_cases: 1 }
}

#[test]
fn a_planted_panic_is_found() {
    let failed = run(&target(|input| assert!(input.len() < 3, "too long")), b"abc");
    assert_eq!(failed, Err(Failed::Panicked("too long".to_owned())));
}

#[test]
fn planted_memory_is_found_and_what_is_given_back_is_not_counted() {
    let claims = |input: &[u8]| drop(vec![0_u8; 100 * input.len()]);
    assert_eq!(run(&target(claims), &[0; 10]), Ok(()));
    let failed = run(&target(claims), &[0; 100]);
    assert_eq!(
        failed,
        Err(Failed::HeldTooMuch { held: 10_000, input_bytes: 100, warranted: 2000 })
    );
    let often = |input: &[u8]| input.iter().for_each(|_| drop(vec![0_u8; 900]));
    assert_eq!(run(&target(often), &[0; 100]), Ok(()));
}
