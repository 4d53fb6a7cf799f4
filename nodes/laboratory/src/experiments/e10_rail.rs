//! Experiment 10: visual odometry on a rail (Rec-HV 3.1.10, 4.10, Table 8). Not run: there is no visual odometry
//! of our own yet.

use super::published::TABLES;
use super::section::{Section, Shown, Words};
use super::table::{Cell, Row, Table, Unit, Verdict};
use robot::Failure;

pub(crate) fn present() -> Result<Section, Failure> {
    let names = ["largest", "mean", "RMSE", "standard deviation"];
    let rows = TABLES.get()?.rail.iter().flat_map(|axis| {
        names.iter().zip(axis.errors_m).map(|(name, error_m)| {
            let cells = [Cell::published(Unit::Metres, error_m), Cell::Verdict(Verdict::NotRun)];
            Row::new(format!("{}: {name}", axis.axis), cells)
        })
    });
    let table = Table::new("Error of the pose on the rail", ["published", "here"], rows.collect());
    Ok(Section::new(words(), Shown { tables: vec![table], ..Shown::default() }))
}

fn words() -> Words {
    Words {
        key: "10",
        title: "10. Visual odometry on a rail",
        thesis: "The sensors go forward and back on a rail, and the pose of ORB-SLAM2 is compared with a sensor of \
                 displacement on the rail.",
        here: "Not run. The pose of these experiments is the simulator's own, without error: to compare it with the \
               truth would say nothing. The suite has no visual odometry yet; when it has, this experiment is to be \
               run with it."
            .to_owned(),
        comparability: "There is nothing of ours to compare; the published figures stand here as the mark to reach.",
    }
}
