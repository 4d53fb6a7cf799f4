//! The parameters of the detection of line segments.

/// The largest `|Gx| + |Gy|`: 6 times 255.
const LARGEST_GRADIENT: f64 = 1530.0;
/// No image has longer edges.
const LONGEST_PX: i64 = 100_000;

geometry::parameters! {
    /// Parameters of [`LineDetector`](super::LineDetector).
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct LineConfig {
        /// An edge is drawn from pixels whose gradient, `|Gx| + |Gy|` of the Sobel operator on the smoothed image, is a maximum
        /// and at least this large, in gray levels. A step of a quarter as many gray levels has such a gradient.
        // Where rounding to whole gray levels, 8 in all by the Sobel operator's weights, turns a gradient by 45 degrees at
        // most: 8 / sin(45 degrees). Edge Drawing Parameter Free (Akinlar and Topal 2012) has 6 / sin(45 degrees) of the
        // Prewitt operator by the same reasoning.
        anchor_gradient: f64 = 11.3, above_to(0.0, LARGEST_GRADIENT);
        /// An edge is followed while the gradient is at least this large, in gray levels.
        // Canny (1986) recommends a ratio of two or three to one of his two thresholds.
        edge_gradient: f64 = 5.65, above_to(0.0, LARGEST_GRADIENT);
        /// The detail ratio: edges begin in rows and columns whose number this divides; 1 for all.
        // EDLines' demo, and OpenCV: every row and column.
        scan_interval_px: usize = 1, whole(1, LONGEST_PX);
        /// A line begins as this many consecutive pixels of an edge that lie on a line.
        // Long enough for a direction; a third less than what passes the test alone, so that short parts can be joined to some
        // that do.
        seed_px: usize = 8, whole(3, LONGEST_PX);
        /// The pixels of such a beginning deviate from their line by at most this root mean square.
        // EDLines has 1 pixel for whole pixels, which lie up to a half off the edge by themselves. Ours do not.
        max_rms_px: f64 = 0.5, positive;
        /// A line grows by pixels that deviate from it by at most this.
        // EDLines.
        max_deviation_px: f64 = 1.0, positive;
        /// A line ends where more than this many consecutive pixels deviate by more.
        // As many as a crossing edge of the smoothing kernel's width bends.
        max_outliers_px: usize = 5, whole(0, LONGEST_PX);
        /// The number of false segments to be expected of an image of noise alone.
        // EDLines has 1. Its pixels are held to be independent, and neighbours of a smoothed image are not.
        max_false_alarms: f64 = 0.1, positive;
        /// Parts of one line are joined over gaps of at most this length.
        // Two seeds.
        max_gap_px: f64 = 16.0, between(0.0, LONGEST_PX as f64);
        /// Parts of one line differ by at most this in direction.
        // 6 degrees: what the direction of a seed is uncertain by, when its points deviate by 0.25 pixels.
        max_turn_rad: f64 = 0.1, between(0.0, 0.5);
    }
}
