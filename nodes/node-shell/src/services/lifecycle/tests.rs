//! A managed node over real DDS; its manager is the other end of the channel.

use std::time::Duration;

use free_domain::FreeDomain;
use msgs::lifecycle_msgs::{
    ChangeState, ChangeStateRequest, GetState, GetStateRequest, State, Transition,
};
use msgs::std_msgs::String as Text;
use tokio::time::timeout;

use crate::{Host, LifecycleState, Node, PublishError, Qos, RosArguments, Transport};

/// Longer than anything takes on a busy machine; a test that waits this long has failed.
const PATIENCE: Duration = Duration::from_secs(120);

fn text(data: &str) -> Text {
    Text { data: data.to_owned() }
}

fn host() -> Host {
    Host::on(Transport::on_domain(FreeDomain::of_this_process().number()).unwrap()).unwrap()
}

fn node(host: &Host, test: &str, extra: &[&str]) -> Node {
    let rule = format!("__ns:=/lifecycle_test_{}_{test}", std::process::id());
    let mut line = vec!["--ros-args", "-r", &rule];
    line.extend(extra);
    host.node("managed", &RosArguments::parse(line).unwrap()).unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_that_waits_takes_nothing_in_and_publishes_nothing() {
    let host = host();
    let (node, peer) =
        (node(&host, "waits", &["-p", "autostart:=false"]), node(&host, "waits", &[]));
    {
        let inputs = node.subscription::<Text>("in", &Qos::reliable(5)).unwrap();
        let outputs = node.publisher::<Text>("out", &Qos::reliable(5)).unwrap();
        let own = node.own_publisher::<Text>("own", &Qos::reliable(5)).unwrap();
        let kept = node.subscription::<Text>("kept", &Qos::latched()).unwrap();
        let lifecycle = node.manage().unwrap();
        assert!(!lifecycle.is_active());

        peer.publisher::<Text>("in", &Qos::reliable(5)).unwrap().publish(text("early")).unwrap();
        let latched = peer.publisher::<Text>("kept", &Qos::latched()).unwrap();
        latched.publish(text("once")).unwrap();
        assert!(inputs.try_next().is_none());
        let heard = timeout(PATIENCE, kept.next()).await.unwrap();
        assert_eq!(heard.message.data, "once", "it comes no second time");
        let refused = outputs.publish(text("data")).unwrap_err();
        assert!(matches!(refused, PublishError::NotActive { .. }), "{refused}");
        assert!(!outputs.publish_or_warn(text("data")));
        own.publish(text("about itself")).unwrap();
    }
    node.close().await;
    peer.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn messages_that_came_while_a_node_was_inactive_are_ignored() {
    let host = host();
    let (node, peer) = (node(&host, "over", &[]), node(&host, "over", &[]));
    {
        let inputs = node.subscription::<Text>("in", &Qos::reliable(5)).unwrap();
        let talker = peer.publisher::<Text>("in", &Qos::reliable(5)).unwrap();
        talker.publish(text("before")).unwrap();
        let lifecycle = node.manage().unwrap();
        assert!(lifecycle.is_active());
        assert_eq!(inputs.try_next().unwrap().message.data, "before", "a start loses nothing");

        // Both turns before the node looks again.
        talker.publish(text("last")).unwrap();
        node.life().enter(LifecycleState::Deactivating);
        talker.publish(text("meanwhile")).unwrap();
        node.life().enter(LifecycleState::Active);
        assert!(inputs.try_next().is_none());
        talker.publish(text("after")).unwrap();
        let heard = timeout(PATIENCE, inputs.next()).await.unwrap();
        assert_eq!(heard.message.data, "after");
    }
    node.close().await;
    peer.close().await;
}

#[test]
fn without_a_network_a_node_is_unmanaged() {
    let host = Host::in_process();
    let node = node(&host, "alone", &["-p", "autostart:=false"]);
    assert!(node.manage().unwrap().is_active(), "its driver decides when it is active");
}

/// Regression: Nav2's manager ends the nodes of a process one after the other, and asks each for its state when it has. The process ended
/// 0.1 s after the first of them: the manager found the next one gone, and left those behind it running.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn all_nodes_of_a_process_are_ended_and_say_so_before_it_ends() {
    let (host, peers) = (host(), host());
    let peer = node(&peers, "ends", &["-r", "__node:=manager"]);
    let nodes = ["first", "second"].map(|name| {
        node(&host, "ends", &["-p", "autostart:=false", "-r", &format!("__node:={name}")])
    });
    let shutdown = host.shutdown_signal();
    {
        // However slow this machine is.
        let farewell = Duration::from_secs(3600);
        let _lifecycles = nodes.each_ref().map(|node| node.manage_with(farewell).unwrap());
        let transition =
            Transition { id: Transition::TRANSITION_UNCONFIGURED_SHUTDOWN, label: String::new() };
        let clients = ["first", "second"].map(|name| {
            (
                peer.service_client::<ChangeState>(&format!("{name}/change_state")).unwrap(),
                peer.service_client::<GetState>(&format!("{name}/get_state")).unwrap(),
            )
        });
        // The first request finds the server.
        for (_, get_state) in &clients {
            get_state.ask(&GetStateRequest::default(), PATIENCE).await.unwrap();
        }
        for (change_state, get_state) in &clients {
            let request = ChangeStateRequest { transition: transition.clone() };
            assert!(change_state.ask(&request, PATIENCE).await.unwrap().success);
            // A manager has others to ask meanwhile: more than the 0.1 s.
            tokio::time::sleep(Duration::from_millis(200)).await;
            let state = get_state.ask(&GetStateRequest::default(), PATIENCE).await;
            assert_eq!(state.unwrap().current_state.id, State::PRIMARY_STATE_FINALIZED);
            assert!(!shutdown.is_triggered(), "the process ends before all of its nodes have");
        }
    }
    for node in nodes {
        node.close().await;
    }
    peer.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_process_ends_once_its_node_was_ended() {
    let (host, peers) = (host(), host());
    let (managed, peer) = (node(&host, "end", &[]), node(&peers, "end", &["-r", "__node:=peer"]));
    let shutdown = host.shutdown_signal();
    {
        let _lifecycle = managed.manage_with(Duration::ZERO).unwrap();
        let change_state = peer.service_client::<ChangeState>("managed/change_state").unwrap();
        let transition =
            Transition { id: Transition::TRANSITION_ACTIVE_SHUTDOWN, label: String::new() };
        let request = ChangeStateRequest { transition };
        assert!(change_state.ask(&request, PATIENCE).await.unwrap().success);
        timeout(PATIENCE, shutdown.wait()).await.unwrap();
    }
    managed.close().await;
    peer.close().await;
}
