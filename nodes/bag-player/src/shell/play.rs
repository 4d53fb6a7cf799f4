//! Playback of a bag: from the options to the summary.

use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use geometry::Stamp;
use node_shell::{Node, ShellError};
use tokio::time::sleep;

use crate::bag::Bag;
use crate::error::BagError;
use crate::info::BagInfo;
use crate::message::{Selection, bare};
use crate::schedule::{RateError, Schedule};
use crate::shell::clock::{BagClock, CLOCK_TOPIC};
use crate::shell::compress::Compression;
use crate::shell::offers::Offers;
use crate::shell::options::PlayOptions;
use crate::shell::pace::Pace;
use crate::shell::player::{Played, Player};
use crate::shell::summary::{Ending, PlaySummary};

/// How long the publishers are kept after the last message: a reliable one may have to resend.
const LINGER: Duration = Duration::from_millis(500);

/// Why a bag could not be played.
#[derive(Debug, thiserror::Error)]
pub enum PlayError {
    /// The bag cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// The node cannot be created on the network.
    #[error(transparent)]
    Shell(#[from] ShellError),
    /// The rate is invalid.
    #[error(transparent)]
    Rate(#[from] RateError),
    /// Another number is out of its range.
    #[error("--{option} must be {accepted}, not {value}")]
    Number {
        /// The option.
        option: &'static str,
        /// The accepted values.
        accepted: &'static str,
        /// The given value.
        value: f64,
    },
    /// There is no message to play.
    #[error("{path} has no message to play {selected}. `stillmap info {path}` shows what is in it", path = path.display())]
    NothingToPlay {
        /// The bag.
        path: PathBuf,
        /// The selection.
        selected: String,
    },
    /// A topic to wait for is not played.
    #[error("--wait-for {topic}: no such topic is played; there are {available}")]
    WaitForUnplayed {
        /// The topic.
        topic: String,
        /// The topics played.
        available: String,
    },
    /// A remapped topic is not played.
    #[error("--remap {from}: no such topic is played; there are {available}")]
    RemapUnplayed {
        /// The topic.
        from: String,
        /// The topics played.
        available: String,
    },
    /// A topic to compress does not exist.
    #[error("--{option} {topic}: no such topic is played; the bag's images are {images}")]
    CompressUnplayed {
        /// The option.
        option: &'static str,
        /// The topic.
        topic: String,
        /// The topics that carry images.
        images: String,
    },
    /// A topic to compress is not one of images.
    #[error("--{option} {topic}: it carries {type_name}, not sensor_msgs/msg/Image")]
    CompressNoImages {
        /// The option.
        option: &'static str,
        /// The topic.
        topic: String,
        /// Its type.
        type_name: String,
    },
    /// A topic to compress carries images of another kind.
    #[error("{0}")]
    CompressOtherImages(String),
    /// A topic is named for two codecs.
    #[error("{topic} is to be compressed twice, by different codecs; name it once")]
    CompressTwice {
        /// The topic.
        topic: String,
    },
    /// There was no subscriber in time.
    #[error(
        "nobody subscribed to {topics} within {seconds} s; start the subscriber, or give it longer with --wait-timeout"
    )]
    NoSubscriber {
        /// The topics without a subscriber.
        topics: String,
        /// The timeout in seconds.
        seconds: f64,
    },
    /// A topic to hold back is not played.
    #[error("--pace {topic}: no such topic is played; there are {available}")]
    PaceUnplayed {
        /// The topic.
        topic: String,
        /// The topics played.
        available: String,
    },
    /// The reports of --pace are not published.
    #[error(
        "nobody published {topics} within {seconds} s; start the node, or give it longer with --wait-timeout"
    )]
    NoReports {
        /// The topics of reports.
        topics: String,
        /// The timeout in seconds.
        seconds: f64,
    },
    /// The thread that reads the bag could not be started, or failed.
    #[error("the bag cannot be read on a thread of its own: {0}")]
    Thread(io::Error),
}

/// Plays a bag on the network of `node`, until its end or until `node` is shut down.
///
/// # Errors
/// When the bag cannot be read or has nothing to play, an option is invalid, or there is no subscriber of a topic of
/// --wait-for in time. Lost parts of the bag, late messages and messages that could not be sent are not errors but part
/// of the summary.
pub async fn play(options: PlayOptions, node: &Node) -> Result<PlaySummary, PlayError> {
    let schedule = Schedule::new(options.rate, options.looping)?;
    let clock_period = clock_period(&options)?;
    let late_above = seconds("late-ms", options.late_ms * 1e-3)?;
    let patience = seconds("wait-timeout", options.wait_timeout_s)?;
    let (bag, info) = open(options.bag.clone()).await?;
    for remark in &info.remarks {
        tracing::warn!("{remark}");
    }
    for loss in &info.losses {
        tracing::warn!("lost: {loss}");
    }
    // First, so that a topic that is not in the bag is reported before anything is published.
    let messages = bag.messages(&options.selection())?;
    let compression = Compression::checked(&options, &info)?;
    let wanted = |topic: &str| {
        (options.topics.is_empty() || options.topics.iter().any(|one| bare(one) == bare(topic)))
            && !(options.clock && options.published_name(topic) == CLOCK_TOPIC)
    };
    let played = info.topics.iter().filter(|topic| topic.is_playable() && wanted(&topic.topic));
    check_names(&options, played.clone().map(|topic| topic.topic.as_str()))?;
    let offers = Offers::create(node, &options, &compression, played)?;
    let clock = clock_period.map(|period| BagClock::start(node, period)).transpose()?;

    let shutdown = node.shutdown_signal();
    let pace = Pace::new(node, &options.paces)?;
    let mut player =
        Player::new(schedule, offers, (clock, pace), span(&info, &options), late_above, shutdown);
    if !options.wait_for.is_empty() {
        player.wait_for_subscribers(node, &options.wait_for, patience).await?;
    }
    player.wait_for_reports(patience).await?;
    let started = Instant::now();
    let Played { ending, passes, earlier, reader } =
        player.run(&bag, &options, &compression, messages).await?;
    let duration_s = started.elapsed().as_secs_f64();
    if ending == Ending::Finished {
        sleep(LINGER).await;
    }
    let summary = PlaySummary {
        bag: options.bag.clone(),
        ending,
        passes,
        duration_s,
        late_above_s: late_above.as_secs_f64(),
        topics: player.into_summaries(),
        losses: reader.losses,
        skipped: reader.skipped,
        out_of_order: reader.out_of_order,
    };
    if summary.published() + summary.failed() == earlier && ending == Ending::Finished {
        let everything = options.selection() == Selection::default();
        let selected = if everything {
            let others: Vec<&str> = info.other_encodings().into_iter().collect();
            let others = if others.is_empty() {
                String::new()
            } else {
                format!(": its messages are encoded as {}", others.join(", "))
            };
            format!("in cdr, the encoding of ROS 2{others}")
        } else {
            "in the selection of --topics, --start and --duration".to_owned()
        };
        return Err(PlayError::NothingToPlay { path: options.bag, selected });
    }
    Ok(summary)
}

/// Checks that the topics of --remap and --pace are played: a misspelt one would otherwise be ignored.
fn check_names<'a>(
    options: &PlayOptions,
    played: impl Iterator<Item = &'a str> + Clone,
) -> Result<(), PlayError> {
    let is_played = |name: &str| played.clone().any(|topic| bare(topic) == bare(name));
    let available = || played.clone().collect::<Vec<_>>().join(", ");
    let is_known = |from: &str| from == CLOCK_TOPIC || is_played(from);
    if let Some(remap) = options.remap.iter().find(|remap| !is_known(&remap.from)) {
        let from = remap.from.clone();
        return Err(PlayError::RemapUnplayed { from, available: available() });
    }
    if let Some(pace) = options.paces.iter().find(|pace| !is_played(&pace.topic)) {
        let topic = pace.topic.clone();
        return Err(PlayError::PaceUnplayed { topic, available: available() });
    }
    Ok(())
}

/// Opens the bag on a separate thread: without an index all of it is read.
async fn open(path: PathBuf) -> Result<(Bag, BagInfo), PlayError> {
    let opened = tokio::task::spawn_blocking(move || {
        let bag = Bag::open(Path::new(&path))?;
        let info = bag.info()?;
        Ok::<_, BagError>((bag, info))
    });
    match opened.await {
        Ok(result) => Ok(result?),
        Err(error) => Err(PlayError::Thread(io::Error::other(error))),
    }
}

fn seconds(option: &'static str, value: f64) -> Result<Duration, PlayError> {
    Duration::try_from_secs_f64(value).map_err(|_| PlayError::Number {
        option,
        accepted: "0 or more",
        value,
    })
}

fn clock_period(options: &PlayOptions) -> Result<Option<Duration>, PlayError> {
    /// No subscriber needs a higher rate.
    const MOST_HZ: f64 = 10_000.0;
    if !options.clock {
        return Ok(None);
    }
    let hz = options.clock_hz;
    if hz > 0.0 && hz <= MOST_HZ {
        // The lowest rate has the longest duration as its period.
        Ok(Some(Duration::try_from_secs_f64(1.0 / hz).unwrap_or(Duration::MAX)))
    } else {
        let accepted = "more than 0 and at most 10000";
        Err(PlayError::Number { option: "clock-hz", accepted, value: hz })
    }
}

/// The played part of the bag.
fn span(info: &BagInfo, options: &PlayOptions) -> (Stamp, Stamp) {
    let start = info.start.unwrap_or_default().plus_seconds(options.start_s.unwrap_or(0.0));
    let end = info.end.unwrap_or_default();
    match options.duration_s {
        Some(duration_s) => (start, end.min(start.plus_seconds(duration_s))),
        None => (start, end),
    }
}
