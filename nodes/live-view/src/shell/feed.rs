//! From the topics to what is shown, as long as somebody looks.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use geometry::{CycleTracks, DetectedCycle, Method, Scan, SegmentedCycle, Track};
use msgs::convert::{self, ConvertError};
use msgs::diagnostic_msgs::DiagnosticArray;
use msgs::sensor_msgs::{LaserScan, PointCloud2};
use msgs::visualization_msgs::MarkerArray;
use node_shell::{
    Arrived, Node, NodeFailure, Qos, ShellError, Subscription, Throttle, ValueSubscription,
};
use tokio::sync::watch;
use tokio::time::{Instant, MissedTickBehavior};

use super::GraphOf;
use super::shared::Shared;
use super::status::Status;
use crate::Moment;

/// Cycles that may wait: the latest is shown.
const CYCLES: Qos = Qos::sensor(2);
const SCANS: Qos = Qos::sensor(5);
/// Updates of the map that may wait: what is lost comes with the next whole map.
const UPDATES: Qos = Qos::reliable(20);
const DIAGNOSTICS: Qos = Qos::sensor(32);
/// Messages with triangles that may wait: one second of them.
const MESHES: Qos = Qos::reliable(10);
/// The topics are followed for so long after the last browser has gone: a page that is loaded again is there within it.
const LINGER: Duration = Duration::from_secs(2);
/// Scans and cycles that wait for their counterpart.
const KEPT: usize = 8;
/// The page is shown the latest cycle once in this time: as often as the eye follows figures, and as the scanners turn.
const MOMENT_PERIOD: Duration = Duration::from_millis(100);
/// The state of the nodes, once in so many of these periods: a second.
const STATUS_PERIODS: u32 = 10;

/// Follows the topics while browsers look.
pub(super) async fn feed(
    node: &Node,
    graph: GraphOf,
    shared: &Arc<Shared>,
) -> Result<(), NodeFailure> {
    let mut browsers = shared.browsers();
    loop {
        // The sender lives as long as `shared`.
        let _ = browsers.wait_for(|count| *count > 0).await;
        let mut feed = Feed::of(node, graph, shared)?;
        tokio::select! {
            () = feed.follow(shared) => {}
            failed = follow_mesh(node, shared) => return Err(failed.into()),
            () = nobody_looks(&mut browsers) => {}
        }
        drop(feed);
        shared.change(|state| {
            state.map_mut().clear();
            state.mesh_mut().clear();
            state.forget_moment();
        });
    }
}

/// Follows the triangles while a browser asks for them, until that fails.
async fn follow_mesh(node: &Node, shared: &Arc<Shared>) -> ShellError {
    let mut wanted = shared.mesh_wanted();
    let mut bad_input = Throttle::for_warnings();
    loop {
        // The sender lives as long as `shared`.
        let _ = wanted.wait_for(|count| *count > 0).await;
        let markers: Subscription<MarkerArray> = match node.subscription("mesh", &MESHES) {
            Ok(markers) => markers,
            Err(error) => return error,
        };
        node.counters().note_optional(markers.topic());
        loop {
            let received = tokio::select! {
                received = markers.next() => received,
                _ = wanted.wait_for(|count| *count == 0) => break,
            };
            match convert::mesh_from_markers(&received.message) {
                Ok(update) => shared.change(|state| state.mesh_mut().take(&update)),
                Err(error) => warn_of(&error, &mut bad_input),
            }
        }
        drop(markers);
        shared.change(|state| state.mesh_mut().clear());
    }
}

fn warn_of(error: &ConvertError, bad_input: &mut Throttle) {
    if let Some(held_back) = bad_input.pass() {
        tracing::warn!(
            "a message cannot be shown: {error} ({held_back} more since the last warning)"
        );
    }
}

/// Waits until nobody has looked for a while.
async fn nobody_looks(browsers: &mut watch::Receiver<usize>) {
    loop {
        let _ = browsers.wait_for(|count| *count == 0).await;
        let again = browsers.wait_for(|count| *count > 0);
        if tokio::time::timeout(LINGER, again).await.is_err() {
            return;
        }
    }
}

/// The subscriptions, and what has come by them.
struct Feed {
    detected: ValueSubscription<DetectedCycle>,
    segmented: ValueSubscription<SegmentedCycle>,
    tracks: ValueSubscription<CycleTracks>,
    scans: Subscription<LaserScan>,
    maps: Subscription<PointCloud2>,
    updates: Subscription<PointCloud2>,
    removals: Subscription<PointCloud2>,
    diagnostics: Subscription<DiagnosticArray>,
    latest: Latest,
    bad_input: Throttle,
}

/// What a moment is made of.
#[derive(Default)]
struct Latest {
    detected: VecDeque<Arc<DetectedCycle>>,
    segmented: Option<Arc<SegmentedCycle>>,
    scans: VecDeque<Scan>,
    tracks: Vec<Track>,
    is_shown: bool,
    status: Status,
}

enum Input {
    Detected(Arc<Arrived<DetectedCycle>>),
    Segmented(Arc<Arrived<SegmentedCycle>>),
    Tracks(Arc<Arrived<CycleTracks>>),
    Scan(Arc<LaserScan>),
    Map(Arc<PointCloud2>),
    Updates(Arc<PointCloud2>),
    Removals(Arc<PointCloud2>),
    Diagnostics(Arc<DiagnosticArray>),
}

impl Feed {
    fn of(node: &Node, graph: GraphOf, shared: &Shared) -> Result<Self, ShellError> {
        // A latched map is sent over the network as well. Within the process it comes without that, and its publisher is not to wait
        // until a reader that needs no copy has acknowledged the last one.
        let map = Qos::new(graph == GraphOf::OtherProcesses, true, 1);
        let shown = shared.commands.nodes().iter().map(|one| one.name.as_str());
        let status = Status::of(&node.full_name(), shown);
        let feed = Self {
            detected: node.value_subscription("reduced_cloud", &CYCLES)?,
            segmented: node.value_subscription("segmented_cloud", &CYCLES)?,
            tracks: node.value_subscription("tracks", &CYCLES)?,
            scans: node.subscription("scan", &SCANS)?,
            maps: node.subscription("static_map", &map)?,
            updates: node.subscription("static_map_updates", &UPDATES)?,
            removals: node.subscription("static_map_removals", &UPDATES)?,
            diagnostics: node.subscription("/diagnostics", &DIAGNOSTICS)?,
            latest: Latest { status, ..Latest::default() },
            bad_input: Throttle::for_warnings(),
        };
        // A view without input is no fault of the view.
        for topic in [
            feed.detected.topic(),
            feed.segmented.topic(),
            feed.tracks.topic(),
            feed.scans.topic(),
            feed.maps.topic(),
            feed.updates.topic(),
            feed.removals.topic(),
            feed.diagnostics.topic(),
        ] {
            node.counters().note_optional(topic);
        }
        Ok(feed)
    }

    /// Takes all that comes, and shows it.
    async fn follow(&mut self, shared: &Arc<Shared>) {
        let mut tick = tokio::time::interval(MOMENT_PERIOD);
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut ticks = 0_u32;
        loop {
            let input = tokio::select! {
                _ = tick.tick() => {
                    self.latest.show(shared);
                    if ticks.is_multiple_of(STATUS_PERIODS) {
                        self.latest.show_status(shared);
                    }
                    ticks = ticks.wrapping_add(1);
                    continue;
                }
                input = self.next() => input,
            };
            if let Err(error) = self.latest.take(input, shared) {
                warn_of(&error, &mut self.bad_input);
            }
        }
    }

    /// The next message. May be dropped while it waits.
    async fn next(&self) -> Input {
        tokio::select! {
            received = self.diagnostics.next() => Input::Diagnostics(received.message),
            received = self.scans.next() => Input::Scan(received.message),
            received = self.detected.next() => Input::Detected(received.message),
            received = self.segmented.next() => Input::Segmented(received.message),
            received = self.tracks.next() => Input::Tracks(received.message),
            received = self.maps.next() => Input::Map(received.message),
            received = self.updates.next() => Input::Updates(received.message),
            received = self.removals.next() => Input::Removals(received.message),
        }
    }
}

impl Latest {
    fn take(&mut self, input: Input, shared: &Arc<Shared>) -> Result<(), ConvertError> {
        match input {
            Input::Diagnostics(message) => self.status.take(&message, Instant::now()),
            Input::Scan(message) => keep(&mut self.scans, convert::scan_from_message(&message)?),
            Input::Detected(arrived) => keep(&mut self.detected, arrived.value()?),
            Input::Segmented(arrived) => {
                let cycle = arrived.value()?;
                self.follow_edge(&cycle, shared);
                self.segmented = Some(cycle);
                self.is_shown = false;
            }
            Input::Tracks(arrived) => {
                self.tracks.clone_from(&arrived.value()?.tracks);
                self.is_shown = false;
            }
            Input::Map(message) => {
                let whole = convert::coloured_cloud_from_message(&message)?;
                shared.change(|state| state.map_mut().replace(&whole));
            }
            Input::Updates(message) => {
                let updated = convert::coloured_cloud_from_message(&message)?;
                shared.change(|state| state.map_mut().update(&updated));
            }
            Input::Removals(message) => {
                let removed = convert::cloud_from_message(&message)?;
                shared.change(|state| state.map_mut().remove(removed.stamp, &removed.points_m));
            }
        }
        Ok(())
    }

    /// The voxels of the map are those of the cycles.
    fn follow_edge(&self, cycle: &SegmentedCycle, shared: &Arc<Shared>) {
        let setup = &cycle.setup;
        let edge_m = match setup.method {
            Method::RecHv => setup.voxel_edge_m,
            Method::FreeSpace => setup.map_edge_m,
        };
        if shared.state().map().voxel_edge_m() != edge_m {
            // The edge of a cycle was checked; with another one the map begins anew, and is whole with the next whole map.
            let _ = shared.change(|state| state.map_mut().set_voxel_edge(edge_m));
        }
    }

    /// Shows the latest cycle, if it was not.
    fn show(&mut self, shared: &Arc<Shared>) {
        let Some(segmented) = self.segmented.as_deref().filter(|_| !self.is_shown) else { return };
        self.is_shown = true;
        let detected = self.detected.iter().find(|cycle| cycle.index == segmented.index);
        let scan = detected
            .and_then(|cycle| self.scans.iter().find(|scan| scan.stamp == cycle.scan_stamp))
            .or(self.scans.back());
        shared.change(|state| {
            let map_points = state.map().len();
            let detected = detected.map(|cycle| &**cycle);
            let tracks = &self.tracks;
            state.set_moment(&Moment { segmented, detected, scan, tracks, map_points });
        });
    }

    fn show_status(&self, shared: &Arc<Shared>) {
        let browsers = *shared.browsers().borrow();
        shared.change(|state| {
            let json = self.status.json(state.map(), browsers);
            state.set_status(&json);
        });
    }
}

/// Keeps the newest.
fn keep<T>(kept: &mut VecDeque<T>, newest: T) {
    if kept.len() == KEPT {
        kept.pop_front();
    }
    kept.push_back(newest);
}
