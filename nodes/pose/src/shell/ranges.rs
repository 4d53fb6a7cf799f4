//! What others are told that the numbers among the parameters may be. It is what `validate` accepts: a test compares them.

use std::f64::consts::PI;

use node_shell::parameters::Range;

const ABOVE_ZERO: f64 = 0.0_f64.next_up();
const BELOW_ONE: f64 = 1.0_f64.next_down();
/// Of a whole.
const SHARE: Range = Range::real(0.0, 1.0);
/// Whose quantiles say something.
const PROBABILITY: Range = Range::real(ABOVE_ZERO, BELOW_ONE);
/// Of the best to the next best.
const RATIO: Range = Range::real(ABOVE_ZERO, 1.0);
/// Bits of a descriptor.
const BITS: Range = Range::whole(0, 256);
/// Longer than any edge in an image.
const LONGEST_PX: i64 = 100_000;
/// Of one byte.
const MOST_BYTE: i64 = u8::MAX as i64;
/// Of four.
const MOST_WORD: i64 = u32::MAX as i64;

/// By name.
pub(super) const RANGES: &[(&str, Range)] = &[
    ("max_pair_gap_s", Range::POSITIVE),
    ("max_waiting_images", Range::at_least(1)),
    ("smoothing_poses", Range::whole(1, 100)),
    ("path_poses", Range::at_least(1)),
    ("track_margin_m", Range::NOT_NEGATIVE),
    ("max_track_age_s", Range::POSITIVE),
    ("frame.points.max_corners", Range::whole(1, 100_000)),
    ("frame.points.levels", Range::whole(1, 16)),
    ("frame.points.scale_factor", Range::real(1.01, 2.0)),
    ("frame.points.threshold", Range::whole(1, MOST_BYTE)),
    ("frame.points.low_threshold", Range::whole(1, MOST_BYTE)),
    ("frame.points.cell_px", Range::whole(8, 1024)),
    ("frame.points.even_share", SHARE),
    ("frame.points.threads", Range::whole(1, 64)),
    ("frame.lines.anchor_gradient", Range::real(ABOVE_ZERO, 1530.0)),
    ("frame.lines.edge_gradient", Range::real(ABOVE_ZERO, 1530.0)),
    ("frame.lines.scan_interval_px", Range::whole(1, LONGEST_PX)),
    ("frame.lines.seed_px", Range::whole(3, LONGEST_PX)),
    ("frame.lines.max_rms_px", Range::POSITIVE),
    ("frame.lines.max_deviation_px", Range::POSITIVE),
    ("frame.lines.max_outliers_px", Range::whole(0, LONGEST_PX)),
    ("frame.lines.max_false_alarms", Range::POSITIVE),
    ("frame.lines.max_gap_px", Range::real(0.0, LONGEST_PX as f64)),
    ("frame.lines.max_turn_rad", Range::real(0.0, 0.5)),
    ("frame.lines.max_threads", Range::whole(1, 256)),
    ("frame.max_lines", Range::at_least(0)),
    ("frame.line_depth.nearest_side_px", Range::whole(0, 100)),
    ("frame.line_depth.farthest_side_px", Range::whole(0, 100)),
    ("frame.line_depth.step_std_devs", Range::POSITIVE),
    ("frame.line_depth.max_std_devs", Range::POSITIVE),
    ("frame.line_depth.max_bend_std_devs", Range::POSITIVE),
    ("frame.line_depth.min_samples", Range::at_least(3)),
    ("frame.line_depth.min_support", SHARE),
    ("frame.line_depth.min_agreement", SHARE),
    ("frame.inverse_depth_std_dev", Range::POSITIVE),
    ("frame.max_depth_m", Range::POSITIVE),
    ("frame.depth_window_px", Range::whole(0, 10)),
    ("frame.edge_std_devs", Range::POSITIVE),
    ("motion.acceleration_m_per_s2", Range::POSITIVE),
    ("motion.acceleration_rad_per_s2", Range::POSITIVE),
    ("motion.max_gap_s", Range::POSITIVE),
    ("motion.gyro_noise_rad_per_sqrt_s", Range::POSITIVE),
    ("motion.gyro_bias_rad_per_s", Range::POSITIVE),
    ("motion.wheel_noise_along", Range::POSITIVE),
    ("motion.wheel_noise_across", Range::POSITIVE),
    ("motion.wheel_noise_turn", Range::POSITIVE),
    ("motion.wheel_noise_rad_per_m", Range::POSITIVE),
    ("motion.heave_m", Range::POSITIVE),
    ("motion.tilt_rad", Range::POSITIVE),
    ("map.max_points", Range::at_least(1)),
    ("map.max_lines", Range::at_least(0)),
    ("map.max_viewing_angle_rad", Range::POSITIVE),
    ("map.point_std_dev_px", Range::POSITIVE),
    ("map.line_std_dev_px", Range::POSITIVE),
    ("map.landmark_noise_m", Range::POSITIVE),
    ("map.unmeasured_inverse_depth", Range::POSITIVE),
    ("map.unmeasured_inverse_depth_std_dev", Range::POSITIVE),
    ("map.located_share", Range::POSITIVE),
    ("map.unlocated_doubt", Range::POSITIVE),
    ("map.min_seen_share", SHARE),
    ("map.least_foreseen", Range::whole(0, MOST_WORD)),
    ("map.point_matching.max_distance", BITS),
    ("map.point_matching.max_ratio", RATIO),
    ("map.point_matching.rotation_tolerance_rad", Range::POSITIVE),
    ("map.level_tolerance", Range::whole(0, MOST_BYTE)),
    ("map.line_matching.max_distance_bits", BITS),
    ("map.line_matching.max_ratio", RATIO),
    ("map.line_matching.max_turn_rad", Range::real(0.0, PI)),
    ("map.min_line_overlap", SHARE),
    ("refine.inlier_probability", PROBABILITY),
    ("refine.kernel_rounds", Range::at_least(0)),
    ("refine.rounds", Range::at_least(1)),
    ("refine.iterations_per_round", Range::at_least(1)),
    ("refine.max_std_dev_m", Range::POSITIVE),
    ("refine.max_std_dev_rad", Range::POSITIVE),
    ("refine.unknown_std_dev_m", Range::POSITIVE),
    ("refine.unknown_std_dev_rad", Range::POSITIVE),
    ("sets.max_sets", Range::at_least(1)),
    ("sets.min_background_share", SHARE),
    ("sets.size_power", Range::POSITIVE),
    ("sets.prediction_probability", PROBABILITY),
    ("sets.ransac.seed", Range::at_least(0)),
    ("sets.ransac.max_iterations", Range::at_least(1)),
    ("sets.ransac.confidence", PROBABILITY),
    ("sets.ransac.enough_inlier_ratio", SHARE),
    ("sets.ransac.min_inliers", Range::at_least(4)),
    ("sets.ransac.min_depth_share", SHARE),
    ("follow.least_to_begin", Range::at_least(4)),
    ("follow.least_inliers", Range::at_least(4)),
    ("follow.least_inlier_share", SHARE),
    ("follow.least_relocalised", Range::at_least(4)),
    ("follow.narrow_radius_px", Range::POSITIVE),
    ("follow.widest_radius_px", Range::POSITIVE),
    ("follow.search_std_devs", Range::POSITIVE),
    ("follow.known_share", SHARE),
    ("follow.suspicious_share", SHARE),
    ("follow.most_out_of_order", Range::whole(1, MOST_WORD)),
    ("follow.readout_s", Range::real(0.0, 0.1)),
    ("follow.blind_matching.max_distance", BITS),
    ("follow.blind_matching.max_ratio", RATIO),
    ("follow.blind_matching.rotation_tolerance_rad", Range::POSITIVE),
];
