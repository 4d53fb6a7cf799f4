//! The bag that is written from a capture.

use bag_player::BagSummary;
use geometry::Stamp;
use lidar_odometry::capture::Datagram;
use lidar_odometry::packets::PositionPacket;
use lidar_odometry::revolution::{AssemblyCounts, BuiltRevolution, RevolutionAssembly};
use msgs::convert::{message_from_revolution, time_from_stamp};
use msgs::std_msgs::Header;
use msgs::velodyne_msgs::{VelodynePacket, VelodyneScan};

use super::VelodyneArgs;
use crate::existing::BagOutput;
use crate::failure::Failure;
use crate::sensor_bag::SensorBag;

/// Datagrams that were read.
#[derive(Clone, Copy)]
pub(super) struct RecordingCounts {
    /// Datagrams of the data port.
    pub(super) data: AssemblyCounts,
    /// Position packets that could not be read.
    pub(super) broken_positions: u64,
}

/// A bag being written.
pub(super) struct Recording {
    /// Created at the first packet, so that a capture without packets leaves no bag.
    bag: Option<SensorBag>,
    output: BagOutput,
    assembly: RevolutionAssembly,
    broken_positions: u64,
    partial: bool,
    /// With `--packets`: the packets of the incomplete revolution.
    scan: Option<VelodyneScan>,
    frame_id: String,
    last_stamp: Option<Stamp>,
}

impl Recording {
    pub(super) fn new(args: &VelodyneArgs, assembly: RevolutionAssembly) -> Self {
        Self {
            bag: None,
            output: args.output.clone(),
            assembly,
            broken_positions: 0,
            partial: args.partial,
            scan: args.packets.then(VelodyneScan::default),
            frame_id: args.frame.clone(),
            last_stamp: None,
        }
    }

    /// The counts so far.
    pub(super) fn counts(&self) -> RecordingCounts {
        RecordingCounts { data: self.assembly.counts(), broken_positions: self.broken_positions }
    }

    /// Takes a datagram of the data port.
    pub(super) fn data(&mut self, datagram: &Datagram) -> Result<(), Failure> {
        let refused = self.assembly.counts().refused;
        let ended = self.assembly.push(&datagram.payload, datagram.arrival);
        if self.assembly.counts().refused > refused {
            return Ok(());
        }
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
            self.broken_positions += 1;
        }
    }

    /// Writes the incomplete revolution, if requested, and closes the bag.
    pub(super) fn finish(mut self) -> Result<(RecordingCounts, BagSummary), Failure> {
        let last = self.assembly.finish();
        if self.scan.is_some() {
            self.write_scan()?;
        } else {
            self.write_cloud(last)?;
        }
        self.bag()?;
        let counts = self.counts();
        let bag = self.bag.ok_or_else(|| Failure::new("the bag was not created"))?;
        Ok((counts, bag.finish()?))
    }

    fn bag(&mut self) -> Result<&mut SensorBag, Failure> {
        match &mut self.bag {
            Some(bag) => Ok(bag),
            empty => Ok(empty.insert(self.output.create()?)),
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
        // A decoded datagram has the length of a packet.
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
