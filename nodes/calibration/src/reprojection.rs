//! The reprojection error of a camera, and what it comes to in the scene (Rec-HV Annex 1).
//!
//! Annex 1 prints one number, 0.114397 px: neither the pictures of the board nor an error for each of them, so it
//! cannot be computed again. What follows from it can: [`angle_of_px_rad`] is its equation 13, [`sideways_m`] its equations
//! 14 and 15. And what the number says of a camera can be shown on boards that are simulated ([`reprojection_error`]).
//!
//! Two of the printed results are slips. Equation 14 has tan(1 degree) * 3 m = 0.047 m, and equation 15
//! tan(0.01018135 degrees) * 3 m = 0.004797 m; they are 0.0524 m and 0.000533 m. The printed ones come out when the
//! calculator takes the angles for gradians (0.0471 m; 0.00047979 m, with its decimal point one place off). So the shift
//! at 3 m is half a millimetre, not five.

#[cfg(test)]
mod tests;

use geometry::CameraModel;
use nalgebra::{Isometry3, Point2, Point3};

/// The angle that corresponds to an error in the image: a camera of `width_px` columns sees `field_of_view_rad`
/// (Rec-HV eq. 13, which rounds 57 / 640 to 0.089 degrees a pixel).
#[must_use]
pub fn angle_of_px_rad(error_px: f64, field_of_view_rad: f64, width_px: usize) -> f64 {
    error_px * field_of_view_rad / width_px as f64
}

/// How far to the side an angle leads at a distance (Rec-HV eq. 14 and 15).
#[must_use]
pub fn sideways_m(angle_rad: f64, distance_m: f64) -> f64 {
    angle_rad.tan() * distance_m
}

/// A calibration board as one picture shows it.
#[derive(Clone, PartialEq, Debug)]
pub struct BoardView {
    /// Where the board was.
    pub camera_from_board: Isometry3<f64>,
    /// For each corner its place on the board, and where it was found in the picture.
    pub corners: Vec<(Point3<f64>, Point2<f64>)>,
}

/// How far corners are found from where the camera's model has them.
#[derive(Clone, PartialEq, Debug)]
pub struct ReprojectionError {
    /// The root mean square of the distances of all corners: what `calibrateCamera` of OpenCV returns.
    pub rms_px: f64,
    /// The same for each view; `None` for one without a corner.
    pub views_px: Vec<Option<f64>>,
}

/// There is no reprojection error.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum ReprojectionFailure {
    /// No view has a corner.
    #[error("no view has a corner")]
    NoCorner,
    /// A corner lies where the camera does not see.
    #[error("corner {corner} of view {view} is outside of the camera's view")]
    Unseen {
        /// The view, counted from 0.
        view: usize,
        /// The corner, likewise.
        corner: usize,
    },
}

/// The reprojection error of a camera over views of boards.
///
/// # Errors
/// Without any corner, or when one lies where the camera's model does not see it.
pub fn reprojection_error(
    camera: &CameraModel,
    views: &[BoardView],
) -> Result<ReprojectionError, ReprojectionFailure> {
    let mut views_px = Vec::with_capacity(views.len());
    let (mut all_squares, mut all_corners) = (0.0, 0_usize);
    for (view_index, view) in views.iter().enumerate() {
        let mut squares = 0.0;
        for (corner_index, (on_board_m, found_px)) in view.corners.iter().enumerate() {
            let unseen = ReprojectionFailure::Unseen { view: view_index, corner: corner_index };
            let expected_px =
                camera.project(&(view.camera_from_board * on_board_m)).ok_or(unseen)?;
            squares += (expected_px - found_px).norm_squared();
        }
        let corners = view.corners.len();
        views_px.push((corners > 0).then(|| (squares / corners as f64).sqrt()));
        all_squares += squares;
        all_corners += corners;
    }
    if all_corners == 0 {
        return Err(ReprojectionFailure::NoCorner);
    }
    Ok(ReprojectionError { rms_px: (all_squares / all_corners as f64).sqrt(), views_px })
}
