use super::*;

const LINE: Line<'_> = Line {
    severity: "WARN",
    name: "robot1.detection",
    message: "no scan",
    time: Duration::new(1_731_140_000, 5_000_001),
    function_name: "detection::shell",
    file_name: "src/shell.rs",
    line_number: 7,
};

fn written(format: &str) -> String {
    let mut line = String::new();
    LineFormat::parse(format).write(&LINE, &mut line).unwrap();
    line
}

#[test]
fn each_token_is_filled_in_and_what_is_none_stays() {
    for (format, expected) in [
        (BY_DEFAULT, "[WARN] [1731140000.005000001] [robot1.detection]: no scan"),
        ("{time_as_nanoseconds}|{message}", "1731140000005000001|no scan"),
        ("{file_name}:{line_number} {function_name}", "src/shell.rs:7 detection::shell"),
        ("{{name}} {no_token} {", "{robot1.detection} {no_token} {"),
        ("{message} at {ti{time}", "no scan at {ti1731140000.005000001"),
        ("{severity_with_color} {message}", "WARN no scan"),
        ("plain", "plain"),
    ] {
        assert_eq!(written(format), expected, "{format}");
    }
}

#[test]
fn a_date_is_that_of_the_place_to_the_millisecond() {
    let date = written("{date_time_with_ms}");
    let parsed = chrono::NaiveDateTime::parse_from_str(&date, "%Y-%m-%d %H:%M:%S%.3f").unwrap();
    let here = parsed.and_local_timezone(Local).single().unwrap();
    assert_eq!(here.timestamp_millis(), 1_731_140_000_005, "{date}");
    assert_eq!(date.len(), "2024-11-09 08:26:40.005".len());
}
