//! A bag through the pipeline in this process, with what each cycle finds: for callers that want more than the files of a run.
//! The nodes, and so the map, are those of `stillmap run --transport local`.

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;
use std::sync::Arc;

use geometry::{CycleTracks, DetectedCycle, DynamicZone, SegmentedCycle, Stamp, Track};
use msgs::convert;
use node_shell::{Node, NodeFailure, Qos, ValueSubscription};

use super::bag_name;
use super::chosen::Chosen;
use super::findings::{InputLosses, findings, no_cycle};
use super::inputs::TopicArgs;
use super::local::Passage;
use super::parameters::ParameterArgs;
use crate::failure::Failure;
use crate::interrupt::Interrupt;
use crate::map_file::MapFile;

/// What a cycle has found.
#[derive(Clone, Debug)]
pub struct CycleFinding {
    /// The scan's stamp; that of the depth image is in `segmented`.
    pub scan_stamp: Stamp,
    /// The zones in which the scan moves, around the rig's z axis.
    pub zones: Vec<DynamicZone>,
    /// The pose, both clouds, the depth image and its mask.
    pub segmented: Arc<SegmentedCycle>,
    /// The objects that move, in the map.
    pub tracks: Vec<Track>,
}

/// A bag on its way through the pipeline.
pub struct CycleRun {
    state: State,
    bag_name: String,
    notes: Vec<String>,
    detected: ValueSubscription<DetectedCycle>,
    segmented: ValueSubscription<SegmentedCycle>,
    tracks: ValueSubscription<CycleTracks>,
    /// The node of the subscriptions.
    _listener: Node,
    zones_of: BTreeMap<u32, (Stamp, Vec<DynamicZone>)>,
    tracks_of: BTreeMap<u32, Vec<Track>>,
    found: VecDeque<CycleFinding>,
}

enum State {
    Going(Box<Passage>),
    /// What is left of it.
    Ended {
        map: MapFile,
        findings: Vec<Failure>,
    },
    /// An error has ended it.
    Failed,
}

impl CycleRun {
    /// Opens a bag and chooses its topics. Nothing is processed until [`Self::advance`].
    ///
    /// # Errors
    /// When the bag cannot be read, lacks an input, or a parameter is refused.
    pub fn begin(
        bag: &Path,
        topics: &TopicArgs,
        parameters: &ParameterArgs,
        wants_no_colour: bool,
    ) -> Result<Self, Failure> {
        if topics.wants_lidar() {
            return Err(Failure::new("a road map of a LiDAR alone has no cycles")
                .fix("`stillmap run --pose lidar` makes it"));
        }
        let chosen = Chosen::of(bag, topics, (parameters, wants_no_colour), &Interrupt::default())?;
        let Chosen { bag, added_scans, inputs, parameters, notes, .. } = chosen;
        let passage = Passage::begin(&bag, (inputs, added_scans), &parameters)?;
        let of_node = |error: NodeFailure| Failure::new(error.to_string());
        let of_shell = |error: node_shell::ShellError| Failure::new(error.to_string());
        let listener = passage.pipeline.listener().map_err(of_node)?;
        // The most that one message can complete: the scan that it comes with, and those that wait for it.
        let qos = Qos::reliable(parameters.detection().max_waiting_scans.saturating_add(1));
        Ok(Self {
            bag_name: bag_name(bag.path()),
            notes,
            detected: listener.value_subscription("reduced_cloud", &qos).map_err(of_shell)?,
            segmented: listener.value_subscription("segmented_cloud", &qos).map_err(of_shell)?,
            tracks: listener.value_subscription("tracks", &qos).map_err(of_shell)?,
            _listener: listener,
            zones_of: BTreeMap::new(),
            tracks_of: BTreeMap::new(),
            found: VecDeque::new(),
            state: State::Going(Box::new(passage)),
        })
    }

    /// Where the scans come from, where the bag has none, and the poses, where it is not a topic of PoseStamped; and which parameters are
    /// likely misspelt.
    #[must_use]
    pub fn note(&self) -> Option<String> {
        (!self.notes.is_empty()).then(|| self.notes.join("\n"))
    }

    /// Processes the next message of the bag; `false` at its end. It may complete cycles, and so may the end: see
    /// [`Self::next_found`].
    ///
    /// # Errors
    /// When the bag can be read no further, or at its end when no scan has become a cycle. After an error there are no more cycles.
    pub fn advance(&mut self) -> Result<bool, Failure> {
        // What is not put back has failed.
        match std::mem::replace(&mut self.state, State::Failed) {
            State::Going(mut passage) => {
                if passage.advance()? {
                    self.collect()?;
                    self.state = State::Going(passage);
                    return Ok(true);
                }
                passage.pipeline.end_of_input();
                self.collect()?;
                self.state = self.end(*passage)?;
            }
            ended => self.state = ended,
        }
        Ok(false)
    }

    /// The next cycle that is complete and was not taken, in the order of their numbers.
    pub fn next_found(&mut self) -> Option<CycleFinding> {
        self.found.pop_front()
    }

    /// The map so far; empty after an error.
    #[must_use]
    pub fn map(&self) -> MapFile {
        match &self.state {
            State::Going(passage) => MapFile::of(passage.pipeline.map().whole()),
            State::Ended { map, .. } => map.clone(),
            State::Failed => MapFile::default(),
        }
    }

    /// What is wrong with the run, which has a result nevertheless: `stillmap run` prints the same. Complete at the end of the bag,
    /// and before it empty.
    #[must_use]
    pub fn findings(&self) -> &[Failure] {
        match &self.state {
            State::Ended { findings, .. } => findings,
            State::Going(_) | State::Failed => &[],
        }
    }

    /// Takes what the nodes have published. Each publishes its cycles in their order, and detection first.
    fn collect(&mut self) -> Result<(), Failure> {
        let wrong = |error: convert::ConvertError| Failure::new(error.to_string());
        while let Some(received) = self.detected.try_next() {
            let cycle = received.message.value().map_err(wrong)?;
            self.zones_of.insert(cycle.index, (cycle.scan_stamp, cycle.zones.clone()));
        }
        while let Some(received) = self.tracks.try_next() {
            let cycle = Arc::unwrap_or_clone(received.message.value().map_err(wrong)?);
            self.tracks_of.insert(cycle.index, cycle.tracks);
        }
        while let Some(received) = self.segmented.try_next() {
            let segmented = received.message.value().map_err(wrong)?;
            let index = segmented.index;
            let (scan_stamp, zones) =
                self.zones_of.remove(&index).unwrap_or((segmented.static_cloud.stamp, Vec::new()));
            let tracks = self.tracks_of.remove(&index).unwrap_or_default();
            // Those of cycles that segmentation has dropped.
            self.zones_of.retain(|waiting, _| *waiting > index);
            self.found.push_back(CycleFinding { scan_stamp, zones, segmented, tracks });
        }
        Ok(())
    }

    fn end(&self, passage: Passage) -> Result<State, Failure> {
        let map = MapFile::of(passage.pipeline.map().whole());
        let inputs = passage.inputs().clone();
        let losses = InputLosses {
            bag: passage.losses().to_vec(),
            doubtful: passage.pipeline.doubtful(),
            lost: Vec::new(),
            bounds_reached: passage.pipeline.bounds_reached(),
        };
        let record = passage.pipeline.finish(&self.bag_name);
        if let Some(failure) = no_cycle(&record) {
            return Err(failure);
        }
        Ok(State::Ended { map, findings: findings(&losses, &record, &inputs) })
    }
}
