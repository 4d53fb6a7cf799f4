//! The sensors simulated in addition to the scanner and the depth camera.

use clap::{Args, ValueEnum};
use simulator::{ColourCamera, Imu, Scenario, Velodyne, VelodyneModel, Wheels};

/// Sensors that a scenario does not have by itself, and how its colour camera takes images.
#[derive(Args, Debug)]
#[command(next_help_heading = "Sensors")]
pub(super) struct SensorArgs {
    /// A colour camera, registered to the depth camera
    #[arg(long, visible_alias = "color")]
    colour: bool,
    /// A 3D scanner
    #[arg(long, value_name = "MODEL")]
    velodyne: Option<VelodyneName>,
    /// An inertial measurement unit (IMU) at 200 Hz
    #[arg(long)]
    imu: bool,
    /// Wheel odometry at 50 Hz
    #[arg(long)]
    wheels: bool,
    /// Colour images in low light, with shot noise
    #[arg(long)]
    low_light: bool,
    /// Colour images with the motion blur of this exposure
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u16).range(1..=33))]
    motion_blur_ms: Option<u16>,
    /// Rays per colour pixel along each axis: fewer are faster, more give finer edges [default: 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=8))]
    supersampling: Option<u8>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum VelodyneName {
    /// 32 lasers
    Hdl32e,
    /// 16 lasers
    Vlp16,
    /// 64 lasers
    Hdl64e,
}

impl VelodyneName {
    fn model(self) -> VelodyneModel {
        match self {
            Self::Hdl32e => VelodyneModel::Hdl32e,
            Self::Vlp16 => VelodyneModel::Vlp16,
            Self::Hdl64e => VelodyneModel::Hdl64e,
        }
    }
}

/// Images averaged over an exposure.
const SUB_EXPOSURES: usize = 6;

impl SensorArgs {
    /// The scenario with these sensors added.
    pub(super) fn added_to(&self, mut scenario: Scenario) -> Scenario {
        let rig = &mut scenario.rig;
        let about_colour =
            self.low_light || self.motion_blur_ms.is_some() || self.supersampling.is_some();
        if self.colour || about_colour {
            let mut colour = rig.colour_camera.take().unwrap_or_default();
            if self.low_light {
                colour = colour.in_low_light();
            }
            if let Some(exposure_ms) = self.motion_blur_ms {
                colour = colour.with_motion_blur(f64::from(exposure_ms) * 1e-3, SUB_EXPOSURES);
            }
            if let Some(rays) = self.supersampling {
                colour = ColourCamera { supersampling: usize::from(rays), ..colour };
            }
            rig.colour_camera = Some(colour);
        }
        if let Some(name) = self.velodyne {
            let velodyne = rig.velodyne.take().unwrap_or_default();
            rig.velodyne = Some(Velodyne { model: name.model(), ..velodyne });
        }
        if self.imu {
            rig.imu.get_or_insert_with(Imu::default);
        }
        if self.wheels {
            rig.wheels.get_or_insert_with(Wheels::default);
        }
        scenario
    }
}
