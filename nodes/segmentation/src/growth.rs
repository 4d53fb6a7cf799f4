//! The object grown from its seeds through the cloud.

#[cfg(test)]
mod tests;

use geometry::VoxelKey;

/// How a point of the cycle stands to what is known of its place.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Standing {
    /// Background or floor, or out of reach: growth stops there.
    Still,
    /// Nothing is known of its place.
    New,
    /// The camera would have seen it there before (module `recent_views`), though its place was not seen free; or it is
    /// at the height of a floor that is not seen.
    Arrived,
    /// In a place that was seen free, with a surface in a voxel beside it: what the noise of depth and
    /// of the pose throws off a surface, or an object that stands close to one.
    CameBesideSurface,
    /// In a place that was seen free, all by itself.
    Came,
}

impl Standing {
    /// Whether it stands where free space was seen.
    #[must_use]
    pub fn came(self) -> bool {
        matches!(self, Self::Came | Self::CameBesideSurface)
    }

    /// Whether it was not there before, by rays or by what the camera would have seen.
    #[must_use]
    pub fn is_newcomer(self) -> bool {
        self.came() || self == Self::Arrived
    }

    /// Whether it was not there before, and no surface is beside it that noise may have thrown it off.
    #[must_use]
    pub fn came_alone(self) -> bool {
        matches!(self, Self::Came | Self::Arrived)
    }

    /// How many voxels lie between it and what it is linked to, at most, and one. The reduced cloud leaves
    /// an empty voxel here and there within a surface; only in space known to be free is it certain that
    /// what lies across the gap is no background.
    fn reach_voxels(self) -> i32 {
        if self == Self::Came { 2 } else { 1 }
    }
}

/// The points that are not still, found by their voxels.
#[derive(Clone, Debug)]
pub struct Candidates<'a> {
    standings: &'a [Standing],
    voxels: &'a [VoxelKey],
    /// Voxel and index of each candidate, sorted.
    by_voxel: Vec<(VoxelKey, usize)>,
}

impl<'a> Candidates<'a> {
    /// The candidates among points, whose standings and voxels are given in the same order.
    #[must_use]
    pub fn new(standings: &'a [Standing], voxels: &'a [VoxelKey]) -> Self {
        let mut by_voxel: Vec<_> = standings
            .iter()
            .zip(voxels)
            .enumerate()
            .filter(|(_, (standing, _))| **standing != Standing::Still)
            .map(|(index, (_, voxel))| (*voxel, index))
            .collect();
        by_voxel.sort_unstable();
        Self { standings, voxels, by_voxel }
    }

    /// The connected groups of candidates that hold a seed: each in ascending order of the points, the
    /// groups by their first seed. Growth enters only points that `may_take` accepts; seeds are taken
    /// whatever it says.
    ///
    /// Two points are linked when their voxels touch, or lie one apart where both are `Came`.
    #[must_use]
    pub fn grown_from(&self, seeds: &[usize], may_take: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
        let mut seen = vec![false; self.standings.len()];
        let mut is_seed = vec![false; self.standings.len()];
        for &seed in seeds {
            is_seed[seed] = true;
        }
        let mut groups = Vec::new();
        for &seed in seeds {
            if std::mem::replace(&mut seen[seed], true) {
                continue;
            }
            let mut group = vec![seed];
            let mut next = 0;
            while let Some(&from) = group.get(next) {
                next += 1;
                self.for_each_linked(from, |to| {
                    if !seen[to] && (is_seed[to] || may_take(to)) {
                        seen[to] = true;
                        group.push(to);
                    }
                });
            }
            group.sort_unstable();
            groups.push(group);
        }
        groups
    }

    fn for_each_linked(&self, from: usize, mut visit: impl FnMut(usize)) {
        let reach = self.standings[from].reach_voxels();
        let VoxelKey { x, y, z } = self.voxels[from];
        let beside = |value: i32, by: i32| value.saturating_add(by);
        for dx in -reach..=reach {
            for dy in -reach..=reach {
                // Keys are sorted by x, then y, then z: a column along z is one stretch.
                let at = |dz| VoxelKey { x: beside(x, dx), y: beside(y, dy), z: beside(z, dz) };
                let (low, high) = (at(-reach), at(reach));
                let first = self.by_voxel.partition_point(|(voxel, _)| *voxel < low);
                for &(voxel, to) in self.by_voxel[first..].iter().take_while(|(v, _)| *v <= high) {
                    let dz = voxel.z.saturating_sub(z);
                    let apart = dx.abs().max(dy.abs()).max(dz.saturating_abs());
                    if apart <= self.standings[to].reach_voxels() {
                        visit(to);
                    }
                }
            }
        }
    }
}
