//! The cases of one target, in this process.

use std::io::Write;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rustix::time::{ClockId, Timespec, clock_gettime};
use stillmap_fuzz::{Mutator, Target, run};

use crate::Arguments;

/// No input of 64 KiB warrants more of a processor's time: what takes longer grows faster than its input.
const LONGEST: Duration = Duration::from_secs(5);
/// A case that has not ended after so much of it never will.
const ENDLESS: Duration = Duration::from_secs(60);
/// How often the clock is looked at.
const CASES_AT_A_TIME: u64 = 64;

/// What begins the line with how many cases there were.
pub(crate) const RAN: &str = "ran ";

pub(crate) fn work(target: &Target, arguments: &Arguments, seconds: f64) -> ExitCode {
    let mutator = Mutator::new(arguments.seed, (target.seeds)(), target.words);
    let end = Instant::now() + Duration::from_secs_f64(seconds);
    let cases = arguments.cases.unwrap_or(u64::MAX);
    let now = Arc::new(AtomicU64::new(arguments.first));
    watch(&now, target, arguments.seed);
    let mut ran = 0;
    while ran < cases && (ran % CASES_AT_A_TIME != 0 || Instant::now() < end) {
        let case = arguments.first + ran;
        now.store(case, Ordering::Relaxed);
        if arguments.trace {
            println!("{case}");
            let _ = std::io::stdout().flush();
        }
        let input = mutator.input(case);
        let begun = used(ClockId::ThreadCPUTime);
        let result = run(target, &input);
        let took = used(ClockId::ThreadCPUTime).saturating_sub(begun);
        if let Err(failed) = result {
            println!("{}", failure(target, arguments.seed, case, &failed.to_string()));
            return ExitCode::FAILURE;
        }
        if took > LONGEST {
            let what = format!("it took {:.1} s for {} bytes", took.as_secs_f64(), input.len());
            println!("{}", failure(target, arguments.seed, case, &what));
            return ExitCode::FAILURE;
        }
        ran += 1;
    }
    println!("{RAN}{ran}");
    ExitCode::SUCCESS
}

/// A line that says what failed, and how it is repeated.
pub(crate) fn failure(target: &Target, seed: u64, case: u64, what: &str) -> String {
    format!(
        "{}: {what}\n  again: cargo run -p stillmap-fuzz -- {} --seed {seed} --case {case}",
        target.name, target.name
    )
}

/// The time of processors so far: a machine that is busy makes no case take longer.
fn used(clock: ClockId) -> Duration {
    let Timespec { tv_sec, tv_nsec } = clock_gettime(clock);
    Duration::new(tv_sec.unsigned_abs(), u32::try_from(tv_nsec).unwrap_or_default())
}

/// Ends the process when a case does not.
fn watch(now: &Arc<AtomicU64>, target: &Target, seed: u64) {
    let (now, target) = (Arc::clone(now), *target);
    std::thread::spawn(move || {
        let mut last = u64::MAX;
        let mut since = Duration::ZERO;
        loop {
            std::thread::sleep(Duration::from_secs(1));
            let case = now.load(Ordering::Relaxed);
            let used = used(ClockId::ProcessCPUTime);
            if case != last {
                (last, since) = (case, used);
            } else if used.saturating_sub(since) > ENDLESS {
                let what = format!("it has not ended after {} s", ENDLESS.as_secs());
                println!("{}", failure(&target, seed, case, &what));
                std::process::exit(1);
            }
        }
    });
}
