//! The outcome of a run in words: the page's first lines, and the last output of the command line.

use crate::{DynamicScore, KeptOutCause, ObjectScore, Summary};

/// The outcome of a run in plain sentences, the most important first. There is at least one.
#[must_use]
pub fn headline(summary: &Summary) -> Vec<String> {
    if summary.cycles.total == 0 {
        return vec![format!(
            "No cycle was processed: {} dropped.",
            counted(summary.dropped() as usize, "input was", "inputs were")
        )];
    }
    let mut sentences = Vec::new();
    match &summary.truth {
        Some(score) if score.cycles_scored > 0 => truth_sentences(score, &mut sentences),
        _ => sentences.push(zone_sentence(summary)),
    }
    sentences.push(map_sentence(summary));
    sentences.extend(dropped_sentence(summary));
    sentences.extend(kept_out_sentence(summary));
    if summary.dropped() > 0 {
        sentences.push(format!(
            "{} dropped in transit; the table of drops says where and why.",
            counted(summary.dropped() as usize, "input was", "inputs were")
        ));
    }
    sentences
}

/// "the person", or "object 3" where it has no name.
pub(crate) fn object_name(object: &ObjectScore) -> String {
    match &object.name {
        Some(name) => format!("the {name}"),
        None => format!("object {}", object.object_id),
    }
}

/// A share as a percentage with one digit after the point, or a dash where there is none. The space
/// does not break.
pub(crate) fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "\u{2013}".to_owned(), |share| format!("{:.1}\u{a0}%", share * 100.0))
}

/// A number with a comma between its thousands.
pub(crate) fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

fn counted(number: usize, one: &str, many: &str) -> String {
    format!("{} {}", grouped(number), if number == 1 { one } else { many })
}

/// "1st", "2nd" and so on.
pub(crate) fn ordinal(number: usize) -> String {
    let ending = match (number % 10, number % 100) {
        (_, 11..=13) => "th",
        (1, _) => "st",
        (2, _) => "nd",
        (3, _) => "rd",
        _ => "th",
    };
    format!("{}{ending}", grouped(number))
}

fn truth_sentences(score: &DynamicScore, sentences: &mut Vec<String>) {
    let in_view: Vec<_> = score.objects.iter().filter(|object| object.cycles_in_view > 0).collect();
    if in_view.is_empty() {
        sentences.push("The truth has no moving object in view of the camera.".to_owned());
    }
    for object in in_view {
        sentences.push(capitalised(&format!(
            "{} was found in {} of the {} in which it was in view{}, and removed in {} ({} of its points \
             over the run); {} of the {} that only it touched {} left in the map.",
            object_name(object),
            grouped(object.cycles_found_or_removed),
            counted(object.cycles_in_view, "cycle", "cycles"),
            object.first_found.map_or_else(String::new, |first| format!(
                ", for the first time in the {} of them",
                ordinal(first.nth_in_view)
            )),
            grouped(object.cycles_removed),
            percent(object.points.share),
            grouped(object.own_voxels_left),
            counted(object.own_voxels, "voxel", "voxels"),
            if object.own_voxels_left == 1 { "is" } else { "are" },
        )));
    }
    if let Some(identities) = score.identities.filter(|identities| identities.sightings > 0) {
        sentences.push(format!(
            "Tracks followed moving objects in {} of {}, with {}.",
            grouped(identities.followed),
            counted(identities.sightings, "sighting", "sightings"),
            counted(identities.switches, "identity switch", "identity switches"),
        ));
    }
    if let Some(surface) = &score.map.surface {
        sentences.push(format!(
            "The points of the map are {:.1} mm from the true surface in the mean ({} within {:.0} cm), and {} of the true surface \
             has a point of the map within {:.0} cm.",
            1e3 * surface.accuracy_m,
            percent(Some(surface.precision)),
            1e2 * surface.tolerance_m,
            percent(Some(surface.recall)),
            1e2 * surface.tolerance_m,
        ));
    }
    sentences.push(format!(
        "{} of the voxels in which the static scene was seen in {} cycles or more have a point of the map within one edge ({} of \
         those that have one of the map without removal), and {} of its points were removed wrongly.",
        percent(score.map.static_confirmed.kept_share),
        score.rules.confirming_cycles,
        percent(score.map.static_confirmed.kept_share_of_unfiltered),
        percent(score.static_points.share),
    ));
    if score.cycles_without_truth > 0 {
        sentences.push(format!(
            "{} no truth to compare with.",
            counted(score.cycles_without_truth, "cycle has", "cycles have")
        ));
    }
}

fn zone_sentence(summary: &Summary) -> String {
    let cycles = &summary.cycles;
    if cycles.without_zone == cycles.total {
        return format!(
            "No moving object was found in {}.",
            counted(cycles.total, "cycle", "cycles")
        );
    }
    format!(
        "A moving object was found in {} of {}, and held over in {} more.",
        grouped(cycles.with_measured_zone),
        counted(cycles.total, "cycle", "cycles"),
        grouped(cycles.with_held_zone_only),
    )
}

fn map_sentence(summary: &Summary) -> String {
    let map = &summary.map;
    format!("The map holds {}.", counted(map.points, "point", "points"))
}

/// The map has what was seen last alone.
fn dropped_sentence(summary: &Summary) -> Option<String> {
    let dropped = summary.map.dropped_blocks;
    (dropped > 0).then(|| {
        format!(
            "The map had no room for all: it dropped {} of 8 voxels an axis, those seen longest ago (at_max_voxels: \
             drop_oldest; more max_map_blocks, or spill, keep them).",
            counted(dropped, "block", "blocks")
        )
    })
}

/// Why the map has no point in some voxels of the map without removal: something moved there, or why not.
fn kept_out_sentence(summary: &Summary) -> Option<String> {
    let map = &summary.map;
    if map.voxels_kept_out == 0 {
        return None;
    }
    let other = KeptOutCause::ALL
        .into_iter()
        .filter(|cause| *cause != KeptOutCause::Moved && map.kept_out.of(*cause) > 0)
        .map(|cause| format!("{} ({})", cause.name(), grouped(map.kept_out.of(cause))))
        .collect::<Vec<_>>();
    let other = other.join(", ");
    let moved = map.kept_out.moved;
    let why = match (moved, other.is_empty()) {
        (0, _) => format!("; nothing moved there: {other}"),
        (_, true) => format!(": something moved in {} of them", grouped(moved)),
        (_, false) => format!(
            ": something moved in {} of them; the others did not move: {other}",
            grouped(moved)
        ),
    };
    Some(format!(
        "{} of the map without removal {} no point of the map{why}.",
        counted(map.voxels_kept_out, "voxel", "voxels"),
        if map.voxels_kept_out == 1 { "holds" } else { "hold" },
    ))
}

fn capitalised(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |first| first.to_uppercase().chain(chars).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A static recording read "No moving object was found", and then that removal kept 2,815 voxels out of the map.
    #[test]
    fn what_is_not_in_a_static_map_is_not_said_to_have_moved() {
        let mut summary = Summary::of_run(
            &crate::run_record::tests::run(vec![crate::run_record::tests::cycle(0)]),
            None,
            false,
        )
        .unwrap();
        summary.map.voxels_kept_out = 2815;
        summary.map.kept_out.seen_once = 15;
        summary.map.kept_out.beside_surface = 2800;
        assert_eq!(
            headline(&summary)[2],
            "2,815 voxels of the map without removal hold no point of the map; nothing moved there: \
             beside a surface of the map (2,800), seen in one cycle only (15)."
        );
        summary.map.kept_out.moved = 2815;
        summary.map.kept_out.seen_once = 0;
        summary.map.kept_out.beside_surface = 0;
        assert!(headline(&summary)[2].ends_with(": something moved in 2,815 of them."));
    }

    /// Regression: a map that dropped nine tenths of what it had seen said nothing of it.
    #[test]
    fn what_the_map_dropped_is_said() {
        let run = crate::run_record::tests::run(vec![crate::run_record::tests::cycle(0)]);
        let of = |dropped_blocks| {
            let run = crate::RunRecord { dropped_blocks, ..run.clone() };
            headline(&Summary::of_run(&run, None, false).unwrap())
        };
        assert!(of(1200)[2].contains("1,200 blocks"), "{:?}", of(1200));
        assert!(of(0).iter().all(|sentence| !sentence.contains("dropped")));
    }

    #[test]
    fn thousands_are_grouped() {
        for (number, text) in
            [(0, "0"), (999, "999"), (1000, "1,000"), (12_345, "12,345"), (1_234_567, "1,234,567")]
        {
            assert_eq!(grouped(number), text);
        }
    }

    #[test]
    fn a_share_without_a_whole_is_a_dash() {
        assert_eq!(percent(None), "\u{2013}");
        assert_eq!(percent(Some(0.8643)), "86.4\u{a0}%");
    }

    #[test]
    fn one_is_singular() {
        assert_eq!(counted(1, "voxel", "voxels"), "1 voxel");
        assert_eq!(counted(1200, "voxel", "voxels"), "1,200 voxels");
    }

    #[test]
    fn numbers_in_a_row_have_their_endings() {
        for (number, text) in [
            (1, "1st"),
            (2, "2nd"),
            (3, "3rd"),
            (4, "4th"),
            (11, "11th"),
            (22, "22nd"),
            (1113, "1,113th"),
        ] {
            assert_eq!(ordinal(number), text);
        }
    }

    #[test]
    fn a_sentence_starts_with_a_capital() {
        assert_eq!(capitalised("the person"), "The person");
        assert_eq!(capitalised(""), "");
    }
}
