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
        ("plain", "plain"),
    ] {
        assert_eq!(written(format), expected, "{format}");
    }
}
