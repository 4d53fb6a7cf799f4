//! How well a run did: scores against the truth, figures of speed and growth, and the report page.
//!
//! Everything starts from a [`RunRecord`], which the front door fills from either transport. From it
//! come a [`Summary`] (`summary.json`), pictures of the map with and without removal, and a page that
//! needs nothing but itself (`report.html`). Where the truth is known, [`score_dynamic`] says how much
//! of each moving object was removed and what that cost the static scene.
//!
//! No ROS, no files, no clock: bytes and text go out, and the same record gives the same bytes.

mod chart;
mod cloud_distance;
mod correlation;
mod dynamic_score;
mod headline;
mod html_document;
mod identity;
mod page;
mod pictures;
mod report;
mod run_record;
mod scan_zones;
mod summary;
mod timing;
pub mod trajectory;
mod truth;

pub use chart::{Axis, Chart, Marks, Series};
pub use cloud_distance::{CloudDistance, CloudDistanceError, cloud_distance};
pub use correlation::{Correlation, CorrelationError, LocalisedView, correlation};
pub use dynamic_score::{
    CycleScore, DynamicScore, DynamicScoreRules, FirstFound, LabelScore, MapAccuracy, MapScore,
    ObjectCycleScore, ObjectScore, RemovedPoints, ScoreError, StaticVoxels, score_dynamic,
};
pub use headline::headline;
pub use identity::{IdentityCycle, IdentityScore, score_identities};
pub use page::{
    CellTone, Page, PageCell, PagePart, PagePicture, PageRow, PageSection, PageTable, page_html,
};
pub use pictures::{
    CloudPicture, MapPictures, PictureError, PictureFrame, View, ViewPictures, cloud_pictures,
    map_pictures,
};
pub use report::report_html;
pub use run_record::{CycleRecord, DropCount, RunRecord, Transport};
pub use scan_zones::{LabelledScan, ScanZoneScore, score_scan_zones};
pub use summary::{
    CycleCounts, DropSummary, MapSummary, PointStatistics, StagePoints, Summary, ZoneShares,
};
pub use timing::{DurationStatistics, StepTiming, Timing};
pub use truth::{LabelledPoint, TruthFrame, TruthFrameError};
