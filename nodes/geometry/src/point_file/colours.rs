//! The colours in the records of a file.

use super::{Encoding, PointFileError, RecordLayout, Scalar, shortened};

impl RecordLayout {
    /// The colour of each record; none where they have none.
    pub(super) fn colours(
        &self,
        encoding: Encoding,
        body: &[u8],
        stated: usize,
    ) -> Result<Vec<[u8; 3]>, PointFileError> {
        if let [Some(red), Some(green), Some(blue)] = self.colour {
            let records = self.records([red, green, blue], encoding, body, stated)?;
            // Whole numbers of a byte; the casts saturate.
            return Ok(records.into_iter().map(|parts| parts.map(|part| part as u8)).collect());
        }
        let Some((offset, column, scalar)) = self.packed_colour else { return Ok(Vec::new()) };
        let unpacked = |bits: u32| {
            let [blue, green, red, _] = bits.to_le_bytes();
            [red, green, blue]
        };
        if encoding == Encoding::BinaryLittleEndian {
            let records = body.chunks_exact(self.bytes.max(1)).take(stated);
            let bits = records.map(|record| {
                let bytes = record.get(offset..).and_then(|bytes| bytes.first_chunk());
                u32::from_le_bytes(bytes.copied().unwrap_or_default())
            });
            return Ok(bits.map(unpacked).collect());
        }
        let text = String::from_utf8_lossy(body);
        let lines = text.lines().filter(|line| !line.trim().is_empty()).take(stated);
        let bits = lines.enumerate().map(|(point, line)| {
            let word = line.split_ascii_whitespace().nth(column).unwrap_or_default();
            // PCL writes the bits as a whole number, older versions with the type of a float. A float that is written as such stands for
            // its bits, and is too small, or none at all (alpha 255), to be taken for a whole number.
            let float = || word.parse::<f32>().ok().map(f32::to_bits);
            let whole = word.parse::<i64>().ok().map(|bits| bits as u32);
            let bits = whole.or_else(|| (scalar == Scalar::F32).then(float).flatten());
            bits.ok_or_else(|| PointFileError::Number { point, text: shortened(word) })
        });
        bits.map(|bits| bits.map(unpacked)).collect()
    }
}
