//! The thesis' own odometry: each scan onto the one before, and the motions one after another (Road LiDAR, section 3.1.2,
//! eq. 3.1). It drifts with every scan; it is here to be compared with.

use std::sync::Arc;

use estimation::Executor;
use nalgebra::{Isometry3, Point3};

use crate::registration::{
    PreparationConfig, PreparedCloud, Registration, RegistrationConfig, RegistrationError, register,
};

geometry::choices! {
    /// Where a registration begins.
    #[derive(Default)]
    pub enum Guess {
        /// With no motion.
        Standing = "standing",
        /// With the motion between the previous two scans (the thesis' matrix of estimation, section 4.2.1.1: 58 % of the
        /// time saved).
        PreviousMotion = "previous_motion" as default,
    }
}

/// The odometry from scan to scan.
#[derive(Clone, Debug)]
pub struct ScanToScan {
    preparation: PreparationConfig,
    registration: RegistrationConfig,
    guess: Guess,
    executor: Arc<dyn Executor>,
    previous: Option<PreparedCloud>,
    motion: Isometry3<f64>,
    odom_from_lidar: Isometry3<f64>,
}

impl ScanToScan {
    /// An odometry that has seen nothing.
    #[must_use]
    pub fn new(
        preparation: PreparationConfig,
        registration: RegistrationConfig,
        guess: Guess,
        executor: Arc<dyn Executor>,
    ) -> Self {
        let (motion, odom_from_lidar) = (Isometry3::identity(), Isometry3::identity());
        Self { preparation, registration, guess, executor, previous: None, motion, odom_from_lidar }
    }

    /// Forgets everything: the next scan is the first one.
    pub fn forget(&mut self) {
        self.previous = None;
        self.motion = Isometry3::identity();
        self.odom_from_lidar = Isometry3::identity();
    }

    /// Where the sensor was at the last scan, in its frame at the first.
    #[must_use]
    pub fn pose(&self) -> Isometry3<f64> {
        self.odom_from_lidar
    }

    /// How far correspondences reach.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        self.registration.max_correspondence_m
    }

    /// Takes in the points of the next scan (in the sensor's frame, as if measured at once). The pose, and how the scan lies
    /// to the one before; `None` for the first.
    ///
    /// # Errors
    /// When the scan has no point, a parameter is out of its range, or the scans do not overlap. The next scan is then
    /// registered to the last usable one.
    pub fn step(
        &mut self,
        points_m: &[Point3<f32>],
    ) -> Result<(Isometry3<f64>, Option<Registration>), RegistrationError> {
        let cloud = PreparedCloud::new(points_m, &self.preparation, &*self.executor)?;
        let mut registration = None;
        if let Some(previous) = &self.previous {
            let guess = match self.guess {
                Guess::Standing => Isometry3::identity(),
                Guess::PreviousMotion => self.motion,
            };
            let found = register(&cloud, previous, &guess, &self.registration, &*self.executor)?;
            self.motion = found.target_from_source;
            self.odom_from_lidar *= self.motion;
            self.odom_from_lidar.rotation.renormalize_fast();
            registration = Some(found);
        }
        self.previous = Some(cloud);
        Ok((self.odom_from_lidar, registration))
    }
}
