//! The record of a run, its figures, and the pages that show them.
//!
//! A [`RunRecord`] is filled by either transport. From it come a [`Summary`] (`summary.json`), pictures of the map
//! with and without removal, and a page that needs nothing but itself (`report.html`). Where the truth is known, the
//! summary holds a [`DynamicScore`], which the crate `evaluation` computes.
//!
//! [`MapDrawing`] has what needs no browser: pictures of the map in space, still and moving, and a small one for a terminal.
//!
//! The pages of all subcommands are made here: [`Page`] is one of sections with tables, [`Chart`]s and pictures.
//!
//! No ROS, no files, no clock: bytes and text go out, and the same record gives the same bytes.
//!
//! ```
//! use report::{Page, PagePart, PageSection, page_html};
//!
//! let text = PagePart::Text { label: "Here".to_owned(), text: "no object is left, 2 < 3".to_owned() };
//! let map = PageSection { id: "map".to_owned(), title: "The map".to_owned(), parts: vec![text] };
//! let html = page_html(&Page { title: "A run".to_owned(), sections: vec![map], ..Page::default() });
//! assert!(html.contains("<title>") && html.contains("2 &lt; 3"));
//! ```

mod chart;
mod cycle_view;
mod drawing;
mod figures_table;
mod headline;
mod html_document;
mod kept_out;
mod live_page;
mod page;
pub mod payload;
mod pictures;
mod run_record;
mod run_report;
mod scene;
mod summary;
mod timing;
mod truth_score;

pub use chart::{Axis, Chart, Marks, Series};
pub use cycle_view::{
    CLOUD_STEP_M, CycleView, RANGE_STEP_M, RigCamera, ScanView, SmallDepth, cloud_steps,
};
pub use drawing::{MapDrawing, TerminalColours, thumbnail};
pub use figures_table::figures_table;
pub use headline::headline;
pub use kept_out::{KeptOut, KeptOutCause};
pub use live_page::{live_page_html, live_page_policy};
pub use page::{
    CellTone, Page, PageCell, PagePart, PagePicture, PageRow, PageSection, PageTable, page_html,
};
pub use pictures::{
    CloudPicture, MapPictures, PictureError, PictureFrame, View, ViewPictures, cloud_pictures,
    map_pictures,
};
pub use run_record::{CycleRecord, DropCount, RunRecord, Transport};
pub use run_report::{report_html, report_html_within};
pub use scene::PageLimits;
pub use summary::{
    CycleCounts, DropSummary, KeptOutCounts, MapSummary, PointStatistics, StagePoints, Summary,
    ZoneShares,
};
pub use timing::{DurationStatistics, StepTiming, Timing};
pub use truth_score::{
    CloudDistance, CycleScore, DynamicScore, DynamicScoreRules, FirstFound, IDENTITY_GATE_M,
    IdentityScore, LabelScore, MapAccuracy, MapScore, ObjectCycleScore, ObjectScore, RemovedPoints,
    StaticVoxels,
};
