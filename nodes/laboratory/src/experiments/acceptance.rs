//! The targets of the suite, beyond the experiments of the thesis: each figure with its target, by both methods, and
//! whether free_space meets it.

mod cases;
mod criteria;
mod values;

use simulator::SceneName;

use super::runs::{METHODS, Run, Runs};
use super::section::{Section, Shown, Words};
use super::settings::Settings;
use super::table::{Cell, Figure, Row, Table, Verdict};
use cases::{Case, Cases};
use criteria::{Criterion, NOT_RUN};
use geometry::Method;
use robot::Failure;

pub(crate) fn plan(settings: &Settings) -> Vec<Run> {
    Cases::of(settings).into_runs()
}

pub(crate) fn present(settings: &Settings, runs: &Runs) -> Result<Section, Failure> {
    let cases = Cases::of(settings);
    let mut rows = Vec::new();
    for criterion in &criteria::all() {
        let ceilings = if criterion.has_ceiling { ceilings(&cases, runs) } else { Vec::new() };
        rows.push(summary_row(criterion, cases.set(criterion.set), runs, &ceilings));
        rows.extend(ceilings.into_iter().map(|ceiling| ceiling.row));
    }
    rows.extend(NOT_RUN.iter().map(|(name, target)| {
        let not_run = Cell::Verdict(Verdict::NotRun);
        Row::new(
            *name,
            [Cell::words(*target), Cell::Absent, Cell::Absent, Cell::Absent, Cell::Absent, not_run],
        )
    }));
    let summary = Table::new(
        "Medians over the seeds, of the worst case",
        [
            "target",
            "rec_hv",
            "free_space",
            "where free_space is worst",
            "cases that meet it",
            "verdict",
        ],
        rows,
    );
    let details = METHODS.into_iter().map(|method| case_table(&cases.crossings, runs, method));
    let shown = Shown { tables: vec![summary], details: details.collect(), ..Shown::default() };
    Ok(Section::new(words(settings), shown))
}

fn words(settings: &Settings) -> Words {
    let scenes: Vec<String> = settings.scenes.iter().map(ToString::to_string).collect();
    let paths: Vec<String> = settings.paths.iter().map(|path| format!("{path:?}")).collect();
    Words {
        key: "acceptance",
        title: "What must be reached",
        thesis: "These targets are the suite's own. Some are figures of the thesis made harder, most are of things \
                 that it does not measure: with a simulator there is a truth for each pixel.",
        here: format!(
            "Crossings: robot and person on the paths {} in the scenes {}, {}; a case is one scene, object and \
             path, its figure the median over the seeds, and a target is met when every case meets it. The row \
             shows the worst case of each method. The false zones, the objects that cross each other and the one \
             that pauses are run in the scenes B, E and G as far as these are among the above. The targets are \
             meant for 10 seeds.",
            paths.join(", "),
            scenes.join(", "),
            settings.seeds_text()
        ),
        comparability: "All of it is simulated: noise, gaps, shadows and stamps as the sensors have them, a pose \
                        without error, and rooms that are models. Found is counted in the cycles in which both \
                        sensors have the object; precision leaves the borders of one voxel aside; the position is \
                        rec_hv's mean of points and free_space's track, against the visible surface. Correlation is \
                        by the thesis' own measure: the front view, against a map of the empty scene that was \
                        measured with the same sensors and other noise. Where two such maps of the empty scene correlate \
                        by less than the target, a case meets it that reaches the least that two of them do: that \
                        ceiling stands below it, scene by scene. Against the true surface even the map of a \
                        scene in which nothing moved stays below the target; both stand beside it. The doorways of \
                        the simulator's rooms are hard on rec_hv (experiment 3): their edges alone exceed its \
                        threshold in an empty room.",
    }
}

/// The ceilings of a scene.
struct Ceiling {
    scene: SceneName,
    figure: Figure,
    row: Row,
}

fn ceilings(cases: &Cases, runs: &Runs) -> Vec<Ceiling> {
    let criterion = criteria::ceiling();
    let of_scene = |case: &Case| {
        // Nothing was removed, so both methods give the same.
        let figure = criterion.figure(case, runs, Method::FreeSpace)?;
        let cells = [
            Cell::Absent,
            Cell::Absent,
            Cell::Figure(figure),
            Cell::words(case.name.clone()),
            Cell::Absent,
            Cell::Absent,
        ];
        let row = Row::new(format!("{}, {}", criterion.name, case.scene), cells);
        Some(Ceiling { scene: case.scene, figure, row })
    };
    cases.set(criterion.set).iter().filter_map(of_scene).collect()
}

/// A criterion over its cases. A case also meets it by reaching the least of its scene's `ceilings`.
fn summary_row(criterion: &Criterion, cases: &[Case], runs: &Runs, ceilings: &[Ceiling]) -> Row {
    let figures = |method| -> Vec<(&Case, Figure)> {
        let of_case = |case| Some((case, criterion.figure(case, runs, method)?));
        cases.iter().filter_map(of_case).collect()
    };
    let rec_hv = criterion.worst(figures(Method::RecHv)).map(|(_, figure)| figure);
    let free_space = figures(Method::FreeSpace);
    let reaches_ceiling = |case: &Case, figure: &Figure| {
        let ceiling = ceilings.iter().find(|ceiling| ceiling.scene == case.scene);
        ceiling.is_some_and(|Ceiling { figure: ceiling, .. }| {
            figure.median >= ceiling.min.unwrap_or(ceiling.median)
        })
    };
    let alone = free_space.iter().filter(|(_, figure)| criterion.is_met(figure)).count();
    let met = free_space
        .iter()
        .filter(|(case, figure)| criterion.is_met(figure) || reaches_ceiling(case, figure))
        .count();
    let all = free_space.len();
    let verdict = match criterion.target {
        None => Cell::Absent,
        Some(_) if all == 0 => Cell::Verdict(Verdict::NotRun),
        Some(_) => Cell::Verdict(Verdict::of(met == all)),
    };
    let of_all = match criterion.target {
        Some(_) if all > 0 && met > alone => {
            Cell::words(format!("{met} of {all}, {} of them by the ceiling", met - alone))
        }
        Some(_) if all > 0 => Cell::words(format!("{met} of {all}")),
        _ => Cell::Absent,
    };
    let worst = criterion.worst(free_space);
    let place = worst.map_or(Cell::Absent, |(case, _)| Cell::words(case.name.clone()));
    let figure = worst.map(|(_, figure)| figure);
    Row::new(
        criterion.name,
        [criterion.target_cell(), rec_hv.into(), figure.into(), place, of_all, verdict],
    )
}

/// All crossings, for each criterion.
fn case_table(cases: &[Case], runs: &Runs, method: Method) -> Table {
    let criteria: Vec<Criterion> = criteria::all()
        .into_iter()
        .filter(|criterion| criterion.set == cases::Set::Crossings)
        .collect();
    let row = |case: &Case| {
        let cells = criteria.iter().map(|criterion| criterion.figure(case, runs, method).into());
        Row::new(case.name.clone(), cells.collect::<Vec<Cell>>())
    };
    let caption = format!("Every crossing by {}", method.name());
    let columns = criteria.iter().map(|criterion| criterion.name);
    Table::new(caption, columns, cases.iter().map(row).collect())
}

#[cfg(test)]
mod tests;
