//! Which of two returns of a shot is which echo.

use crate::packets::data_packet::Block;
use crate::packets::model::ReturnMode;

/// Which echo of a shot a return is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Echo {
    /// The strongest; another one came later, or was not requested.
    Strongest,
    /// The last; another one was stronger, or was not requested.
    Last,
    /// The strongest is the last.
    StrongestAndLast,
    /// The second strongest, where the strongest is the last.
    SecondStrongest,
}

/// The blocks that contain the echoes of the same shots.
pub(super) struct Echoes<'a> {
    /// Of two, the one with the last echoes.
    pub(super) main: &'a Block<'a>,
    pub(super) other: Option<&'a Block<'a>>,
    pub(super) return_mode: ReturnMode,
}

impl Echoes<'_> {
    /// The laser in its bank, the echo, and its values in the packet, for the shots of a firing.
    pub(super) fn read(
        &self,
        shots: std::ops::Range<usize>,
    ) -> impl Iterator<Item = (usize, Echo, (u16, u8))> + '_ {
        let (skipped, count) = (shots.start, shots.len());
        let others = self.other.map(|block| block.shots().skip(skipped));
        let mut others = others.into_iter().flatten();
        let main = self.main.shots().skip(skipped).take(count).enumerate();
        main.flat_map(move |(laser, main)| {
            let (first, second) = match (self.return_mode, others.next()) {
                (ReturnMode::Dual, Some(other)) => echoes_of(main, other),
                (ReturnMode::Last, _) => ((Echo::Last, main), None),
                _ => ((Echo::Strongest, main), None),
            };
            [Some(first), second].into_iter().flatten().map(move |(echo, raw)| (laser, echo, raw))
        })
    }
}

type RawEcho = (Echo, (u16, u8));

/// The even block of a pair holds the last echoes, the odd one the strongest, or the second strongest where the last
/// is the strongest (VLP-16 user's manual, section 9.3.2): that is so where the odd one is the weaker.
fn echoes_of(last: (u16, u8), other: (u16, u8)) -> (RawEcho, Option<RawEcho>) {
    if last == other || other.0 == 0 {
        ((Echo::StrongestAndLast, last), None)
    } else if other.1 < last.1 {
        ((Echo::StrongestAndLast, last), Some((Echo::SecondStrongest, other)))
    } else {
        ((Echo::Last, last), Some((Echo::Strongest, other)))
    }
}
