use proptest::prelude::*;

use super::*;

const STRING: &str = "std_msgs::msg::dds_::String_";
const HASH: &str = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18";

/// The examples of rmw_zenoh's description of its design.
#[test]
fn keys_are_those_of_rmw_zenoh() {
    assert_eq!(data_key(0, "/chatter", STRING, HASH), format!("0/chatter/{STRING}/{HASH}"));
    let key = data_key(2, "/robot1/chatter", STRING, HASH);
    assert_eq!(key, format!("2/robot1/chatter/{STRING}/{HASH}"));
    assert_eq!(all_tokens(2), "@ros2_lv/2/**");
    let node = NodePlace {
        domain_id: 2,
        session: "aac3178e146ba6f1fc6e6a4085e77f21".to_owned(),
        node_id: 0,
        namespace: "/".to_owned(),
        name: "listener".to_owned(),
    };
    let token = Token { node: node.clone(), entity_id: 0, kind: Kind::Node, end: None };
    let text = "@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener";
    assert_eq!(token.to_string(), text);
    let end = End {
        name: "/chatter".to_owned(),
        dds_type: STRING.to_owned(),
        hash: HASH.to_owned(),
        qos: Qos::reliable(10),
    };
    let token = Token { node, entity_id: 10, kind: Kind::Subscription, end: Some(end) };
    let text = format!(
        "@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/10/MS/%/%/listener/%chatter/{STRING}/{HASH}/::,10:,:,:,,"
    );
    assert_eq!(token.to_string(), text);
    // The 128 bits of XXH3, the low ones first.
    assert_eq!(identity("")[..4], [0x7f, 0x49, 0x8d, 0x46]);
}

#[test]
fn what_is_no_token_is_none() {
    for key in [
        "",
        "0/chatter/a/b",
        "@ros2_lv/2",
        "@ros2_lv/x/aa/0/0/NN/%/%/listener",
        "@ros2_lv/2/aa/0/0/XX/%/%/listener",
        "@ros2_lv/2/aa/0/1/MP/%/%/talker/%chatter/type/hash",
        "@ros2_lv/2/aa/0/1/MP/%/%/talker/%chatter/type/hash/1:1",
    ] {
        assert_eq!(Token::parse(key), None, "{key}");
    }
}

/// One of a bag becomes a part of a key.
#[cfg(feature = "zenoh")]
#[test]
fn a_hash_is_that_of_a_definition() {
    assert!(is_hash(HASH));
    let short = &HASH[..70];
    let longer = [format!("{short}/"), format!("{HASH}0")];
    let others = ["", "*", "RIHS01_", UNKNOWN_HASH, short, &longer[0], &longer[1]];
    assert!(!others.into_iter().any(is_hash));
}

/// Other implementations name each policy, or none.
#[test]
fn the_qualities_of_others_are_read() {
    let read = |text: &str| parse_qos(text).unwrap();
    assert_eq!(read("2:1:1,5:1,0:,:,,"), Qos::new(false, true, 5));
    assert_eq!(read("1:2:2,:,:,:,,"), Qos::new(true, false, DEFAULT_DEPTH));
}

proptest! {
    #[test]
    fn a_token_is_read_as_it_was_written(
        ids in any::<(u16, u64, u64)>(), namespace in "(/[a-z]{1,5}){1,2}", name in "[a-z_]{1,6}",
        topic in "(/[a-z]{1,5}){1,3}", kind in 0_usize..5, qos in any::<(bool, bool, u16)>(),
    ) {
        let node = NodePlace {
            domain_id: ids.0, session: "ab12".to_owned(), node_id: ids.1, namespace, name,
        };
        let kind = Kind::ALL[kind].0;
        let end = (kind != Kind::Node).then(|| End {
            name: topic, dds_type: STRING.to_owned(), hash: HASH.to_owned(),
            qos: Qos::new(qos.0, qos.1, usize::from(qos.2)),
        });
        let token = Token { node, entity_id: ids.2, kind, end };
        prop_assert_eq!(Token::parse(&token.to_string()), Some(token));
    }
}
