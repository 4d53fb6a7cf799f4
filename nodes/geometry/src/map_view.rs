//! Where a map was seen from: what it has no points of may be empty there, or may never have been in view. Who compares two maps
//! has to tell one from the other.

#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::fmt;
use std::str::FromStr;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use crate::{CameraModel, Distortion, Stamp, VoxelKey};

/// Views nearer to each other than this, in place and direction, show the same: half an arm's length, and a quarter of the width of a
/// depth camera's image.
const NEAR_M: f64 = 0.3;
const NEAR_RAD: f64 = 0.26;

/// A place of a depth camera that took part in a map.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MapView {
    /// When the image was taken.
    pub stamp: Stamp,
    /// The camera's optical frame in the frame of the map.
    pub map_from_camera: Isometry3<f64>,
    /// The camera. Its distortion does not survive a file.
    pub camera: CameraModel,
}

impl MapView {
    /// Whether another view shows nearly the same.
    fn is_near(&self, other: &Self) -> bool {
        let (here, there) = (&self.map_from_camera, &other.map_from_camera);
        (here.translation.vector - there.translation.vector).norm() < NEAR_M
            && here.rotation.angle_to(&there.rotation) < NEAR_RAD
    }

    /// The area of the image at a depth of a metre, between the centres of its outermost pixels.
    fn area(&self) -> f64 {
        let CameraModel { width_px, height_px, fx_px, fy_px, .. } = self.camera;
        let along = |pixels: usize, focal_px: f64| pixels.saturating_sub(1) as f64 / focal_px;
        along(width_px, fx_px) * along(height_px, fy_px)
    }

    /// Views that are near have their places in cells of [`NEAR_M`] that touch.
    fn cell(&self) -> VoxelKey {
        let cell_of = |value_m: f64| (value_m / NEAR_M).floor() as i32;
        let [x, y, z] = self.map_from_camera.translation.vector.map(cell_of).into();
        VoxelKey { x, y, z }
    }
}

/// As one line of text: nanoseconds, position, quaternion (x y z w), width, height, fx, fy, cx, cy.
impl fmt::Display for MapView {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { stamp, map_from_camera: Isometry3 { translation, rotation }, camera } = self;
        let ([x, y, z], [i, j, k, w]) = (translation.vector.into(), rotation.coords.into());
        let CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, .. } = camera;
        write!(f, "{} {x:.4} {y:.4} {z:.4} {i:.5} {j:.5} {k:.5} {w:.5}", stamp.as_nanos())?;
        write!(f, " {width_px} {height_px} {fx_px:.2} {fy_px:.2} {cx_px:.2} {cy_px:.2}")
    }
}

/// A text is no view.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("a view of a map is 14 numbers: a stamp, a pose, and a pinhole camera")]
pub struct NoView;

impl FromStr for MapView {
    type Err = NoView;

    fn from_str(text: &str) -> Result<Self, NoView> {
        let words: [&str; 14] =
            text.split_ascii_whitespace().collect::<Vec<_>>().try_into().map_err(|_| NoView)?;
        let [stamp, numbers @ ..] = words;
        let stamp = stamp.parse().map(Stamp::from_nanos).map_err(|_| NoView)?;
        let mut values = [0.0_f64; 13];
        for (value, word) in values.iter_mut().zip(numbers) {
            *value = word.parse().ok().filter(|value: &f64| value.is_finite()).ok_or(NoView)?;
        }
        let [x, y, z, i, j, k, w, width, height, fx_px, fy_px, cx_px, cy_px] = values;
        let rotation = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 0.5).ok_or(NoView)?;
        // Sizes are whole numbers; what a camera may have is checked below.
        let (width_px, height_px) = (width as usize, height as usize);
        let distortion = Distortion::None;
        let camera = CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion };
        camera.validate().map_err(|_| NoView)?;
        let map_from_camera = Isometry3::from_parts(Translation3::new(x, y, z), rotation);
        Ok(Self { stamp, map_from_camera, camera })
    }
}

/// The views of a map, none of them near another, in the order in which they came.
///
/// # Memory
/// Some 200 bytes a view, of which there are [`MapViews::MOST`] at most: of more the oldest go.
#[derive(Clone, Debug, Default)]
pub struct MapViews {
    views: Vec<MapView>,
    /// The indices of the views, by the cell of their place.
    by_cell: HashMap<VoxelKey, Vec<usize>>,
}

impl MapViews {
    /// The most views that are kept: of a way of an hour and more through new places.
    pub const MOST: usize = 16_384;

    /// The views.
    #[must_use]
    pub fn as_slice(&self) -> &[MapView] {
        &self.views
    }

    /// Adds a view, unless one that is near is there. A wider one takes the place of those near it.
    pub fn add(&mut self, view: MapView) {
        let beside = view.cell().with_neighbours();
        let beside = beside.filter_map(|cell| self.by_cell.get(&cell)).flatten();
        let near = beside.filter_map(|index| self.views.get(*index));
        let areas = near.filter(|known| known.is_near(&view)).map(MapView::area);
        if let Some(widest) = areas.reduce(f64::max) {
            if widest >= view.area() {
                return;
            }
            self.keep(|known| !known.is_near(&view));
        }
        if self.views.len() == Self::MOST {
            self.forget_first(Self::MOST / 16);
        }
        self.push(view);
    }

    /// Forgets the views that came before one that was taken at this moment or earlier, and that one.
    pub fn forget_until(&mut self, stamp: Stamp) {
        if let Some(last) = self.views.iter().rposition(|view| view.stamp <= stamp) {
            self.forget_first(last + 1);
        }
    }

    fn forget_first(&mut self, count: usize) {
        let mut index = 0..;
        self.keep(|_| index.next().is_some_and(|index| index >= count));
    }

    fn keep(&mut self, is_kept: impl FnMut(&MapView) -> bool) {
        let mut views = std::mem::take(self).views;
        views.retain(is_kept);
        views.into_iter().for_each(|view| self.push(view));
    }

    fn push(&mut self, view: MapView) {
        self.by_cell.entry(view.cell()).or_default().push(self.views.len());
        self.views.push(view);
    }

    /// Moves each view by the motion of its moment, in the frame of the map.
    pub fn correct(&mut self, now_from_before: impl Fn(Stamp) -> Isometry3<f64>) {
        for mut view in std::mem::take(self).views {
            view.map_from_camera = now_from_before(view.stamp) * view.map_from_camera;
            self.push(view);
        }
    }
}

impl FromIterator<MapView> for MapViews {
    fn from_iter<I: IntoIterator<Item = MapView>>(views: I) -> Self {
        let mut all = Self::default();
        views.into_iter().for_each(|view| all.add(view));
        all
    }
}
