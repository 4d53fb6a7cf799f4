use proptest::prelude::*;

use super::super::path::{LeftOut, Times};
use super::*;

fn parse(text: &str) -> Result<ParsedTrajectory, ParseError> {
    parse_trajectory(text.as_bytes())
}

fn error(text: &str) -> String {
    parse(text).unwrap_err().to_string()
}

#[test]
fn the_same_pose_in_three_formats() {
    // A quarter turn to the left.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let tum = parse(&format!("# a comment\n\n1.5 1 2 3 0 0 {half} {half}\n")).unwrap();
    let euroc = parse(&format!("1500000000,1,2,3,{half},0,0,{half},0.1,0.2,0.3\n")).unwrap();
    let kitti = parse("0 -1 0 1  1 0 0 2  0 0 1 3").unwrap();
    assert_eq!(
        [tum.format, euroc.format, kitti.format],
        [TrajectoryFormat::Tum, TrajectoryFormat::Euroc, TrajectoryFormat::Kitti]
    );
    let stamps = Times::Stamps(vec![Stamp::from_secs_nanos(1, 500_000_000)]);
    assert_eq!((tum.trajectory.times(), euroc.trajectory.times()), (&stamps, &stamps));
    assert_eq!(kitti.trajectory.times(), &Times::Frames(vec![0]));
    for parsed in [&tum, &euroc, &kitti] {
        let pose = parsed.trajectory.poses()[0];
        let moved = pose * nalgebra::Point3::new(1.0, 0.0, 0.0);
        assert!((moved - nalgebra::Point3::new(1.0, 3.0, 3.0)).norm() < 1e-12, "{parsed:?}");
    }
}

#[test]
fn what_editors_and_tools_add_is_no_fault() {
    let plain = parse("1 1 2 3 0 0 0 1\n2 1 2 3 0 0 0 1").unwrap();
    for text in [
        "1 1 2 3 0 0 0 1\r\n2 1 2 3 0 0 0 1\r\n",
        "\u{feff}1 1 2 3 0 0 0 1\n2 1 2 3 0 0 0 1",
        "  1\t1 2 3  0 0 0 1  # first\n\n#\n2 1 2 3 0 0 0 1\n\n",
        "time x y z qx qy qz qw\n1 1 2 3 0 0 0 1\n2 1 2 3 0 0 0 1",
        "1.0e0 1e0 2 3 0 0 0 1\n2 1 2 3 0 0 0 1",
    ] {
        assert_eq!(parse(text).unwrap(), plain, "{text}");
    }
    let header = "#timestamp, p_RS_R_x [m], y, z, q_RS_w [], x, y, z\n";
    let euroc = format!("{header}1000000000, 1, 2, 3, 1, 0, 0, 0,\r\n2000000000,1,2,3,1,0,0,0\r\n");
    assert_eq!(parse(&euroc).unwrap().trajectory, plain.trajectory);
}

/// Regression: the files of OKVIS2, which have w at the end, were scored with rotations that are none of theirs.
#[test]
fn the_header_of_a_csv_file_says_where_w_is() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let tum = parse(&format!("1.5 1 2 3 0 0 {half} {half}")).unwrap();
    let w_last = format!("1500000000, 1, 2, 3, 0, 0, {half}, {half}, 0, 0, 0\n");
    let w_first = format!("1500000000, 1, 2, 3, {half}, 0, 0, {half}, 0, 0, 0\n");
    let okvis = "timestamp, p_WS_W_x, p_WS_W_y, p_WS_W_z, q_WS_x, q_WS_y, q_WS_z, q_WS_w, v_WS_W_x";
    let plain = "Time (s),X,Y,Z,QX,QY,QZ,QW";
    let euroc = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []";
    let prose = "# poses, of a walk, around the house, and the garden, on a, warm, day, in May";
    for (header, row) in [
        (okvis.to_owned(), &w_last),
        (format!("\u{feff}# {okvis}\r"), &w_last),
        (plain.to_owned(), &w_last),
        (euroc.to_owned(), &w_first),
        (euroc.trim_start_matches('#').to_owned(), &w_first),
        (prose.to_owned(), &w_first),
    ] {
        let parsed = parse(&format!("{header}\n{row}")).unwrap();
        assert_eq!(parsed.trajectory, tum.trajectory, "{header}");
    }
    for header in [
        "t,qx,qy,qz,qw,px,py,pz",
        "t,x,y,z,roll,pitch,yaw,state",
        "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.x,field.y,field.z,w",
    ] {
        let refused = error(&format!("{header}\n{w_last}"));
        assert!(refused.contains("line 1: the header calls columns 2 to 8"), "{refused}");
    }
}

#[test]
fn a_tracker_that_is_lost_is_no_fault_of_its_file() {
    let parsed = parse(
        "1 0 0 0 0 0 0 1\n2 nan nan nan nan nan nan nan\n3 0 0 inf 0 0 0 1\n4 0 0 0 0 0 0 0\n\
         5 0 0 0 0 0 0 0.9\n5 1 1 1 0 0 0 1\n4.5 0 0 0 0 0 0 1\n",
    )
    .unwrap();
    assert_eq!(parsed.trajectory.len(), 3);
    let expected = LeftOut { not_a_pose: 3, repeated_stamps: 1, out_of_order: 1, renormalised: 1 };
    assert_eq!(parsed.trajectory.left_out(), expected);
    let kitti = parse("1 0 0 0 0 1 0 0 0 0 1 0\nnan 0 0 0 0 1 0 0 0 0 1 0").unwrap();
    assert_eq!((kitti.trajectory.len(), kitti.trajectory.left_out().not_a_pose), (1, 1));
}

#[test]
fn what_is_no_trajectory_says_where_and_why() {
    assert_eq!(parse(""), Err(ParseError::Empty));
    assert_eq!(parse("# nothing\n\r\n"), Err(ParseError::Empty));
    let good = "1 0 0 0 0 0 0 1\n";
    for (text, wanted) in [
        ("# c\n1 2 3\n".to_owned(), "line 2: 3 columns are not a known trajectory format"),
        (format!("{good}2 0 0 0 0 0 0\n"), "line 2: 7 columns, but a line of TUM has 8"),
        (format!("{good}2,0,0,0,0,0,0,1\n"), "line 2: 8 columns, but a line of TUM has 8"),
        (format!("{good}2 0 x 0 0 0 0 1\n"), "line 2, column 3: 'x' is not a number"),
        (format!("{good}nan 0 0 0 0 0 0 1\n"), "line 2: 'nan' is not a stamp in seconds"),
        ("1403636579763555 0 0 0 0 0 0 1".to_owned(), "is not a stamp in seconds"),
        ("1.5,0,0,0,0,0,0,1".to_owned(), "line 1: '1.5' is not a stamp in whole nanoseconds"),
        ("1,0,0,0,0,0,1".to_owned(), "line 1: 7 columns are not a known trajectory"),
        ("2 0 0 0 0 1 0 0 0 0 1 0".to_owned(), "line 1: the left three columns"),
        ("1 0 0 0 0 1 0 0 0 0 -1 0".to_owned(), "line 1: the left three columns"),
    ] {
        assert!(error(&text).contains(wanted), "{text}: {}", error(&text));
    }
    let binary = parse_trajectory(b"1 0 0 0 0 0 0 1\n\xff\xfe\n").unwrap_err();
    assert_eq!(binary, ParseError::NotText { line: 2 });
}

#[test]
fn a_rounded_matrix_is_made_a_rotation() {
    let text = "0.9999795 0.0005025123 -0.006380358 -0.0046 -0.000500516 0.9999998 0.0003144878 -0.002 \
                0.006380515 -0.0003112871 0.9999796 0.0915";
    let pose = parse(text).unwrap().trajectory.poses()[0];
    let matrix = pose.rotation.to_rotation_matrix();
    let deviation = (matrix.matrix().transpose() * matrix.matrix() - Matrix3::identity()).amax();
    assert!(deviation < 1e-14, "{deviation}");
    assert!((matrix[(0, 2)] + 0.006_380_358).abs() < 1e-6, "{matrix}");
}

#[test]
fn stamps_of_frames_are_one_a_line() {
    let stamps = parse_stamps(b"0.000000e+00\r\n1.037e-01\n# end\n").unwrap();
    assert_eq!(stamps, [Stamp::default(), Stamp::from_nanos(103_700_000)]);
    let error = parse_stamps(b"0 1\n").unwrap_err().to_string();
    assert_eq!(error, "line 1: '0 1' is not a stamp in seconds, one per line");
    assert!(parse_stamps(b"x").is_err());
}

/// Bytes that resemble the formats.
fn near_text() -> impl Strategy<Value = Vec<u8>> {
    let piece = prop_oneof![
        Just("1 2 3 4 0 0 0 1\n".to_owned()),
        Just("1000,2,3,4,1,0,0,0\n".to_owned()),
        Just("t,x,y,z,qx,qy,qz,qw\n".to_owned()),
        Just("1 0 0 0 0 1 0 0 0 0 1 0\n".to_owned()),
        Just("nan ".to_owned()),
        Just("1e308 ".to_owned()),
        Just("\r\n#".to_owned()),
        "[-+.,0-9eE \n]{0,12}",
    ];
    proptest::collection::vec(piece, 0..30).prop_map(|pieces| pieces.concat().into_bytes())
}

proptest! {
    #[test]
    fn no_bytes_are_too_bad(bytes in proptest::collection::vec(any::<u8>(), 0..600)) {
        let _ = (parse_trajectory(&bytes), parse_stamps(&bytes));
    }

    #[test]
    fn what_comes_near_is_read_or_refused(text in near_text()) {
        if let Ok(parsed) = parse_trajectory(&text) {
            let trajectory = parsed.trajectory;
            for pose in trajectory.poses() {
                prop_assert!(pose.translation.vector.iter().all(|value| value.is_finite()));
                prop_assert!((pose.rotation.norm() - 1.0).abs() < 1e-9);
            }
            if let Times::Stamps(stamps) = trajectory.times() {
                prop_assert!(stamps.is_sorted_by(|one, other| one < other));
            }
            let config = crate::trajectory::TrajectoryScoreConfig::default();
            let _ = crate::trajectory::score_trajectory(&trajectory, &trajectory, &config);
        }
    }
}
