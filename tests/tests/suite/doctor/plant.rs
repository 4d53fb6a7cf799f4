//! Plants faults into bags of the simulator, by rewriting their messages.

use std::path::{Path, PathBuf};

use bag_player::{Bag, BagWriter, OfferedQos, Selection};
use geometry::{Stamp, pose_from_vector};
use msgs::geometry_msgs::TransformStamped;
use msgs::std_msgs::Header;
use msgs::tf2_msgs::TFMessage;
use msgs::{RosMessage, cdr, convert, schema_of};

/// A message as it lies in a bag.
#[derive(Clone)]
pub(super) struct Recorded {
    pub(super) topic: String,
    type_name: String,
    pub(super) log_time: Stamp,
    data: Vec<u8>,
}

/// All messages of a bag, in their order.
#[derive(Clone)]
pub(super) struct Recording {
    pub(super) messages: Vec<Recorded>,
    /// Topics with another quality of service than reliable.
    latched: Vec<&'static str>,
    /// A type and what its definition says, in place of what it is.
    definition: Option<(&'static str, String)>,
}

impl Recording {
    pub(super) fn read(path: &Path) -> Self {
        let bag = Bag::open(path).unwrap();
        let messages = bag.messages(&Selection::default()).unwrap().map(|message| {
            let message = message.unwrap();
            Recorded {
                topic: message.topic.to_string(),
                type_name: message.type_name.to_string(),
                log_time: message.log_time,
                data: message.data,
            }
        });
        Self { messages: messages.collect(), latched: vec!["/tf_static"], definition: None }
    }

    pub(super) fn write(&self, path: PathBuf) -> PathBuf {
        let mut writer = BagWriter::create(&path).unwrap();
        for message in &self.messages {
            let schema = match &self.definition {
                Some((type_name, text)) if *type_name == message.type_name => text.clone(),
                _ => schema_of(&message.type_name).unwrap(),
            };
            let is_latched = self.latched.contains(&message.topic.as_str());
            let qos = if is_latched { OfferedQos::latched() } else { OfferedQos::reliable(10) };
            let channel = writer
                .raw_channel(&message.topic, &message.type_name, &schema, &qos.to_yaml())
                .unwrap();
            writer.write_raw(channel, message.log_time, message.log_time, &message.data).unwrap();
        }
        writer.finish().unwrap();
        path
    }

    pub(super) fn start(&self) -> Stamp {
        self.messages.iter().map(|message| message.log_time).min().unwrap()
    }

    /// Changes every message of a topic; `index` counts them.
    pub(super) fn edit<M: RosMessage>(
        &mut self,
        topic: &str,
        mut edit: impl FnMut(usize, &mut M),
    ) -> &mut Self {
        let of_topic = self.messages.iter_mut().filter(|message| message.topic == topic);
        let mut count = 0;
        for (index, message) in of_topic.enumerate() {
            let mut decoded: M = cdr::decode(&message.data).unwrap();
            edit(index, &mut decoded);
            message.data = cdr::encode(&decoded).unwrap();
            count += 1;
        }
        assert!(count > 0, "there is no {topic}");
        self
    }

    /// Replaces every message of a topic by one of another type.
    pub(super) fn retype<M: RosMessage, N: RosMessage>(
        &mut self,
        topic: &str,
        convert: impl Fn(M) -> N,
    ) -> &mut Self {
        for message in self.messages.iter_mut().filter(|message| message.topic == topic) {
            message.data = cdr::encode(&convert(cdr::decode(&message.data).unwrap())).unwrap();
            message.type_name = N::TYPE_NAME.to_owned();
        }
        self
    }

    /// Leaves out what `is_kept` does not want; the number counts the messages of the topic.
    pub(super) fn keep(&mut self, topic: &str, is_kept: impl Fn(usize) -> bool) -> &mut Self {
        let mut index = 0;
        self.messages.retain(|message| {
            if message.topic != topic {
                return true;
            }
            index += 1;
            is_kept(index - 1)
        });
        self
    }

    pub(super) fn add<M: RosMessage>(
        &mut self,
        topic: &str,
        messages: impl IntoIterator<Item = (Stamp, M)>,
    ) -> &mut Self {
        self.messages.extend(messages.into_iter().map(|(log_time, message)| Recorded {
            topic: topic.to_owned(),
            type_name: M::TYPE_NAME.to_owned(),
            log_time,
            data: cdr::encode(&message).unwrap(),
        }));
        self.messages.sort_by_key(|message| message.log_time);
        self
    }

    /// Latches nothing.
    pub(super) fn unlatch(&mut self) -> &mut Self {
        self.latched.clear();
        self
    }

    /// Another definition of a type.
    pub(super) fn define(&mut self, type_name: &'static str, edit: impl Fn(String) -> String) {
        self.definition = Some((type_name, edit(schema_of(type_name).unwrap())));
    }

    /// A robot's tf: sensors fixed to its base, which moves in the odometry's frame.
    pub(super) fn with_tf(&mut self) -> &mut Self {
        let start = self.start();
        let mounts = [
            transform(start, "base_link", "laser", LASER),
            transform(start, "base_link", CAMERA, OPTICAL),
        ];
        self.add("/tf_static", [(start, TFMessage { transforms: mounts.into() })]);
        let moments = (0..40).map(move |twentieth| start.plus_seconds(f64::from(twentieth) / 20.0));
        self.add(
            "/tf",
            moments.map(|stamp| {
                (
                    stamp,
                    TFMessage { transforms: vec![transform(stamp, "odom", "base_link", [0.0; 6])] },
                )
            }),
        )
    }
}

/// The frame of the depth images.
pub(super) const CAMERA: &str = "camera_depth_optical_frame";
/// An optical frame on a robot whose base is the rig.
const OPTICAL: [f64; 6] =
    [0.0, 0.0, 0.0, -std::f64::consts::FRAC_PI_2, 0.0, -std::f64::consts::FRAC_PI_2];
/// Where the simulated scanner is on the rig.
const LASER: [f64; 6] = [0.0, 0.0, -0.05, 0.0, 0.0, 0.0];

pub(super) fn transform(
    stamp: Stamp,
    parent: &str,
    child: &str,
    pose: [f64; 6],
) -> TransformStamped {
    TransformStamped {
        header: Header { stamp: convert::time_from_stamp(stamp), frame_id: parent.to_owned() },
        child_frame_id: child.to_owned(),
        transform: convert::transform_from_isometry(&pose_from_vector(&pose)),
    }
}
