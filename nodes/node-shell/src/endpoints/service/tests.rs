//! A service over real DDS, asked by the library's own client.

use std::time::Duration;

use free_domain::FreeDomain;
use msgs::std_srvs::{SetBool, SetBoolRequest, SetBoolResponse};
use ros2_client::dds::{Client, Context};
use ros2_client::{NodeName, NodeOptions};

use super::*;
use crate::{Host, Node, RosArguments, Transport};

/// Longer than anything takes on a busy machine; a test that waits this long has failed.
const PATIENCE: Duration = Duration::from_secs(120);
/// How long a client waits before it asks again: the first requests may go out before the match.
const ASK_AGAIN: Duration = Duration::from_millis(300);

#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
struct Ask(SetBoolRequest);
impl ros2_client::Message for Ask {}

#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
struct Answer(SetBoolResponse);
impl ros2_client::Message for Answer {}

fn transport() -> Transport {
    Transport::on_domain(FreeDomain::of_this_process().number()).unwrap()
}

fn namespace(test: &str) -> String {
    format!("/service_test_{}_{test}", std::process::id())
}

fn server_node(test: &str) -> Node {
    let rule = format!("__ns:={}", namespace(test));
    let arguments = RosArguments::parse(["--ros-args", "-r", &rule]).unwrap();
    Node::start_on(transport(), "server", &arguments).unwrap()
}

/// A client with its node and context, in the order in which they must end.
struct Asker {
    client: Client<Ask, Answer>,
    _node: ros2_client::Node,
    _context: Context,
}

impl Asker {
    fn new(test: &str) -> Self {
        let participant = rustdds::DomainParticipant::new(transport().domain_id()).unwrap();
        let context = Context::from_domain_participant(participant).unwrap();
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let name = NodeName::new(&namespace(test), "asker").unwrap();
        let mut node = context.new_node(name, options).unwrap();
        let qos = QosProfile::default()
            .reliability(Reliability::Reliable { when_full: WhenFull::DEFAULT })
            .history(History::KeepLast { depth: DEPTH });
        let client = node
            .create_client(
                ServiceMapping::Enhanced,
                &Name::new(&format!("{}/server", namespace(test)), "switch").unwrap(),
                &ServiceTypeName::new("std_srvs", "SetBool"),
                qos.clone(),
                qos,
            )
            .unwrap();
        Self { client, _node: node, _context: context }
    }

    /// Asks until there is an answer to the latest question.
    async fn ask(&self, data: bool) -> SetBoolResponse {
        let mut wait = ASK_AGAIN;
        loop {
            let question = self.client.async_send_request(Ask(SetBoolRequest { data }));
            let id = question.await.unwrap();
            let answer = self.client.async_receive_response(id);
            if let Ok(answer) = tokio::time::timeout(wait, answer).await {
                return answer.unwrap().0;
            }
            wait *= 2;
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_client_gets_the_answer_to_its_own_request() {
    let node = server_node("answers");
    {
        let service = node.service::<SetBool>("~/switch").unwrap();
        assert_eq!(service.name(), format!("{}/server/switch", namespace("answers")));
        let askers = [Asker::new("answers"), Asker::new("answers")];
        let serve = async {
            loop {
                let request = service.next().await;
                let data = request.message.data;
                // Lengths of all four remainders, so that padding shows.
                let message = format!("{data}");
                request.respond(&SetBoolResponse { success: data, message }).unwrap();
            }
        };
        let ask = async {
            for _ in 0..5 {
                let answers = futures::join!(askers[0].ask(true), askers[1].ask(false));
                assert_eq!((answers.0.success, answers.0.message.as_str()), (true, "true"));
                assert_eq!((answers.1.success, answers.1.message.as_str()), (false, "false"));
            }
        };
        tokio::select! {
            () = serve => {}
            () = ask => {}
            () = tokio::time::sleep(PATIENCE) => panic!("no answers within {PATIENCE:?}"),
        }
    }
    node.close().await;
}

/// RustDDS sends the request of its own client wrongly when it takes fragments, and its thread ends by that.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_response_that_would_be_sent_in_fragments_is_refused_and_the_next_one_goes_out() {
    let node = server_node("large");
    {
        let service = node.service::<SetBool>("~/switch").unwrap();
        let largest = service.dds_ends().unwrap().largest_whole;
        let asker = Asker::new("large");
        // Of a response: encapsulation, a flag, the count and the end of the text.
        let text = |bytes: usize| "x".repeat(bytes - 4 - 4 - 4 - 1);
        let response = |bytes| SetBoolResponse { success: true, message: text(bytes) };
        let has_reason = std::cell::Cell::new(false);
        let serve = async {
            loop {
                let request = service.next().await;
                if request.message.data {
                    request.respond(&response(largest)).unwrap();
                } else if has_reason.get() {
                    let reason = |error: &PublishError| SetBoolResponse {
                        success: false,
                        message: error.to_string(),
                    };
                    request.respond_or(&response(largest + 4), reason).unwrap();
                } else {
                    let error = request.respond(&response(largest + 4)).unwrap_err();
                    assert!(matches!(error, PublishError::ResponseTooLarge { .. }), "{error}");
                }
            }
        };
        let ask = async {
            assert_eq!(asker.ask(true).await.message.len(), text(largest).len());
            let large = asker.ask(false);
            assert!(tokio::time::timeout(3 * ASK_AGAIN, large).await.is_err());
            assert!(asker.ask(true).await.success);
            has_reason.set(true);
            let answer = asker.ask(false).await;
            assert!(!answer.success && answer.message.contains("ask for less"), "{answer:?}");
        };
        tokio::select! {
            () = serve => {}
            () = ask => {}
            () = tokio::time::sleep(PATIENCE) => panic!("no answers within {PATIENCE:?}"),
        }
    }
    node.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_invalid_request_is_ignored() {
    let node = server_node("malformed");
    {
        let service = node.service::<SetBool>("~/switch").unwrap();
        let ends = service.dds_ends().unwrap();
        let decode = |body| service.decode(ends, RmwRequestId::default(), Body(body));
        assert!(decode(vec![1]).unwrap().message.data);
        assert!(decode(Vec::new()).is_err());
        // A SetBool request has one byte, and at most seven of padding.
        assert!(decode(vec![1; 40]).is_err());
    }
    node.close().await;
}

#[tokio::test]
async fn without_a_network_there_are_no_requests() {
    let arguments = RosArguments::parse(std::iter::empty::<String>()).unwrap();
    let node = Host::in_process().node("server", &arguments).unwrap();
    let service = node.service::<SetBool>("~/switch").unwrap();
    assert_eq!(service.name(), "/server/switch");
    assert!(tokio::time::timeout(Duration::from_millis(20), service.next()).await.is_err());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_name_that_is_none_is_refused() {
    let node = server_node("names");
    for name in ["~/a b", "1st", ""] {
        let error = node.service::<SetBool>(name).err().unwrap().to_string();
        assert!(error.contains("is no"), "{error}");
    }
    node.close().await;
}
