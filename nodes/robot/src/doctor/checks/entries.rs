//! What is to be said of each check.

use super::Check;

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
    /// What mends it, in short; each finding has its own.
    pub(crate) mend: &'static str,
}

const fn entry(
    name: &'static str,
    [place, severity]: [&'static str; 2],
    looks_at: &'static str,
    consequence: &'static str,
    mend: &'static str,
) -> Entry {
    Entry { name, place, severity, looks_at, consequence, mend }
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
    /// What is to be said of it.
    pub(crate) const fn entry(self) -> Entry {
        match self {
            Self::Environment => entry(
                "environment",
                MACHINE_ERROR,
                "variables of ROS that cannot be understood",
                "no node starts in this shell",
                "the values that are accepted",
            ),
            Self::Transport => entry(
                "transport",
                ["machine", "ok"],
                "the domain and the range of discovery",
                "",
                "",
            ),
            Self::Ports => entry(
                "ports",
                MACHINE_WARN,
                "whether the domain's ports are among those that the kernel gives to anybody",
                "now and then a node cannot join the domain",
                "a lower `ROS_DOMAIN_ID`",
            ),
            Self::Interfaces => entry(
                "interfaces",
                MACHINE_WARN,
                "the network interfaces in use, and whether they carry multicast",
                "nodes of other machines are not found",
                "`ip link set IFACE multicast on`, or `ROS_STATIC_PEERS`",
            ),
            Self::ReceiveBuffer => entry(
                "receive_buffer",
                MACHINE_BOTH,
                "the receive buffer that the kernel grants, against images and clouds",
                "fragments of large messages are dropped, and the messages with them",
                "`config/sysctl/60-stillmap.conf`",
            ),
            Self::SendBuffer => entry(
                "send_buffer",
                MACHINE_WARN,
                "the send buffer, where large messages go to another machine",
                "images and clouds leave late or not at all",
                "`net.core.wmem_max`",
            ),
            Self::Fragments => entry(
                "fragments",
                MACHINE_WARN,
                "the kernel's memory for datagrams that came in part",
                "after a loss on the network nothing large arrives for a while",
                "`net.ipv4.ipfrag_time`, `ipfrag_high_thresh`",
            ),
            Self::Dropped => entry(
                "dropped",
                MACHINE_WARN,
                "datagrams and fragments that the kernel dropped meanwhile",
                "messages are missing, large ones first",
                "larger buffers, or compressed topics",
            ),
            Self::Graph => entry(
                "graph",
                GRAPH_WARN,
                "who was heard at all",
                "nothing can be said of the graph",
                "start the drivers, with the same domain",
            ),
            Self::Types => entry(
                "types",
                GRAPH_ERROR,
                "topics with several types under one name",
                "the ends of different types hear nothing of each other",
                "another name for one of them: `-r`",
            ),
            Self::Qos => entry(
                "qos",
                ALL_BOTH,
                "pairs whose qualities of service do not fit; fixed transforms that are not latched",
                "the subscription hears nothing of that publisher",
                "the policy of one end, named",
            ),
            Self::Names => entry(
                "names",
                GRAPH_WARN,
                "subscriptions without a publisher, beside an unread topic of their type",
                "the subscription waits for ever",
                "`-r` with both names",
            ),
            Self::Nodes => entry(
                "nodes",
                GRAPH_WARN,
                "nodes of one name in several processes",
                "their parameters, services and logs cannot be told apart, and one of them may answer for the other",
                "`-r __node:=` or `-r __ns:=`",
            ),
            Self::Publishers => entry(
                "publishers",
                GRAPH_WARN,
                "several publishers of one input",
                "the readings of two sensors are taken for those of one",
                "end all but one, or `-r`",
            ),
            Self::Diagnostics => entry(
                "diagnostics",
                GRAPH_BOTH,
                "what nodes report of themselves",
                "the node says it itself",
                "what the node says",
            ),
            Self::Damage => entry(
                "damage",
                BAG_BOTH,
                "parts of the bag that cannot be read",
                "what was in them is not mapped",
                "`mcap recover`",
            ),
            Self::Inputs => entry(
                "inputs",
                ALL_BOTH,
                "the topics that the suite reads: whether they are there, with the right type",
                "nothing is mapped without them",
                "the driver, or the option or `-r` that names the topic",
            ),
            Self::Messages => entry(
                "messages",
                ALL_BOTH,
                "messages that cannot be decoded, or make no sense",
                "they are dropped",
                "the driver, by the reason",
            ),
            Self::Versions => entry(
                "versions",
                ALL_BOTH,
                "definitions of types that differ from this release's; makes of DDS and releases of ROS 2 that do not mix",
                "messages are read wrongly, or services are not answered",
                "one release and one make of DDS everywhere",
            ),
            Self::Sizes => entry(
                "sizes",
                ["graph, bag", "error, warn"],
                "the sizes of messages, against what arrives whole here",
                "of larger ones most are lost between processes",
                "larger buffers, or compressed topics",
            ),
            Self::Stamps => entry(
                "stamps",
                ALL_BOTH,
                "stamps that are zero, all the same, or out of order",
                "scans, images and poses are paired wrongly or not at all",
                "the driver must stamp with the time of measurement",
            ),
            Self::Clocks => entry(
                "clocks",
                ALL_BOTH,
                "stamps of one sensor against those of the others, and against the time of arrival",
                "what is paired was measured at different times, and what moves is smeared",
                "chrony or PTP between the hosts",
            ),
            Self::Gaps => entry(
                "gaps",
                BAG_WARN,
                "where messages are missing",
                "nothing is seen meanwhile, and who stood still is taken for new",
                "`ros2 bag record --max-cache-size`",
            ),
            Self::Offsets => entry(
                "offsets",
                BAG_BOTH,
                "how far the nearest image is from each scan",
                "scans without an image are dropped",
                "full rates, one clock, or `max_cloud_offset_s`",
            ),
            Self::Poses => entry(
                "poses",
                BAG_BOTH,
                "for how many images the rig's pose is known",
                "images without a pose are dropped",
                "start the odometry before the recording",
            ),
            Self::Frames => entry(
                "frames",
                ALL_BOTH,
                "frame_id: empty, with a leading slash, changing, or not in tf",
                "tf cannot say where the sensor is",
                "the driver's `frame_id`; `static_transform_publisher`",
            ),
            Self::Transforms => entry(
                "transforms",
                ALL_BOTH,
                "tf: loops, two parents, parts that do not hang together, no rotations, gaps",
                "lookups fail, or give another place from one moment to the next",
                "one broadcaster for each frame, as in REP-105",
            ),
            Self::Units => entry(
                "units",
                ALL_BOTH,
                "millimetres for metres, degrees for radians, g for m/s2, nanoseconds for seconds, and the other way round",
                "all is as many times too large or too small",
                "SI in the driver (REP-103, REP-118)",
            ),
            Self::PointTimes => entry(
                "point_times",
                ALL_WARN,
                "the time of each point of a 3D scanner's turn",
                "the platform's own motion bends every cloud, and the odometry with it",
                "the driver's clouds with times (XYZIRT), or packets",
            ),
            Self::Returns => entry(
                "returns",
                ALL_BOTH,
                "sensors that measure nothing",
                "nothing is found or mapped by them",
                "uncover the sensor; its range and limits",
            ),
            Self::Calibration => entry(
                "calibration",
                ALL_ERROR,
                "the camera's calibration: missing, changing, or of another image size",
                "points come to lie in wrong directions, or images are dropped",
                "the driver's file for its mode; `camera_info_file`",
            ),
            Self::Motion => entry(
                "motion",
                ALL_WARN,
                "poses that jump",
                "the map is torn there",
                "the smooth pose (`odom`), of one source",
            ),
            Self::Extrinsics => entry(
                "extrinsics",
                BAG_BOTH,
                "whether the scan lies on the surfaces that the camera sees",
                "zones miss their objects, which stay in the map",
                "`stillmap calibrate`, or `extrinsics: tf`",
            ),
        }
    }
}
