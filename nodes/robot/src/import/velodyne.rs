//! `stillmap import velodyne`: a capture of a Velodyne's packets.

mod recording;

use std::fs::File;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use lidar_odometry::capture::{CaptureCounts, CaptureReader};
use lidar_odometry::packets::{Calibration, DATA_PORT, DecoderConfig, Model, POSITION_PORT};
use lidar_odometry::revolution::{KeptEcho, PacketClock, RevolutionAssembly, RevolutionConfig};

use crate::console;
use crate::existing::BagOutput;
use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::lidar::nothing_decoded;
use crate::progress::Progress;
use recording::{Recording, RecordingCounts};

/// Arguments of `stillmap import velodyne`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap import velodyne drive.pcap -o drive.mcap
  stillmap import velodyne hdl64e.pcapng --calibration 64e_s3.yaml --clock scanner -o drive.mcap

Model and return mode are read from the packets. Exit code 3: part of the capture could not be read, or packets are
missing in it; the bag holds what there is.")]
pub struct VelodyneArgs {
    /// The capture, pcap or pcapng
    #[arg(value_name = "PCAP")]
    capture: PathBuf,
    /// Write the packets as velodyne_msgs/VelodyneScan on /velodyne_packets instead of clouds
    #[arg(long)]
    packets: bool,
    /// The model of the scanner, if its packets do not state it
    #[arg(long, value_name = "MODEL")]
    model: Option<ModelArg>,
    /// The scanner's own calibration: YAML of ROS' velodyne_pointcloud; an HDL-64E needs one
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// The return to use where packets have two
    #[arg(long, value_name = "ECHO", default_value = "strongest")]
    echo: EchoArg,
    /// Revolutions begin where the scanner passes this azimuth, clockwise from forward
    #[arg(long, value_name = "DEG", default_value_t = RevolutionConfig::default().cut_azimuth_deg)]
    cut: f64,
    /// Also write the incomplete revolutions at the beginning and at the end
    #[arg(long)]
    partial: bool,
    /// Stamps by the arrival of packets, or by the clock of a scanner that is synchronised to GPS
    #[arg(long, value_name = "CLOCK", default_value = "arrival")]
    clock: ClockArg,
    /// The frame of the clouds
    #[arg(long, value_name = "FRAME", default_value_t = RevolutionConfig::default().frame_id)]
    frame: String,
    /// The UDP port of data packets
    #[arg(long, value_name = "PORT", default_value_t = DATA_PORT)]
    data_port: u16,
    /// The UDP port of position packets
    #[arg(long, value_name = "PORT", default_value_t = POSITION_PORT)]
    position_port: u16,
    #[command(flatten)]
    pub(super) output: BagOutput,
}

/// A scanner's model.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum ModelArg {
    Hdl32e,
    Vlp16,
    PuckHiRes,
    Vlp32c,
    Hdl64e,
}

impl ModelArg {
    pub(super) fn model(self) -> Model {
        match self {
            Self::Hdl32e => Model::Hdl32e,
            Self::Vlp16 => Model::Vlp16,
            Self::PuckHiRes => Model::PuckHiRes,
            Self::Vlp32c => Model::Vlp32c,
            Self::Hdl64e => Model::Hdl64e,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum EchoArg {
    Strongest,
    Last,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum ClockArg {
    Arrival,
    Scanner,
}

pub(crate) fn import(args: &VelodyneArgs, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    let revolution = RevolutionConfig {
        frame_id: args.frame.clone(),
        cut_azimuth_deg: args.cut,
        kept_echo: match args.echo {
            EchoArg::Strongest => KeptEcho::Strongest,
            EchoArg::Last => KeptEcho::Last,
        },
        ..RevolutionConfig::default()
    };
    let assembly = RevolutionAssembly::new(decoder_config(args)?, revolution)
        .map_err(|error| Failure::new(error.to_string()))?
        .with_clock(match args.clock {
            ClockArg::Arrival => PacketClock::Arrival,
            ClockArg::Scanner => PacketClock::Scanner,
        });

    let file = File::open(&args.capture).map_err(|error| {
        Failure::new(format!("cannot open {}: {error}", args.capture.display()))
    })?;
    let frames = frames_in(&file);
    let in_capture = |error: String| Failure::new(error).within(args.capture.display());
    let mut capture = CaptureReader::new(file).map_err(|error| {
        in_capture(error.to_string()).fix("give a capture of tcpdump, Wireshark or VeloView")
    })?;
    let mut other_port = None;
    let mut broken = None;
    let mut recording = Recording::new(args, assembly);
    let progress = Progress::new("importing", frames);
    for next in capture.by_ref() {
        if interrupt.has_come() {
            break;
        }
        let datagram = match next {
            Ok(datagram) => datagram,
            Err(error) => {
                broken = Some(error);
                break;
            }
        };
        match datagram.port {
            port if port == args.data_port => recording.data(&datagram)?,
            port if port == args.position_port => recording.position(&datagram),
            port => other_port = other_port.or(Some(port)),
        }
        progress.advance();
    }
    progress.finish();
    let broken = broken.map(|error| error.to_string());
    let counts = recording.counts();
    if counts.data.losses.packets == 0 && !interrupt.has_come() {
        let ports = (args.data_port, other_port);
        let failure = nothing_decoded(counts.data.first_refusal, broken, ports);
        return Err(failure.within(args.capture.display()));
    }
    let (counts, summary) = recording.finish()?;
    console::print(format_args!(
        "{}: {} messages of {} packets",
        args.output.path().display(),
        summary.message_count,
        counts.data.losses.packets
    ))?;
    if interrupt.has_come() {
        let path = args.output.path().display();
        console::note(format_args!("interrupted: {path} has what was imported until then"));
        return Ok(Outcome::Interrupted);
    }
    let nothing_written = summary.message_count == 0;
    Ok(print_losses(args, &counts, &capture.counts(), broken, nothing_written))
}

/// The number of frames of a capture file, for the progress bar.
fn frames_in(file: &File) -> u64 {
    /// The size of a packet with its headers of the capture and of the network.
    const FRAME_BYTES: u64 = 16 + 42 + 1206;
    file.metadata().map_or(0, |metadata| metadata.len() / FRAME_BYTES)
}

fn decoder_config(args: &VelodyneArgs) -> Result<DecoderConfig, Failure> {
    let model = args.model.map(ModelArg::model);
    let calibration = match &args.calibration {
        Some(path) => Some(read_calibration(path)?),
        None => None,
    };
    Ok(DecoderConfig { model, calibration, ..DecoderConfig::default() })
}

fn read_calibration(path: &Path) -> Result<Calibration, Failure> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| Failure::new(format!("cannot read {}: {error}", path.display())))?;
    Calibration::from_yaml(&text).map_err(|error| {
        Failure::new(error.to_string())
            .within(path.display())
            .fix("ROS' gen_calibration.py makes such a file of the scanner's db.xml")
    })
}

/// Prints what was lost.
fn print_losses(
    args: &VelodyneArgs,
    counts: &RecordingCounts,
    in_capture: &CaptureCounts,
    broken: Option<String>,
    nothing_written: bool,
) -> Outcome {
    let mut losses = Vec::new();
    losses.extend(broken);
    if nothing_written {
        losses.push("no revolution is complete (--partial writes the parts too)".to_owned());
    }
    if in_capture.cut_off {
        losses.push("the capture ends within a frame".to_owned());
    }
    for (count, what) in [
        (counts.data.losses.lost, "packets are missing by the scanner's clock"),
        (counts.data.refused, "data packets could not be decoded"),
        (counts.broken_positions, "position packets could not be read"),
        (in_capture.fragments, "fragments of IP packets were left out"),
        (in_capture.cut_frames, "frames were captured in part only"),
    ] {
        if count > 0 {
            losses.push(format!("{count} {what}"));
        }
    }
    if let Some(error) = counts.data.first_refusal {
        losses.push(format!("the first of them: {error}"));
    }
    if losses.is_empty() {
        return Outcome::Complete;
    }
    console::print_failure(&Failure::new(losses.join("; ")).within(args.capture.display()));
    Outcome::WithLosses
}
