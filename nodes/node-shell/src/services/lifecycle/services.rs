//! The services of a managed node, and the topic on which it publishes its transitions.

use std::time::Duration;

use msgs::lifecycle_msgs::{
    ChangeState, ChangeStateResponse, GetAvailableStates, GetAvailableStatesResponse,
    GetAvailableTransitions, GetAvailableTransitionsResponse, GetState, GetStateResponse,
    TransitionEvent,
};
use tokio::sync::{mpsc, oneshot};
use tokio::time::Instant;

use super::{Lifecycle, Reset};
use crate::endpoints::publisher::Publisher;
use crate::endpoints::service::{Service, answer};
use crate::node::Node;
use crate::node::clock::NodeClock;
use crate::node::life::Life;
use crate::node::life::states::{LifecycleState, Step, all_states, available, graph, start_up};
use crate::process::shutdown::Shutdown;
use crate::process::throttle::Throttle;
use crate::settings::qos::Qos;
use crate::wire::error::ShellError;

/// The topic of transitions.
const EVENTS: &str = "~/transition_event";
/// Events that a subscriber may be behind, as ROS 2 has it.
const EVENTS_KEPT: usize = 10;

/// The services by which others manage a node.
pub(crate) struct LifecycleServices {
    manager: Manager,
    change_state: Service<ChangeState>,
    get_state: Service<GetState>,
    states: Service<GetAvailableStates>,
    transitions: Service<GetAvailableTransitions>,
    graph: Service<GetAvailableTransitions>,
}

/// Takes the node from one state to another.
struct Manager {
    node_name: String,
    life: Life,
    state: LifecycleState,
    clock: NodeClock,
    events: Publisher<TransitionEvent>,
    resets: mpsc::Sender<Reset>,
    shutdown: Shutdown,
}

impl LifecycleServices {
    /// The services of `node`, and what its body gets of them. With `autostart` the node is active from the start.
    pub(crate) fn open(
        node: &Node,
        life: &Life,
        autostart: bool,
    ) -> Result<(Self, Lifecycle), ShellError> {
        let (resets, receiver) = mpsc::channel(1);
        let mut services = Self {
            manager: Manager {
                node_name: node.full_name(),
                life: life.clone(),
                state: LifecycleState::Unconfigured,
                clock: node.clock(),
                events: node.own_publisher(EVENTS, &Qos::reliable(EVENTS_KEPT))?,
                resets,
                shutdown: node.shutdown_signal(),
            },
            change_state: node.service("~/change_state")?,
            get_state: node.service("~/get_state")?,
            states: node.service("~/get_available_states")?,
            transitions: node.service("~/get_available_transitions")?,
            graph: node.service("~/get_transition_graph")?,
        };
        services.manager.start(autostart);
        Ok((services, Lifecycle { life: life.clone(), resets: Some(receiver) }))
    }

    /// Answers until `stop` resolves. A node that was ended lets its process end after the farewell.
    pub(crate) async fn run(self, farewell: Duration, stop: impl Future<Output = ()>) {
        let Self { mut manager, change_state, get_state, states, transitions, graph: whole } = self;
        let failed = Throttle::for_warnings();
        let mut ends_at: Option<Instant> = None;
        let serve = async {
            loop {
                let end = async {
                    match ends_at {
                        Some(ends_at) => tokio::time::sleep_until(ends_at).await,
                        None => std::future::pending().await,
                    }
                };
                tokio::select! {
                    () = end => {
                        ends_at = None;
                        manager.shutdown.trigger();
                    }
                    request = change_state.next() => {
                        let success = match Step::wanted(manager.state, &request.message.transition) {
                            Some(step) => manager.change(step).await,
                            None => manager.refuse(&request.message.transition),
                        };
                        answer(&failed, request, &ChangeStateResponse { success });
                        if success && manager.state == LifecycleState::Finalized {
                            ends_at = Instant::now().checked_add(farewell);
                        }
                    }
                    request = get_state.next() => {
                        let current_state = manager.state.to_message();
                        answer(&failed, request, &GetStateResponse { current_state });
                    }
                    request = states.next() => {
                        let available_states = all_states();
                        answer(&failed, request, &GetAvailableStatesResponse { available_states });
                    }
                    request = transitions.next() => {
                        let available_transitions = available(manager.state);
                        let response = GetAvailableTransitionsResponse { available_transitions };
                        answer(&failed, request, &response);
                    }
                    request = whole.next() => {
                        let available_transitions = graph();
                        let response = GetAvailableTransitionsResponse { available_transitions };
                        answer(&failed, request, &response);
                    }
                }
            }
        };
        tokio::select! {
            () = stop => {}
            () = serve => {}
        }
    }
}

impl Manager {
    fn start(&mut self, autostart: bool) {
        if autostart {
            self.life.has_started();
            start_up().for_each(|step| self.announce(step));
            self.state = LifecycleState::Active;
        } else {
            self.life.enter(self.state);
            tracing::info!(
                "{} is unconfigured and waits; bring it up with: ros2 lifecycle set {0} configure, and then activate",
                self.node_name
            );
        }
    }

    /// Makes a transition; whether it was made.
    async fn change(&mut self, step: Step) -> bool {
        let before = self.state;
        self.enter(step);
        if step.to == LifecycleState::CleaningUp && !self.reset().await {
            // The node's body has ended, and so has the node.
            return false;
        }
        let Some(success) = step.success() else { return false };
        self.enter(success);
        tracing::info!(
            "{}: it was {}, and is {}",
            self.node_name,
            before.label(),
            self.state.label()
        );
        true
    }

    /// Lets the node's body drop its state; whether it has.
    async fn reset(&self) -> bool {
        let (done, is_done) = oneshot::channel();
        self.resets.send(Reset { done: Some(done) }).await.is_ok() && is_done.await.is_ok()
    }

    fn refuse(&self, wanted: &msgs::lifecycle_msgs::Transition) -> bool {
        let names: Vec<String> =
            available(self.state).into_iter().map(|one| one.transition.label).collect();
        tracing::warn!(
            "{}: the transition {:?} ({}) was requested, but the node is {}; possible: {}",
            self.node_name,
            wanted.label,
            wanted.id,
            self.state.label(),
            names.join(" and ")
        );
        false
    }

    fn enter(&mut self, step: Step) {
        self.life.enter(step.to);
        self.state = step.to;
        self.announce(step);
    }

    fn announce(&self, step: Step) {
        let now = self.clock.now();
        let seconds = u64::try_from(now.sec).unwrap_or(0);
        self.events.publish_or_warn(TransitionEvent {
            timestamp: seconds * 1_000_000_000 + u64::from(now.nanosec),
            transition: step.transition(),
            start_state: step.from.to_message(),
            goal_state: step.to.to_message(),
        });
    }
}
