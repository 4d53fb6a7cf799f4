//! Whether a calibration can be that of a camera's images.

/// Places in K, row by row: fx, cx, fy, cy.
const FX: usize = 0;
const CX: usize = 2;
const FY: usize = 4;
const CY: usize = 5;
/// Lenses with narrower and with wider views are no depth cameras.
const LEAST_VIEW_RAD: f64 = 0.1;
const MOST_VIEW_RAD: f64 = 2.9;
/// By the calibration of another resolution the optical centre is off the middle on both axes to the same side: at a quarter of the
/// image with that of half as many pixels, at an edge with that of twice as many. On one axis it is by more than this share of the size,
const MOST_OFF_CENTRE: f64 = 0.2;
/// on the other, where the ratio of the sides may be another, by more than this. An image that was cropped at the top or at a side is
/// off on one axis.
const LEAST_OFF_CENTRE: f64 = 0.1;

/// Why a calibration is not that of images of its size.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct CalibrationFault {
    /// Otherwise it is right of an image that was cropped at a corner.
    pub(crate) is_certain: bool,
    pub(crate) what: String,
    pub(crate) fix: &'static str,
}

impl CalibrationFault {
    /// Of K and the columns and rows of the images.
    pub(crate) fn of(k: &[f64; 9], size_px: (u32, u32)) -> Option<Self> {
        let numbers = format!("(K = {k:?}, {} x {} pixels)", size_px.0, size_px.1);
        if let Some(wrong) = wrong(k, size_px) {
            return Some(Self {
                is_certain: true,
                what: format!("{wrong} {numbers}"),
                fix: "calibrate the camera (ros2 run camera_calibration cameracalibrator) and let its driver load the file; \
                      or name one with the parameter camera_info_file",
            });
        }
        off_centre(k, size_px).map(|share| Self {
            is_certain: false,
            what: format!(
                "by K the optical centre lies at {share:.2} of the image: K is likely that of an image of {:.1} times as many \
                 columns and rows {numbers}",
                2.0 * share
            ),
            fix: "let the driver load the calibration of the mode that it runs in, and where a node resizes images, resize their calibration \
                  too (image_proc's resize does); of an image that was cropped at a corner it is right",
        })
    }
}

/// Where the optical centre is, as a share of the image on the axis where it is farther from the middle, if it is far from it.
fn off_centre(k: &[f64; 9], (width, height): (u32, u32)) -> Option<f64> {
    if width == 0 || height == 0 {
        return None;
    }
    // The middle of the first pixel is 0.
    let off = |centre_px: f64, size: u32| (centre_px + 0.5) / f64::from(size) - 0.5;
    let (x, y) = (off(k[CX], width), off(k[CY], height));
    let (more, less) = if x.abs() > y.abs() { (x, y) } else { (y, x) };
    let is_far = more.abs() > MOST_OFF_CENTRE && less * more.signum() > LEAST_OFF_CENTRE;
    is_far.then_some(more + 0.5)
}

/// What is wrong with a calibration.
pub(crate) fn wrong(k: &[f64; 9], (width, height): (u32, u32)) -> Option<String> {
    if k.iter().all(|one| *one == 0.0) {
        return Some("the camera is not calibrated, K is all zero".to_owned());
    }
    let axes = [("x", k[FX], k[CX], width), ("y", k[FY], k[CY], height)];
    axes.into_iter().find_map(|(axis, focal_px, centre_px, size)| {
        let size_px = f64::from(size);
        let view_rad = 2.0 * (0.5 * size_px / focal_px).atan();
        if !(focal_px > 0.0 && focal_px.is_finite()) {
            Some(format!("the focal length f{axis} is {focal_px}"))
        } else if size > 0 && !(LEAST_VIEW_RAD..=MOST_VIEW_RAD).contains(&view_rad) {
            Some(format!(
                "f{axis} = {focal_px} px gives a view of {:.0} degrees",
                view_rad.to_degrees()
            ))
        } else if size > 0 && !(0.0..=size_px).contains(&centre_px) {
            Some(format!("the optical centre c{axis} = {centre_px} px lies outside the image"))
        } else {
            None
        }
    })
}
