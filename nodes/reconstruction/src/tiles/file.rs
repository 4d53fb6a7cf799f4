//! What the bytes of every tile have: [`crate::tiles`] has the table.

use super::{TileFormatError, TileKey};

const MAGIC: &[u8; 4] = b"SMTL";
const VERSION: u16 = 2;
/// Everything before the content.
const HEADER_BYTES: usize = 28;
const CHECKSUM_BYTES: usize = 4;

/// How a map is cut into tiles.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct TileFrame {
    /// A tile's edge.
    pub(crate) edge_voxels: u16,
    /// A voxel's edge.
    pub(crate) edge_m: f64,
}

impl TileFrame {
    /// The bytes of a tile. `content` appends what is in it, about so many bytes.
    pub(crate) fn seal(
        &self,
        tile: TileKey,
        content_bytes: usize,
        content: impl FnOnce(&mut Vec<u8>),
    ) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER_BYTES + content_bytes + CHECKSUM_BYTES);
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(self.edge_voxels.to_le_bytes());
        bytes.extend(self.edge_m.to_le_bytes());
        for along in [tile.x, tile.y, tile.z] {
            bytes.extend(along.to_le_bytes());
        }
        content(&mut bytes);
        let checksum = crc32fast::hash(&bytes);
        bytes.extend(checksum.to_le_bytes());
        bytes
    }

    /// The content of a tile.
    pub(crate) fn open<'a>(
        &self,
        tile: TileKey,
        bytes: &'a [u8],
    ) -> Result<TileReader<'a>, TileFormatError> {
        let (bytes, checksum) =
            bytes.split_last_chunk::<CHECKSUM_BYTES>().ok_or(TileFormatError::CutOff)?;
        let mut reader = TileReader { bytes };
        if reader.array()? != *MAGIC {
            return Err(TileFormatError::NotThisFormat);
        }
        let version = u16::from_le_bytes(reader.array()?);
        if version != VERSION {
            return Err(TileFormatError::OtherVersion { version });
        }
        if crc32fast::hash(bytes) != u32::from_le_bytes(*checksum) {
            return Err(TileFormatError::Checksum);
        }
        let edge_voxels = u16::from_le_bytes(reader.array()?);
        let edge_m = f64::from_le_bytes(reader.array()?);
        let mut along = || Ok(i32::from_le_bytes(reader.array()?));
        let key = TileKey { x: along()?, y: along()?, z: along()? };
        if (edge_voxels, key) != (self.edge_voxels, tile)
            || edge_m.to_bits() != self.edge_m.to_bits()
        {
            return Err(TileFormatError::OtherTile);
        }
        Ok(reader)
    }
}

/// Takes the content of a tile, number by number.
pub(crate) struct TileReader<'a> {
    bytes: &'a [u8],
}

impl<'a> TileReader<'a> {
    /// How many bytes are left.
    pub(crate) fn left(&self) -> usize {
        self.bytes.len()
    }

    pub(crate) fn array<const N: usize>(&mut self) -> Result<[u8; N], TileFormatError> {
        let (array, rest) = self.bytes.split_first_chunk().ok_or(TileFormatError::CutOff)?;
        self.bytes = rest;
        Ok(*array)
    }

    /// So many bytes.
    pub(crate) fn slice(&mut self, length: usize) -> Result<&'a [u8], TileFormatError> {
        let (slice, rest) = self.bytes.split_at_checked(length).ok_or(TileFormatError::CutOff)?;
        self.bytes = rest;
        Ok(slice)
    }
}
