//! What the PL-SLAM thesis has measured on ten sequences, and what it and others have published of them.

use simulator::SlamRun;

/// A sequence of the thesis.
#[derive(Debug)]
pub(super) struct Published {
    /// Its name in the data set, without `rgbd_dataset_`.
    pub(super) name: &'static str,
    /// The thesis' table of its ten runs.
    pub(super) table: u8,
    /// Table 14: RMSE, mean, median, standard deviation, least and largest error in metres; median and mean tracking time in
    /// seconds. Means of ten runs, as printed.
    pub(super) thesis: [f64; 8],
    /// Table 15, in centimetres: ORB-SLAM, PTAM, LSD-SLAM, RGBD-SLAM.
    pub(super) others_cm: [Option<f64>; 4],
    /// The best that is published of it besides, in metres, and by whom.
    pub(super) best: Option<(f64, &'static str)>,
}

impl Published {
    /// What is aimed at, in metres: the better of the thesis' and the best.
    pub(super) fn aim_m(&self) -> f64 {
        let [rmse_m, ..] = self.thesis;
        self.best.map_or(rmse_m, |(best_m, _)| best_m.min(rmse_m))
    }

    /// Where it is had.
    pub(super) fn address(&self) -> String {
        let camera = self.name.split('_').next().unwrap_or_default();
        let name = self.name;
        format!("https://cvg.cit.tum.de/rgbd/dataset/{camera}/rgbd_dataset_{name}.tgz")
    }
}

/// What Table 15 calls the others.
pub(super) const OTHERS: [&str; 4] = ["ORB-SLAM", "PTAM", "LSD-SLAM", "RGBD-SLAM"];

/// The thesis' mean of Table 16: median and mean tracking time.
pub(super) const MEAN_TIMES_S: [f64; 2] = [0.193_386_93, 0.196_662_04];

const ORB_SLAM2: &str = "ORB-SLAM2 RGB-D";
const DYNA_SLAM: &str = "DynaSLAM";

/// In the order of Tables 14 to 16.
pub(super) const SEQUENCES: [Published; 10] = [
    Published {
        name: "freiburg1_xyz",
        table: 5,
        thesis: [
            0.0094588, 0.0081533, 0.0074297, 0.0047506, 0.0015508, 0.0212112, 0.1787609, 0.1751403,
        ],
        others_cm: [Some(1.38), Some(1.15), Some(9.0), Some(1.34)],
        best: None,
    },
    Published {
        name: "freiburg2_xyz",
        table: 6,
        thesis: [
            0.0028902, 0.0026358, 0.0024931, 0.0011816, 0.0006507, 0.0052374, 0.2220995, 0.2246417,
        ],
        others_cm: [Some(0.54), Some(0.2), Some(2.15), Some(2.61)],
        best: None,
    },
    Published {
        name: "freiburg3_long_office_household",
        table: 4,
        thesis: [
            0.0590727, 0.0492972, 0.0441114, 0.0475287, 0.01279906, 0.1963556, 0.195512, 0.19848731,
        ],
        others_cm: [Some(4.05), None, Some(38.53), None],
        best: Some((0.010, ORB_SLAM2)),
    },
    Published {
        name: "freiburg3_nostructure_texture_near_withloop",
        table: 8,
        thesis: [
            0.1512661, 0.1519077, 0.1323819, 0.05054396, 0.06091777, 0.2691192, 0.2052659,
            0.2152639,
        ],
        others_cm: [Some(2.88), Some(2.74), Some(7.54), None],
        best: Some((0.019, ORB_SLAM2)),
    },
    Published {
        name: "freiburg3_structure_texture_near",
        table: 9,
        thesis: [
            0.0267468, 0.0244468, 0.0223451, 0.0112999, 0.0074597, 0.0588414, 0.184492, 0.1940455,
        ],
        others_cm: [Some(1.5451), Some(1.04), None, None],
        best: None,
    },
    Published {
        name: "freiburg2_desk_with_person",
        table: 7,
        thesis: [
            0.0277862, 0.0262602, 0.0258044, 0.0088079, 0.0093048, 0.0496, 0.1998169, 0.2078379,
        ],
        others_cm: [Some(5.95), None, Some(31.73), Some(6.97)],
        best: None,
    },
    Published {
        name: "freiburg3_sitting_xyz",
        table: 10,
        thesis: [
            0.0199143, 0.0184066, 0.0182521, 0.0074909, 0.0046736, 0.0358783, 0.2166033, 0.2074018,
        ],
        // The first as printed.
        others_cm: [Some(0.08), Some(0.83), Some(7.73), None],
        best: None,
    },
    Published {
        name: "freiburg3_sitting_halfsphere",
        table: 11,
        thesis: [
            0.0265885, 0.02194796, 0.02194796, 0.0126997, 0.0050021, 0.0670302, 0.1988952,
            0.19872355,
        ],
        others_cm: [Some(1.48), None, Some(5.87), None],
        best: None,
    },
    Published {
        name: "freiburg3_walking_xyz",
        table: 12,
        thesis: [
            0.0207109, 0.0173107, 0.0151597, 0.0106872, 0.0050733, 0.0475757, 0.135224, 0.1490779,
        ],
        others_cm: [Some(1.64), None, Some(12.44), None],
        best: Some((0.015, DYNA_SLAM)),
    },
    Published {
        name: "freiburg3_walking_halfsphere",
        table: 13,
        thesis: [
            0.0819636, 0.0715726, 0.0689467, 0.03957497, 0.0161642, 0.17743672, 0.1971996,
            0.19600054,
        ],
        others_cm: [Some(2.09), None, None, None],
        best: Some((0.025, DYNA_SLAM)),
    },
];

/// What is published of the sequence of this name.
pub(super) fn of(name: &str) -> Option<&'static Published> {
    SEQUENCES.iter().find(|sequence| sequence.name == name)
}

/// A simulated counterpart of a sequence.
#[derive(Debug)]
pub(super) struct Counterpart {
    /// What `stillmap simulate` calls it.
    pub(super) run: SlamRun,
    /// The sequence, without `rgbd_dataset_`.
    pub(super) of: &'static str,
    /// What is aimed at, in metres.
    pub(super) aim_m: f64,
}

/// Where nobody walks.
const STILL_AIM_M: f64 = 0.010;

/// In the order of Tables 14 to 16. What is aimed at is this project's: of people who walk what DynaSLAM has published of the
/// sequences, else what the best have of the easy ones.
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
