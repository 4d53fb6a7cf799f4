//! How well zones cover the moving objects of a scan, for recordings with labels: a point for each leg of each
//! person, as in the training data of leg trackers.
//!
//! Labels do not say who walks and who stands. A label stays where another label is at the same place a while
//! earlier or later; any other moves. A walker's leg stands for 0.6 s of a step, so the while is longer.

use std::collections::BTreeMap;

use geometry::DynamicZone;
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

/// A leg that is at the same place after this time belongs to a standing person.
const WHILE_S: f64 = 1.0;
/// The search for such a label goes on this long after that time: a few scans.
const LOOK_S: f64 = 0.5;
/// Labels within this distance are at one place: a leg's width and the noise of a cluster's centre.
const SAME_PLACE_M: f64 = 0.15;
/// Returns within this distance of a label are of its leg: half of a thick leg's width. Labels are the centres of the legs'
/// returns.
const OF_LEG_M: f64 = 0.1;
/// A return of the background is within this distance of the median range of its beam: the noise.
const OF_BACKGROUND_M: f64 = 0.1;
/// Since some persons are not labelled, the background is recognised by this: a beam with at least this share of its
/// returns there.
const OF_STEADY_BEAM: f64 = 0.5;

/// One scan with its labels and zones.
#[derive(Clone, PartialEq, Debug)]
pub struct LabelledScan {
    /// The start of the scan, in seconds since any moment.
    pub time_s: f64,
    /// The pose of the rig.
    pub map_from_rig: Isometry3<f64>,
    /// The zones of its cycle.
    pub zones: Vec<DynamicZone>,
    /// The labelled positions in the rig frame; `None` when the scan was not labelled.
    pub labels_in_rig_m: Option<Vec<Point3<f64>>>,
    /// The returns.
    pub returns: Vec<ScanReturn>,
}

/// A return of a scan.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ScanReturn {
    /// The beam's index in the scan.
    pub beam: usize,
    /// The measured range.
    pub range_m: f64,
    /// The position in the rig frame.
    pub in_rig_m: Point3<f64>,
    /// Whether it is missing from the static scan.
    pub is_removed: bool,
}

/// The score of a recording.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct ScanZoneScore {
    /// Scans.
    pub scans: usize,
    /// Of these, scans with a zone.
    pub scans_with_zone: usize,
    /// Zones of all scans.
    pub zones: usize,
    /// Labelled scans without a person.
    pub empty_scans: usize,
    /// Zones of these.
    pub zones_in_empty_scans: usize,
    /// Labels.
    pub labels: usize,
    /// Of these, labels that move.
    pub moving_labels: usize,
    /// Of these, labels in the direction of a zone.
    pub moving_labels_in_zone: usize,
    /// Of the moving labels, those with a return at their position.
    pub moving_legs: usize,
    /// Of these, legs whose returns were all removed.
    pub moving_legs_removed: usize,
    /// Returns of the background: at the range that their beam has most of the time. None if the platform moves.
    pub background_returns: usize,
    /// Of these, returns that are removed.
    pub background_returns_removed: usize,
}

impl ScanZoneScore {
    /// The share of the moving labels in a zone; `None` without moving labels.
    #[must_use]
    pub fn found_share(&self) -> Option<f64> {
        share(self.moving_labels_in_zone, self.moving_labels)
    }

    /// The share of the moving legs whose returns were all removed; `None` without moving legs.
    #[must_use]
    pub fn removed_share(&self) -> Option<f64> {
        share(self.moving_legs_removed, self.moving_legs)
    }

    /// The share of the background's returns that are kept; `None` without any.
    #[must_use]
    pub fn background_share(&self) -> Option<f64> {
        let kept = self.background_returns - self.background_returns_removed;
        share(kept, self.background_returns)
    }

    /// The share of scans with a zone; `None` without scans.
    #[must_use]
    pub fn zone_share(&self) -> Option<f64> {
        share(self.scans_with_zone, self.scans)
    }
}

fn share(part: usize, whole: usize) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

/// Scores the scans of a recording, in the order of their times.
#[must_use]
pub fn score_scan_zones(scans: &[LabelledScan]) -> ScanZoneScore {
    let mut score = ScanZoneScore { scans: scans.len(), ..ScanZoneScore::default() };
    let is_background = background(scans);
    let returns = scans.iter().flat_map(|scan| &scan.returns);
    for one in returns.filter(|one| is_background(one)) {
        score.background_returns += 1;
        score.background_returns_removed += usize::from(one.is_removed);
    }
    for (index, scan) in scans.iter().enumerate() {
        score.zones += scan.zones.len();
        score.scans_with_zone += usize::from(!scan.zones.is_empty());
        let Some(labels) = &scan.labels_in_rig_m else { continue };
        if labels.is_empty() {
            score.empty_scans += 1;
            score.zones_in_empty_scans += scan.zones.len();
        }
        score.labels += labels.len();
        for label in labels {
            if stays(&(scan.map_from_rig * label), index, scans) {
                continue;
            }
            score.moving_labels += 1;
            let in_zone = scan.zones.iter().any(|zone| zone.contains(&label.cast()));
            score.moving_labels_in_zone += usize::from(in_zone);
            let of_leg = scan.returns.iter().filter(|one| apart_m(label, one) <= OF_LEG_M);
            let kept: Vec<bool> = of_leg.map(|one| !one.is_removed).collect();
            score.moving_legs += usize::from(!kept.is_empty());
            score.moving_legs_removed += usize::from(!kept.is_empty() && !kept.contains(&true));
        }
    }
    score
}

/// Whether a return is of the background, for scans of a standing platform.
fn background(scans: &[LabelledScan]) -> impl Fn(&ScanReturn) -> bool + use<> {
    let stands = scans.windows(2).all(|pair| pair[0].map_from_rig == pair[1].map_from_rig);
    let mut by_beam: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for one in scans.iter().filter(|_| stands).flat_map(|scan| &scan.returns) {
        by_beam.entry(one.beam).or_default().push(one.range_m);
    }
    let steady = by_beam.into_iter().filter_map(|(beam, mut ranges_m)| {
        ranges_m.sort_by(f64::total_cmp);
        let median_m = *ranges_m.get(ranges_m.len() / 2)?;
        let near = ranges_m.iter().filter(|range_m| (*range_m - median_m).abs() <= OF_BACKGROUND_M);
        (near.count() as f64 >= OF_STEADY_BEAM * ranges_m.len() as f64).then_some((beam, median_m))
    });
    let steady: BTreeMap<usize, f64> = steady.collect();
    move |one| {
        let known_m = steady.get(&one.beam);
        known_m.is_some_and(|known_m| (one.range_m - known_m).abs() <= OF_BACKGROUND_M)
    }
}

fn apart_m(label: &Point3<f64>, one: &ScanReturn) -> f64 {
    nalgebra::distance(&label.xy(), &one.in_rig_m.xy())
}

/// Whether a label of scan `index` has another at its place some time earlier or later.
fn stays(in_map_m: &Point3<f64>, index: usize, scans: &[LabelledScan]) -> bool {
    let Some((before, from)) = scans.split_at_checked(index) else { return false };
    let Some(now_s) = from.first().map(|scan| scan.time_s) else { return false };
    let apart_s = |scan: &LabelledScan| (scan.time_s - now_s).abs();
    let near = |scan: &&LabelledScan| apart_s(scan) <= WHILE_S + LOOK_S;
    before.iter().rev().take_while(near).chain(from.iter().take_while(near)).any(|scan| {
        let labels = scan.labels_in_rig_m.iter().flatten();
        apart_s(scan) >= WHILE_S
            && labels
                .map(|label| scan.map_from_rig * label)
                .any(|place_m| nalgebra::distance(&place_m.xy(), &in_map_m.xy()) <= SAME_PLACE_M)
    })
}

#[cfg(test)]
mod tests {
    use geometry::ZoneSource;

    use super::*;

    const PERIOD_S: f64 = 0.1;

    fn zone(azimuth_min_rad: f64, azimuth_max_rad: f64) -> DynamicZone {
        DynamicZone {
            azimuth_min_rad,
            azimuth_max_rad,
            peak_std_dev_m: 1.0,
            source: ZoneSource::Measured,
            returns: None,
        }
    }

    fn scan(index: usize, labels_in_rig_m: &[[f64; 2]], zones: Vec<DynamicZone>) -> LabelledScan {
        let labels = labels_in_rig_m.iter().map(|&[x, y]| Point3::new(x, y, 0.0)).collect();
        LabelledScan {
            time_s: index as f64 * PERIOD_S,
            map_from_rig: Isometry3::identity(),
            zones,
            labels_in_rig_m: Some(labels),
            returns: Vec::new(),
        }
    }

    #[test]
    fn a_leg_is_gone_when_none_of_its_returns_is_left() {
        let back = |beam: usize, x: f64, y: f64, is_removed| ScanReturn {
            beam,
            range_m: x.hypot(y),
            in_rig_m: Point3::new(x, y, 0.0),
            is_removed,
        };
        let walk = |index: usize| LabelledScan {
            returns: vec![
                // The leg, of which one return is kept in every second scan.
                back(0, 2.0, 0.1 * index as f64, true),
                back(1, 2.05, 0.1 * index as f64, index.is_multiple_of(2)),
                // The other leg, and the wall, before which he is once.
                back(2, 2.0, 0.1 * index as f64 + 0.3, true),
                back(3, if index == 7 { 2.0 } else { 4.0 }, 0.0, index == 3 || index == 7),
            ],
            ..scan(index, &[[2.0, 0.1 * index as f64]], Vec::new())
        };
        let score = score_scan_zones(&(0..40).map(walk).collect::<Vec<_>>());
        assert_eq!((score.moving_legs, score.moving_legs_removed), (40, 20));
        assert_eq!((score.background_returns, score.background_returns_removed), (39, 1));
        assert_eq!(score.removed_share(), Some(0.5));
        assert_eq!(score.background_share(), Some(38.0 / 39.0));
    }

    #[test]
    fn who_walks_counts_and_who_stands_does_not() {
        // One person stands 2 m ahead; one walks across at 1 m/s, 3 m ahead; zones cover the left side only.
        let scans: Vec<_> = (0..40)
            .map(|index| {
                let walker_m = [3.0, 2.0 - index as f64 * PERIOD_S];
                scan(index, &[[2.0, 0.0], walker_m], vec![zone(0.01, 1.0)])
            })
            .collect();
        let score = score_scan_zones(&scans);
        assert_eq!((score.scans, score.scans_with_zone, score.zones), (40, 40, 40));
        assert_eq!((score.labels, score.moving_labels), (80, 40));
        assert_eq!(score.moving_labels_in_zone, 20);
        assert_eq!(score.found_share(), Some(0.5));
    }

    #[test]
    fn a_platform_that_moves_does_not_make_who_stands_a_walker() {
        let scans: Vec<_> = (0..40)
            .map(|index| {
                let driven_m = 0.5 * index as f64 * PERIOD_S;
                LabelledScan {
                    map_from_rig: Isometry3::translation(driven_m, 0.0, 0.0),
                    ..scan(index, &[[5.0 - driven_m, 1.0]], Vec::new())
                }
            })
            .collect();
        assert_eq!(score_scan_zones(&scans).moving_labels, 0);
    }

    #[test]
    fn zones_where_nobody_is_are_counted() {
        let mut scans =
            vec![scan(0, &[], vec![zone(0.0, 0.1), zone(0.5, 0.6)]), scan(1, &[], vec![])];
        scans.push(LabelledScan { labels_in_rig_m: None, ..scan(2, &[], vec![zone(0.0, 0.1)]) });
        let score = score_scan_zones(&scans);
        assert_eq!((score.empty_scans, score.zones_in_empty_scans), (2, 2));
        assert_eq!((score.zones, score.found_share()), (3, None));
        assert_eq!(score_scan_zones(&[]).zone_share(), None);
    }
}
