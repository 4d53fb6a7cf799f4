use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::LaserScan;
use proptest::prelude::*;

use super::*;
use crate::{Bag, Selection, Storage};

const HEADER: &str = "uint32 seq\ntime stamp\nstring frame_id\n";
const SCAN: &str = "Header header # the first ray
float32 angle_min
float32 angle_max
float32 angle_increment
float32 time_increment
float32 scan_time
float32 range_min
float32 range_max
float32[] ranges
float32[] intensities
";
const POSE: &str = "# A pose
std_msgs/Header header
geometry_msgs/Pose pose
";
const POSE_PARTS: &str = "geometry_msgs/Pose\nPoint position\nQuaternion orientation
================================================================================
MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z
================================================================================
MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w";

fn with(definition: &str, parts: &[&str]) -> String {
    let separator = "=".repeat(80);
    let parts = parts.iter().map(|part| format!("{separator}\nMSG: {part}\n"));
    definition.to_owned() + &parts.collect::<String>()
}

fn scan_definition() -> String {
    with(SCAN, &[&format!("std_msgs/Header\n{HEADER}")])
}

fn pose_definition() -> String {
    with(POSE, &[&format!("std_msgs/Header\n{HEADER}"), POSE_PARTS])
}

/// A message of ROS 1.
#[derive(Default)]
struct Ros1(Vec<u8>);

impl Ros1 {
    fn u32(mut self, value: u32) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    fn f32s(mut self, values: &[f32]) -> Self {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self
    }

    fn f64s(mut self, values: &[f64]) -> Self {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self
    }

    fn text(self, text: &str) -> Self {
        let mut longer = self.u32(text.len() as u32);
        longer.0.extend(text.as_bytes());
        longer
    }

    fn header(seq: u32, frame_id: &str) -> Self {
        Self::default().u32(seq).u32(1_700_000_000).u32(5).text(frame_id)
    }
}

fn scan_message(seq: u32) -> Vec<u8> {
    let fixed = [-1.5, 1.5, 0.5, 0.001, 0.1, 0.2, 8.0];
    let message = Ros1::header(seq, "laser").f32s(&fixed).u32(3).f32s(&[1.0, f32::INFINITY, 2.5]);
    message.u32(0).0
}

fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let mut header = Vec::new();
    for (name, value) in fields {
        header.extend((name.len() as u32 + 1 + value.len() as u32).to_le_bytes());
        header.extend(name.as_bytes());
        header.push(b'=');
        header.extend(*value);
    }
    let mut record = (header.len() as u32).to_le_bytes().to_vec();
    record.extend(header);
    record.extend((data.len() as u32).to_le_bytes());
    record.extend(data);
    record
}

/// A connection with its messages, as a bag has them.
struct Recorded<'a> {
    topic: &'a str,
    type_name: &'a str,
    definition: &'a str,
    messages: Vec<Vec<u8>>,
}

/// A bag of one chunk, not compressed.
fn bag(recorded: &[Recorded<'_>]) -> Vec<u8> {
    let mut chunk = Vec::new();
    let mut connections = Vec::new();
    for (id, one) in (0_u32..).zip(recorded) {
        let data = record(
            &[
                ("topic", one.topic.as_bytes()),
                ("type", one.type_name.as_bytes()),
                ("md5sum", b"0123456789abcdef0123456789abcdef"),
                ("message_definition", one.definition.as_bytes()),
            ],
            &[],
        );
        // The data of a connection is a header without a length of its own.
        let inner = &data[4..data.len() - 4];
        let fields: [(&str, &[u8]); 3] =
            [("op", &[7]), ("conn", &id.to_le_bytes()), ("topic", one.topic.as_bytes())];
        connections.push(record(&fields, inner));
        chunk.extend(connections[id as usize].clone());
        for (index, message) in (0_u32..).zip(&one.messages) {
            let mut time = 1_700_000_000_u32.to_le_bytes().to_vec();
            time.extend((index * 1000).to_le_bytes());
            let fields: [(&str, &[u8]); 3] =
                [("op", &[2]), ("conn", &id.to_le_bytes()), ("time", &time)];
            chunk.extend(record(&fields, message));
        }
    }
    let size = (chunk.len() as u32).to_le_bytes();
    let chunk = record(&[("op", &[5]), ("compression", b"none"), ("size", &size)], &chunk);
    let index_at = HEADER_BYTES + chunk.len() as u64;
    let count = (recorded.len() as u32).to_le_bytes();
    let fields: [(&str, &[u8]); 4] = [
        ("op", &[3]),
        ("index_pos", &index_at.to_le_bytes()),
        ("conn_count", &count),
        ("chunk_count", &1_u32.to_le_bytes()),
    ];
    let empty = record(&fields, &[]).len();
    let padding = vec![b' '; HEADER_BYTES as usize - 13 - empty];
    let mut bag = b"#ROSBAG V2.0\n".to_vec();
    bag.extend(record(&fields, &padding));
    bag.extend(chunk);
    bag.extend(connections.concat());
    bag
}

fn converted(bytes: &[u8]) -> Result<(Ros1Conversion, tempfile::TempDir), Ros1Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recorded.bag");
    std::fs::write(&path, bytes).unwrap();
    let conversion = convert_ros1(&path, &folder.path().join("bag.mcap"), || true)?;
    Ok((conversion, folder))
}

/// The members were written out: 32 types of two fields each, the next of them, are 2^32.
#[test]
fn a_definition_that_doubles_with_each_type_is_refused() {
    let doubling = |level: u32| format!("p/T{level}\nT{next} a\nT{next} b", next = level + 1);
    let parts: Vec<String> = (1..30).map(doubling).chain(["p/T30\nuint8 a".to_owned()]).collect();
    let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
    let definition = with("T1 a\nT1 b\n", &parts);
    let refused = Definitions::read("p/T0", &definition).unwrap().members("p/T0").unwrap_err();
    assert!(matches!(refused, DefinitionError::TooLarge { .. }), "{refused}");
}

/// An array of messages without fields was cut to the message's length; one of messages that hold such messages never ended.
#[test]
fn an_array_of_messages_without_a_byte_ends() {
    let definition = with("Part[4000000000] parts\n", &["p/Part\nNothing[3] none", "p/Nothing"]);
    let members = Definitions::read("p/Whole", &definition).unwrap().members("p/Whole").unwrap();
    assert_eq!(transcode(&members, &[]), Err(TranscodeError::TooManyEmpty));
    let few = with("Part[2] parts\n", &["p/Part\nNothing[3] none", "p/Nothing"]);
    let members = Definitions::read("p/Whole", &few).unwrap().members("p/Whole").unwrap();
    assert_eq!(transcode(&members, &[]).unwrap().len(), 4 + 6);
}

#[test]
fn scans_and_poses_come_over_field_by_field() {
    let pose = Ros1::header(9, "map").f64s(&[1.0, -2.0, 3.0, 0.0, 0.0, 0.0, 1.0]).0;
    let bytes = bag(&[
        Recorded {
            topic: "scan",
            type_name: "sensor_msgs/LaserScan",
            definition: &scan_definition(),
            messages: vec![scan_message(1), scan_message(2)],
        },
        Recorded {
            topic: "/pose",
            type_name: "geometry_msgs/PoseStamped",
            definition: &pose_definition(),
            messages: vec![pose],
        },
    ]);
    let (conversion, folder) = converted(&bytes).unwrap();
    assert_eq!((conversion.left_out.len(), conversion.broken_off), (0, None));
    let bag = Bag::open(&folder.path().join("bag.mcap")).unwrap();
    let messages: Vec<_> =
        bag.messages(&Selection::default()).unwrap().map(Result::unwrap).collect();
    assert_eq!(messages.len(), 3);
    for message in messages {
        if &*message.topic == "/scan" {
            let scan = message.decode::<LaserScan>().unwrap();
            assert_eq!((&*scan.header.frame_id, scan.header.stamp.nanosec), ("laser", 5));
            assert_eq!((scan.angle_min, scan.range_max), (-1.5, 8.0));
            assert_eq!(scan.ranges, [1.0, f32::INFINITY, 2.5]);
            assert!(scan.intensities.is_empty());
        } else {
            let pose = message.decode::<PoseStamped>().unwrap();
            assert_eq!(&*message.topic, "/pose");
            assert_eq!((pose.pose.position.y, pose.pose.orientation.w), (-2.0, 1.0));
        }
    }
}

#[test]
fn a_bag_of_ros_1_is_read_as_one_of_ros_2_by_its_content() {
    let recorded = |topic, type_name, definition, messages| Recorded {
        topic,
        type_name,
        definition,
        messages,
    };
    let scans = scan_definition();
    let bytes = bag(&[
        recorded("scan", "sensor_msgs/LaserScan", &scans, vec![scan_message(1), scan_message(2)]),
        recorded("/odd", "std_msgs/String", "string data\n", vec![vec![9, 0, 0, 0, 1]]),
    ]);
    let folder = tempfile::tempdir().unwrap();
    // Neither the name nor the compression of the whole file matters.
    for bytes in [bytes.clone(), zstd::encode_all(bytes.as_slice(), 1).unwrap()] {
        let path = folder.path().join("people.mcap");
        std::fs::write(&path, bytes).unwrap();
        let bag = Bag::open(&path).unwrap();
        let info = bag.info().unwrap();
        assert_eq!((info.files[0].storage, &info.files[0].path), (Storage::Ros1, &path));
        assert!(info.remarks[0].contains("`stillmap import bag "), "{:?}", info.remarks);
        let mut messages = bag.messages(&Selection::default()).unwrap();
        assert_eq!(messages.by_ref().filter(|message| message.is_ok()).count(), 2);
        let [loss] = messages.losses() else { panic!("{:?}", messages.losses()) };
        assert_eq!((loss.messages, &loss.file, &info.losses[0]), (Some(1), &path, loss));
        let said = loss.to_string();
        assert!(said.contains("/odd (std_msgs/String) is left out"), "{said}");
    }
}

#[test]
fn a_conversion_ends_when_it_is_to() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scans.bag");
    let scans = Recorded {
        topic: "/scan",
        type_name: "sensor_msgs/LaserScan",
        definition: &scan_definition(),
        messages: vec![scan_message(1)],
    };
    std::fs::write(&path, bag(&[scans])).unwrap();
    assert!(crate::Bag::open_while(&path, &|| true).is_ok());
    let ended = crate::Bag::open_while(&path, &|| false).unwrap_err();
    assert!(matches!(ended, crate::BagError::Interrupted { .. }), "{ended}");
}

#[test]
fn an_unknown_type_is_converted_with_its_definition() {
    let definition = "byte level\ntime[2] at\nstring[] names\nint64 BIG=7\nfloat64 value\nstd_msgs/Empty[] none\n";
    let definition = with(definition, &["std_msgs/Empty\n"]);
    let mut message = vec![3];
    message.extend(Ros1::default().u32(1).u32(2).u32(3).u32(4).u32(2).text("a").text("bc").0);
    message.extend(Ros1::default().f64s(&[0.5]).u32(0).0);
    let bytes = bag(&[Recorded {
        topic: "/odd",
        type_name: "odd_msgs/Odd",
        definition: &definition,
        messages: vec![message],
    }]);
    let (conversion, folder) = converted(&bytes).unwrap();
    assert_eq!(conversion.left_out, BTreeMap::new());
    let bag = Bag::open(&folder.path().join("bag.mcap")).unwrap();
    let mut messages = bag.messages(&Selection::default()).unwrap();
    let message = messages.next().unwrap().unwrap();
    let mut expected = vec![0, 1, 0, 0, 3, 0, 0, 0];
    for value in [1_u32, 2, 3, 4, 2, 2] {
        expected.extend(value.to_le_bytes());
    }
    expected.extend(*b"a\0\0\0");
    expected.extend(3_u32.to_le_bytes());
    expected.extend(*b"bc\0");
    // The next number of eight bytes stands at a multiple of eight.
    expected.resize((expected.len() - 4).next_multiple_of(8) + 4, 0);
    expected.extend(0.5_f64.to_le_bytes());
    expected.extend(0_u32.to_le_bytes());
    assert_eq!(&message.data[..], &expected[..]);
    let schema = as_ros2("odd_msgs/Odd", &definition);
    assert!(
        schema.starts_with("int8 level\nbuiltin_interfaces/Time[2] at\nstring[] names"),
        "{schema}"
    );
    assert!(schema.contains("MSG: builtin_interfaces/Time\nint32 sec"), "{schema}");
}

#[test]
fn what_does_not_fit_is_left_out_and_named() {
    let bytes = bag(&[
        Recorded {
            topic: "/markers",
            type_name: "visualization_msgs/Marker",
            definition: "int32 id",
            messages: vec![vec![0; 4], vec![0; 4]],
        },
        Recorded {
            topic: "/scan",
            type_name: "sensor_msgs/LaserScan",
            definition: &scan_definition(),
            messages: vec![scan_message(1), scan_message(2)[..30].to_vec()],
        },
        Recorded {
            topic: "/undefined",
            type_name: "a/B",
            definition: "C c",
            messages: vec![vec![]],
        },
    ]);
    let (conversion, _folder) = converted(&bytes).unwrap();
    let left_out = |topic: &str| {
        let left_out = &conversion.left_out[topic];
        (left_out.messages, left_out.reason.clone())
    };
    assert_eq!(conversion.summary.message_count, 1);
    assert_eq!(left_out("/markers").0, 2);
    assert!(left_out("/markers").1.contains("has another layout"));
    assert_eq!(left_out("/scan").0, 1);
    assert!(left_out("/scan").1.contains("30 bytes"));
    assert!(left_out("/undefined").1.contains("a/C is not defined"));
}

#[test]
fn a_bag_without_an_index_is_refused_with_its_fix() {
    let bytes = bag(&[]);
    let cut = converted(&bytes[..4000]).unwrap_err().to_string();
    assert!(cut.contains("rosbag reindex"), "{cut}");
    let other = converted(b"no bag at all").unwrap_err();
    assert!(matches!(other, Ros1Error::Open { .. }), "{other}");
}

#[test]
fn a_type_within_itself_is_an_error() {
    let definitions = Definitions::read("a/B", "B b").unwrap();
    let error = definitions.members("a/B").unwrap_err();
    assert!(matches!(error, DefinitionError::TooDeep { .. }), "{error}");
}

proptest! {
    #[test]
    fn no_message_and_no_bag_is_a_fault(
        cut in 0_usize..6000,
        at in 0_usize..6000,
        byte in any::<u8>(),
    ) {
        let mut bytes = bag(&[Recorded {
            topic: "/scan",
            type_name: "sensor_msgs/LaserScan",
            definition: &scan_definition(),
            messages: vec![scan_message(1)],
        }]);
        bytes.truncate(bytes.len().saturating_sub(cut).max(14));
        if let Some(changed) = bytes.get_mut(at) {
            *changed = byte;
        }
        let _ = converted(&bytes);
    }
}
