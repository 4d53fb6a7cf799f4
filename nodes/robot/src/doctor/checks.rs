//! The checks of the doctor, by name: what each looks at, and what comes of it when something is wrong. The table of
//! the checks in the crate's README is made of this.

mod entries;

use serde::{Serialize, Serializer};

use entries::Entry;

/// A check.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Check {
    Environment,
    Transport,
    Ports,
    Interfaces,
    ReceiveBuffer,
    SendBuffer,
    Fragments,
    Dropped,
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
    /// All of them, in the order of the table.
    const ALL: [Self; 33] = [
        Self::Environment,
        Self::Transport,
        Self::Ports,
        Self::Interfaces,
        Self::ReceiveBuffer,
        Self::SendBuffer,
        Self::Fragments,
        Self::Dropped,
        Self::Graph,
        Self::Types,
        Self::Qos,
        Self::Names,
        Self::Nodes,
        Self::Publishers,
        Self::Diagnostics,
        Self::Damage,
        Self::Inputs,
        Self::Messages,
        Self::Versions,
        Self::Sizes,
        Self::Stamps,
        Self::Clocks,
        Self::Gaps,
        Self::Offsets,
        Self::Poses,
        Self::Frames,
        Self::Transforms,
        Self::Units,
        Self::PointTimes,
        Self::Returns,
        Self::Calibration,
        Self::Motion,
        Self::Extrinsics,
    ];
}

/// All checks as a table in Markdown.
pub(crate) fn table() -> String {
    let mut table =
        "| check | looks at | finds | severity | what comes of it | mend |\n|---|---|---|---|---|---|\n".to_owned();
    for Entry { name, place, severity, looks_at, consequence, mend } in
        Check::ALL.into_iter().map(Check::entry)
    {
        table +=
            &format!("| `{name}` | {place} | {looks_at} | {severity} | {consequence} | {mend} |\n");
    }
    table
}

impl Serialize for Check {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.entry().name)
    }
}
