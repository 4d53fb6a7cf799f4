//! The options of the player.

use std::path::PathBuf;
use std::str::FromStr;

use crate::message::{Selection, bare};
use crate::shell::compress::{ColorCompression, DepthFormat};
use crate::shell::pace::PaceBy;

/// The lowest rate of `/clock` that rosbag2 and simulators use.
const DEFAULT_CLOCK_HZ: f64 = 100.0;
/// The timeout for subscribers: a node on a slow machine takes some seconds to start.
const DEFAULT_WAIT_TIMEOUT_S: f64 = 30.0;
/// A message that is later than this is counted as late: more than a period of a 50 Hz sensor.
const DEFAULT_LATE_MS: f64 = 20.0;

/// The arguments of `stillmap play` and `bag-player`.
#[derive(clap::Args, Clone, PartialEq, Debug)]
pub struct PlayOptions {
    /// The bag: MCAP, sqlite3 or ROS 1, recognised by its content, or a rosbag2 folder
    pub bag: PathBuf,
    /// Seconds of the bag per second of the clock
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true, default_value_t = 1.0)]
    pub rate: f64,
    /// Start again at the end, until stopped
    #[arg(long = "loop")]
    pub looping: bool,
    /// Leave out the first seconds of the bag, but for the last messages of latched topics
    #[arg(long = "start", value_name = "SECONDS", allow_negative_numbers = true)]
    pub start_s: Option<f64>,
    /// Play this many seconds of the bag
    #[arg(long = "duration", value_name = "SECONDS", allow_negative_numbers = true)]
    pub duration_s: Option<f64>,
    /// Play these topics only (comma-separated, or given several times)
    #[arg(long, value_name = "TOPIC", value_delimiter = ',')]
    pub topics: Vec<String>,
    /// Publish the bag's time on /clock
    #[arg(long)]
    pub clock: bool,
    /// The rate of /clock
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, default_value_t = DEFAULT_CLOCK_HZ, requires = "clock")]
    pub clock_hz: f64,
    /// Publish a topic under another name (several times for several topics)
    #[arg(long, value_name = "FROM:=TO")]
    pub remap: Vec<Remap>,
    /// Publish the depth images of this topic of the bag compressed without loss, below the topic's name
    /// as .../compressedDepth (several times for several topics)
    #[arg(long, value_name = "TOPIC", value_delimiter = ',')]
    pub compress_depth: Vec<String>,
    /// How depth images are compressed
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t = DepthFormat::default(), requires = "compress_depth")]
    pub depth_format: DepthFormat,
    /// Publish the colour or grey images of this topic of the bag as JPEG of a quality of 1 .. 100
    /// (without it 95), or without loss as png, below the topic's name as .../compressed (several times for several topics)
    #[arg(long, value_name = "TOPIC[=QUALITY]", value_delimiter = ',', alias = "compress-colour")]
    pub compress_color: Vec<ColorCompression>,
    /// Wait for a subscriber of this topic, given by its published name (several times
    /// for several topics)
    #[arg(long, value_name = "TOPIC", value_delimiter = ',')]
    pub wait_for: Vec<String>,
    /// Stop waiting for subscribers, and for the reports of --pace, after this time
    #[arg(long = "wait-timeout", value_name = "SECONDS", allow_negative_numbers = true, default_value_t = DEFAULT_WAIT_TIMEOUT_S)]
    pub wait_timeout_s: f64,
    /// Hold playback back while a node is behind with a topic of the bag, by the node's reports (as
    /// /camera/depth/image_raw=/pose/report), so that a slow node loses nothing (several times for several)
    #[arg(long = "pace", value_name = "TOPIC=REPORTS")]
    pub paces: Vec<PaceBy>,
    /// Count a message as late when it is published more than this long after it was due
    #[arg(long, value_name = "MILLISECONDS", allow_negative_numbers = true, default_value_t = DEFAULT_LATE_MS)]
    pub late_ms: f64,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
}

impl PlayOptions {
    /// The whole bag at its own rate, with the defaults of all options.
    #[must_use]
    pub fn new(bag: PathBuf) -> Self {
        Self {
            bag,
            rate: 1.0,
            looping: false,
            start_s: None,
            duration_s: None,
            topics: Vec::new(),
            clock: false,
            clock_hz: DEFAULT_CLOCK_HZ,
            remap: Vec::new(),
            compress_depth: Vec::new(),
            depth_format: DepthFormat::default(),
            compress_color: Vec::new(),
            wait_for: Vec::new(),
            wait_timeout_s: DEFAULT_WAIT_TIMEOUT_S,
            paces: Vec::new(),
            late_ms: DEFAULT_LATE_MS,
            json: false,
        }
    }

    pub(super) fn selection(&self) -> Selection {
        Selection {
            topics: (!self.topics.is_empty()).then(|| self.topics.clone()),
            start_s: self.start_s,
            duration_s: self.duration_s,
            all_encodings: false,
        }
    }

    /// The published name of a topic of the bag.
    pub(super) fn published_name<'a>(&'a self, topic: &'a str) -> &'a str {
        self.remap
            .iter()
            .find(|remap| bare(&remap.from) == bare(topic))
            .map_or(topic, |remap| &remap.to)
    }
}

/// A topic of the bag and the name to publish it by.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Remap {
    /// The name in the bag.
    pub from: String,
    /// The name on the network.
    pub to: String,
}

/// A remapping is not of the form `FROM:=TO`.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("accepted is FROM:=TO, as /camera/depth/image_raw:=/depth/image")]
pub struct RemapError;

impl FromStr for Remap {
    type Err = RemapError;

    fn from_str(text: &str) -> Result<Self, RemapError> {
        match text.split_once(":=") {
            Some((from, to)) if !from.is_empty() && !to.is_empty() => {
                Ok(Self { from: from.to_owned(), to: to.to_owned() })
            }
            _ => Err(RemapError),
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory, Parser};

    use super::*;

    #[derive(Parser, Debug)]
    struct Cli {
        #[command(flatten)]
        options: PlayOptions,
    }

    fn parse(line: &str) -> Result<PlayOptions, clap::Error> {
        let arguments = std::iter::once("bag-player").chain(line.split_whitespace());
        Cli::try_parse_from(arguments).map(|cli| cli.options)
    }

    #[test]
    fn the_definition_is_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn without_options_it_is_the_default() {
        assert_eq!(parse("x.mcap").unwrap(), PlayOptions::new("x.mcap".into()));
    }

    #[test]
    fn every_option_is_taken() {
        let options = parse(
            "x.mcap --rate 2 --loop --start 1.5 --duration 3 --topics /a,b --topics /c --clock --clock-hz 50 \
             --remap a:=/left/a --compress-depth /d --compress-depth e --depth-format rvl \
             --compress-color /f,g=80 --compress-colour /h=1 --wait-for /left/a --wait-timeout 5 --pace /d=/pose/report --late-ms 7 --json",
        )
        .unwrap();
        let expected = PlayOptions {
            bag: "x.mcap".into(),
            rate: 2.0,
            looping: true,
            start_s: Some(1.5),
            duration_s: Some(3.0),
            topics: vec!["/a".into(), "b".into(), "/c".into()],
            clock: true,
            clock_hz: 50.0,
            remap: vec![Remap { from: "a".into(), to: "/left/a".into() }],
            compress_depth: vec!["/d".into(), "e".into()],
            depth_format: DepthFormat::Rvl,
            compress_color: ["/f=95", "g=80", "/h=1"].map(|text| text.parse().unwrap()).into(),
            wait_for: vec!["/left/a".into()],
            wait_timeout_s: 5.0,
            paces: vec!["/d=/pose/report".parse().unwrap()],
            late_ms: 7.0,
            json: true,
        };
        assert_eq!(options, expected);
        assert_eq!(options.published_name("/a"), "/left/a");
        assert_eq!(options.published_name("/c"), "/c");
    }

    /// Regression: the rate of a clock that is not published and the form of images that are not compressed were without effect.
    #[test]
    fn options_without_effect_are_refused() {
        for line in ["x.mcap --clock-hz 50", "x.mcap --depth-format rvl"] {
            let refused = parse(line).unwrap_err().to_string();
            assert!(refused.contains("required arguments"), "{refused}");
        }
        assert!(parse("x.mcap --clock --clock-hz 50").is_ok());
    }

    #[test]
    fn malformed_remaps_are_refused_with_the_form() {
        for text in ["/a", "/a:=", ":=/b", "/a=/b"] {
            let refused = parse(&format!("x.mcap --remap {text}")).unwrap_err().to_string();
            assert!(refused.contains("accepted is FROM:=TO"), "{refused}");
        }
    }
}
