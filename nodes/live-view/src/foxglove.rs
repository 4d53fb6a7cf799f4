//! Foxglove's websocket protocol, as far as a viewer of topics needs it: <https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>.
//!
//! The server says who it is and which channels there are, each a topic with its type; the viewer subscribes to channels, and gets their messages in
//! the encoding of ROS 2. Texts are JSON, messages are binary.

use serde_json::{Value, json};

/// The protocols that are spoken, the preferred one first: the name that the SDK gave it, and the one before. What is said is the same.
pub const SUBPROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

/// The opcode of a message of a channel.
const MESSAGE_DATA: u8 = 1;
/// The levels of a status: information, warning, error.
const WARNING: u8 = 1;

/// A topic that a viewer may subscribe to.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Advertised {
    /// Its number.
    pub id: u32,
    /// The topic.
    pub topic: String,
    /// Its type, as `sensor_msgs/msg/LaserScan`.
    pub type_name: &'static str,
    /// The definition of the type with those of all types within it (`ros2msg`).
    pub schema: String,
}

/// What a viewer asks for.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Request {
    /// To get the messages of channels: pairs of the viewer's number of the subscription and the channel's.
    Subscribe(Vec<(u32, u32)>),
    /// To get no more of these subscriptions.
    Unsubscribe(Vec<u32>),
    /// Something else: its operation.
    Other(String),
}

/// The first words to a viewer. With another `session` than before, as after another start, the viewer forgets what it had.
#[must_use]
pub fn server_info(session: &str) -> String {
    let info = json!({
        "op": "serverInfo", "name": "stillmap", "capabilities": [], "supportedEncodings": ["cdr"], "metadata": {}, "sessionId": session,
    });
    info.to_string()
}

/// The channels that there are.
#[must_use]
pub fn advertise(channels: &[Advertised]) -> String {
    let channel = |channel: &Advertised| {
        json!({
            "id": channel.id, "topic": channel.topic, "encoding": "cdr", "schemaName": channel.type_name, "schema": channel.schema,
            "schemaEncoding": "ros2msg",
        })
    };
    let channels: Vec<Value> = channels.iter().map(channel).collect();
    json!({ "op": "advertise", "channels": channels }).to_string()
}

/// A line that the viewer shows as a warning.
#[must_use]
pub fn warning(text: &str) -> String {
    json!({ "op": "status", "level": WARNING, "message": text }).to_string()
}

/// A message of a channel for a subscription, received at `at_ns` (nanoseconds since 1970).
#[must_use]
pub fn message(subscription: u32, at_ns: u64, encoded: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(1 + size_of::<u32>() + size_of::<u64>() + encoded.len());
    bytes.push(MESSAGE_DATA);
    bytes.extend(subscription.to_le_bytes());
    bytes.extend(at_ns.to_le_bytes());
    bytes.extend(encoded);
    bytes
}

/// What a text of a viewer asks for; none where it is not of the protocol.
#[must_use]
pub fn request(text: &str) -> Option<Request> {
    let value: Value = serde_json::from_str(text).ok()?;
    let number = |value: &Value| value.as_u64().and_then(|number| u32::try_from(number).ok());
    match value.get("op")?.as_str()? {
        "subscribe" => {
            let pair =
                |one: &Value| Some((number(one.get("id")?)?, number(one.get("channelId")?)?));
            let pairs: Option<Vec<_>> =
                value.get("subscriptions")?.as_array()?.iter().map(pair).collect();
            pairs.map(Request::Subscribe)
        }
        "unsubscribe" => {
            let ids: Option<Vec<_>> =
                value.get("subscriptionIds")?.as_array()?.iter().map(number).collect();
            ids.map(Request::Unsubscribe)
        }
        other => Some(Request::Other(other.to_owned())),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_viewer_asks_for_channels_and_for_no_more_of_them() {
        let subscribe =
            r#"{"op":"subscribe","subscriptions":[{"id":0,"channelId":3},{"id":1,"channelId":5}]}"#;
        assert_eq!(request(subscribe), Some(Request::Subscribe(vec![(0, 3), (1, 5)])));
        let unsubscribe = r#"{"op":"unsubscribe","subscriptionIds":[1]}"#;
        assert_eq!(request(unsubscribe), Some(Request::Unsubscribe(vec![1])));
        assert_eq!(
            request(r#"{"op":"getParameters"}"#),
            Some(Request::Other("getParameters".to_owned()))
        );
        for wrong in [
            "",
            "[]",
            "{}",
            r#"{"op":1}"#,
            r#"{"op":"subscribe"}"#,
            r#"{"op":"unsubscribe","subscriptionIds":[-1]}"#,
            r#"{"op":"subscribe","subscriptions":[{"id":0}]}"#,
            r#"{"op":"unsubscribe","subscriptionIds":[4294967296]}"#,
        ] {
            assert_eq!(request(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn a_message_has_its_subscription_and_its_time_before_it() {
        let bytes = message(7, 0x0102_0304_0506_0708, &[9, 10]);
        assert_eq!(bytes, [1, 7, 0, 0, 0, 8, 7, 6, 5, 4, 3, 2, 1, 9, 10]);
    }

    #[test]
    fn a_channel_is_told_with_its_type() {
        let channel = Advertised {
            id: 3,
            topic: "/scan".to_owned(),
            type_name: "sensor_msgs/msg/LaserScan",
            schema: "float32 \"angle\"".to_owned(),
        };
        let told: Value = serde_json::from_str(&advertise(&[channel])).unwrap();
        assert_eq!(told["channels"][0]["schemaName"], "sensor_msgs/msg/LaserScan");
        assert_eq!(told["channels"][0]["schema"], "float32 \"angle\"");
        assert_eq!(told["channels"][0]["encoding"], "cdr");
    }

    proptest! {
        #[test]
        fn whatever_a_viewer_says_nothing_panics(text in ".{0,200}", op in "[a-z]{0,12}", value in any::<i64>()) {
            let _ = request(&text);
            let _ = request(&format!(r#"{{"op":"{op}","subscriptions":[{{"id":{value},"channelId":{value}}}],"subscriptionIds":[{value}]}}"#));
        }
    }
}
