//! The method `rec_hv`: the angle stage and the depth stage (Rec-HV 3.2.5, 3.2.6). It remembers nothing.

use geometry::DetectedCycle;
use nalgebra::Point3;

use crate::angular::{azimuths_rad, points_in_zone};
use crate::depth_clustering::{depth_groups, nearest_group};
use crate::segmenter::{Judged, Step};

/// Where a point belongs.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    /// PCL_ze: outside of every zone.
    Static,
    /// PCL_Oe: within a zone, behind the object.
    InZone,
    /// PCL_Din: the object.
    Dynamic,
}

/// The two stages. A zone without points has no object, and each of several zones is handled by itself; a point of two zones
/// is dynamic if it is so in one of them.
#[derive(Clone, Debug)]
pub(crate) struct TwoStages {
    /// The width of a cell of the depth histogram.
    pub(crate) cell_m: f64,
}

impl TwoStages {
    pub(crate) fn step(&self, cycle: &DetectedCycle, observe: &mut impl FnMut(Step)) -> Judged {
        let points_in_rig_m = &cycle.reduced_cloud.points_m;

        // 3.2.5, eq. 6: the points between alpha1 and alpha2 are PCL_ZD, the others PCL_ze.
        let azimuths_rad = azimuths_rad(points_in_rig_m, &cycle.zones);
        let in_zones: Vec<Vec<usize>> =
            cycle.zones.iter().map(|zone| points_in_zone(&azimuths_rad, zone)).collect();
        observe(Step::Angular);

        // 3.2.6: of PCL_ZD, what is no farther than the nearest group is PCL_Din, the rest PCL_Oe.
        let mut parts = vec![Part::Static; points_in_rig_m.len()];
        for in_zone in &in_zones {
            self.mark_object(points_in_rig_m, in_zone, &mut parts);
        }
        observe(Step::DepthClustering);
        Judged {
            is_dynamic: parts.iter().map(|part| *part == Part::Dynamic).collect(),
            tracks: Vec::new(),
            in_zone: parts.iter().filter(|part| **part >= Part::InZone).count(),
            retracted_m: Vec::new(),
            floor_in_rig: None,
        }
    }

    /// Marks the points of one zone: the object up to x_max, and what is behind it.
    fn mark_object(&self, points_m: &[Point3<f32>], in_zone: &[usize], parts: &mut [Part]) {
        let groups = depth_groups(in_zone.iter().map(|index| points_m[*index].x), self.cell_m);
        let x_max_m = nearest_group(&groups).map(|object| object.max_x_m);
        for &index in in_zone {
            let is_object = x_max_m.is_some_and(|x_max_m| points_m[index].x <= x_max_m);
            let part = if is_object { Part::Dynamic } else { Part::InZone };
            parts[index] = parts[index].max(part);
        }
    }
}
