//! The published results on the benchmark: the PL-SLAM thesis' on ten sequences, and those of others.

use serde::Deserialize;
use simulator::SlamRun;

use crate::published_file::{PublishedFile, of_yaml};

/// The thesis' tables.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub(super) struct Published {
    /// The names of the other systems in Table 15.
    pub(super) others: [String; 4],
    /// The means of Table 16: median and mean tracking time.
    pub(super) mean_times_s: [f64; 2],
    /// In the order of Tables 14 to 16.
    pub(super) sequences: Vec<PublishedSequence>,
}

/// `published.yaml`.
pub(super) static PUBLISHED: PublishedFile<Published> =
    PublishedFile::new("eval/tum/published.yaml", || of_yaml(include_str!("published.yaml")));

impl Published {
    /// The published results of the sequence with this name.
    pub(super) fn of(&self, name: &str) -> Option<&PublishedSequence> {
        self.sequences.iter().find(|sequence| sequence.name == name)
    }
}

/// A sequence of the thesis.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub(super) struct PublishedSequence {
    /// Its name in the data set, without `rgbd_dataset_`.
    pub(super) name: String,
    /// The thesis' table of its ten runs.
    pub(super) table: u8,
    /// Table 14: RMSE, mean, median, standard deviation, least and largest error in metres; median and mean tracking time in
    /// seconds. Means of ten runs, as printed.
    pub(super) thesis: [f64; 8],
    /// Table 15, in centimetres, in the order of [`Published::others`].
    pub(super) others_cm: [Option<f64>; 4],
    /// The best other published result.
    pub(super) best: Option<Best>,
}

/// A result of another publication.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub(super) struct Best {
    /// Root of the mean squared error of the positions.
    pub(super) rmse_m: f64,
    /// The method.
    pub(super) of: String,
}

impl PublishedSequence {
    /// The target in metres: the better of the thesis' result and the best other one.
    pub(super) fn aim_m(&self) -> f64 {
        let [rmse_m, ..] = self.thesis;
        self.best.as_ref().map_or(rmse_m, |best| best.rmse_m.min(rmse_m))
    }

    /// Where it can be downloaded.
    pub(super) fn address(&self) -> String {
        let camera = self.name.split('_').next().unwrap_or_default();
        let name = &self.name;
        format!("https://cvg.cit.tum.de/rgbd/dataset/{camera}/rgbd_dataset_{name}.tgz")
    }
}

/// A simulated counterpart of a sequence.
#[derive(Debug)]
pub(super) struct Counterpart {
    /// Its name in `stillmap simulate`.
    pub(super) run: SlamRun,
    /// The sequence, without `rgbd_dataset_`.
    pub(super) of: &'static str,
    /// The target in metres.
    pub(super) aim_m: f64,
}

/// The targets for scenes without walking people.
const STILL_AIM_M: f64 = 0.010;

/// In the order of Tables 14 to 16. The targets are this project's: for walking people DynaSLAM's published results on the
/// sequences, otherwise the best published results on the easy ones.
pub(super) const COUNTERPARTS: [Counterpart; 10] = {
    const fn of(run: SlamRun, of: &'static str, aim_m: f64) -> Counterpart {
        Counterpart { run, of, aim_m }
    }
    [
        of(SlamRun::DeskXyz, "freiburg1_xyz", STILL_AIM_M),
        of(SlamRun::SlowXyz, "freiburg2_xyz", STILL_AIM_M),
        of(SlamRun::LongOffice, "freiburg3_long_office_household", STILL_AIM_M),
        of(SlamRun::TexturedPlane, "freiburg3_nostructure_texture_near_withloop", STILL_AIM_M),
        of(SlamRun::ZigZag, "freiburg3_structure_texture_near", STILL_AIM_M),
        of(SlamRun::DeskWithPerson, "freiburg2_desk_with_person", STILL_AIM_M),
        of(SlamRun::SittingXyz, "freiburg3_sitting_xyz", STILL_AIM_M),
        of(SlamRun::SittingHalfsphere, "freiburg3_sitting_halfsphere", STILL_AIM_M),
        of(SlamRun::WalkingXyz, "freiburg3_walking_xyz", 0.015),
        of(SlamRun::WalkingHalfsphere, "freiburg3_walking_halfsphere", 0.025),
    ]
};

/// Whether a simulated counterpart has this name.
pub(super) fn is_counterpart(name: &str) -> bool {
    COUNTERPARTS.iter().any(|counterpart| counterpart.run.name() == name)
}
