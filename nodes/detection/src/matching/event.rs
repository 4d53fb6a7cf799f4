//! The events of matching.

use std::fmt;

use geometry::{PoseLookupError, PosePushError, Stamp, StampedPose};

/// An input of the matcher.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Input {
    /// The laser scans.
    Scan,
    /// The clouds or depth images.
    Cloud,
    /// The poses.
    Pose,
}

impl Input {
    /// The input's name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Scan => "scan",
            Self::Cloud => "cloud",
            Self::Pose => "pose",
        }
    }
}

/// The inputs of one cycle.
#[derive(Clone, PartialEq, Debug)]
pub struct Matched<S, C> {
    /// The scan's stamp.
    pub scan_stamp: Stamp,
    /// The scan.
    pub scan: S,
    /// The cloud's stamp.
    pub cloud_stamp: Stamp,
    /// The cloud or depth image nearest to the scan.
    pub cloud: C,
    /// The pose at the cloud's stamp; `None` of a matcher without poses.
    pub pose: Option<StampedPose>,
}

/// A scan for which no cycle could be put together.
#[derive(Clone, PartialEq, Debug)]
pub struct Dropped {
    /// The scan's stamp.
    pub stamp: Stamp,
    /// The inputs that it lacked, at least one; the scan's own input if the scan was late.
    pub missing: Vec<Input>,
    /// Why it did not wait any longer.
    pub cause: DropCause,
}

/// `missing cloud and pose: it waited 0.501 s`
impl fmt::Display for Dropped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.missing.iter().map(|input| input.name()).collect();
        write!(f, "{}: {}", self.of_inputs(&names.join(" and ")), self.cause)
    }
}

impl Dropped {
    /// What is wrong with the inputs, by these names of [`Self::missing`].
    #[must_use]
    pub fn of_inputs(&self, names: &str) -> String {
        match self.cause {
            DropCause::CameLate { .. } => format!("{names} is behind the other inputs"),
            _ => format!("missing {names}"),
        }
    }
}

/// Why a scan was dropped.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum DropCause {
    /// The cloud nearest to it is too far away in time.
    #[error("the nearest cloud is {offset_s:.3} s away")]
    NoCloudNear {
        /// From the scan to the cloud.
        offset_s: f64,
    },
    /// There is no pose at the cloud's stamp, and none can come any more.
    #[error("its cloud has no pose: {0}")]
    NoPose(PoseLookupError),
    /// The other inputs are ahead by more than a scan may wait.
    #[error("it waited {waited_s:.3} s")]
    WaitedTooLong {
        /// From the scan to the newest stamp.
        waited_s: f64,
    },
    /// When it came, the stamps of the other inputs were ahead by more than a scan may wait. How long it was on its way is another
    /// question: a clock that is behind looks the same.
    #[error(
        "its stamp is {late_s:.3} s before the newest one of all inputs, more than max_wait_s: it came late, or the clock of its \
         driver is behind theirs"
    )]
    CameLate {
        /// From the scan to the newest stamp.
        late_s: f64,
    },
    /// Too many scans wait.
    #[error("{waiting} scans were waiting")]
    TooManyWaiting {
        /// How many.
        waiting: usize,
    },
    /// Nothing more will come.
    #[error("the input ended")]
    EndOfInput,
    /// The clock went back.
    #[error("the clock jumped back")]
    ClockJumpedBack,
}

/// An event caused by a message.
#[derive(Clone, PartialEq, Debug)]
pub enum MatchEvent<S, C> {
    /// A cycle is complete.
    Matched(Matched<S, C>),
    /// A scan was dropped.
    Dropped(Dropped),
    /// A message was ignored, because it is not newer than the one before on its input.
    Ignored {
        /// The input.
        input: Input,
        /// The message's stamp.
        stamp: Stamp,
        /// The latest stamp of the input before.
        latest: Stamp,
    },
    /// A pose was left out.
    PoseRefused(PosePushError),
    /// The frame of the poses has changed; poses in the old one are forgotten, and a map in it cannot be continued.
    PoseFrameChanged {
        /// The frame before.
        from: String,
        /// The new frame.
        to: String,
    },
    /// The clock jumped back: matching was reset, and everything that depends on time should be, too.
    ClockJumpedBack {
        /// The input that showed it.
        input: Input,
        /// The latest stamp of the input before.
        from: Stamp,
        /// The stamp after.
        to: Stamp,
    },
}
