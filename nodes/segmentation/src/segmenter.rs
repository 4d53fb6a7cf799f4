//! One cycle's cloud into its static and dynamic parts.

use geometry::{
    Cloud, DetectedCycle, DynamicZone, MapPath, SegmentationCounts, SegmentedCycle, SteadyFrame,
    Track, UnusablePose, check_pose,
};
use nalgebra::Point3;

use crate::angular::points_in_zone;
use crate::config::{ConfigError, Method, SegmentationConfig};
use crate::depth_clustering::{depth_groups, nearest_group};
use crate::steady::{in_map, in_steady_frame};
use crate::stillmap::{Judged, Stillmap};

/// A stage of [`Segmenter::step`], for whoever times them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Step {
    /// What is known of the points' places, asked and learned; of `stillmap` alone, and ends twice a cycle.
    Evidence,
    /// The angular stage, of all zones (3.2.5); in `stillmap` all seeds.
    Angular,
    /// The depth stage, of all zones (3.2.6); in `stillmap` the growth from the seeds.
    DepthClustering,
    /// The objects followed; of `stillmap` alone.
    Tracking,
    /// The static part taken to the map frame (3.2.7).
    Transform,
}

impl Step {
    /// The step's name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Evidence => "evidence",
            Self::Angular => "angular",
            Self::DepthClustering => "depth_clustering",
            Self::Tracking => "tracking",
            Self::Transform => "transform",
        }
    }
}

/// What segmentation makes of a cycle.
#[derive(Clone, PartialEq, Debug)]
pub struct Segmented {
    /// What reconstruction needs.
    pub cycle: SegmentedCycle,
    /// What moves, followed over the cycles, by rising id; empty where nothing is followed.
    pub tracks: Vec<Track>,
    /// How many points each stage took.
    pub counts: SegmentationCounts,
}

/// A cycle that cannot be segmented.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum SegmentationError {
    /// A bound of a zone is not a number, or the bounds are the wrong way round.
    #[error(
        "cycle {index}: the dynamic zone from {azimuth_min_rad} to {azimuth_max_rad} rad is none; its bounds \
         must be finite and in this order"
    )]
    Zone {
        /// The cycle.
        index: u32,
        /// The right-hand bound.
        azimuth_min_rad: f64,
        /// The left-hand bound.
        azimuth_max_rad: f64,
    },
    /// The pose cannot carry a cloud: the static points would be lost.
    #[error("cycle {index}: {source}")]
    Pose {
        /// The cycle.
        index: u32,
        /// Why.
        source: UnusablePose,
    },
}

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

/// Cuts the moving objects out of each cycle's cloud (Rec-HV 3.3.3). With the method of Rec-HV it remembers
/// nothing from cycle to cycle.
#[derive(Clone, Debug)]
pub struct Segmenter {
    depth_cell_m: f64,
    /// With that method.
    stillmap: Option<Stillmap>,
    steady: SteadyFrame,
}

impl Segmenter {
    /// A segmenter with these parameters.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(config: SegmentationConfig) -> Result<Self, ConfigError> {
        config.validate()?;
        let stillmap = match config.method {
            Method::RecHv => None,
            Method::Stillmap => Some(Stillmap::new(config)?),
        };
        let steady = SteadyFrame::default();
        Ok(Self { depth_cell_m: config.depth_cell_m, stillmap, steady })
    }

    /// Takes the way of the platform as the map of its poses has it by now. Where the map was corrected, the pose jumps: what
    /// moves is looked for in a frame that does not ([`geometry::SteadyFrame`]), and tracks are told where the map has them.
    /// Without a path, and as long as none has moved, that frame is the map, to the bit.
    pub fn follow_path(&mut self, path: MapPath) {
        self.steady.take(path);
    }

    /// Voxels of evidence held now, at most `max_evidence_voxels`; the method of Rec-HV holds none.
    #[must_use]
    pub fn evidence_voxels(&self) -> usize {
        self.stillmap.as_ref().map_or(0, Stillmap::evidence_voxels)
    }

    /// Splits the cycle's reduced cloud: every point of it lands in exactly one of the two clouds, in
    /// the order it had. `observe` is called at the end of each stage.
    ///
    /// With the method of Rec-HV, a zone without points has no object, and each of several zones is handled by itself; a
    /// point of two zones is dynamic if it is so in one of them.
    ///
    /// # Errors
    /// When a zone or the pose holds numbers that mean nothing.
    pub fn step(
        &mut self,
        cycle: &DetectedCycle,
        mut observe: impl FnMut(Step),
    ) -> Result<Segmented, SegmentationError> {
        check(cycle)?;
        let judged = match &mut self.stillmap {
            Some(stillmap) => {
                let stamp = cycle.reduced_cloud.stamp;
                let map_from_steady = self.steady.map_from_steady(stamp, &cycle.map_frame_id);
                let steady = in_steady_frame(cycle, map_from_steady.as_ref());
                let mut judged = stillmap.step(&steady, &mut observe);
                if let Some(map_from_steady) = &map_from_steady {
                    judged
                        .tracks
                        .iter_mut()
                        .for_each(|track| *track = in_map(track, map_from_steady));
                }
                judged
            }
            None => self.two_stages(cycle, &mut observe),
        };
        let Judged { is_dynamic, tracks, in_zone } = judged;

        // Eq. 7: PCL_est = PCL_ze || PCL_Oe. Eq. 8: PCL_k = Mt_k * PCL_est.
        let static_in_rig = part_of(&cycle.reduced_cloud, &is_dynamic, false);
        let static_cloud = static_in_rig.transformed(&cycle.map_from_rig, &cycle.map_frame_id);
        let dynamic_cloud = part_of(&cycle.reduced_cloud, &is_dynamic, true);
        observe(Step::Transform);

        let counts = SegmentationCounts {
            reduced: is_dynamic.len(),
            in_zone,
            dynamic: dynamic_cloud.points_m.len(),
        };
        let cycle = SegmentedCycle {
            index: cycle.index,
            static_cloud,
            dynamic_cloud,
            map_from_rig: cycle.map_from_rig,
            camera_in_rig_m: cycle.camera_in_rig_m,
        };
        Ok(Segmented { cycle, tracks, counts })
    }

    /// The two stages of Rec-HV.
    fn two_stages(&self, cycle: &DetectedCycle, observe: &mut impl FnMut(Step)) -> Judged {
        let points_in_rig_m = &cycle.reduced_cloud.points_m;

        // 3.2.5, eq. 6: the points between alpha1 and alpha2 are PCL_ZD, the others PCL_ze.
        let in_zones: Vec<Vec<usize>> =
            cycle.zones.iter().map(|zone| points_in_zone(points_in_rig_m, zone)).collect();
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
        }
    }

    /// Marks the points of one zone: the object up to x_max, and what lies behind it.
    fn mark_object(&self, points_m: &[Point3<f32>], in_zone: &[usize], parts: &mut [Part]) {
        let groups =
            depth_groups(in_zone.iter().map(|index| points_m[*index].x), self.depth_cell_m);
        let x_max_m = nearest_group(&groups).map(|object| object.max_x_m);
        for &index in in_zone {
            let is_object = x_max_m.is_some_and(|x_max_m| points_m[index].x <= x_max_m);
            let part = if is_object { Part::Dynamic } else { Part::InZone };
            parts[index] = parts[index].max(part);
        }
    }
}

fn check(cycle: &DetectedCycle) -> Result<(), SegmentationError> {
    let index = cycle.index;
    for &DynamicZone { azimuth_min_rad, azimuth_max_rad, .. } in &cycle.zones {
        let in_order = azimuth_min_rad <= azimuth_max_rad;
        if !(in_order && azimuth_min_rad.is_finite() && azimuth_max_rad.is_finite()) {
            return Err(SegmentationError::Zone { index, azimuth_min_rad, azimuth_max_rad });
        }
    }
    check_pose(&cycle.map_from_rig).map_err(|source| SegmentationError::Pose { index, source })
}

/// The points of `cloud` that move, or those that do not, in their order.
fn part_of(cloud: &Cloud, is_dynamic: &[bool], wanted: bool) -> Cloud {
    let points_m = cloud
        .points_m
        .iter()
        .zip(is_dynamic)
        .filter_map(|(point, is_dynamic)| (*is_dynamic == wanted).then_some(*point))
        .collect();
    Cloud { stamp: cloud.stamp, frame_id: cloud.frame_id.clone(), points_m }
}

#[cfg(test)]
mod tests;
