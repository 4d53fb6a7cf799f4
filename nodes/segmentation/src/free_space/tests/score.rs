//! How well a run tells what moves.

use super::*;

#[derive(Clone, Debug, Default)]
pub(super) struct Score {
    /// True moving points, away from borders, and those of them that were cut out.
    pub(super) moving: usize,
    pub(super) found: usize,
    /// Points cut out, and those of them that are true or at a border.
    pub(super) cut: usize,
    pub(super) right: usize,
    /// The same two without any tolerance.
    pub(super) strict_moving: usize,
    pub(super) strict_found: usize,
    pub(super) strict_right: usize,
    /// Static points, and those of them that were cut out though at no border.
    pub(super) still: usize,
    pub(super) lost: usize,
    /// From the true centre of the visible surface to the track's position, squared, on the ground and in
    /// height, and how many.
    pub(super) centre_m2: f64,
    pub(super) height_m2: f64,
    pub(super) centres: usize,
    /// The same for the plain mean of the points that were cut out.
    pub(super) mean_m2: f64,
    pub(super) means: usize,
    /// Cycles with a true object in view, and those without a track seen near it.
    pub(super) cycles: usize,
    pub(super) unfollowed: usize,
    /// The numbers of the tracks nearest to each object, in the order of their first cycle.
    pub(super) ids: BTreeMap<u16, Vec<u32>>,
    /// Points cut out in each cycle.
    pub(super) cut_of_cycle: Vec<usize>,
    /// Of the depth image: pixels of objects, and those of them in the mask; the same of the pixels within [`RIM_PX`] of
    /// something else; and pixels of the room, and those of them in the mask.
    pub(super) pixels: [usize; 2],
    pub(super) rim_pixels: [usize; 2],
    pub(super) room_pixels: [usize; 2],
    /// Time that the segmentation took over all cycles.
    pub(super) took_s: f64,
}

impl Score {
    pub(super) fn recall(&self) -> f64 {
        self.found as f64 / self.moving.max(1) as f64
    }

    pub(super) fn precision(&self) -> f64 {
        self.right as f64 / self.cut.max(1) as f64
    }

    pub(super) fn pixel_recall(&self) -> f64 {
        self.pixels[1] as f64 / self.pixels[0].max(1) as f64
    }

    pub(super) fn rim_recall(&self) -> f64 {
        self.rim_pixels[1] as f64 / self.rim_pixels[0].max(1) as f64
    }

    /// The share of the room's pixels that the mask takes from a cycle.
    pub(super) fn room_masked(&self) -> f64 {
        self.room_pixels[1] as f64 / self.room_pixels[0].max(1) as f64
    }

    fn take_pixels(&mut self, view: &room::View, is_moving: &[bool]) {
        let is_rim = rim_of(&view.ids_of_pixels);
        for ((id, is_moving), is_rim) in view.ids_of_pixels.iter().zip(is_moving).zip(is_rim) {
            let count = |[all, masked]: &mut [usize; 2]| {
                *all += 1;
                *masked += usize::from(*is_moving);
            };
            if *id == 0 {
                count(&mut self.room_pixels);
            } else {
                count(&mut self.pixels);
            }
            if *id != 0 && is_rim {
                count(&mut self.rim_pixels);
            }
        }
    }

    pub(super) fn static_lost(&self) -> f64 {
        self.lost as f64 / self.still.max(1) as f64
    }

    pub(super) fn centre_rmse_m(&self) -> f64 {
        (self.centre_m2 / self.centres.max(1) as f64).sqrt()
    }

    /// Takes in a cycle: its view and what was made of it.
    pub(super) fn take(&mut self, view: &room::View, segmented: &Segmented) {
        let mut cut = segmented.cycle.dynamic_cloud.points_m.iter().peekable();
        let (mut sum_m, mut count) = (Vector3::zeros(), 0.0);
        let mut true_cut = 0;
        for (index, point) in view.cycle.reduced_cloud.points_m.iter().enumerate() {
            let is_cut = cut.next_if_eq(&point).is_some();
            let (is_true, is_border) = (view.ids[index] != 0, view.is_border[index]);
            if is_true {
                self.strict_moving += 1;
                self.strict_found += usize::from(is_cut);
                if !is_border || is_cut {
                    self.moving += 1;
                    self.found += usize::from(is_cut);
                }
            } else {
                self.still += 1;
                self.lost += usize::from(is_cut && !is_border);
            }
            if is_cut {
                self.cut += 1;
                self.right += usize::from(is_true || is_border);
                self.strict_right += usize::from(is_true);
                true_cut += usize::from(is_true);
                sum_m += (view.cycle.map_from_rig * point.cast::<f64>()).coords;
                count += 1.0;
            }
        }
        assert!(cut.next().is_none());
        self.take_pixels(view, segmented.cycle.depth.as_ref().unwrap().is_moving());
        self.cut_of_cycle.push(segmented.counts.dynamic);
        let objects: Vec<_> = view.centres_m.iter().filter(|(id, _)| **id != 0).collect();
        if let [(_, (centre_m, _))] = objects[..]
            && true_cut > 0
        {
            self.mean_m2 += (Point3::from(sum_m / count) - centre_m).norm_squared();
            self.means += 1;
        }
        /// As many pixels of 160 x 120 as 200 of 640 x 480.
        const IN_VIEW_PX: usize = 13;
        for (id, (centre_m, _)) in objects.into_iter().filter(|(_, (_, n))| *n >= IN_VIEW_PX) {
            self.cycles += 1;
            let nearest = segmented
                .tracks
                .iter()
                .filter(|track| track.unseen_cycles == 0)
                .min_by(|a, b| {
                    let off_m = |track: &geometry::Track| (track.position_m - centre_m).norm();
                    off_m(a).total_cmp(&off_m(b))
                })
                .filter(|track| (track.position_m - centre_m).norm() < 0.3);
            let Some(track) = nearest else {
                self.unfollowed += 1;
                continue;
            };
            let off_m = track.position_m - centre_m;
            self.centre_m2 += off_m.xy().norm_squared();
            self.height_m2 += off_m.z.powi(2);
            self.centres += 1;
            let ids = self.ids.entry(*id).or_default();
            if !ids.contains(&track.id) {
                ids.push(track.id);
            }
        }
    }
}

/// 5 px of 640.
const RIM_PX: usize = 1;

/// Which pixels have one that shows something else within [`RIM_PX`].
fn rim_of(ids: &[u16]) -> Vec<bool> {
    let width_px = room::SIZE_PX.0 as usize;
    let rows = ids.len() / width_px;
    let is_rim = |pixel: usize| {
        let (row, column) = (pixel / width_px, pixel % width_px);
        let around =
            |at: usize, most: usize| at.saturating_sub(RIM_PX)..(at + RIM_PX + 1).min(most);
        around(row, rows)
            .flat_map(|row| around(column, width_px).map(move |column| row * width_px + column))
            .any(|other| ids[other] != ids[pixel])
    };
    (0..ids.len()).map(is_rim).collect()
}

/// What is looked at, and how.
pub(super) struct Run<'a> {
    pub(super) config: SegmentationConfig,
    pub(super) room: Vec<Solid>,
    pub(super) moving: &'a dyn Fn(f64) -> Vec<Solid>,
    /// When detection gives zones at all.
    pub(super) is_zoned: &'a dyn Fn(f64) -> bool,
    pub(super) room_from_rig: &'a dyn Fn(f64) -> Isometry3<f64>,
    pub(super) cycles: u32,
    /// Deviations of the reported pose: each coordinate in m, each angle in rad.
    pub(super) pose_noise: (f64, f64),
}

impl Run<'_> {
    /// Runs the segmenter. The zones are missing in every fifth cycle.
    pub(super) fn score(&self, seed: u64) -> Score {
        let mut segmenter = Segmenter::new(self.config.clone()).unwrap();
        let mut random = Random::new(seed);
        let mut score = Score::default();
        let map_from_room = (self.room_from_rig)(0.0).inverse();
        for index in 0..self.cycles {
            let time_s = f64::from(index) * CYCLE_S;
            let mut solids = self.room.clone();
            solids.extend((self.moving)(time_s));
            let room_from_rig = (self.room_from_rig)(time_s);
            let mut noise = |std_dev: f64| Vector3::from_fn(|_, _| std_dev * random.normal());
            let error = Isometry3::from_parts(
                Translation3::from(noise(self.pose_noise.0)),
                UnitQuaternion::from_scaled_axis(noise(self.pose_noise.1)),
            );
            let map_from_rig = map_from_room * room_from_rig * error;
            let mut view = look(&solids, index, &room_from_rig, map_from_rig, &mut random);
            view.cycle.setup = self.config.pipeline.setup();
            if index % 5 == 4 || !(self.is_zoned)(time_s) {
                view.cycle.zones.clear();
            }
            let start = Instant::now();
            let segmented = segmenter.step(&view.cycle, |_| ()).unwrap();
            score.took_s += start.elapsed().as_secs_f64();
            score.take(&view, &segmented);
        }
        score
    }
}
