//! The thesis' Tables 4 to 16 with our results.

use estimation::quantile::median_of_sorted;

use super::follow::{Mode, Run};
use super::published::{COUNTERPARTS, Published, PublishedSequence};
use super::{Followed, Score};

const HEAD: [&str; 8] =
    ["RMSE", "mean", "median", "std. dev.", "least", "largest", "median time", "mean time"];

/// The tables of a sequence, one per mode: Tables 4 to 13.
pub(super) fn of_sequence(followed: &Followed) -> Vec<String> {
    let title = match followed.published {
        Some(published) => format!("Table {}: {}", published.table, followed.name),
        None => followed.name.clone(),
    };
    let mut lines = vec![format!(
        "{title}: {} pairs of images, {} images without depth; metres, seconds",
        followed.pairs, followed.alone
    )];
    for score in &followed.scores {
        lines.push(format!("{:<14}{}poses  keyframes  loops", name(score.mode), heads()));
        for run in &score.runs {
            lines.push(format!(
                "{:<14}{}{:>5}  {:>9}  {:>5}",
                format!("  {}", run.run),
                cells(&numbers(run)),
                run.poses,
                run.keyframes,
                run.loops
            ));
        }
        lines.push(format!("{:<14}{}", "  mean", cells(&score.mean)));
        let [least, median, largest] = spread(score);
        lines.push(format!(
            "  RMSE of the runs: median {median:.5}, from {least:.5} to {largest:.5}; 99 of 100 images in {:.4} s",
            score.runs.iter().map(|run| run.p99_tracking_s).fold(0.0, f64::max)
        ));
        lines.extend(memory(score));
    }
    if let Some(published) = followed.published {
        lines.push(format!("{:<14}{}", "the thesis", cells(&published.thesis)));
    }
    lines
}

/// The memory of the largest map of the runs; empty for odometry.
fn memory(score: &Score) -> Option<String> {
    let largest = score.runs.iter().max_by_key(|run| run.map_bytes)?;
    (largest.map_bytes > 0).then(|| {
        format!(
            "  the map takes {:.1} MB, {:.0} kB a metre",
            1e-6 * largest.map_bytes as f64,
            1e-3 * largest.map_bytes_per_m
        )
    })
}

/// Tables 14 to 16, of all ten sequences.
pub(super) fn of_all(all: &[Followed], tables: &Published) -> Vec<String> {
    let found = |published: &PublishedSequence| all.iter().find(|one| one.name == published.name);
    let mut lines = vec!["Table 14: means of all runs; metres, seconds".to_owned()];
    lines.push(format!("{:<46}{:<14}{}", "", "", heads()));
    for published in &tables.sequences {
        let mut row = |who: &str, numbers: &[f64; 8]| {
            lines.push(format!("{:<46}{who:<14}{}", published.name, cells(numbers)));
        };
        row("the thesis", &published.thesis);
        for score in found(published).map(|one| &one.scores[..]).unwrap_or_default() {
            row(name(score.mode), &score.mean);
        }
    }
    lines.push(String::new());
    lines.push("Table 15: ATE RMSE in centimetres, mean of all runs".to_owned());
    let modes = [Mode::Odometry, Mode::Inline, Mode::Background];
    let others: String = tables.others.iter().map(|other| format!("{other:>12}")).collect();
    let ours: String = modes.iter().map(|mode| format!("{:>12}", name(*mode))).collect();
    lines.push(format!("{:<46}{:>12}{others}{:>24}{:>8}{ours}", "", "the thesis", "best", "aim"));
    for published in &tables.sequences {
        let cell = |value: Option<f64>| {
            value.map_or_else(|| format!("{:>12}", "-"), |value| format!("{value:>12.3}"))
        };
        let [thesis_m, ..] = published.thesis;
        let others: String = published.others_cm.iter().map(|value| cell(*value)).collect();
        let best = published.best.as_ref().map_or_else(
            || "-".to_owned(),
            |best| format!("{:.1} ({})", 100.0 * best.rmse_m, best.of),
        );
        let scores = found(published).map(|one| &one.scores[..]).unwrap_or_default();
        let ours = modes.iter().map(|mode| {
            let score = scores.iter().find(|score| score.mode == *mode);
            cell(score.map(|score| 100.0 * score.mean[0]))
        });
        let ours: String = ours.collect();
        lines.push(format!(
            "{:<46}{:>12.3}{others}{best:>24}{:>8.2}{ours}",
            published.name,
            100.0 * thesis_m,
            100.0 * published.aim_m()
        ));
    }
    lines.push(String::new());
    lines.push("Table 16: median and mean tracking time, seconds".to_owned());
    let mut means: Vec<(Mode, Vec<[f64; 2]>)> = modes.map(|mode| (mode, Vec::new())).into();
    let pair = |of: [f64; 2]| format!("{:>10.4}{:>10.4}", of[0], of[1]);
    let heads: String = modes.iter().map(|mode| format!("{:>20}", name(*mode))).collect();
    lines.push(format!("{:<46}{:>20}{heads}", "", "the thesis"));
    for published in &tables.sequences {
        let [.., median_s, mean_s] = published.thesis;
        let mut line = format!("{:<46}{}", published.name, pair([median_s, mean_s]));
        let scores = found(published).map(|one| &one.scores[..]).unwrap_or_default();
        for (mode, means) in &mut means {
            let times = scores.iter().find(|score| score.mode == *mode).map(|score| {
                let [.., median_s, mean_s] = score.mean;
                [median_s, mean_s]
            });
            line += &times.map_or_else(|| format!("{:>20}", "-"), pair);
            means.extend(times);
        }
        lines.push(line);
    }
    let mut line = format!("{:<46}{}", "mean", pair(tables.mean_times_s));
    for (_, times) in &means {
        let count = times.len() as f64;
        let mean = |at: usize| times.iter().filter_map(|pair| pair.get(at)).sum::<f64>() / count;
        let is_any = !times.is_empty();
        line += &if is_any { pair([mean(0), mean(1)]) } else { format!("{:>20}", "-") };
    }
    lines.push(line);
    lines
}

/// The available simulated counterparts, by their names.
pub(super) fn of_counterparts(all: &[Followed]) -> Vec<String> {
    let modes = [Mode::Odometry, Mode::Inline, Mode::Background];
    let ours: String = modes.iter().map(|mode| format!("{:>12}", name(*mode))).collect();
    let mut lines =
        vec!["Simulated counterparts: ATE RMSE in centimetres, mean of all runs".to_owned()];
    lines.push(format!("{:<20}{:<46}{:>8}{ours}", "", "counterpart of", "aim"));
    for counterpart in &COUNTERPARTS {
        let Some(found) = all.iter().find(|one| one.name == counterpart.run.name()) else {
            continue;
        };
        let ours = modes.iter().map(|mode| {
            let score = found.scores.iter().find(|score| score.mode == *mode);
            score.map_or_else(
                || format!("{:>12}", "-"),
                |score| format!("{:>12.3}", 100.0 * score.mean[0]),
            )
        });
        let ours: String = ours.collect();
        let (run, of, aim_cm) = (counterpart.run.name(), counterpart.of, 100.0 * counterpart.aim_m);
        lines.push(format!("{run:<20}{of:<46}{aim_cm:>8.2}{ours}"));
    }
    lines
}

/// The eight numbers of a run, as in the tables.
pub(super) fn numbers(run: &Run) -> [f64; 8] {
    [
        run.rmse_m,
        run.mean_m,
        run.median_m,
        run.std_m,
        run.min_m,
        run.max_m,
        run.median_tracking_s,
        run.mean_tracking_s,
    ]
}

/// The least, the median and the largest RMSE of the runs.
fn spread(score: &Score) -> [f64; 3] {
    let mut rmse_m: Vec<f64> = score.runs.iter().map(|run| run.rmse_m).collect();
    rmse_m.sort_by(f64::total_cmp);
    let at = |index: usize| rmse_m.get(index).copied().unwrap_or(f64::NAN);
    let median = median_of_sorted(&rmse_m).unwrap_or(f64::NAN);
    [at(0), median, at(rmse_m.len().saturating_sub(1))]
}

fn heads() -> String {
    HEAD.iter().map(|head| format!("{head:<13}")).collect()
}

fn cells(numbers: &[f64; 8]) -> String {
    numbers.iter().map(|number| format!("{number:<13.6}")).collect()
}

fn name(mode: Mode) -> &'static str {
    match mode {
        Mode::Odometry => "odometry",
        Mode::Inline => "inline",
        Mode::Background => "background",
    }
}
