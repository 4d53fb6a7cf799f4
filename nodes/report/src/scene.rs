//! What the 3D view of the page shows: the map and what is not in it, and what the sensors saw in each cycle.
//!
//! The page carries it as a header in JSON and as blocks of bytes that are compressed (deflate, RFC 1951) and written in 85 characters;
//! `page/src/payload.js` reads them. The viewer itself is `page/bundle.js`, which `page/build.sh` makes of `page/src`.

mod cycles;
pub(crate) mod moments;
mod point_set;
#[cfg(test)]
mod tests;
mod triangles;
mod views;

use geometry::VoxelEdgeError;
use maud::{Markup, PreEscaped, html};
use nalgebra::{Isometry3, Point3};
use serde_json::{Value, json};

use self::moments::Moments;
use self::point_set::PointSet;
use self::triangles::Triangles;
use self::views::VIEWS_PER_GROUP;
use crate::cycle_view::RANGE_STEP_M;
use crate::payload::{
    self, Effort, HEIGHT_COLOURS, as_text, deflated, drawn_colour, json_in_script,
};
use crate::{KeptOutCause, RunRecord, Summary};

/// The viewer.
const BUNDLE: &str = include_str!("../page/bundle.js");
/// The hash of the viewer, as the page's Content-Security-Policy has it.
const BUNDLE_HASH: &str = include_str!("../page/bundle.hash");
/// The style of the viewer.
pub(crate) const STYLE: &str = include_str!("../page/viewer.css");

/// Share of the map's points beyond each end of an axis that do not decide how large the map is.
const OUTLIER_SHARE: f64 = 0.005;

/// How much of a run a page carries.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PageLimits {
    /// Points of the map: a larger one is thinned evenly. A point takes about 4 bytes of the page.
    pub map_points: usize,
    /// Points that were removed as moving.
    pub removed_points: usize,
    /// Triangles of the map: more are made coarser. A triangle takes about 4 bytes of the page. They are to show the surface; fine detail is in the points.
    pub triangles: usize,
}

impl Default for PageLimits {
    fn default() -> Self {
        // 20 MB of a page of 40 MB; the rest is for the views.
        Self { map_points: 5_000_000, removed_points: 500_000, triangles: 150_000 }
    }
}

/// The scripts of a page are these and no others, and it loads nothing.
pub(crate) fn content_security_policy() -> String {
    format!(
        "default-src 'none'; script-src '{BUNDLE_HASH}'; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
}

/// The data of the 3D view and its script: the last of the page.
pub(crate) fn scene(
    run: &RunRecord,
    summary: &Summary,
    limits: &PageLimits,
) -> Result<Markup, VoxelEdgeError> {
    let moments = Moments::of(run)?;
    let spacing_m = run.map_spacing_m();
    let (total, most) = (run.static_map.len(), limits.map_points);
    let point = |index: usize| {
        let point_m = run.static_map[index];
        (point_m, moments.first_seen(&point_m))
    };
    let map = if total > 0 && run.map_colours.len() == total {
        PointSet::thinned_with_colours(spacing_m, (total, most), |index| {
            let (point_m, moment) = point(index);
            (point_m, moment, drawn_colour(run.map_colours[index]))
        })
    } else {
        PointSet::thinned(spacing_m, (total, most), point)
    };
    let removed = removed_points(run, limits);
    let kept_out = PointSet::of_classes(
        run.voxel_edge_m,
        summary.kept_out.iter().map(|voxel| (voxel.point_m, voxel.cause as u8)),
    );
    let views = views::encode(run)?;
    let sets = [("map", &map), ("removed", &removed), ("kept_out", &kept_out)];
    let mesh = run.mesh.as_ref().filter(|mesh| !mesh.triangles.is_empty());
    let mesh = mesh.map(|mesh| Triangles::of(mesh, limits.triangles, spacing_m));
    let mut header = header(run, summary, &sets);
    if let Some(mesh) = &mesh {
        header["mesh"] = mesh.header();
    }
    Ok(html! {
        (data("header", "application/json", &json_in_script(&header)))
        (block("cycles", cycles::encode(run).to_string().as_bytes()))
        @for (name, set) in &sets { (block(name, &set.bytes)) }
        @if let Some(mesh) = &mesh { (block("mesh", &mesh.bytes)) }
        @for (number, group) in views.iter().enumerate() { (block(&format!("views-{number}"), group)) }
        (script())
    })
}

/// The viewer.
pub(crate) fn script() -> Markup {
    html! { script { (PreEscaped(BUNDLE)) } }
}

fn header(run: &RunRecord, summary: &Summary, sets: &[(&str, &PointSet)]) -> Value {
    let points: serde_json::Map<String, Value> =
        sets.iter().map(|(name, set)| ((*name).to_owned(), set.header())).collect();
    let (bounds_m, heights_m) = bounds_m(run);
    let causes: Vec<Value> = KeptOutCause::ALL
        .iter()
        .map(|cause| {
            json!({
                "id": cause, "name": cause.name(), "meaning": cause.meaning(), "colour": colour(*cause),
                "moved": *cause == KeptOutCause::Moved, "voxels": summary.map.kept_out.of(*cause),
            })
        })
        .collect();
    json!({
        "title": run.bag_name, "frame": run.map_frame_id, "points": points, "bounds_m": bounds_m, "heights_m": heights_m,
        "height_colours": HEIGHT_COLOURS, "causes": causes, "camera": run.rig_camera().as_ref().map(payload::camera),
        "rig_from_lidar": payload::pose(&run.rig_from_lidar), "range_step_m": RANGE_STEP_M, "cloud_step_m": payload::CLOUD_STEP_M,
        "views_per_group": VIEWS_PER_GROUP, "map_unit": run.map_unit(),
    })
}

/// The colours of the causes, on a dark ground.
fn colour(cause: KeptOutCause) -> &'static str {
    match cause {
        KeptOutCause::Moved => "#ff8a3d",
        KeptOutCause::BesideSurface => "#8b9bb0",
        KeptOutCause::SeenThrough => "#b58cff",
        KeptOutCause::NoRoom => "#5bd1a5",
        KeptOutCause::NoReturn => "#f06fa8",
        KeptOutCause::SeenOnce => "#ecd95a",
        KeptOutCause::Uncertain => "#ffffff",
    }
}

/// The points that were classified as moving, in the map frame, from the cycle on in which they were.
fn removed_points(run: &RunRecord, limits: &PageLimits) -> PointSet {
    let points: Vec<(Point3<f32>, u16)> = run
        .cycles
        .iter()
        .enumerate()
        .flat_map(|(ordinal, cycle)| {
            let map_from_rig: Isometry3<f32> = cycle.map_from_rig.cast();
            let moment = moments::moment(ordinal);
            cycle.dynamic_points_m.iter().map(move |point_m| (map_from_rig * point_m, moment))
        })
        .collect();
    let counts = (points.len(), limits.removed_points);
    PointSet::thinned(run.voxel_edge_m, counts, |index| points[index])
}

/// The corners of what is to be in view, the map without its outliers and the path of the rig; and the lowest and the highest
/// height of the map likewise.
pub(crate) fn bounds_m(run: &RunRecord) -> ([[f32; 3]; 2], [f32; 2]) {
    let axis = |axis: usize| {
        let values_m = run.static_map.iter().map(|point_m| point_m[axis]).collect();
        range_without_outliers(values_m).unwrap_or([0.0; 2])
    };
    let of_map = [0, 1, 2].map(axis);
    let with_path = [0, 1, 2].map(|axis| {
        let path =
            run.cycles.iter().map(|cycle| cycle.map_from_rig.translation.vector[axis] as f32);
        path.fold(of_map[axis], |[low_m, high_m], at_m| [low_m.min(at_m), high_m.max(at_m)])
    });
    ([0, 1].map(|end| with_path.map(|axis| axis[end])), of_map[2])
}

/// The lowest and the highest of the values but for the outliers and what is not finite; none where there are none.
pub(crate) fn range_without_outliers(mut values: Vec<f32>) -> Option<[f32; 2]> {
    values.retain(|value| value.is_finite());
    let last = values.len().checked_sub(1)?;
    let outliers = (last as f64 * OUTLIER_SHARE) as usize;
    let mut at = |index: usize| *values.select_nth_unstable_by(index, f32::total_cmp).1;
    Some([at(outliers), at(last - outliers)])
}

fn block(name: &str, bytes: &[u8]) -> Markup {
    data(name, "text/plain", &as_text(&deflated(bytes, Effort::Usual)))
}

fn data(name: &str, kind: &str, text: &str) -> Markup {
    html! { script type=(kind) id=(format!("scene-{name}")) { (PreEscaped(text)) } }
}
