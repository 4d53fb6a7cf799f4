//! What a browser may ask of the nodes: their services, as any ROS 2 client calls them.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use futures::future::join_all;
use msgs::RosService;
use msgs::lifecycle_msgs::{ChangeState, ChangeStateRequest, Transition};
use msgs::rcl_interfaces::{
    GetParameters, GetParametersRequest, Parameter, SetParameters, SetParametersRequest,
};
use msgs::std_srvs::{Trigger, TriggerRequest};
use node_shell::{Node, ServiceClient, message_from_parameter, parameter_from_message};
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::sync::Mutex;

use super::ShownNode;

/// How long a node may take to be found, and again to answer: a large map takes seconds to be saved.
const PATIENCE: Duration = Duration::from_secs(20);
/// The same where all nodes are asked for their parameters: not all of them need run.
const PATIENCE_FOR_ALL: Duration = Duration::from_secs(3);
/// Parameters that are asked for at a time: their values fit into a datagram, or the nodes would not answer.
const NAMES_AT_A_TIME: usize = 16;

/// A command, as the page sends it. `id` comes back with the answer.
#[derive(Deserialize, Debug)]
struct Command {
    id: u64,
    #[serde(flatten)]
    what: What,
}

#[derive(Deserialize, Debug)]
#[serde(tag = "do", rename_all = "snake_case")]
enum What {
    /// The map to its file.
    SaveMap,
    /// An empty map.
    Reset,
    /// No more cycles: detection is deactivated.
    Pause,
    /// Cycles again.
    Resume,
    /// The parameters of all nodes with their values.
    Parameters,
    /// Another value of a parameter.
    Set { node: String, name: String, value: Value },
}

type Clients<S> = Mutex<BTreeMap<String, Arc<ServiceClient<S>>>>;

/// The services that browsers call, each with its client from the first call on.
pub(super) struct Commands {
    node: Arc<Node>,
    nodes: Vec<ShownNode>,
    triggers: Clients<Trigger>,
    transitions: Clients<ChangeState>,
    getting: Clients<GetParameters>,
    setting: Clients<SetParameters>,
}

impl Commands {
    pub(super) fn new(node: Arc<Node>, nodes: Vec<ShownNode>) -> Self {
        Self {
            node,
            nodes,
            triggers: Mutex::default(),
            transitions: Mutex::default(),
            getting: Mutex::default(),
            setting: Mutex::default(),
        }
    }

    /// Carries out a command in JSON; the answer is JSON, too.
    pub(super) async fn carry_out(&self, text: &str) -> String {
        let command: Command = match serde_json::from_str(text) {
            Ok(command) => command,
            Err(error) => return answer(None, Err(format!("no command: {error}"))),
        };
        let result = match command.what {
            What::SaveMap => self.trigger("reconstruction/save_map").await,
            What::Reset => self.trigger("reconstruction/reset").await,
            What::Pause => self.transition(Transition::TRANSITION_DEACTIVATE, "paused").await,
            What::Resume => self.transition(Transition::TRANSITION_ACTIVATE, "goes on").await,
            What::Parameters => Ok(self.parameters().await),
            What::Set { node, name, value } => self.set(&node, &name, &value).await,
        };
        answer(Some(command.id), result)
    }

    async fn trigger(&self, service: &str) -> Result<Value, String> {
        let response =
            self.ask(&self.triggers, service, &TriggerRequest::default(), PATIENCE).await?;
        if response.success { Ok(response.message.into()) } else { Err(response.message) }
    }

    async fn transition(&self, id: u8, done: &str) -> Result<Value, String> {
        let request = ChangeStateRequest { transition: Transition { id, ..Transition::default() } };
        let response =
            self.ask(&self.transitions, "detection/change_state", &request, PATIENCE).await?;
        if response.success {
            Ok(format!("detection {done}").into())
        } else {
            Err("detection refuses: it is in that state already, or between two".to_owned())
        }
    }

    /// The parameters of each node with their declarations; of a node that does not answer, why.
    async fn parameters(&self) -> Value {
        let nodes = self.nodes.iter().map(async |node| {
            let (values, error) = match self.values(node).await {
                Ok(values) => (values, None),
                Err(error) => (Vec::new(), Some(error)),
            };
            let values = values.into_iter().chain(std::iter::repeat(Value::Null));
            let parameters: Vec<Value> = node
                .parameters
                .iter()
                .zip(values)
                .map(|(declared, value)| {
                    json!({
                        "name": declared.name, "about": declared.description, "value": value,
                        "accepted": declared.additional_constraints, "fixed": declared.read_only,
                    })
                })
                .collect();
            json!({ "node": node.name, "parameters": parameters, "error": error })
        });
        Value::Array(join_all(nodes).await)
    }

    async fn values(&self, node: &ShownNode) -> Result<Vec<Value>, String> {
        let service = format!("{}/get_parameters", node.name);
        let mut values = Vec::new();
        for declared in node.parameters.chunks(NAMES_AT_A_TIME) {
            let names = declared.iter().map(|one| one.name.clone()).collect();
            let request = GetParametersRequest { names };
            let response = self.ask(&self.getting, &service, &request, PATIENCE_FOR_ALL).await?;
            values.extend(
                response
                    .values
                    .iter()
                    .map(|value| parameter_from_message(value).unwrap_or(Value::Null)),
            );
        }
        Ok(values)
    }

    async fn set(&self, node: &str, name: &str, value: &Value) -> Result<Value, String> {
        let declared = self
            .nodes
            .iter()
            .find(|one| one.name == node)
            .and_then(|one| one.parameters.iter().find(|one| one.name == name))
            .ok_or_else(|| format!("{node} has no parameter {name}"))?;
        let value = message_from_parameter(value, declared.r#type);
        let parameters = vec![Parameter { name: name.to_owned(), value }];
        let service = format!("{node}/set_parameters");
        let request = SetParametersRequest { parameters };
        let response = self.ask(&self.setting, &service, &request, PATIENCE).await?;
        match response.results.first() {
            Some(result) if result.successful => Ok(format!("{node}: {name} is set").into()),
            Some(result) => Err(result.reason.clone()),
            None => Err(format!("{node} does not say whether {name} was set")),
        }
    }

    async fn ask<S: RosService>(
        &self,
        clients: &Clients<S>,
        service: &str,
        request: &S::Request,
        patience: Duration,
    ) -> Result<S::Response, String> {
        let mut known = clients.lock().await;
        let client = match known.get(service) {
            Some(client) => Arc::clone(client),
            None => {
                let client =
                    self.node.service_client(service).map_err(|error| error.to_string())?;
                let client = Arc::new(client);
                known.insert(service.to_owned(), Arc::clone(&client));
                client
            }
        };
        drop(known);
        client.ask(request, patience).await.map_err(|error| error.to_string())
    }
}

fn answer(id: Option<u64>, result: Result<Value, String>) -> String {
    match result {
        Ok(value) => json!({ "id": id, "done": value }),
        Err(reason) => json!({ "id": id, "failed": reason }),
    }
    .to_string()
}
