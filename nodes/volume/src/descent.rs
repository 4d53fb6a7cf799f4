//! Finds the blocks that an image affects: from large cubes down to blocks, each classified as a whole where possible.

use nalgebra::{Point3, Vector3};

use crate::block::{BLOCK_EDGE, BlockKey};
use crate::camera_frame::CameraFrame;
use crate::depth_view::DepthView;
use crate::levels::level_of;
use crate::noise::DepthNoise;
use crate::projection::{Covered, Extent, LANES, Project};

/// The maximum number of root cubes along an axis of the box around the view, less one.
const ROOTS_AN_AXIS: i64 = 4;
/// Cubes have at most `2^20` blocks an axis.
const MOST_LEVEL: u32 = 20;

/// The class of a cube by an image.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Verdict {
    /// It is outside of the image, or out of reach.
    Unseen,
    /// No pixel that it may cover has a return; a part of it may be outside of the image.
    Blank,
    /// It is behind the surfaces in the image.
    Hidden,
    /// All of it is free, with the required margin.
    Free,
    /// Its parts may differ.
    Mixed,
}

/// The margins around the depth of the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Margins {
    /// Space is certainly free only if it is nearer than the depth by more than this.
    pub(crate) before_m: f32,
    /// Space farther than the depth by less than this is not hidden.
    pub(crate) behind: Behind,
    /// Cubes farther from the camera are not classified: depth along the axis or range, as in the image.
    pub(crate) reach_m: f32,
}

/// The range behind a depth in which nodes are updated. A depth that is measured too short puts the surface too near: within
/// the range of such errors, nodes behind must count as much as nodes in front, or the mean is biased away from the camera.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Behind {
    /// Full weight up to at least this distance,
    pub(crate) full_m: f32,
    /// and up to this many standard deviations of the depth.
    pub(crate) full_in_sigmas: f32,
    /// From there on the weight falls to zero over this distance, so that both sides of a thin object can be mapped
    /// (Bylow et al., "Real-time camera tracking and 3D reconstruction using signed distance functions", RSS 2013,
    /// section III-C).
    pub(crate) falls_in_m: f32,
}

impl Behind {
    /// The distance up to which the weight is full.
    #[inline(always)]
    pub(crate) fn full_to_m(&self, depth_m: f32, noise: &DepthNoise) -> f32 {
        self.full_m.max(self.full_in_sigmas * noise.sigma_m(depth_m))
    }

    /// The distance at which the weight is zero.
    #[inline(always)]
    pub(crate) fn ends_m(&self, depth_m: f32, noise: &DepthNoise) -> f32 {
        self.full_to_m(depth_m, noise) + self.falls_in_m
    }
}

/// Classifies cubes by an image: the image, its projection and the transform from the map.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Judge<'a, P> {
    view: &'a DepthView,
    projection: P,
    pub(crate) frame: CameraFrame,
    margins: Margins,
    /// The edge of the voxels that are compared with coarser levels; 0 where only the finest level is used.
    sampled_edge_m: f32,
}

impl<'a, P: Project> Judge<'a, P> {
    pub(crate) fn new(
        view: &'a DepthView,
        projection: P,
        margins: Margins,
        sampled_edge_m: f32,
    ) -> Self {
        let frame = CameraFrame::new(&view.map_from_camera);
        Self { view, projection, frame, margins, sampled_edge_m }
    }

    /// The margin before a depth beyond which space is certainly free.
    pub(crate) fn before_m(&self) -> f32 {
        self.margins.before_m
    }

    /// The part of the image that a cube with this centre covers.
    #[inline]
    pub(crate) fn extent(&self, middle_in_map_m: &Point3<f64>, edge_m: f32) -> Extent {
        self.projection.extent(&self.frame.around_cube(middle_in_map_m, edge_m))
    }

    /// The class of a cube with this centre.
    #[inline]
    pub(crate) fn judge(&self, middle_in_map_m: &Point3<f64>, edge_m: f32) -> Verdict {
        self.judge_extent(&self.extent(middle_in_map_m, edge_m))
    }

    /// The classes of several cubes of one size with these centres.
    #[inline]
    pub(crate) fn judge_all(
        &self,
        middles_in_map_m: &[Point3<f64>; LANES],
        edge_m: f32,
    ) -> [Verdict; LANES] {
        let boxes = self.frame.around_cubes(middles_in_map_m, edge_m);
        let mut verdicts = [Verdict::Unseen; LANES];
        self.projection.for_each_extent(&boxes, |lane, extent| {
            if let Some(verdict) = verdicts.get_mut(lane) {
                *verdict = self.judge_extent(&extent);
            }
        });
        verdicts
    }

    #[inline]
    fn judge_extent(&self, extent: &Extent) -> Verdict {
        let covered = match extent {
            Extent::Outside => return Verdict::Unseen,
            Extent::Undecided => return Verdict::Mixed,
            Extent::Within(covered) => covered,
        };
        let Margins { before_m, behind, reach_m } = self.margins;
        let Covered { nearest_m, farthest_m, columns, rows, is_cut } = *covered;
        if nearest_m > reach_m {
            return Verdict::Unseen;
        }
        let beside_px = self.beside_px(nearest_m);
        let grown = |[first, last]: [u32; 2]| [first.saturating_sub(beside_px), last + beside_px];
        let span = self.view.tiles.span(grown(columns), grown(rows));
        if span.known_to_m == 0.0 {
            Verdict::Blank
        } else if nearest_m > span.known_to_m + behind.ends_m(span.known_to_m, &self.view.noise) {
            Verdict::Hidden
        } else if !is_cut && farthest_m <= reach_m && farthest_m + before_m < span.free_to_m {
            Verdict::Free
        } else {
            Verdict::Mixed
        }
    }

    /// Whether some eighth of a cube is mixed, and whether some is free.
    pub(crate) fn eighths(&self, middle_in_map_m: &Point3<f64>, edge_m: f64) -> (bool, bool) {
        let middles_m = std::array::from_fn(|eighth| {
            let aside_m = Vector3::new(eighth & 1, eighth >> 1 & 1, eighth >> 2)
                .map(|upper| (upper as f64 - 0.5) * 0.5 * edge_m);
            middle_in_map_m + aside_m
        });
        let verdicts = self.judge_all(&middles_m, 0.5 * edge_m as f32);
        (verdicts.contains(&Verdict::Mixed), verdicts.contains(&Verdict::Free))
    }

    /// How many pixels a pixel of the voxel's coarser level extends beyond the voxel's own pixel.
    fn beside_px(&self, nearest_m: f32) -> u32 {
        if self.sampled_edge_m == 0.0 {
            return 0;
        }
        (1 << level_of(self.sampled_edge_m, self.view.pixel_slope(), nearest_m)) - 1
    }
}

/// Finds the blocks that an image affects.
pub(crate) struct Descent<'a, P> {
    pub(crate) judge: &'a Judge<'a, P>,
    pub(crate) block_edge_m: f64,
    /// The maximum number of classified cubes: it bounds the time.
    pub(crate) most_judged: usize,
}

impl<P: Project> Descent<'_, P> {
    /// Calls `visit` with each largest cube that is free or blank (its least block, and its level: the edge is `2^level` blocks),
    /// and with each block that is mixed. In a fixed order, nearer ones first. Returns whether the whole view was visited.
    pub(crate) fn run(&self, mut visit: impl FnMut(BlockKey, u32, Verdict)) -> bool {
        let Margins { reach_m, behind, .. } = self.judge.margins;
        let farthest_m = self.judge.view.farthest_m();
        if farthest_m <= 0.0 {
            return true;
        }
        let behind_m = behind.ends_m(farthest_m, &self.judge.view.noise);
        let Some((roots, level)) = self.roots(reach_m.min(farthest_m + behind_m)) else {
            return true;
        };
        let mut judged = 0;
        for root in roots {
            let verdict = self.judge.judge(&self.middle_m(root, level), self.edge_m(level) as f32);
            if !self.visit_cube(root, level, verdict, &mut judged, &mut visit) {
                return false;
            }
        }
        true
    }

    fn visit_cube(
        &self,
        least: BlockKey,
        level: u32,
        verdict: Verdict,
        judged: &mut usize,
        visit: &mut impl FnMut(BlockKey, u32, Verdict),
    ) -> bool {
        *judged += 1;
        if *judged > self.most_judged {
            return false;
        }
        match verdict {
            Verdict::Unseen | Verdict::Hidden => return true,
            Verdict::Free | Verdict::Blank => visit(least, level, verdict),
            Verdict::Mixed if level == 0 => visit(least, level, verdict),
            Verdict::Mixed => {
                let children = self.children(least, level);
                let middles_m = children.map(|child| self.middle_m(child, level - 1));
                let verdicts = self.judge.judge_all(&middles_m, self.edge_m(level - 1) as f32);
                for (child, verdict) in children.into_iter().zip(verdicts) {
                    if !self.visit_cube(child, level - 1, verdict, judged, visit) {
                        return false;
                    }
                }
            }
        }
        true
    }

    /// The eighths of a cube above level 0. The one on the camera's side comes first, so that cubes that are left out are far away.
    fn children(&self, least: BlockKey, level: u32) -> [BlockKey; LANES] {
        let (half, middle_m) = (1_i32 << (level - 1), self.middle_m(least, level));
        let camera_m = self.judge.frame.camera_in_map_m;
        let nearest = [0, 1, 2].map(|axis: usize| camera_m[axis] > middle_m[axis]);
        std::array::from_fn(|eighth| {
            let step = |axis: usize| {
                let is_upper = (eighth >> axis & 1 == 1) != nearest[axis];
                if is_upper { half } else { 0 }
            };
            least.offset(step(0), step(1), step(2))
        })
    }

    /// The edge of the cubes of a level.
    fn edge_m(&self, level: u32) -> f64 {
        self.block_edge_m * f64::from(1_u32 << level)
    }

    fn middle_m(&self, least: BlockKey, level: u32) -> Point3<f64> {
        let half = 0.5 * f64::from(1_u32 << level);
        Point3::from(least.coordinates().map(|along| (f64::from(along) + half) * self.block_edge_m))
    }

    /// The cubes that together contain the view, nearest first.
    fn roots(&self, depth_m: f32) -> Option<(Vec<BlockKey>, u32)> {
        let view = self.judge.view;
        let hull = self.judge.projection.hull_m(depth_m);
        let hull = hull.map(|corner| view.map_from_camera * Point3::from(corner).cast::<f64>());
        let (mut least_m, mut most_m) = (hull[0], hull[0]);
        for corner in &hull {
            (least_m, most_m) = (least_m.inf(corner), most_m.sup(corner));
        }
        let key = |value_m: f64| (value_m / self.block_edge_m).floor() as i64;
        let (least, most) = (least_m.coords.map(key), most_m.coords.map(key));
        let longest = (most - least).max();
        let level = (0..MOST_LEVEL).find(|level| longest >> level < ROOTS_AN_AXIS)?;
        let along = |axis: usize| {
            let (first, last) = (least[axis] >> level, most[axis] >> level);
            (first..=last).filter_map(move |cube| i32::try_from(cube << level).ok())
        };
        let mut roots: Vec<BlockKey> = along(2)
            .flat_map(|z| along(1).flat_map(move |y| along(0).map(move |x| BlockKey { x, y, z })))
            .collect();
        let distance_m2 = |root: &BlockKey| {
            (self.middle_m(*root, level) - self.judge.frame.camera_in_map_m).norm_squared()
        };
        roots.sort_by(|a, b| distance_m2(a).total_cmp(&distance_m2(b)).then(a.cmp(b)));
        Some((roots, level))
    }
}

/// The edge of a block.
pub(crate) fn block_edge_m(voxel_edge_m: f64) -> f64 {
    voxel_edge_m * BLOCK_EDGE as f64
}
