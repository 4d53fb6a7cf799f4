//! The trajectory, from above (Road LiDAR, section 3.2): about the vehicle, which stays in the middle and looks up
//! (option A), or all of it on a map that stays (option B).

mod canvas;
#[cfg(test)]
mod tests;

use nalgebra::{Isometry3, Point2, Vector3};

use canvas::Canvas;
pub use canvas::Picture;

/// The view of a drawing.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum DrawnView {
    /// The vehicle in the middle, looking up; the trajectory turns about it (option A).
    AboutVehicle {
        /// From the middle to the edges.
        radius_m: f64,
    },
    /// All of the trajectory, x to the right (option B).
    Whole,
}

/// The poses and points that are drawn.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DrawnTrajectory<'a> {
    /// Where the vehicle was, the latest last; in a frame with z up.
    pub map_from_vehicle: &'a [Isometry3<f64>],
    /// Where it truly was, if that is known; in the same frame.
    pub truth: Option<&'a [Isometry3<f64>]>,
    /// The surroundings, from above: drawn below the trajectory.
    pub surroundings_m: &'a [Point2<f32>],
}

/// Colours that are distinguishable with red-green colour blindness, too (Okabe and Ito 2008).
const BACKGROUND: [u8; 3] = [255, 255, 255];
const GRID: [u8; 3] = [225, 225, 225];
const SURROUNDINGS: [u8; 3] = [150, 150, 150];
const TRUTH: [u8; 3] = [230, 159, 0];
const TRAJECTORY: [u8; 3] = [0, 114, 178];
const VEHICLE: [u8; 3] = [213, 94, 0];
const START: [u8; 3] = [0, 158, 115];

/// A drawing leaves this share free at each side.
const MARGIN: f64 = 0.06;
/// The grid has at least this many squares from side to side.
const LEAST_SQUARES: f64 = 4.0;
/// The least extent of a whole trajectory: that of a static vehicle is visible, too.
const LEAST_EXTENT_M: f64 = 10.0;

/// Draws a trajectory as a square of `edge_px`, at least 1, with a grid whose lines are 1, 2, 5, 10, ... m apart; the result has the distance.
#[must_use]
pub fn drawn(trajectory: &DrawnTrajectory<'_>, view: DrawnView, edge_px: usize) -> Drawing {
    let edge_px = edge_px.max(1);
    let frame = Frame::of(trajectory, view, edge_px);
    let mut canvas = Canvas::new(edge_px, BACKGROUND);
    let grid_m = frame.grid_m();
    frame.draw_grid(&mut canvas, grid_m);
    for place in trajectory.surroundings_m {
        canvas.dot(frame.px(f64::from(place.x), f64::from(place.y)), 0, SURROUNDINGS);
    }
    let places = |poses: &[Isometry3<f64>]| -> Vec<[f64; 2]> {
        poses.iter().map(|pose| frame.px(pose.translation.x, pose.translation.y)).collect()
    };
    if let Some(truth) = trajectory.truth {
        canvas.trajectory(&places(truth), 1, TRUTH);
    }
    let places = places(trajectory.map_from_vehicle);
    canvas.trajectory(&places, 1, TRAJECTORY);
    if let Some(first) = places.first() {
        canvas.dot(*first, 4, START);
    }
    if let Some(last) = trajectory.map_from_vehicle.last() {
        frame.draw_vehicle(&mut canvas, last);
    }
    Drawing { picture: canvas.into_picture(), grid_m }
}

/// A drawing and its scale.
#[derive(Clone, PartialEq, Debug)]
pub struct Drawing {
    /// The picture.
    pub picture: Picture,
    /// From one line of the grid to the next.
    pub grid_m: f64,
}

/// How places become pixels.
struct Frame {
    /// The place in the middle.
    middle_m: [f64; 2],
    /// Cosine and sine of the turn that brings the vehicle's heading up.
    turn: [f64; 2],
    px_per_m: f64,
    edge_px: f64,
}

impl Frame {
    fn of(trajectory: &DrawnTrajectory<'_>, view: DrawnView, edge_px: usize) -> Self {
        let edge_px = edge_px as f64;
        match view {
            DrawnView::AboutVehicle { radius_m } => {
                let last =
                    trajectory.map_from_vehicle.last().copied().unwrap_or_else(Isometry3::identity);
                let ahead = last.rotation * Vector3::x();
                let (sin, cos) = (std::f64::consts::FRAC_PI_2 - ahead.y.atan2(ahead.x)).sin_cos();
                let px_per_m = 0.5 * edge_px / radius_m.max(f64::MIN_POSITIVE);
                let middle_m = [last.translation.x, last.translation.y];
                Self { middle_m, turn: [cos, sin], px_per_m, edge_px }
            }
            DrawnView::Whole => {
                let poses = trajectory
                    .map_from_vehicle
                    .iter()
                    .chain(trajectory.truth.into_iter().flatten());
                let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
                for pose in poses {
                    for (axis, value) in
                        [pose.translation.x, pose.translation.y].into_iter().enumerate()
                    {
                        low[axis] = low[axis].min(value);
                        high[axis] = high[axis].max(value);
                    }
                }
                if !low.iter().chain(&high).all(|value| value.is_finite()) {
                    (low, high) = ([0.0; 2], [0.0; 2]);
                }
                let extent_m = (high[0] - low[0]).max(high[1] - low[1]).max(LEAST_EXTENT_M);
                Self {
                    middle_m: [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])],
                    turn: [1.0, 0.0],
                    px_per_m: (1.0 - 2.0 * MARGIN) * edge_px / extent_m,
                    edge_px,
                }
            }
        }
    }

    /// From the left and from the top.
    fn px(&self, x_m: f64, y_m: f64) -> [f64; 2] {
        let [x_m, y_m] = [x_m - self.middle_m[0], y_m - self.middle_m[1]];
        let [cos, sin] = self.turn;
        let (right_m, up_m) = (cos * x_m - sin * y_m, sin * x_m + cos * y_m);
        let half_px = 0.5 * self.edge_px;
        [half_px + self.px_per_m * right_m, half_px - self.px_per_m * up_m]
    }

    /// The largest of 1, 2, 5, 10, ... m of which there are enough.
    fn grid_m(&self) -> f64 {
        let most_m = self.edge_px / self.px_per_m / LEAST_SQUARES;
        let decade = 10.0_f64.powf(most_m.max(f64::MIN_POSITIVE).log10().floor());
        [5.0, 2.0].into_iter().find(|step| step * decade <= most_m).unwrap_or(1.0) * decade
    }

    /// Lines at whole multiples of the grid, in the map's axes.
    fn draw_grid(&self, canvas: &mut Canvas, grid_m: f64) {
        // The corners are farthest.
        let reach_m = self.edge_px / self.px_per_m;
        let lines = |middle_m: f64| {
            let (from, to) = ((middle_m - reach_m) / grid_m, (middle_m + reach_m) / grid_m);
            (from.floor() as i64..=to.ceil() as i64).map(move |line| line as f64 * grid_m)
        };
        let [x_m, y_m] = self.middle_m;
        for line_m in lines(x_m) {
            canvas.line(self.px(line_m, y_m - reach_m), self.px(line_m, y_m + reach_m), 0, GRID);
        }
        for line_m in lines(y_m) {
            canvas.line(self.px(x_m - reach_m, line_m), self.px(x_m + reach_m, line_m), 0, GRID);
        }
    }

    /// An arrow of a size that is seen at every scale.
    fn draw_vehicle(&self, canvas: &mut Canvas, pose: &Isometry3<f64>) {
        let size_m = 0.025 * self.edge_px / self.px_per_m;
        let corner = |x: f64, y: f64| {
            let place =
                pose.translation.vector + pose.rotation * (size_m * Vector3::new(x, y, 0.0));
            self.px(place.x, place.y)
        };
        canvas.triangle([corner(1.0, 0.0), corner(-0.7, 0.7), corner(-0.7, -0.7)], VEHICLE);
    }
}
