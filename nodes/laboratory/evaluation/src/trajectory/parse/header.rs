//! The names of the columns of a CSV file with poses: where the quaternion's w is.

/// The order of the numbers of a quaternion.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum QuaternionOrder {
    /// As EuRoC has it.
    Wxyz,
    /// As TUM and OKVIS2 have it.
    Xyzw,
}

impl QuaternionOrder {
    /// The numbers of a quaternion as x, y, z, w.
    pub(super) fn xyzw(self, numbers: [f64; 4]) -> [f64; 4] {
        let [first, second, third, fourth] = numbers;
        match self {
            Self::Wxyz => [second, third, fourth, first],
            Self::Xyzw => numbers,
        }
    }
}

/// The order that the names of the columns say; none where they are not those of a stamp, a position and a quaternion.
pub(super) fn order(names: &[&str]) -> Option<QuaternionOrder> {
    let axes = |of: std::ops::Range<usize>| -> Option<String> {
        let names = names.get(of)?.iter().map(|name| stem_and_axis(name));
        let names: Vec<(&str, char)> = names.collect::<Option<_>>()?;
        // Only the first may say of what it is: "q_RS_w [], x, y, z".
        let mut stems = names.iter().map(|(stem, _)| *stem).filter(|stem| !stem.is_empty());
        let first = stems.next();
        stems.all(|stem| Some(stem) == first).then(|| names.iter().map(|(_, axis)| *axis).collect())
    };
    if axes(1..4)? != "xyz" {
        return None;
    }
    match axes(4..8)?.as_str() {
        "wxyz" => Some(QuaternionOrder::Wxyz),
        "xyzw" => Some(QuaternionOrder::Xyzw),
        _ => None,
    }
}

/// The order that a comment before the poses says, as EuRoC's own files have one; other comments are prose.
pub(super) fn commented_order(text: &[u8]) -> Option<QuaternionOrder> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let lines = text.split(|byte| *byte == b'\n').map(|line| str::from_utf8(line).unwrap_or(""));
    let lines = lines.map(str::trim).take_while(|line| line.is_empty() || line.starts_with('#'));
    let orders = lines.filter_map(|line| {
        let names: Vec<&str> = line.trim_start_matches('#').split(',').collect();
        order(&names)
    });
    orders.last()
}

/// Of "q_RS_w []" "q_RS_" and w.
fn stem_and_axis(name: &str) -> Option<(&str, char)> {
    let name = name.split(['[', '(']).next().unwrap_or_default().trim();
    let axis = name.chars().next_back()?;
    let stem = name.strip_suffix(axis)?;
    Some((stem, axis.to_ascii_lowercase()))
}
