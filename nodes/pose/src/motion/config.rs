//! The parameters of the predictions, their defaults, and where these come from.

geometry::parameters! {
    /// The parameters of the predictions.
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct MotionConfig {
        /// Standard deviation of the camera's acceleration along each axis.
        // A hand-held camera: walking people's heads and hands accelerate by 1 to 3 m/s^2 (Rec-HV's platform by less).
        acceleration_m_per_s2: f64 = 3.0, positive;
        /// Standard deviation of the camera's angular acceleration about each axis.
        // A hand turns by 1 rad/s within a fifth of a second.
        acceleration_rad_per_s2: f64 = 5.0, positive;
        /// Over longer gaps between two frames no motion is predicted.
        // Fifteen frames of a Kinect: after that a walker has changed his mind.
        max_gap_s: f64 = 0.5, positive;
        /// The noise density of the gyroscope: the standard deviation of the rotation after a second.
        // MPU-6050's data sheet: 0.005 degrees a second per root of a hertz; ten times that for what shakes on a platform.
        gyro_noise_rad_per_sqrt_s: f64 = 1e-3, positive;
        /// Standard deviation of the gyroscope's bias.
        // The same data sheet states 20 degrees a second before any calibration; a second of rest leaves less than half a
        // degree.
        gyro_bias_rad_per_s: f64 = 0.01, positive;
        /// Standard deviation of wheel odometry along the distance travelled, as a share of it.
        // What is common for encoders on indoor floors (Borenstein and Feng 1996 measured errors of 1 to 3 % for carpets and
        // tiles).
        wheel_noise_along: f64 = 0.03, positive;
        /// Standard deviation of wheel odometry across the distance travelled, as a share of it: slip.
        wheel_noise_across: f64 = 0.03, positive;
        /// Standard deviation of wheel odometry's rotation about the vertical axis, as a share of the rotation.
        wheel_noise_turn: f64 = 0.05, positive;
        /// Standard deviation of wheel odometry's rotation about the vertical axis for each metre travelled.
        wheel_noise_rad_per_m: f64 = 0.05, positive;
        /// Standard deviation of the platform's vertical motion from frame to frame, by the floor.
        // Joints of tiles, and the play of a mast.
        heave_m: f64 = 0.002, positive;
        /// Standard deviation of the platform's roll and pitch from frame to frame, by the floor.
        tilt_rad: f64 = 0.005, positive;
    }
}
