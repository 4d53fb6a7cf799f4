//! Merges maps of simulated flats, and says how well: each flat with itself of another day, and with the next one.
//!
//! ```text
//! cargo run --release -p map-merge --example flats -- [FIRST_SEED [COUNT [EDGE_M [FOLDER]]]]
//! ```
//! With a folder it writes the maps of each pair there.
#![expect(clippy::print_stdout, clippy::unwrap_used, reason = "a program for a terminal")]

#[path = "../tests/flats/mapping.rs"]
mod mapping;
#[path = "flats/missed.rs"]
mod missed;

use std::num::NonZeroUsize;
use std::path::Path;
use std::time::Instant;

use estimation::ScopedThreads;
use geometry::ply;
use map_merge::{Candidate, MergeError, SavedMap, merge};
use mapping::{Mapping, Visit, altered, bare, score, visit};
use nalgebra::Isometry3;
use simulator::Home;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |index: usize, otherwise: f64| {
        arguments.get(index).map_or(otherwise, |text| text.parse().unwrap())
    };
    let (first, count) = (number(0, 1.0) as u64, number(1, 10.0) as u64);
    let mapping = Mapping { edge_m: number(2, 0.05), ..Mapping::default() };
    let folder = arguments.get(3).map(Path::new);
    for seed in first..first + count {
        let before = Home::new(seed).furnished(1000 + seed);
        let after = before.rearranged(2000 + seed, 0.5);
        let rooms = Visit::all_rooms(&before);
        let start = Instant::now();
        let [a, b] = [(&before, 10 * seed), (&after, 10 * seed + 1)]
            .map(|(home, seed)| visit(home, &rooms, seed, mapping));
        let other = visit(
            &Home::new(5000 + seed).furnished(6000 + seed),
            &(0..4).collect::<Vec<_>>(),
            10 * seed + 2,
            mapping,
        );
        let part = visit(&after, &rooms[..3], 10 * seed + 3, mapping);
        println!(
            "seed {seed}: {} and {} points, {} views, {:.1} s to map",
            a.map.points.points_m.len(),
            b.map.points.points_m.len(),
            a.map.views.len(),
            start.elapsed().as_secs_f64()
        );
        report(
            "again",
            &a,
            &b,
            &a.map,
            &b.map,
            &Isometry3::identity(),
            folder.map(|folder| folder.join(seed.to_string())).as_deref(),
        );
        let turn = Isometry3::new([11.0, -7.0, 0.4].into(), [0.01, -0.02, 2.0].into());
        report("turned", &a, &b, &a.map, &altered(&b.map, &turn), &turn, None);
        report("part", &a, &part, &a.map, &part.map, &Isometry3::identity(), None);
        report(
            "bare",
            &a,
            &b,
            &bare(&a.map, 0.05),
            &bare(&b.map, 0.08),
            &Isometry3::identity(),
            None,
        );
        report("other", &a, &other, &a.map, &other.map, &Isometry3::identity(), None);
        report(
            "other bare",
            &a,
            &other,
            &bare(&a.map, 0.05),
            &bare(&other.map, 0.05),
            &Isometry3::identity(),
            None,
        );
    }
}

fn report(
    what: &str,
    a: &Visit,
    b: &Visit,
    map_a: &SavedMap,
    map_b: &SavedMap,
    new_from_b: &Isometry3<f64>,
    folder: Option<&Path>,
) {
    let start = Instant::now();
    let threads = ScopedThreads::new(NonZeroUsize::MIN);
    let merged = merge(map_a, map_b, None, &threads, &|| false);
    let seconds = start.elapsed().as_secs_f64();
    let said = |candidate: &Candidate| {
        let agreement = candidate.agreement;
        format!(
            "{:.2} of {:.0} m2, overlap {:.2}",
            agreement.share(),
            agreement.same_m2 + agreement.contradicting_m2,
            agreement.overlap
        )
    };
    let expected = a.map_from_room * b.map_from_room.inverse() * new_from_b.inverse();
    let off = |found: &Isometry3<f64>| {
        let middle = new_from_b * b.map_from_room * nalgebra::Point3::new(5.0, 0.0, 1.0);
        (
            (found * middle - expected * middle).norm(),
            found.rotation.angle_to(&expected.rotation).to_degrees(),
        )
    };
    let line = match &merged {
        Ok(merge) => {
            let alignment = &merge.alignment;
            let (metres, degrees) = off(&alignment.a_from_b);
            let (gone, added) =
                (score(a, b, &merge.changes.gone), score(b, a, &merge.changes.added));
            let next = alignment.next.as_ref().map_or("none".to_owned(), said);
            let best =
                said(&Candidate { a_from_b: alignment.a_from_b, agreement: alignment.agreement });
            let scores = [gone, added].map(|score| {
                format!(
                    "P {:.3} R {:.3} ({:.3}) of {}",
                    score.precision(),
                    score.recall(),
                    score.recall_of_all(),
                    score.changed_and_seen
                )
            });
            if what == "again" {
                println!("    gone:");
                missed::print(a, b, &merge.changes.gone);
                println!("    added:");
                missed::print(b, a, &merge.changes.added);
            }
            if let Some(folder) = folder {
                std::fs::create_dir_all(folder).unwrap();
                let write = |name: &str, map: &SavedMap| {
                    std::fs::write(folder.join(name), ply::encode_map(&map.points, &map.views))
                        .unwrap()
                };
                write("a.ply", map_a);
                write("b.ply", &altered(map_b, &alignment.a_from_b));
                write("merged.ply", &merge.merged);
                let points = |map: &SavedMap, groups: &[map_merge::Group]| -> Vec<_> {
                    groups
                        .iter()
                        .flat_map(|group| &group.points)
                        .map(|index| map.points.points_m[*index])
                        .collect()
                };
                std::fs::write(
                    folder.join("gone.ply"),
                    ply::encode(&points(map_a, &merge.changes.gone)),
                )
                .unwrap();
                std::fs::write(
                    folder.join("added.ply"),
                    ply::encode(&points(
                        &altered(map_b, &alignment.a_from_b),
                        &merge.changes.added,
                    )),
                )
                .unwrap();
            }
            format!(
                "{metres:.4} m {degrees:.3} deg | {best} | next {next} | gone {} | added {} | groups {} {} only {} {}",
                scores[0],
                scores[1],
                merge.changes.gone.len(),
                merge.changes.added.len(),
                merge.changes.only_in_a.len(),
                merge.changes.only_in_b.len()
            )
        }
        Err(MergeError::NoAgreement { best, .. }) => format!(
            "refused: {} | {:.3} m {:.2} deg off",
            said(best),
            off(&best.a_from_b).0,
            off(&best.a_from_b).1
        ),
        Err(MergeError::Ambiguous { best, next }) => format!(
            "ambiguous: {} | {} | {:.3} m {:.2} deg off",
            said(best),
            said(next),
            off(&best.a_from_b).0,
            off(&best.a_from_b).1
        ),
        Err(error) => format!("{error}"),
    };
    println!("  {what:10} {seconds:5.1} s  {line}");
}
