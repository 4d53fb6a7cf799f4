//! What one browser has been sent, and what it lacks.

use std::collections::BTreeMap;
use std::ops::Bound;
use std::sync::Arc;

use crate::map::{BlockKey, LiveMap};
use crate::message::{self, Kind};
use crate::state::{LiveState, Numbered};

/// Points of one message, at most, but for its last block: 100 kB before compression.
const MOST_POINTS: usize = 16_384;
/// Blocks of one message, at most: those that have gone have no points.
const MOST_BLOCKS: usize = 4_096;

/// What one browser has: of each block of the map the number of the change that it was sent, and of what has only a latest state the
/// number of that. Nothing waits here: a message is made when the browser can take it, of what is by then.
#[derive(Clone, Debug, Default)]
pub struct Browser {
    epoch: u32,
    blocks: BTreeMap<BlockKey, u64>,
    /// The change of the map up to which the browser has everything.
    complete: u64,
    /// The last block that was sent: those after it come first, so that none is sent again and again while others wait.
    last_block: Option<BlockKey>,
    moment: u64,
    status: u64,
    /// Whose turn it is.
    turn: usize,
}

/// What is sent in turns: a browser that is behind gets some of each.
const TURNS: [Kind; 3] = [Kind::Moment, Kind::Map, Kind::Status];

impl Browser {
    /// The next message, or none while the browser has all there is. The caller must send it, or forget the browser.
    pub fn next_message(&mut self, state: &LiveState) -> Option<Arc<[u8]>> {
        for step in 0..TURNS.len() {
            let turn = (self.turn + step) % TURNS.len();
            let message = match TURNS[turn] {
                Kind::Moment => latest(&mut self.moment, state.moment()),
                Kind::Status => latest(&mut self.status, state.status()),
                Kind::Map => self.next_of_map(state.map()),
            };
            if message.is_some() {
                self.turn = turn + 1;
                return message;
            }
        }
        None
    }

    /// Whether the browser has all of the map.
    #[must_use]
    pub fn has_map(&self, map: &LiveMap) -> bool {
        self.epoch == map.epoch() && self.complete == map.revision()
    }

    fn next_of_map(&mut self, map: &LiveMap) -> Option<Arc<[u8]>> {
        if self.has_map(map) {
            return None;
        }
        if self.epoch != map.epoch() {
            *self = Self {
                epoch: map.epoch(),
                moment: self.moment,
                status: self.status,
                ..Self::default()
            };
        }
        let mut sent = self.gone(map);
        let room = sent.len() < MOST_BLOCKS;
        let is_complete = room && self.add_changed(map, &mut sent);
        if is_complete {
            self.complete = map.revision();
        }
        Some(message::of_map(map, &sent).into())
    }

    /// Takes note of blocks that are no longer there.
    fn gone(&mut self, map: &LiveMap) -> Vec<BlockKey> {
        let gone = self.blocks.keys().filter(|key| map.changed(key).is_none());
        let gone: Vec<BlockKey> = gone.take(MOST_BLOCKS).copied().collect();
        for key in &gone {
            self.blocks.remove(key);
        }
        gone
    }

    /// Adds blocks that have changed, as many as fit; whether that is all of them.
    fn add_changed(&mut self, map: &LiveMap, sent: &mut Vec<BlockKey>) -> bool {
        let after = self.last_block.map_or(Bound::Unbounded, Bound::Excluded);
        let until = self.last_block.map_or(Bound::Unbounded, Bound::Included);
        let order = map.blocks_in((after, Bound::Unbounded));
        let rest = self.last_block.is_some().then(|| map.blocks_in((Bound::Unbounded, until)));
        let mut points = 0;
        for (key, changed) in order.chain(rest.into_iter().flatten()) {
            if self.blocks.get(&key) == Some(&changed) {
                continue;
            }
            if points >= MOST_POINTS || sent.len() >= MOST_BLOCKS {
                return false;
            }
            points += map.point_count(&key);
            sent.push(key);
            self.blocks.insert(key, changed);
            self.last_block = Some(key);
        }
        true
    }
}

fn latest(has: &mut u64, state: Option<&Numbered>) -> Option<Arc<[u8]>> {
    let Numbered { number, message } = state?;
    (*has != *number).then(|| {
        *has = *number;
        Arc::clone(message)
    })
}
