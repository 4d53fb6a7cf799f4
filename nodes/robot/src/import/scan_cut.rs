//! A laser scan computed from a depth image, for recordings without a laser scanner.

use clap::Args;
use geometry::{CameraModel, DepthImage, RayTable, Scan, ScanBand, ScanCutter, ScanFromDepth};

use crate::failure::Failure;
use crate::rig::rig_from_camera;

/// Arguments of the computed scan.
#[derive(Args, Debug)]
pub(crate) struct ScanCutArgs {
    /// Add a LaserScan computed from the depth image at the scan plane
    #[arg(long)]
    scan_from_depth: bool,
    /// Height of the scan plane above the camera's optical centre
    #[arg(long, value_name = "M", default_value_t = -0.05, allow_negative_numbers = true)]
    scan_height: f64,
    /// Thickness of the layer around the scan plane
    #[arg(long, value_name = "M", default_value_t = 0.02)]
    scan_band: f64,
    /// Beams over the camera's field of view
    #[arg(long, default_value_t = 90)]
    scan_beams: usize,
}

impl ScanCutArgs {
    /// Whether scans are requested.
    pub(crate) fn is_requested(&self) -> bool {
        self.scan_from_depth
    }
}

/// Computes scans; keeps the data that depend only on the camera.
pub(crate) struct ScanCut {
    parameters: Option<ScanFromDepth>,
    cutter: Option<(CameraModel, ScanCutter)>,
}

impl ScanCut {
    /// One with these arguments; `None` if they request no scan.
    pub(crate) fn new(args: &ScanCutArgs) -> Self {
        let parameters = args.scan_from_depth.then(|| ScanFromDepth {
            band: ScanBand::Height {
                plane_height_m: args.scan_height,
                band_height_m: args.scan_band,
            },
            beams: args.scan_beams,
            ..ScanFromDepth::default()
        });
        Self { parameters, cutter: None }
    }

    /// One that makes scans as the arguments have them where nothing else is said.
    pub(crate) fn usual() -> Self {
        Self { parameters: Some(ScanFromDepth::default()), cutter: None }
    }

    /// The height of the scans above the camera's optical centre.
    pub(crate) fn height_m(&self) -> f64 {
        match self.parameters.as_ref().map(|parameters| parameters.band) {
            Some(ScanBand::Height { plane_height_m, .. }) => plane_height_m,
            Some(ScanBand::Rows { .. }) | None => 0.0,
        }
    }

    /// The scan of an image.
    pub(crate) fn scan(
        &mut self,
        image: &DepthImage,
        camera: &CameraModel,
    ) -> Result<Option<Scan>, Failure> {
        let Some(parameters) = &self.parameters else { return Ok(None) };
        let cutter = match &mut self.cutter {
            Some((known, cutter)) if known == camera => cutter,
            cutter => {
                let rays =
                    RayTable::new(camera).map_err(|error| Failure::new(error.to_string()))?;
                let new = ScanCutter::new(rays, &rig_from_camera(), parameters)
                    .map_err(|error| Failure::new(format!("no scan can be cut: {error}")))?;
                &mut cutter.insert((*camera, new)).1
            }
        };
        let scan = cutter.cut(image).map_err(|error| Failure::new(error.to_string()))?;
        Ok(Some(scan))
    }
}
