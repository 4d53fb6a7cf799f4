//! Why two maps are not merged.

use registration::RegistrationError;

use crate::alignment::Candidate;

/// Two maps are not merged. Maps are numbered 0 and 1.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum MergeError {
    /// There is nothing to register.
    #[error(transparent)]
    Registration(#[from] RegistrationError),
    /// A map has no point.
    #[error("{} has no points", ordinal(*.map))]
    Empty {
        /// Which one.
        map: usize,
    },
    /// The edge of voxels is none.
    #[error("voxels of {edge_m} m are no map's")]
    Edge {
        /// The edge.
        edge_m: f64,
    },
    /// A map has too few walls.
    #[error(
        "{} has {upright_m2:.1} m2 of upright surface, and {least_m2:.1} m2 are needed: its walls and furniture are what it is aligned by",
        ordinal(*.map)
    )]
    NoWalls {
        /// Which one.
        map: usize,
        /// What it has.
        upright_m2: f64,
        /// What is needed.
        least_m2: f64,
    },
    /// A map is too wide.
    #[error("{} is {:.0} m x {:.0} m wide from above, which is more than can be searched", ordinal(*.map), .extent_m[0], .extent_m[1])]
    TooWide {
        /// Which one.
        map: usize,
        /// Along x and y.
        extent_m: [f64; 2],
    },
    /// Nothing of the one map comes to lie upon the other.
    #[error("the maps do not overlap: nowhere do surfaces of one lie upon those of the other")]
    NoOverlap,
    /// Nowhere do they agree enough.
    #[error(
        "the maps do not fit: at the best place {:.0} % of the upright surfaces that both know agree ({:.1} m2 agree, {:.1} m2 contradict), \
         which are {:.0} % of the smaller map; needed are {:.0} %, {least_m2:.0} m2 and {:.0} %",
        100.0 * .best.agreement.share(), .best.agreement.same_m2, .best.agreement.contradicting_m2, 100.0 * .best.agreement.overlap,
        100.0 * .least, 100.0 * .least_overlap
    )]
    NoAgreement {
        /// The best place.
        best: Box<Candidate>,
        /// The share that is to agree.
        least: f64,
        /// The share of the smaller map that the other must know.
        least_overlap: f64,
        /// The surface that is to agree.
        least_m2: f64,
    },
    /// They agree in two places.
    #[error(
        "the maps fit in two places: {:.0} % of the upright surfaces agree in one ({:.1} m2), and {:.0} % in the other ({:.1} m2), {:.2} m and {:.0} degrees from it",
        100.0 * .best.agreement.share(), .best.agreement.same_m2, 100.0 * .next.agreement.share(), .next.agreement.same_m2,
        (.best.a_from_b.translation.vector - .next.a_from_b.translation.vector).norm(),
        .best.a_from_b.rotation.angle_to(&.next.a_from_b.rotation).to_degrees()
    )]
    Ambiguous {
        /// The best place.
        best: Box<Candidate>,
        /// The other one.
        next: Box<Candidate>,
    },
    /// A direction is not determined, as along a bare corridor.
    #[error("the surfaces of both maps do not determine where the one lies in the other{}", along(.shift))]
    Undetermined {
        /// The direction in the first map, where it is one.
        shift: Option<[f64; 3]>,
    },
    /// The caller ended the work.
    #[error("interrupted")]
    Interrupted,
}

fn ordinal(map: usize) -> &'static str {
    if map == 0 { "the first map" } else { "the second map" }
}

fn along(shift: &Option<[f64; 3]>) -> String {
    shift.map_or_else(String::new, |[x, y, z]| {
        format!(": along ({x:.2}, {y:.2}, {z:.2}) it may be shifted")
    })
}
