//! Tiles of the store that are looked at and stay there: the points of a tile need those beside it, too.

use std::collections::{BTreeMap, VecDeque};

use volume::{BlockKey, Surface};

use super::Spill;
use crate::tiles::{TileError, TileKey};

/// So many tiles are kept, those that were looked at last: eight are needed at a time, and where the map is gone through
/// by ascending key the next ones need some of them again.
const KEPT_TILES: usize = 16;

/// The tiles that were looked at last.
pub(in super::super) struct LookedAt {
    /// Their blocks.
    pub(in super::super) surface: Surface,
    /// The latest at the end.
    kept: VecDeque<(TileKey, Vec<BlockKey>)>,
    most: usize,
    /// Those that cannot be read.
    pub(in super::super) unreadable: BTreeMap<TileKey, TileError>,
}

impl LookedAt {
    /// None yet, of a map with this surface.
    pub(in super::super) fn of(surface: &Surface) -> Self {
        Self::with_room_for(KEPT_TILES, surface)
    }

    /// The same with room for so many tiles.
    pub(in super::super) fn with_room_for(most: usize, surface: &Surface) -> Self {
        let (kept, unreadable) = (VecDeque::new(), BTreeMap::new());
        Self { surface: surface.unbounded(), kept, most, unreadable }
    }

    /// Looks at a tile, if it is in the store.
    pub(in super::super) fn look(&mut self, spill: &Spill, tile: TileKey) {
        if let Some(place) = self.kept.iter().position(|(kept, _)| *kept == tile) {
            let latest = self.kept.remove(place);
            self.kept.extend(latest);
            return;
        }
        if !spill.tiles.is_in_store(tile) || self.unreadable.contains_key(&tile) {
            return;
        }
        match spill.read_into(tile, &mut self.surface) {
            Ok(known) => {
                self.kept.push_back((tile, known.into_iter().map(|known| known.key).collect()));
            }
            Err(error) => {
                self.unreadable.insert(tile, error);
            }
        }
        if self.kept.len() > self.most
            && let Some((_, keys)) = self.kept.pop_front()
        {
            for key in keys {
                self.surface.remove_block(key);
            }
        }
    }

    /// The blocks of a tile that was looked at last.
    pub(in super::super) fn blocks_of(&self, tile: TileKey) -> &[BlockKey] {
        let kept = self.kept.iter().find(|(kept, _)| *kept == tile);
        kept.map_or(&[], |(_, keys)| keys)
    }
}
