//! From datagrams to revolutions: decoder, loss counts and builder in one.

use geometry::Stamp;

use super::{BuiltRevolution, RevolutionBuilder, RevolutionConfig, RevolutionConfigError};
use crate::packets::{
    Continuity, DecodeError, DecoderConfig, DecoderConfigError, LossCounts, Model, PacketDecoder,
    ReturnMode,
};

/// Why packets cannot become revolutions.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum AssemblyConfigError {
    /// They cannot be decoded so.
    #[error(transparent)]
    Decoder(#[from] DecoderConfigError),
    /// They cannot be cut so.
    #[error(transparent)]
    Revolution(#[from] RevolutionConfigError),
}

/// Counts of the datagrams by outcome so far.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct AssemblyCounts {
    /// Of those that were decoded.
    pub losses: LossCounts,
    /// Those that could not be.
    pub refused: u64,
    /// Why the first of these could not.
    pub first_refusal: Option<DecodeError>,
    /// Why the last of these could not.
    pub last_refusal: Option<DecodeError>,
}

/// By whose clock revolutions have their stamps.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum PacketClock {
    /// That of the computer at which the packets arrived.
    #[default]
    Arrival,
    /// The scanner's own, which follows GPS.
    Scanner,
}

/// Makes revolutions of the data packets of one scanner.
#[derive(Clone, Debug)]
pub struct RevolutionAssembly {
    decoder: PacketDecoder,
    continuity: Continuity,
    builder: RevolutionBuilder,
    counts: AssemblyCounts,
    scanner: Option<(Model, ReturnMode)>,
    clock: PacketClock,
}

impl RevolutionAssembly {
    /// One that has seen no packet.
    ///
    /// # Errors
    /// When a configuration does not hold.
    pub fn new(
        decoder: DecoderConfig,
        revolution: RevolutionConfig,
    ) -> Result<Self, AssemblyConfigError> {
        Ok(Self {
            decoder: PacketDecoder::new(decoder)?,
            continuity: Continuity::default(),
            builder: RevolutionBuilder::new(revolution)?,
            counts: AssemblyCounts::default(),
            scanner: None,
            clock: PacketClock::default(),
        })
    }

    /// The same with stamps by another clock.
    #[must_use]
    pub fn with_clock(self, clock: PacketClock) -> Self {
        Self { clock, ..self }
    }

    /// Takes the payload of a datagram that arrived then; gives the revolution that it ends. What is no data packet is counted.
    pub fn push(&mut self, payload: &[u8], arrival: Stamp) -> Option<BuiltRevolution> {
        match self.decoder.decode(payload) {
            Ok(packet) => {
                self.continuity.push(&packet);
                self.scanner = Some((packet.model, packet.return_mode));
                let stamp = match self.clock {
                    PacketClock::Arrival => packet.stamp_by_arrival(arrival),
                    PacketClock::Scanner => packet.stamp_by_scanner(arrival),
                };
                self.builder.push(&packet, stamp)
            }
            Err(error) => {
                self.counts.refused += 1;
                self.counts.first_refusal.get_or_insert(error);
                self.counts.last_refusal = Some(error);
                None
            }
        }
    }

    /// The revolution that is not complete yet.
    pub fn finish(&mut self) -> Option<BuiltRevolution> {
        self.builder.finish()
    }

    /// The counts so far.
    #[must_use]
    pub fn counts(&self) -> AssemblyCounts {
        AssemblyCounts { losses: self.continuity.counts(), ..self.counts }
    }

    /// The model that sends the packets, once one was decoded.
    #[must_use]
    pub fn scanner(&self) -> Option<(Model, ReturnMode)> {
        self.scanner
    }
}
