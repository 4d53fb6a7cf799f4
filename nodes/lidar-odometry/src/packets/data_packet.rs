//! The layout of a data packet: twelve blocks of 100 bytes, a timestamp, two factory bytes (Road LiDAR section 2.3,
//! the user's manuals).

use super::error::PacketError;
use super::model::{BLOCKS, Model, PACKET_BYTES, ReturnMode, SHOTS, VLS_128};

/// Bytes of a block: flag, azimuth, 32 shots.
const BLOCK_BYTES: usize = 100;
/// Bytes of a shot: a range in two, an intensity in one.
const SHOT_BYTES: usize = 3;
/// The flag of the blocks of one bank, and of the upper blocks of two.
const UPPER_FLAG: u16 = 0xeeff;
/// The flag of the lower blocks of an HDL-64E.
const LOWER_FLAG: u16 = 0xddff;
/// The flags of the third and fourth banks of a VLS-128.
const VLS_128_FLAGS: [u16; 2] = [0xccff, 0xbbff];
/// A whole turn in the packet's unit.
const TURN_HUNDREDTHS: u16 = 36_000;
/// Microseconds of the hour at which the timestamp wraps.
pub(super) const HOUR_US: u32 = 3_600_000_000;

/// How the blocks of a packet belong together.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum BlockLayout {
    /// Each block holds shots of all lasers.
    OneBank,
    /// Blocks of the upper 32 lasers and of the lower 32 take turns.
    TwoBanks,
}

/// A data packet whose layout holds.
#[derive(Clone, Copy, Debug)]
pub struct DataPacket<'a> {
    blocks: [Block<'a>; BLOCKS],
    layout: BlockLayout,
    timestamp_us: u32,
    return_mode: u8,
    product: u8,
}

/// One block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Block<'a> {
    /// Clockwise seen from above, in hundredths of a degree, below 36000.
    pub(super) azimuth_hundredths: u16,
    shots: &'a [u8],
}

impl Block<'_> {
    /// Clockwise seen from above.
    pub(super) fn azimuth_deg(&self) -> f64 {
        f64::from(self.azimuth_hundredths) / 100.0
    }

    /// Range in units of the model and intensity of each of the 32 shots.
    pub(super) fn shots(&self) -> impl Iterator<Item = (u16, u8)> + '_ {
        self.shots.chunks_exact(SHOT_BYTES).map(|shot| match *shot {
            [low, high, intensity] => (u16::from_le_bytes([low, high]), intensity),
            _ => (0, 0),
        })
    }
}

impl<'a> DataPacket<'a> {
    /// The packet in the payload of a datagram.
    ///
    /// # Errors
    /// When the length, a block's flag or an azimuth is not that of a data packet.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, PacketError> {
        if bytes.len() != PACKET_BYTES {
            return Err(PacketError::Length { found: bytes.len() });
        }
        let (body, tail) = bytes.split_at(BLOCKS * BLOCK_BYTES);
        let mut timestamp_us = [0; 4];
        timestamp_us.copy_from_slice(tail.get(..4).unwrap_or(&[0; 4]));
        let byte = |index: usize| tail.get(index).copied().unwrap_or_default();
        let (return_mode, product) = (byte(4), byte(5));

        let flags: [u16; BLOCKS] = std::array::from_fn(|block| word(body, block * BLOCK_BYTES));
        let layout = layout_of(&flags, product)?;
        let mut blocks = [Block::default(); BLOCKS];
        for (index, (block, bytes)) in
            blocks.iter_mut().zip(body.chunks_exact(BLOCK_BYTES)).enumerate()
        {
            let azimuth_hundredths = word(bytes, 2);
            if azimuth_hundredths >= TURN_HUNDREDTHS {
                return Err(PacketError::Azimuth { block: index, found: azimuth_hundredths });
            }
            let shots = bytes.get(BLOCK_BYTES - SHOTS * SHOT_BYTES..).unwrap_or_default();
            *block = Block { azimuth_hundredths, shots };
        }
        let timestamp_us = u32::from_le_bytes(timestamp_us);
        Ok(Self { blocks, layout, timestamp_us, return_mode, product })
    }

    /// When the first shot was fired, in microseconds since the hour; by GPS time where the scanner has it, otherwise
    /// since some moment after it was switched on.
    #[must_use]
    pub fn timestamp_us(&self) -> u32 {
        self.timestamp_us
    }

    /// The model that the packet is of.
    ///
    /// # Errors
    /// When the product id is of none that is decoded here.
    pub fn model(&self) -> Result<Model, PacketError> {
        Model::detect(self.layout, self.product)
    }

    /// Which echoes the packet reports. An HDL-64E uses these bytes for its status: two firings at one azimuth are the
    /// two echoes of one.
    ///
    /// # Errors
    /// When the return mode is unknown.
    pub fn return_mode(&self) -> Result<ReturnMode, PacketError> {
        match self.layout {
            BlockLayout::OneBank => ReturnMode::detect(self.return_mode),
            BlockLayout::TwoBanks => Ok(self.return_mode_of_two_banks()),
        }
    }

    fn return_mode_of_two_banks(&self) -> ReturnMode {
        let [first, _, second, _, third, _, fourth, ..] =
            self.blocks.map(|block| block.azimuth_hundredths);
        // Of a head that does not turn all azimuths are the same.
        if first == second && third == fourth && first != third {
            ReturnMode::Dual
        } else {
            ReturnMode::Strongest
        }
    }

    pub(super) fn layout(&self) -> BlockLayout {
        self.layout
    }

    pub(super) fn blocks(&self) -> &[Block<'a>; BLOCKS] {
        &self.blocks
    }
}

fn word(bytes: &[u8], at: usize) -> u16 {
    match bytes.get(at..at + 2) {
        Some(&[low, high]) => u16::from_le_bytes([low, high]),
        _ => 0,
    }
}

fn layout_of(flags: &[u16; BLOCKS], product: u8) -> Result<BlockLayout, PacketError> {
    if flags.iter().any(|flag| VLS_128_FLAGS.contains(flag)) {
        return Err(PacketError::UnsupportedProduct { id: product, name: VLS_128 });
    }
    let layout = if flags[1] == LOWER_FLAG { BlockLayout::TwoBanks } else { BlockLayout::OneBank };
    for (block, &found) in flags.iter().enumerate() {
        let lower = layout == BlockLayout::TwoBanks && block % 2 == 1;
        let (flag, expected) = if lower { (LOWER_FLAG, "0xddff") } else { (UPPER_FLAG, "0xeeff") };
        if found != flag {
            return Err(PacketError::Flag { block, found, expected });
        }
    }
    Ok(layout)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A packet without returns.
    fn empty(flags: [[u8; 2]; 2]) -> Vec<u8> {
        let mut bytes = Vec::new();
        for block in 0..BLOCKS {
            bytes.extend(flags[block % 2]);
            bytes.extend((100 * block as u16).to_le_bytes());
            bytes.extend([0; SHOTS * SHOT_BYTES]);
        }
        bytes.extend(123_456_789_u32.to_le_bytes());
        bytes.extend([0x38, 0x21]);
        bytes
    }

    #[test]
    fn a_packet_has_its_time_its_model_and_its_returns() {
        let bytes = empty([[0xff, 0xee]; 2]);
        let packet = DataPacket::parse(&bytes).unwrap();
        assert_eq!(packet.timestamp_us(), 123_456_789);
        assert_eq!(packet.model(), Ok(Model::Hdl32e));
        assert_eq!(packet.return_mode(), Ok(ReturnMode::Last));
        assert_eq!(packet.blocks()[3].azimuth_deg(), 3.0);
        assert_eq!(packet.blocks()[3].shots().count(), SHOTS);
        let bytes = empty([[0xff, 0xee], [0xff, 0xdd]]);
        assert_eq!(DataPacket::parse(&bytes).unwrap().model(), Ok(Model::Hdl64e));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_numbers() {
        let good = empty([[0xff, 0xee]; 2]);
        for length in [0, 512, 1205, 1207] {
            let mut bytes = good.clone();
            bytes.resize(length, 0);
            let error = DataPacket::parse(&bytes).unwrap_err();
            assert_eq!(error.to_string(), format!("a data packet has 1206 bytes, not {length}"));
        }
        let with = |at: usize, new: [u8; 2]| {
            let mut bytes = good.clone();
            bytes[at..at + 2].copy_from_slice(&new);
            DataPacket::parse(&bytes).unwrap_err()
        };
        assert_eq!(
            with(500, [0xff, 0xdd]),
            PacketError::Flag { block: 5, found: 0xddff, expected: "0xeeff" }
        );
        assert_eq!(
            with(702, 36_000_u16.to_le_bytes()),
            PacketError::Azimuth { block: 7, found: 36_000 }
        );
        assert!(with(300, [0xff, 0xcc]).to_string().contains("VLS-128"));
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in proptest::collection::vec(any::<u8>(), 0..1300), cut in 0..1206_usize) {
            let _ = DataPacket::parse(&bytes);
            let mut packet = empty([[0xff, 0xee]; 2]);
            packet.truncate(cut);
            packet.extend(&bytes);
            let _ = DataPacket::parse(&packet);
        }
    }
}
