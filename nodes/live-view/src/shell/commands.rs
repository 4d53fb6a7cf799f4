//! What a browser may ask of the nodes: their services, as any ROS 2 client calls them.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use futures::future::join_all;
use msgs::RosService;
use msgs::lifecycle_msgs::{ChangeState, ChangeStateRequest, Transition};
use msgs::rcl_interfaces::{
    GetParameters, GetParametersRequest, Parameter, ParameterType, SetParameters,
    SetParametersRequest,
};
use msgs::std_srvs::{Trigger, TriggerRequest};
use node_shell::{
    DiscoveredEndpoint, Node, Role, ServiceClient, message_from_parameter, parameter_from_message,
};
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::sync::Mutex;

use super::ShownNode;

/// How long a node may take to be found, and again to answer: a large map takes seconds to be saved.
const PATIENCE: Duration = Duration::from_secs(20);
/// The same where all nodes are asked for their parameters: one of them may have ended.
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

    /// The nodes that are shown.
    pub(super) fn nodes(&self) -> &[ShownNode] {
        &self.nodes
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
        let survey = self.node.survey();
        let shown =
            self.nodes.iter().filter(|node| !node.may_be_absent || self.is_in(&survey, node));
        let nodes = shown.map(async |node| {
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

    /// Whether a node is in the graph: each one of the suite publishes its reports.
    fn is_in(&self, survey: &[DiscoveredEndpoint], node: &ShownNode) -> bool {
        let Ok(reports) = self.node.resolve(&format!("{}/report", node.name)) else { return false };
        survey.iter().any(|one| one.role == Role::Publisher && one.topic == reports)
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
        if let Err(wanted) = check_type(value, declared.r#type) {
            return Err(format!("{node}: {name} must be {wanted}, not {value}"));
        }
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

/// Whether a value is of a parameter's type; else what is. As a message a value of another one would be 0, or empty.
fn check_type(value: &Value, kind: u8) -> Result<(), &'static str> {
    let is_whole = |value: &Value| value.is_i64() || value.is_u64();
    let all =
        |is_one: fn(&Value) -> bool| value.as_array().is_some_and(|all| all.iter().all(is_one));
    let (is_of_it, wanted) = match kind {
        ParameterType::PARAMETER_BOOL => (value.is_boolean(), "true or false"),
        ParameterType::PARAMETER_INTEGER => (is_whole(value), "a whole number"),
        ParameterType::PARAMETER_DOUBLE => (value.is_number(), "a number"),
        ParameterType::PARAMETER_STRING => (value.is_string(), "a text"),
        ParameterType::PARAMETER_BOOL_ARRAY => (all(Value::is_boolean), "a list of true or false"),
        ParameterType::PARAMETER_INTEGER_ARRAY => (all(is_whole), "a list of whole numbers"),
        ParameterType::PARAMETER_DOUBLE_ARRAY => (all(Value::is_number), "a list of numbers"),
        ParameterType::PARAMETER_STRING_ARRAY => (all(Value::is_string), "a list of texts"),
        _ => (false, "of a type that can be set here"),
    };
    if is_of_it { Ok(()) } else { Err(wanted) }
}

fn answer(id: Option<u64>, result: Result<Value, String>) -> String {
    match result {
        Ok(value) => json!({ "id": id, "done": value }),
        Err(reason) => json!({ "id": id, "failed": reason }),
    }
    .to_string()
}

#[cfg(test)]
mod tests {
    use node_shell::{Host, RosArguments};

    use super::*;

    /// Regression: a value of another type was sent as 0, which switches off what may be 0.
    #[test]
    fn a_value_of_another_type_is_refused_before_the_node_is_asked() {
        let host = Host::in_process();
        let arguments = RosArguments::parse([] as [String; 0]).unwrap();
        let node = Arc::new(host.node("live_view", &arguments).unwrap());
        let declared = |name: &str, kind| msgs::rcl_interfaces::ParameterDescriptor {
            name: name.to_owned(),
            r#type: kind,
            ..Default::default()
        };
        let parameters = vec![
            declared("period_s", ParameterType::PARAMETER_DOUBLE),
            declared("count", ParameterType::PARAMETER_INTEGER),
            declared("names", ParameterType::PARAMETER_STRING_ARRAY),
        ];
        let shown = ShownNode { name: "detection".to_owned(), parameters, may_be_absent: false };
        let commands = Commands::new(node, vec![shown]);
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        for (name, value, wanted) in [
            ("period_s", json!("a"), "detection: period_s must be a number, not \"a\""),
            ("period_s", json!(true), "must be a number, not true"),
            ("period_s", json!([1]), "must be a number, not [1]"),
            ("period_s", Value::Null, "must be a number, not null"),
            ("count", json!(1.5), "must be a whole number, not 1.5"),
            ("names", json!(["a", 1]), "must be a list of texts"),
        ] {
            let command =
                json!({"id": 7, "do": "set", "node": "detection", "name": name, "value": value});
            let answer = runtime.block_on(commands.carry_out(&command.to_string()));
            let answer: Value = serde_json::from_str(&answer).unwrap();
            let failed = answer["failed"].as_str().unwrap();
            assert!(failed.contains(wanted), "{value}: {failed}");
        }
        assert_eq!(check_type(&json!(3), ParameterType::PARAMETER_DOUBLE), Ok(()));
        assert_eq!(check_type(&json!([]), ParameterType::PARAMETER_STRING_ARRAY), Ok(()));
    }

    /// Regression: beside a suite without them the page said of `pose` and `lidar_odometry` that they do not answer.
    #[test]
    fn a_node_that_the_suite_runs_without_is_not_asked_for_its_parameters() {
        let host = Host::in_process();
        let arguments = RosArguments::parse([] as [String; 0]).unwrap();
        let node = Arc::new(host.node("live_view", &arguments).unwrap());
        let shown = |name: &str, may_be_absent| ShownNode {
            name: name.to_owned(),
            parameters: vec![msgs::rcl_interfaces::ParameterDescriptor::default()],
            may_be_absent,
        };
        let commands = Commands::new(node, vec![shown("detection", false), shown("pose", true)]);
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let answer = runtime.block_on(commands.carry_out(r#"{"id": 7, "do": "parameters"}"#));
        let asked: Value = serde_json::from_str(&answer).unwrap();
        let asked: Vec<&Value> =
            asked["done"].as_array().unwrap().iter().map(|node| &node["node"]).collect();
        assert_eq!(asked, ["detection"]);
    }
}
