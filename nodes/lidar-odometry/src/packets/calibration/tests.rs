use super::*;

fn rounded_deg(model: Model) -> Vec<f64> {
    let lasers = Calibration::of_data_sheet(model).lasers;
    lasers.iter().map(|laser| (laser.elevation_deg * 100.0).round() / 100.0).collect()
}

#[test]
fn elevations_are_those_of_the_tables_in_the_order_of_firing() {
    // Road LiDAR, table 2.2; it prints -6.66 for laser 6.
    let hdl_32e = rounded_deg(Model::Hdl32e);
    assert_eq!(hdl_32e[..6], [-30.67, -9.33, -29.33, -8.0, -28.0, -6.67]);
    assert_eq!(hdl_32e[27..], [8.0, -12.0, 9.33, -10.67, 10.67]);
    let vlp_16 = rounded_deg(Model::Vlp16);
    assert_eq!((vlp_16[0], vlp_16[1], vlp_16[14], vlp_16[15]), (-15.0, 1.0, -1.0, 15.0));
    let hi_res = rounded_deg(Model::PuckHiRes);
    assert_eq!((hi_res[0], hi_res[1], hi_res[15]), (-10.0, 0.67, 10.0));
    let hdl_64e = rounded_deg(Model::Hdl64e);
    let mut sorted = hdl_64e.clone();
    sorted.sort_by(|a, b| b.total_cmp(a));
    sorted.dedup();
    assert_eq!((sorted.len(), sorted[0], sorted[31]), (64, 2.0, -8.33));
    assert_eq!((sorted[32], sorted[63]), (-8.83, -24.33));
    // The first bank is the upper.
    assert!(hdl_64e[..32].iter().all(|elevation_deg| *elevation_deg > -8.5));
}

#[test]
fn rows_count_from_the_highest() {
    for model in Model::ALL {
        let calibration = Calibration::of_data_sheet(model);
        calibration.validate(model).unwrap();
        let rows = calibration.rows();
        let elevations_deg = calibration.row_elevations_deg();
        assert!(elevations_deg.windows(2).all(|pair| pair[0] > pair[1]), "{model}");
        for (laser, row) in calibration.lasers.iter().zip(rows) {
            assert_eq!(laser.elevation_deg, elevations_deg[usize::from(row)]);
        }
    }
}

#[test]
fn what_no_laser_can_be_is_refused() {
    let good = Calibration::of_data_sheet(Model::Vlp16);
    let error = good.validate(Model::Hdl32e).unwrap_err();
    assert_eq!(error.to_string(), "16 lasers are calibrated, but the HDL-32E has 32");
    for (value, part) in [(f64::NAN, "NaN"), (91.0, "is 91, not within -90 .. 90")] {
        let mut wrong = good.clone();
        wrong.lasers[3].rotation_deg = value;
        let error = wrong.validate(Model::Vlp16).unwrap_err().to_string();
        assert!(error.starts_with("rotation_deg of laser 3") && error.contains(part), "{error}");
    }
    let wrong = Calibration { range_step_m: 0.0, ..good };
    assert!(wrong.validate(Model::Vlp16).is_err());
}

#[test]
fn a_file_of_ros_is_read() {
    let text = "lasers:\n- {laser_id: 1, rot_correction: -0.01, vert_correction: 0.02, dist_correction: 1.2,\n   \
        dist_correction_x: 1.3, dist_correction_y: 1.4, vert_offset_correction: 0.2,\n   \
        horiz_offset_correction: -0.026, focal_distance: 10.5, min_intensity: 5}\n\
        - {laser_id: 0, vert_correction: -0.1}\nnum_lasers: 2\ndistance_resolution: 0.004\n";
    let calibration = Calibration::from_yaml(text).unwrap();
    assert_eq!(calibration.range_step_m, 0.004);
    assert_eq!(calibration.lasers[0].elevation_deg, (-0.1_f64).to_degrees());
    let expected = LaserCalibration {
        elevation_deg: 0.02_f64.to_degrees(),
        rotation_deg: (-0.01_f64).to_degrees(),
        range_offset_m: 1.2,
        near_range_offset_m: [1.3, 1.4],
        height_m: 0.2,
        horizontal_offset_m: -0.026,
    };
    assert_eq!(calibration.lasers[1], expected);
    for (text, part) in [
        ("lasers: 3", "cannot be read"),
        ("lasers:\n- {laser_id: 1, vert_correction: 0}", "laser 0 occurs 0 times among 1"),
        (
            "lasers:\n- {laser_id: 0, vert_correction: 0}\n- {laser_id: 0, vert_correction: 0}",
            "laser 0 occurs 2 times",
        ),
    ] {
        let error = Calibration::from_yaml(text).unwrap_err().to_string();
        assert!(error.contains(part) && error.lines().count() == 1, "{error}");
    }
}
