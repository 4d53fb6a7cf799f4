//! The checks of the doctor, and the catalogue that describes them: `checks.md`, a table that `stillmap doctor
//! --checks` prints and that the page of the crate `stillmap` shows.

use serde::Serialize;

/// A row for each check: its name, what it applies to, what it checks, severity, consequence and fix.
const CATALOGUE: &str = include_str!("checks.md");

/// A check.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Check {
    Environment,
    Transport,
    Ports,
    Interfaces,
    ReceiveBuffer,
    SendBuffer,
    Fragments,
    Dropped,
    Router,
    Graph,
    Types,
    Qos,
    Names,
    Nodes,
    Publishers,
    Diagnostics,
    Damage,
    Inputs,
    Messages,
    Versions,
    Sizes,
    Stamps,
    Clocks,
    Gaps,
    Offsets,
    Poses,
    Frames,
    Transforms,
    Units,
    PointTimes,
    Returns,
    Calibration,
    Motion,
    Extrinsics,
}

impl Check {
    /// The consequence of what it finds.
    pub(crate) fn consequence(self) -> &'static str {
        self.cells().and_then(|mut cells| cells.nth(4)).unwrap_or_default()
    }

    /// The cells of its row.
    fn cells(self) -> Option<impl Iterator<Item = &'static str>> {
        let name = serde_json::to_value(self).ok()?;
        let begin = format!("| `{}` |", name.as_str()?);
        let row = CATALOGUE.lines().find(|line| line.starts_with(&begin))?;
        Some(row.trim_matches('|').split('|').map(str::trim))
    }
}

/// All checks as a table in Markdown.
pub(crate) fn table() -> &'static str {
    CATALOGUE
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The last one of [`Check`].
    const LAST: Check = Check::Extrinsics;

    #[test]
    fn each_check_has_a_row_and_each_row_is_a_check() {
        let rows = CATALOGUE.lines().skip(2);
        assert_eq!(rows.clone().count(), LAST as usize + 1);
        for row in rows {
            assert_eq!(row.split(" | ").count(), 6, "{row}");
        }
        for check in [Check::Environment, Check::ReceiveBuffer, Check::PointTimes, LAST] {
            assert!(!check.consequence().is_empty(), "{check:?}");
        }
    }
}
