//! What one browser has been sent, and what it lacks.

use std::collections::BTreeMap;
use std::ops::Bound;
use std::sync::Arc;

use crate::map::{BlockKey, LiveMap};
use crate::mesh::LiveMesh;
use crate::message::{self, Kind};
use crate::state::{LiveState, Numbered};

/// Points of one message, at most, but for its last block: 100 kB before compression.
const MOST_POINTS: usize = 16_384;
/// Triangles of one message, at most, but for its last block: 110 kB before compression.
const MOST_TRIANGLES: usize = 4_096;
/// Blocks of one message, at most: those that have gone have no points.
const MOST_BLOCKS: usize = 4_096;

/// What one browser has: of each block of the map the number of the change that it was sent, and of what has only a latest state the
/// number of that. Nothing waits here: a message is made when the browser can take it, of what is by then.
#[derive(Clone, Debug, Default)]
pub struct Browser {
    epoch: u32,
    map: Blocks,
    /// Of a browser that asks for triangles.
    mesh: Option<Blocks>,
    moment: u64,
    status: u64,
    /// Whose turn it is.
    turn: usize,
}

/// What a browser has of something that is sent by blocks.
#[derive(Clone, Debug, Default)]
struct Blocks {
    sent: BTreeMap<BlockKey, u64>,
    /// The change up to which the browser has everything.
    complete: u64,
    /// The last block that was sent: those after it come first, so that none is sent again and again while others wait.
    last: Option<BlockKey>,
}

/// What is sent in turns: a browser that is behind gets some of each.
const TURNS: [Kind; 4] = [Kind::Moment, Kind::Map, Kind::Mesh, Kind::Status];

impl Browser {
    /// The next message, or none while the browser has all there is. The caller must send it, or forget the browser.
    pub fn next_message(&mut self, state: &LiveState) -> Option<Arc<[u8]>> {
        for step in 0..TURNS.len() {
            let turn = (self.turn + step) % TURNS.len();
            let message = match TURNS[turn] {
                Kind::Moment => latest(&mut self.moment, state.moment()),
                Kind::Status => latest(&mut self.status, state.status()),
                Kind::Map => self.next_of_map(state.map()),
                Kind::Mesh => self.next_of_mesh(state.mesh()),
            };
            if message.is_some() {
                self.turn = turn + 1;
                return message;
            }
        }
        None
    }

    /// Whether the browser is sent triangles from now on. One that was not has none.
    pub fn want_mesh(&mut self, is_wanted: bool) {
        self.mesh = is_wanted.then(|| self.mesh.take().unwrap_or_default());
    }

    /// Whether the browser has all of the map.
    #[must_use]
    pub fn has_map(&self, map: &LiveMap) -> bool {
        self.epoch == map.epoch() && self.map.complete == map.revision()
    }

    fn next_of_map(&mut self, map: &LiveMap) -> Option<Arc<[u8]>> {
        if self.has_map(map) {
            return None;
        }
        if self.epoch != map.epoch() {
            (self.epoch, self.map) = (map.epoch(), Blocks::default());
        }
        let mut sent = self.map.gone(|key| map.changed(key).is_some());
        let size = |key: &BlockKey| map.point_count(key);
        let in_range = |range| map.blocks_in(range);
        if self.map.add_changed(in_range, size, MOST_POINTS, &mut sent) {
            self.map.complete = map.revision();
        }
        Some(message::of_map(map, &sent).into())
    }

    fn next_of_mesh(&mut self, mesh: &LiveMesh) -> Option<Arc<[u8]>> {
        let blocks = self.mesh.as_mut().filter(|blocks| blocks.complete != mesh.revision())?;
        let is_first = blocks.complete == 0 && blocks.last.is_none();
        let mut sent = blocks.gone(|key| mesh.changed(key).is_some());
        let size = |key: &BlockKey| mesh.block(key).map_or(0, |block| block.triangles());
        let in_range = |range| mesh.blocks_in(range);
        if blocks.add_changed(in_range, size, MOST_TRIANGLES, &mut sent) {
            blocks.complete = mesh.revision();
        }
        Some(message::of_mesh(mesh, &sent, is_first).into())
    }
}

type KeyRange = (Bound<BlockKey>, Bound<BlockKey>);

impl Blocks {
    /// Takes note of blocks that are no longer there.
    fn gone(&mut self, is_there: impl Fn(&BlockKey) -> bool) -> Vec<BlockKey> {
        let gone = self.sent.keys().filter(|key| !is_there(key));
        let gone: Vec<BlockKey> = gone.take(MOST_BLOCKS).copied().collect();
        for key in &gone {
            self.sent.remove(key);
        }
        gone
    }

    /// Adds blocks that have changed, as many as fit; whether that is all of them.
    fn add_changed<I: Iterator<Item = (BlockKey, u64)>>(
        &mut self,
        in_range: impl Fn(KeyRange) -> I,
        size: impl Fn(&BlockKey) -> usize,
        most_size: usize,
        sent: &mut Vec<BlockKey>,
    ) -> bool {
        if sent.len() >= MOST_BLOCKS {
            return false;
        }
        let after = self.last.map_or(Bound::Unbounded, Bound::Excluded);
        let until = self.last.map_or(Bound::Unbounded, Bound::Included);
        let order = in_range((after, Bound::Unbounded));
        let rest = self.last.is_some().then(|| in_range((Bound::Unbounded, until)));
        let mut total = 0;
        for (key, changed) in order.chain(rest.into_iter().flatten()) {
            if self.sent.get(&key) == Some(&changed) {
                continue;
            }
            if total >= most_size || sent.len() >= MOST_BLOCKS {
                return false;
            }
            total += size(&key);
            sent.push(key);
            self.sent.insert(key, changed);
            self.last = Some(key);
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
