//! The body of `DATA binary_compressed`: all values of a field one after the other, then those of the next field, compressed as
//! LibLZF does. <http://oldhome.schmorp.de/marc/liblzf.html>

use crate::point_file::PointFileError;

/// Shorter ones are of literal bytes: their number less one.
const FIRST_COPY: u8 = 1 << 5;
/// The length of a copy, in the upper three bits, that is followed by a byte with the rest of it.
const LONG_COPY: usize = 7;
/// A copy has so many bytes more than its length says.
const SHORTEST_COPY: usize = 2;

/// The records of a body, each with its fields of these sizes.
pub(super) fn records(
    body: &[u8],
    field_bytes: &[usize],
    points: usize,
) -> Result<Vec<u8>, PointFileError> {
    let record_bytes = field_bytes.iter().fold(0_usize, |sum, bytes| sum.saturating_add(*bytes));
    let stated = record_bytes.saturating_mul(points);
    let damaged = |found| PointFileError::Compressed { stated, found };
    let (Some(compressed), Some(uncompressed)) = (length(body, 0), length(body, 4)) else {
        return Err(damaged(0));
    };
    if uncompressed != stated {
        return Err(damaged(uncompressed));
    }
    let compressed = body.get(8..).and_then(|bytes| bytes.get(..compressed));
    let compressed = compressed.ok_or(damaged(0))?;
    let columns = decompressed(compressed, stated).map_err(damaged)?;
    let mut records = vec![0; stated];
    let mut rest = columns.as_slice();
    let mut offset = 0;
    for &bytes in field_bytes.iter().filter(|bytes| **bytes > 0) {
        let (column, behind) =
            rest.split_at_checked(bytes.saturating_mul(points)).ok_or(damaged(0))?;
        rest = behind;
        for (record, value) in
            records.chunks_exact_mut(record_bytes).zip(column.chunks_exact(bytes))
        {
            if let Some(place) = record.get_mut(offset..offset + bytes) {
                place.copy_from_slice(value);
            }
        }
        offset += bytes;
    }
    Ok(records)
}

fn length(body: &[u8], offset: usize) -> Option<usize> {
    let bytes = body.get(offset..)?.first_chunk()?;
    usize::try_from(u32::from_le_bytes(*bytes)).ok()
}

/// The bytes that were compressed, `stated` of them; or how many were found.
fn decompressed(mut from: &[u8], stated: usize) -> Result<Vec<u8>, usize> {
    // It grows with what is read: the header may state any number.
    let mut to: Vec<u8> = Vec::new();
    while let Some((&control, behind)) = from.split_first() {
        from = behind;
        if control < FIRST_COPY {
            let literal = from.split_at_checked(usize::from(control) + 1);
            let Some((literal, behind)) = literal else { return Err(to.len()) };
            to.extend_from_slice(literal);
            from = behind;
        } else {
            let mut length = usize::from(control >> 5);
            if length == LONG_COPY {
                let Some((&more, behind)) = from.split_first() else { return Err(to.len()) };
                (length, from) = (length + usize::from(more), behind);
            }
            let Some((&low, behind)) = from.split_first() else { return Err(to.len()) };
            from = behind;
            let back = (usize::from(control & (FIRST_COPY - 1)) << 8) + usize::from(low) + 1;
            let Some(start) = to.len().checked_sub(back) else { return Err(to.len()) };
            // It may copy what it has just written.
            for place in start..start + length + SHORTEST_COPY {
                to.extend(to.get(place).copied());
            }
        }
        if to.len() > stated {
            return Err(to.len());
        }
    }
    if to.len() == stated { Ok(to) } else { Err(to.len()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_may_reach_into_what_they_write() {
        // "ab", then seven bytes from two before; then 267 bytes from one before.
        assert_eq!(decompressed(&[1, b'a', b'b', 5 << 5, 1], 9).unwrap(), b"ababababa");
        let long = decompressed(&[0, 7, 0xe0, 255, 0], 265).unwrap();
        assert_eq!(long, [7; 265]);
    }

    #[test]
    fn what_is_cut_off_or_reaches_before_the_start_is_damaged() {
        for (bytes, found) in [
            (&[3, 1, 2][..], 0),
            (&[0, 1, 32, 1][..], 1),
            (&[0, 1, 0xe0][..], 1),
            (&[0, 1, 32][..], 1),
            (&[0, 1, 32, 0, 32, 0][..], 4),
        ] {
            assert_eq!(decompressed(bytes, 3), Err(found), "{bytes:?}");
        }
    }
}
