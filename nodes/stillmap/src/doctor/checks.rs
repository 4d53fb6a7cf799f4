//! The checks of the doctor, by name: what each looks at, and what comes of it when something is wrong. The table of
//! the checks in the crate's README is made of this.

use serde::{Serialize, Serializer};

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

/// What is to be said of a check beside its findings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    /// Its name, for programs.
    pub(crate) name: &'static str,
    /// Where it looks: the machine, the graph, a bag.
    pub(crate) place: &'static str,
    /// How grave its findings are.
    pub(crate) severity: &'static str,
    /// What it looks at.
    pub(crate) looks_at: &'static str,
    /// What comes of it.
    pub(crate) consequence: &'static str,
}

const fn entry(
    name: &'static str,
    [place, severity]: [&'static str; 2],
    looks_at: &'static str,
    consequence: &'static str,
) -> Entry {
    Entry { name, place, severity, looks_at, consequence }
}

/// Where a check looks, and how grave what it finds is.
const MACHINE_ERROR: [&str; 2] = ["machine", "error"];
const MACHINE_WARN: [&str; 2] = ["machine", "warn"];
const MACHINE_BOTH: [&str; 2] = ["machine", "error, warn"];
const GRAPH_ERROR: [&str; 2] = ["graph", "error"];
const GRAPH_WARN: [&str; 2] = ["graph", "warn"];
const GRAPH_BOTH: [&str; 2] = ["graph", "error, warn"];
const BAG_WARN: [&str; 2] = ["bag", "warn"];
const BAG_BOTH: [&str; 2] = ["bag", "error, warn"];
const ALL_BOTH: [&str; 2] = ["graph, bag", "error, warn"];
const ALL_ERROR: [&str; 2] = ["graph, bag", "error"];
const ALL_WARN: [&str; 2] = ["graph, bag", "warn"];

impl Check {
    /// All of them, in the order of the table.
    #[cfg(test)]
    pub(crate) const ALL: [Self; 33] = [
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

    /// What is to be said of it.
    pub(crate) const fn entry(self) -> Entry {
        match self {
            Self::Environment => entry(
                "environment",
                MACHINE_ERROR,
                "variables of ROS that cannot be understood",
                "no node starts in this shell",
            ),
            Self::Transport => {
                entry("transport", ["machine", "ok"], "the domain and the range of discovery", "")
            }
            Self::Ports => entry(
                "ports",
                MACHINE_WARN,
                "whether the domain's ports are among those that the kernel gives to anybody",
                "now and then a node cannot join the domain",
            ),
            Self::Interfaces => entry(
                "interfaces",
                MACHINE_WARN,
                "the network interfaces in use, and whether they carry multicast",
                "nodes of other machines are not found",
            ),
            Self::ReceiveBuffer => entry(
                "receive_buffer",
                MACHINE_BOTH,
                "the receive buffer that the kernel grants, against images and clouds",
                "fragments of large messages are dropped, and the messages with them",
            ),
            Self::SendBuffer => entry(
                "send_buffer",
                MACHINE_WARN,
                "the send buffer, where large messages go to another machine",
                "images and clouds leave late or not at all",
            ),
            Self::Fragments => entry(
                "fragments",
                MACHINE_WARN,
                "the kernel's memory for datagrams that came in part",
                "after a loss on the network nothing large arrives for a while",
            ),
            Self::Dropped => entry(
                "dropped",
                MACHINE_WARN,
                "datagrams and fragments that the kernel dropped meanwhile",
                "messages are missing, large ones first",
            ),
            Self::Graph => entry(
                "graph",
                GRAPH_WARN,
                "who was heard at all",
                "nothing can be said of the graph",
            ),
            Self::Types => entry(
                "types",
                GRAPH_ERROR,
                "topics with several types under one name",
                "the ends of different types hear nothing of each other",
            ),
            Self::Qos => entry(
                "qos",
                ALL_BOTH,
                "pairs whose qualities of service do not fit; fixed transforms that are not latched",
                "the subscription hears nothing of that publisher",
            ),
            Self::Names => entry(
                "names",
                GRAPH_WARN,
                "subscriptions without a publisher, beside an unread topic of their type",
                "the subscription waits for ever",
            ),
            Self::Nodes => entry(
                "nodes",
                GRAPH_WARN,
                "nodes of one name in several processes",
                "their parameters, services and logs cannot be told apart, and one of them may answer for the other",
            ),
            Self::Publishers => entry(
                "publishers",
                GRAPH_WARN,
                "several publishers of one input",
                "the readings of two sensors are taken for those of one",
            ),
            Self::Diagnostics => entry(
                "diagnostics",
                GRAPH_BOTH,
                "what nodes report of themselves",
                "the node says it itself",
            ),
            Self::Damage => entry(
                "damage",
                BAG_BOTH,
                "parts of the bag that cannot be read",
                "what was in them is not mapped",
            ),
            Self::Inputs => entry(
                "inputs",
                ALL_BOTH,
                "the topics that the suite reads: whether they are there, with the right type",
                "nothing is mapped without them",
            ),
            Self::Messages => entry(
                "messages",
                ALL_BOTH,
                "messages that cannot be decoded, or make no sense",
                "they are dropped",
            ),
            Self::Versions => entry(
                "versions",
                ALL_BOTH,
                "definitions of types that differ from this release's; makes of DDS and releases of ROS 2 that do not mix",
                "messages are read wrongly, or services are not answered",
            ),
            Self::Sizes => entry(
                "sizes",
                ["graph, bag", "error, warn"],
                "the sizes of messages, against what arrives whole here",
                "of larger ones most are lost between processes",
            ),
            Self::Stamps => entry(
                "stamps",
                ALL_BOTH,
                "stamps that are zero, all the same, or out of order",
                "scans, images and poses are paired wrongly or not at all",
            ),
            Self::Clocks => entry(
                "clocks",
                ALL_BOTH,
                "stamps of one sensor against those of the others, and against the time of arrival",
                "what is paired was measured at different times, and what moves is smeared",
            ),
            Self::Gaps => entry(
                "gaps",
                BAG_WARN,
                "where messages are missing",
                "nothing is seen meanwhile, and who stood still is taken for new",
            ),
            Self::Offsets => entry(
                "offsets",
                BAG_BOTH,
                "how far the nearest image is from each scan",
                "scans without an image are dropped",
            ),
            Self::Poses => entry(
                "poses",
                BAG_BOTH,
                "for how many images the rig's pose is known",
                "images without a pose are dropped",
            ),
            Self::Frames => entry(
                "frames",
                ALL_BOTH,
                "frame_id: empty, with a leading slash, changing, or not in tf",
                "tf cannot say where the sensor is",
            ),
            Self::Transforms => entry(
                "transforms",
                ALL_BOTH,
                "tf: loops, two parents, parts that do not hang together, no rotations, gaps",
                "lookups fail, or give another place from one moment to the next",
            ),
            Self::Units => entry(
                "units",
                ALL_BOTH,
                "millimetres for metres, degrees for radians, g for m/s2, nanoseconds for seconds, and the other way round",
                "all is as many times too large or too small",
            ),
            Self::PointTimes => entry(
                "point_times",
                ALL_WARN,
                "the time of each point of a 3D scanner's turn",
                "the platform's own motion bends every cloud, and the odometry with it",
            ),
            Self::Returns => entry(
                "returns",
                ALL_BOTH,
                "sensors that measure nothing",
                "nothing is found or mapped by them",
            ),
            Self::Calibration => entry(
                "calibration",
                ALL_ERROR,
                "the camera's calibration: missing, changing, or of another image size",
                "points come to lie in wrong directions, or images are dropped",
            ),
            Self::Motion => entry("motion", ALL_WARN, "poses that jump", "the map is torn there"),
            Self::Extrinsics => entry(
                "extrinsics",
                BAG_BOTH,
                "whether the scan lies on the surfaces that the camera sees",
                "zones miss their objects, which stay in the map",
            ),
        }
    }
}

impl Serialize for Check {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.entry().name)
    }
}
