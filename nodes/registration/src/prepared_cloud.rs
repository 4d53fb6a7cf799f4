//! A cloud that is ready for registration: thinned out, in the order of a tree, with normals.

use estimation::{Executor, Symmetric3};
use geometry::{VoxelGrid, is_finite};
use nalgebra::{Point3, Vector3};

use super::config::PreparationConfig;
use super::error::RegistrationError;
use super::kd_tree::KdTree;
use super::normal::normals;
use super::surface::{Surface, SurfaceElement};

/// Points of one sensor frame, prepared as source or target of a registration.
#[derive(Clone, Debug)]
pub struct PreparedCloud {
    tree: KdTree,
    normals: Vec<Vector3<f32>>,
    not_finite: usize,
}

impl PreparedCloud {
    /// Thins out the points (metres, in the sensor's frame), and finds the normal of each. Points that are not finite are
    /// left out. The same points make the same cloud to the bit, whatever the number of threads.
    ///
    /// # Errors
    /// When a parameter is out of its range, or no point is finite.
    pub fn new(
        points_m: &[Point3<f32>],
        config: &PreparationConfig,
        executor: &dyn Executor,
    ) -> Result<Self, RegistrationError> {
        config.validate()?;
        let finite = points_m.iter().filter(|point| is_finite(point)).count();
        if finite == 0 {
            return Err(RegistrationError::Empty { points: points_m.len() });
        }
        let thinned: Vec<Point3<f32>> = match VoxelGrid::new(config.voxel_edge_m) {
            Ok(grid) => grid.reduce(points_m),
            // An edge of 0 keeps them all.
            Err(_) => points_m.iter().copied().filter(is_finite).collect(),
        };
        let tree = KdTree::new(&thinned, executor);
        let normals = normals(&tree, config.neighbours, executor);
        Ok(Self { tree, normals, not_finite: points_m.len() - finite })
    }

    /// How many points are left after thinning out.
    #[must_use]
    pub fn len(&self) -> usize {
        self.tree.len()
    }

    /// Whether there is none: never.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.tree.len() == 0
    }

    /// How many points were left out since they were not finite.
    #[must_use]
    pub fn not_finite(&self) -> usize {
        self.not_finite
    }

    /// The points, each with the normal of its surface (of length 1, its sign means nothing) where its neighbours lie on
    /// one.
    pub fn points_m(&self) -> impl Iterator<Item = (Point3<f32>, Option<Vector3<f32>>)> + '_ {
        self.normals.iter().enumerate().map(|(number, normal)| {
            let normal = (*normal != Vector3::zeros()).then_some(*normal);
            (Point3::from(self.tree.point_m(number)), normal)
        })
    }

    /// A point by its number, and its normal or zero.
    #[inline]
    #[must_use]
    pub fn point(&self, number: usize) -> (Vector3<f64>, Vector3<f64>) {
        (Vector3::from(self.tree.point_m(number)).cast(), self.normals[number].cast())
    }
}

impl Surface for PreparedCloud {
    #[inline]
    fn corresponding(
        &self,
        place_m: &Vector3<f64>,
        limit_m: f64,
        before: Option<u32>,
    ) -> Option<u32> {
        let place_m = [place_m.x as f32, place_m.y as f32, place_m.z as f32];
        self.tree.nearest(place_m, (limit_m * limit_m) as f32, before)
    }

    #[inline]
    fn element(&self, number: u32) -> SurfaceElement {
        let (place_m, normal) = self.point(number as usize);
        SurfaceElement { place_m, normals: Symmetric3::outer(&normal) }
    }
}
