//! Captures of a network: the datagrams in a pcap or pcapng file. Behind the feature `io`.
#![cfg_attr(not(test), deny(clippy::indexing_slicing))]

mod frame;

use std::io::Read;

use geometry::Stamp;
use pcap_parser::traits::PcapReaderIterator;
use pcap_parser::{Block, PcapBlockOwned, PcapError, create_reader};
use serde::Serialize;

use frame::{FrameContents, LinkLayer};

/// A UDP datagram.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Datagram {
    /// When it arrived.
    pub arrival: Stamp,
    /// The port that it was sent to.
    pub port: u16,
    /// Its payload.
    pub payload: Vec<u8>,
}

/// The counts of a capture beside whole datagrams.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct CaptureCounts {
    /// Frames, of whatever kind.
    pub frames: u64,
    /// Datagrams that were given.
    pub datagrams: u64,
    /// Fragments of IP packets. They are not put together: no packet of a scanner is longer than a frame.
    pub fragments: u64,
    /// Frames that the capture holds in part only (a snap length).
    pub cut_frames: u64,
    /// Frames of other protocols than UDP over IP, or broken ones.
    pub other_frames: u64,
    /// Whether the file ends within a frame.
    pub cut_off: bool,
}

/// Why a capture cannot be read, or not further.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum CaptureError {
    /// The file has no bytes.
    #[error("the capture is empty (0 bytes)")]
    Empty,
    /// It is no capture.
    #[error("this is neither pcap nor pcapng")]
    NotACapture,
    /// The frames are of a kind of network that is not read.
    #[error(
        "frames of link type {link_type} after {frames} frames are not read (Ethernet, Linux cooked, loopback and \
         raw IP are)"
    )]
    LinkType {
        /// Its number in the registry of tcpdump.
        link_type: i32,
        /// Frames that were read before.
        frames: u64,
    },
    /// A frame belongs to an interface that the capture does not describe.
    #[error("frame {frame} is of interface {interface}, which the capture does not describe")]
    Interface {
        /// Which frame, from 0.
        frame: u64,
        /// Which interface, from 0.
        interface: u32,
    },
    /// The file cannot be understood any more.
    #[error("the capture is damaged after {frames} frames: {reason}")]
    Damaged {
        /// Frames that were read before.
        frames: u64,
        /// The reason, in a few words.
        reason: &'static str,
    },
}

/// Bytes of a capture that are held at a time: room for the largest frame (a snap length of 262144) and more.
const BUFFER_BYTES: usize = 1 << 20;

/// Reads the datagrams of a capture one by one, in its order, whatever its size.
pub struct CaptureReader<'r> {
    reader: Box<dyn PcapReaderIterator + Send + 'r>,
    interfaces: Interfaces,
    counts: CaptureCounts,
    /// Nothing can be read any more.
    ended: bool,
}

/// The interfaces of the section that is being read; of a pcap file the only one.
#[derive(Debug, Default)]
struct Interfaces(Vec<Interface>);

#[derive(Clone, Copy, Debug)]
struct Interface {
    link: LinkLayer,
    /// Units of a timestamp in a second.
    units_per_s: u64,
    offset_s: i64,
}

impl<'r> CaptureReader<'r> {
    /// A reader of the capture's bytes.
    ///
    /// # Errors
    /// When these do not begin as a capture.
    pub fn new(bytes: impl Read + Send + 'r) -> Result<Self, CaptureError> {
        let reader = create_reader(BUFFER_BYTES, bytes).map_err(|error| match error {
            PcapError::Eof => CaptureError::Empty,
            PcapError::ReadError => damaged(&PcapError::ReadError, 0),
            _ => CaptureError::NotACapture,
        })?;
        let (interfaces, counts) = (Interfaces::default(), CaptureCounts::default());
        Ok(Self { reader, interfaces, counts, ended: false })
    }

    /// The counts so far.
    #[must_use]
    pub fn counts(&self) -> CaptureCounts {
        self.counts
    }

    /// The next datagram, or the error; `None` at the end.
    fn advance(&mut self) -> Option<Result<Datagram, CaptureError>> {
        loop {
            let (length, step) = match self.reader.next() {
                Ok((length, block)) => (length, self.interfaces.take(&block, &mut self.counts)),
                Err(PcapError::Eof) => return None,
                Err(PcapError::UnexpectedEof) => {
                    self.counts.cut_off = true;
                    return None;
                }
                Err(PcapError::Incomplete(_)) => {
                    if let Err(error) = self.refill() {
                        return Some(Err(error));
                    }
                    continue;
                }
                Err(error) => return Some(Err(damaged(&error, self.counts.frames))),
            };
            self.reader.consume(length);
            match step {
                Ok(None) => {}
                Ok(Some(datagram)) => {
                    self.counts.datagrams += 1;
                    return Some(Ok(datagram));
                }
                Err(error) => return Some(Err(error)),
            }
        }
    }

    fn refill(&mut self) -> Result<(), CaptureError> {
        let before = self.reader.data().len();
        let frames = self.counts.frames;
        self.reader.refill().map_err(|error| damaged(&error, frames))?;
        // At the end of the file the reader says so itself; a full buffer would never end.
        if self.reader.data().len() == before && !self.reader.reader_exhausted() {
            return Err(CaptureError::Damaged { frames, reason: "a frame is too long" });
        }
        Ok(())
    }
}

fn damaged(error: &PcapError<&[u8]>, frames: u64) -> CaptureError {
    let reason = match error {
        PcapError::BufferTooSmall => "a frame is too long",
        PcapError::ReadError => "its bytes cannot be read",
        _ => "the bytes after it are no frame",
    };
    CaptureError::Damaged { frames, reason }
}

impl Iterator for CaptureReader<'_> {
    type Item = Result<Datagram, CaptureError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let next = self.advance();
        self.ended = !matches!(next, Some(Ok(_)));
        next
    }
}

const NANOS_PER_SECOND: i128 = 1_000_000_000;

impl Interfaces {
    /// Takes a block of the capture.
    fn take(
        &mut self,
        block: &PcapBlockOwned<'_>,
        counts: &mut CaptureCounts,
    ) -> Result<Option<Datagram>, CaptureError> {
        match block {
            PcapBlockOwned::LegacyHeader(header) => {
                let units_per_s =
                    if header.is_nanosecond_precision() { 1_000_000_000 } else { 1_000_000 };
                self.add(header.network.0, units_per_s, 0, counts.frames)?;
            }
            PcapBlockOwned::Legacy(frame) => {
                let Some(interface) = self.0.first() else { return Ok(None) };
                let units = u64::from(frame.ts_sec)
                    .saturating_mul(interface.units_per_s)
                    .saturating_add(u64::from(frame.ts_usec));
                let whole = frame.origlen as usize <= frame.data.len();
                return Ok(datagram(frame.data, whole, interface, units, counts));
            }
            PcapBlockOwned::NG(Block::SectionHeader(_)) => self.0.clear(),
            PcapBlockOwned::NG(Block::InterfaceDescription(description)) => {
                let units_per_s = units_per_s(description.if_tsresol);
                let offset_s = description.ts_offset();
                self.add(description.linktype.0, units_per_s, offset_s, counts.frames)?;
            }
            PcapBlockOwned::NG(Block::EnhancedPacket(frame)) => {
                let interface = self.get(frame.if_id, counts)?;
                let units = u64::from(frame.ts_high) << 32 | u64::from(frame.ts_low);
                // The data is padded to four bytes.
                let data = frame.data.get(..frame.caplen as usize).unwrap_or(frame.data);
                let whole = frame.origlen as usize <= data.len();
                return Ok(datagram(data, whole, &interface, units, counts));
            }
            PcapBlockOwned::NG(Block::SimplePacket(frame)) => {
                // It has no time.
                let interface = self.get(0, counts)?;
                let data = frame.data.get(..frame.origlen as usize).unwrap_or(frame.data);
                let whole = frame.origlen as usize <= data.len();
                return Ok(datagram(data, whole, &interface, 0, counts));
            }
            PcapBlockOwned::NG(_) => {}
        }
        Ok(None)
    }

    fn add(
        &mut self,
        link_type: i32,
        units_per_s: u64,
        offset_s: i64,
        frames: u64,
    ) -> Result<(), CaptureError> {
        let link = LinkLayer::of(link_type).ok_or(CaptureError::LinkType { link_type, frames })?;
        self.0.push(Interface { link, units_per_s: units_per_s.max(1), offset_s });
        Ok(())
    }

    fn get(&self, interface: u32, counts: &CaptureCounts) -> Result<Interface, CaptureError> {
        let known = self.0.get(interface as usize).copied();
        known.ok_or(CaptureError::Interface { frame: counts.frames, interface })
    }
}

/// Units of a timestamp in a second by the option `if_tsresol`: a power of 2 where its highest bit is set, else of 10.
fn units_per_s(resolution: u8) -> u64 {
    let (base, exponent) =
        if resolution & 0x80 == 0 { (10_u64, resolution) } else { (2, resolution & 0x7f) };
    base.saturating_pow(u32::from(exponent))
}

/// The datagram in a frame, where it holds one; everything else is counted.
fn datagram(
    data: &[u8],
    whole: bool,
    interface: &Interface,
    units: u64,
    counts: &mut CaptureCounts,
) -> Option<Datagram> {
    counts.frames += 1;
    let counter = match interface.link.contents(data) {
        FrameContents::Udp { port, payload } if whole => {
            let nanos = i128::from(units) * NANOS_PER_SECOND / i128::from(interface.units_per_s)
                + i128::from(interface.offset_s) * NANOS_PER_SECOND;
            let nanos = nanos.clamp(i128::from(i64::MIN), i128::from(i64::MAX)) as i64;
            let arrival = Stamp::from_nanos(nanos);
            return Some(Datagram { arrival, port, payload: payload.to_vec() });
        }
        FrameContents::Udp { .. } | FrameContents::Cut => &mut counts.cut_frames,
        FrameContents::Fragment => &mut counts.fragments,
        FrameContents::Other => &mut counts.other_frames,
    };
    *counter += 1;
    None
}

#[cfg(test)]
mod tests;
