//! The bag that a capture becomes.

use std::path::PathBuf;

use bag_player::BagSummary;
use geometry::Stamp;
use lidar_odometry::capture::Datagram;
use lidar_odometry::packets::{Continuity, LossCounts, PacketDecoder, PositionPacket};
use lidar_odometry::revolution::{BuiltRevolution, RevolutionBuilder};
use msgs::convert::{message_from_revolution, time_from_stamp};
use msgs::std_msgs::Header;
use msgs::velodyne_msgs::{VelodynePacket, VelodyneScan};

use super::{ClockArg, VelodyneArgs};
use crate::failure::Failure;
use crate::sensor_bag::SensorBag;

/// What became of the datagrams.
#[derive(Default)]
pub(super) struct RecordingCounts {
    /// Of the packets that were decoded.
    pub(super) losses: LossCounts,
    /// Datagrams on the data port that were not decoded.
    pub(super) refused: u64,
    /// Why the first of them was not.
    pub(super) first_refusal: Option<String>,
    /// Position packets that could not be read.
    pub(super) broken_positions: u64,
}

/// A bag being written.
pub(super) struct Recording {
    /// From the first packet on, so that what holds none leaves no bag.
    bag: Option<SensorBag>,
    output: PathBuf,
    decoder: PacketDecoder,
    builder: RevolutionBuilder,
    continuity: Continuity,
    counts: RecordingCounts,
    by_scanner: bool,
    partial: bool,
    /// With `--packets`: those of the revolution that is not complete.
    scan: Option<VelodyneScan>,
    frame_id: String,
    last_stamp: Option<Stamp>,
}

impl Recording {
    pub(super) fn new(
        args: &VelodyneArgs,
        decoder: PacketDecoder,
        builder: RevolutionBuilder,
    ) -> Self {
        Self {
            bag: None,
            output: args.output.clone(),
            decoder,
            builder,
            continuity: Continuity::default(),
            counts: RecordingCounts::default(),
            by_scanner: args.clock == ClockArg::Scanner,
            partial: args.partial,
            scan: args.packets.then(VelodyneScan::default),
            frame_id: args.frame.clone(),
            last_stamp: None,
        }
    }

    /// Whether any data packet was decoded.
    pub(super) fn has_data(&self) -> bool {
        self.continuity.counts().packets > 0
    }

    /// Why the first datagram that was not decoded was not.
    pub(super) fn first_refusal(&self) -> Option<&str> {
        self.counts.first_refusal.as_deref()
    }

    /// Takes a datagram of the data port.
    pub(super) fn data(&mut self, datagram: &Datagram) -> Result<(), Failure> {
        let packet = match self.decoder.decode(&datagram.payload) {
            Ok(packet) => packet,
            Err(error) => {
                self.counts.refused += 1;
                self.counts.first_refusal.get_or_insert_with(|| error.to_string());
                return Ok(());
            }
        };
        self.continuity.push(&packet);
        let stamp = if self.by_scanner {
            packet.stamp_by_scanner(datagram.arrival)
        } else {
            packet.stamp_by_arrival(datagram.arrival)
        };
        let ended = self.builder.push(&packet, stamp);
        if self.scan.is_some() {
            if ended.is_some() {
                self.write_scan()?;
            }
            self.add_to_scan(datagram);
            return Ok(());
        }
        self.write_cloud(ended)
    }

    /// Takes a datagram of the position port.
    pub(super) fn position(&mut self, datagram: &Datagram) {
        if PositionPacket::parse(&datagram.payload).is_err() {
            self.counts.broken_positions += 1;
        }
    }

    /// Writes what is not complete, as far as it is wanted, and closes the bag.
    pub(super) fn finish(mut self) -> Result<(RecordingCounts, BagSummary), Failure> {
        let last = self.builder.finish();
        if self.scan.is_some() {
            self.write_scan()?;
        } else {
            self.write_cloud(last)?;
        }
        self.bag()?;
        let losses = self.continuity.counts();
        let bag = self.bag.ok_or_else(|| Failure::new("the bag was not begun"))?;
        Ok((RecordingCounts { losses, ..self.counts }, bag.finish()?))
    }

    fn bag(&mut self) -> Result<&mut SensorBag, Failure> {
        match &mut self.bag {
            Some(bag) => Ok(bag),
            empty => Ok(empty.insert(SensorBag::create(&self.output)?)),
        }
    }

    fn write_cloud(&mut self, ended: Option<BuiltRevolution>) -> Result<(), Failure> {
        let Some(built) = ended.filter(|built| built.is_whole() || self.partial) else {
            return Ok(());
        };
        self.bag()?.velodyne(built.revolution.stamp, &message_from_revolution(&built.revolution))
    }

    fn add_to_scan(&mut self, datagram: &Datagram) {
        let stamp = time_from_stamp(datagram.arrival);
        let Some(scan) = &mut self.scan else { return };
        // What was decoded has the length of a packet.
        let Ok(data) = datagram.payload.as_slice().try_into() else { return };
        if scan.packets.is_empty() {
            scan.header = Header { stamp, frame_id: self.frame_id.clone() };
            self.last_stamp = Some(datagram.arrival);
        }
        scan.packets.push(VelodynePacket { stamp, data });
    }

    fn write_scan(&mut self) -> Result<(), Failure> {
        let Some(scan) = self.scan.as_mut().map(std::mem::take) else { return Ok(()) };
        match self.last_stamp {
            Some(stamp) if !scan.packets.is_empty() => self.bag()?.velodyne_packets(stamp, &scan),
            _ => Ok(()),
        }
    }
}
