use rustdds::QosPolicyBuilder;
use rustdds::policy::Deadline;

use super::*;

fn publisher(qos: Qos) -> DiscoveredQos {
    DiscoveredQos::of_publisher(&qos)
}

fn subscription(qos: Qos) -> DiscoveredQos {
    DiscoveredQos::of_subscription(&qos)
}

fn bare(role: Role) -> DiscoveredQos {
    DiscoveredQos { role, policies: QosPolicyBuilder::new().build() }
}

#[test]
fn what_fits_has_no_mismatch() {
    for offer in [Qos::sensor(5), Qos::reliable(1), Qos::latched()] {
        assert_eq!(publisher(offer).mismatch(&subscription(Qos::sensor(5))), None);
    }
    assert_eq!(publisher(Qos::latched()).mismatch(&subscription(Qos::latched())), None);
}

#[test]
fn a_mismatch_names_policy_offer_and_request() {
    let mismatch = |offer, request| publisher(offer).mismatch(&subscription(request)).unwrap();
    let one = mismatch(Qos::sensor(5), Qos::reliable(5));
    assert_eq!(
        (one.policy, &*one.offered, &*one.requested),
        ("reliability", "best effort", "reliable")
    );
    let one = mismatch(Qos::reliable(5), Qos::latched());
    assert_eq!(
        (one.policy, &*one.offered, &*one.requested),
        ("durability", "volatile", "transient local")
    );
}

#[test]
fn a_deadline_is_reported_in_seconds() {
    let mut strict = subscription(Qos::sensor(5));
    let deadline = QosPolicyBuilder::new().deadline(Deadline(Duration::from_millis(100))).build();
    strict.policies = strict.policies.modify_by(&deadline);
    assert_eq!(strict.to_string(), "best effort, volatile, deadline 0.100 s");
    let one = publisher(Qos::sensor(5)).mismatch(&strict).unwrap();
    assert_eq!((one.policy, &*one.offered, &*one.requested), ("deadline", "none", "0.100 s"));
}

#[test]
fn what_an_endpoint_leaves_out_has_the_default_of_its_end() {
    assert!(bare(Role::Publisher).is_reliable());
    assert!(!bare(Role::Subscription).is_reliable());
    assert_eq!(bare(Role::Publisher).to_string(), "reliable, volatile");
}

#[test]
fn a_participant_names_its_vendor() {
    let id = |first, second| {
        let mut prefix = [7; 12];
        prefix[..2].copy_from_slice(&[first, second]);
        ParticipantId(prefix)
    };
    assert_eq!(id(1, 0x12).vendor(), "RustDDS");
    assert_eq!(id(1, 0x10).vendor(), "Cyclone DDS");
    assert_eq!(id(1, 0x0f).vendor(), "Fast DDS");
    assert_eq!(id(9, 9).vendor(), "unknown DDS");
    assert_eq!(id(1, 0x10).to_string(), "01100707070707070707 0707".replace(' ', ""));
}

#[test]
fn only_topics_of_ros_are_topics() {
    assert_eq!(ros_topic_name("rt/robot/scan").as_deref(), Some("/robot/scan"));
    assert_eq!(ros_topic_name("rq/robot/saveRequest"), None);
    assert_eq!(ros_topic_name("ros_discovery_info"), None);
}
