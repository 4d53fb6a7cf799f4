//! Records of MCAP, once their lengths are known to be within them: the reader of the mcap crate makes room for a text of as many
//! bytes as it claims, up to 4 GB, before it looks for them.

use mcap::McapError;
use mcap::records::{Record, op};

/// The record with this opcode and body.
///
/// # Errors
/// When it is none, or a text in it is longer than the record.
pub(crate) fn parse(opcode: u8, body: &[u8]) -> Result<Record<'_>, McapError> {
    texts_are_within(opcode, body).ok_or(McapError::UnexpectedEof)?;
    mcap::parse_record(opcode, body)
}

/// By the table of records of the specification (mcap.dev/spec), as far as there are texts in them; `None` where one is not whole.
fn texts_are_within(opcode: u8, body: &[u8]) -> Option<()> {
    let mut rest = body;
    match opcode {
        op::HEADER => {
            block(&mut rest)?;
            block(&mut rest)?;
        }
        op::SCHEMA => {
            skip(&mut rest, 2)?;
            block(&mut rest)?;
            block(&mut rest)?;
        }
        op::CHANNEL => {
            skip(&mut rest, 4)?;
            block(&mut rest)?;
            block(&mut rest)?;
            let mut metadata = block(&mut rest)?;
            while !metadata.is_empty() {
                block(&mut metadata)?;
                block(&mut metadata)?;
            }
        }
        op::CHUNK_INDEX => {
            skip(&mut rest, 4 * 8)?;
            block(&mut rest)?;
            skip(&mut rest, 8)?;
            block(&mut rest)?;
        }
        _ => {}
    }
    Some(())
}

fn skip(rest: &mut &[u8], bytes: usize) -> Option<()> {
    *rest = rest.get(bytes..)?;
    Some(())
}

/// Bytes with their number in front.
fn block<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (length, after) = rest.split_first_chunk()?;
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    let (block, after) = after.split_at_checked(length)?;
    *rest = after;
    Some(block)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(text: &str) -> Vec<u8> {
        [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat()
    }

    /// A schema, a channel, a header, an index of a chunk: an MCAP file of 100 bytes took 4 GB.
    #[test]
    fn a_text_longer_than_its_record_is_refused_before_there_is_room_for_it() {
        let (id, a, b) = (vec![1, 0], text("a"), text("bc"));
        let metadata = [text("key"), text("value")].concat();
        let counted = [(metadata.len() as u32).to_le_bytes().to_vec(), metadata].concat();
        let records = [
            (op::HEADER, [a.clone(), b.clone()].concat()),
            (op::SCHEMA, [id.clone(), a.clone(), b.clone(), text("data")].concat()),
            (op::CHANNEL, [id.clone(), id, a.clone(), b, counted].concat()),
            (op::CHUNK_INDEX, [vec![0; 32], vec![0; 4], vec![0; 8], a, vec![0; 16]].concat()),
        ];
        for (opcode, whole) in records {
            assert!(parse(opcode, &whole).is_ok(), "{opcode}");
            let length_of = |text: &str| {
                let text = text.as_bytes();
                whole.windows(text.len()).position(|part| part == text).map(|at| at - 4)
            };
            for at in ["a", "bc", "key", "value"].iter().filter_map(|text| length_of(text)) {
                let mut claims = whole.clone();
                claims[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
                let refused = parse(opcode, &claims);
                assert!(matches!(refused, Err(McapError::UnexpectedEof)), "{opcode} {at}");
            }
            for length in 0..whole.len() {
                let _ = parse(opcode, &whole[..length]);
            }
        }
    }
}
