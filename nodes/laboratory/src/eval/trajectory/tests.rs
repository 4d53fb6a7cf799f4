use evaluation::trajectory::{Delta, DeltaUnit, SegmentLengths};

use super::choice::{parse_delta, parse_segments};

#[test]
fn a_length_is_a_number_and_its_unit() {
    for (text, value, unit) in [
        ("1s", 1.0, DeltaUnit::Seconds),
        ("0.5m", 0.5, DeltaUnit::Metres),
        ("10deg", 10.0, DeltaUnit::Degrees),
        ("30frames", 30.0, DeltaUnit::Frames),
        ("1 f", 1.0, DeltaUnit::Frames),
    ] {
        assert_eq!(parse_delta(text), Ok(Delta { value, unit }), "{text}");
    }
    for text in ["", "1", "s", "1e3m", "1 km", "xm"] {
        assert!(parse_delta(text).is_err(), "{text}");
    }
}

#[test]
fn segments_have_names_or_lengths() {
    assert_eq!(parse_segments("kitti"), Ok(SegmentLengths::Kitti));
    assert_eq!(parse_segments("scaled"), Ok(SegmentLengths::Scaled));
    assert_eq!(parse_segments("1, 2.5"), Ok(SegmentLengths::Metres(vec![1.0, 2.5])));
    assert!(parse_segments("1,x").is_err());
}
