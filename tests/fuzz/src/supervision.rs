//! Targets in turn, each in a process of its own: what takes a process down ends its target alone, and is named.

use std::process::{Command, ExitCode, Output, Stdio};
use std::time::Instant;

use stillmap_fuzz::Target;

use crate::Arguments;
use crate::worker::{RAN, failure};

/// How long a target runs before it is the next one's turn.
const TURN_S: f64 = 20.0;

/// How far a target is.
struct Progress {
    target: Target,
    next: u64,
    ran: u64,
    seconds: f64,
    failure: Option<String>,
}

pub(crate) fn explore(targets: &[Target], arguments: &Arguments) -> ExitCode {
    let begun = Instant::now();
    let seconds = arguments.minutes.map_or(f64::INFINITY, |minutes| 60.0 * minutes);
    // Without a number of cases or of minutes each has one turn.
    let turns = if arguments.minutes.is_some() || arguments.cases.is_some() { u64::MAX } else { 1 };
    let (first, next) = (arguments.first, arguments.first);
    let mut all: Vec<Progress> = targets
        .iter()
        .map(|target| Progress { target: *target, next, ran: 0, seconds: 0.0, failure: None })
        .collect();
    let mut turn = 0;
    while turn < turns {
        let mut is_left = false;
        for progress in &mut all {
            let cases = arguments.cases.map(|cases| cases.saturating_sub(progress.next - first));
            let left_s = seconds - begun.elapsed().as_secs_f64();
            if progress.failure.is_some() || cases == Some(0) || left_s <= 0.0 {
                continue;
            }
            is_left = true;
            // In a short run each has a turn all the same.
            let share_s = (seconds / targets.len() as f64).min(TURN_S);
            progress.turn(arguments.seed, cases, share_s.min(left_s));
        }
        turn += 1;
        if !is_left {
            break;
        }
    }
    tell(&all)
}

impl Progress {
    fn turn(&mut self, seed: u64, cases: Option<u64>, seconds: f64) {
        let begun = Instant::now();
        let output = self.process(seed, self.next, cases, seconds, false);
        self.seconds += begun.elapsed().as_secs_f64();
        let text = String::from_utf8_lossy(&output.stdout);
        let ran = text.lines().find_map(|line| line.strip_prefix(RAN)?.parse::<u64>().ok());
        if let Some(ran) = ran.filter(|_| output.status.success()) {
            self.next += ran;
            self.ran += ran;
            return;
        }
        if !text.trim().is_empty() {
            self.failure = Some(text.trim().to_owned());
            return;
        }
        // It could not say which case it was.
        let errors = String::from_utf8_lossy(&output.stderr);
        let last = errors.lines().rfind(|line| !line.trim().is_empty()).unwrap_or_default();
        let traced = self.process(seed, self.next, cases, 10.0 * seconds, true);
        let traced = String::from_utf8_lossy(&traced.stdout);
        let case = traced.lines().rev().find_map(|line| line.parse().ok()).unwrap_or(self.next);
        let what = format!("it took the process down ({}): {last}", output.status);
        self.failure = Some(failure(&self.target, seed, case, &what));
    }

    fn process(
        &self,
        seed: u64,
        first: u64,
        cases: Option<u64>,
        seconds: f64,
        trace: bool,
    ) -> Output {
        let program = std::env::current_exe().expect("the program knows where it is");
        let mut command = Command::new(program);
        command.arg(self.target.name);
        command.args(["--seed", &seed.to_string(), "--first", &first.to_string()]);
        command.args(["--worker", &seconds.to_string()]);
        if let Some(cases) = cases {
            command.args(["--cases", &cases.to_string()]);
        }
        if trace {
            command.arg("--trace");
        }
        command.stdin(Stdio::null()).output().expect("the program can be started again")
    }
}

fn tell(all: &[Progress]) -> ExitCode {
    for Progress { target, ran, seconds, failure, .. } in all {
        println!(
            "{:<20} {ran:>12} cases in {seconds:>7.1} s{}",
            target.name,
            if failure.is_some() { ", then a failure" } else { "" }
        );
    }
    let failures: Vec<&String> =
        all.iter().filter_map(|progress| progress.failure.as_ref()).collect();
    failures.iter().for_each(|failure| println!("{failure}"));
    if failures.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
