//! Rows of records in a block of bytes, as clouds and images have them.

use super::ConvertError;
use crate::sensor_msgs::PointCloud2;

/// Sizes as a message states them.
pub(super) struct StatedSizes {
    /// The type of the message.
    pub(super) message: &'static str,
    /// Records in a row.
    pub(super) width: u32,
    /// Rows.
    pub(super) height: u32,
    /// Bytes of a record, at least 1.
    pub(super) record_bytes: u32,
    /// Bytes from a row to the next.
    pub(super) step: u32,
}

impl From<&PointCloud2> for StatedSizes {
    fn from(message: &PointCloud2) -> Self {
        Self {
            message: "PointCloud2",
            width: message.width,
            height: message.height,
            record_bytes: message.point_step,
            step: message.row_step,
        }
    }
}

/// Rows that lie within their data.
pub(super) struct Rows<'data> {
    data: &'data [u8],
    step: usize,
    row_bytes: usize,
    records: usize,
}

impl<'data> Rows<'data> {
    /// The rows of `data`. Data behind the last row is left alone. A single row may leave its step 0,
    /// since nothing follows it.
    ///
    /// # Errors
    /// When the rows overlap, or the data is shorter than they are.
    pub(super) fn checked(data: &'data [u8], sizes: &StatedSizes) -> Result<Self, ConvertError> {
        let StatedSizes { message, width, height, record_bytes, step } = *sizes;
        if width == 0 || height == 0 {
            return Ok(Self { data: &[], step: 1, row_bytes: 1, records: 0 });
        }
        let row_bytes = u64::from(width) * u64::from(record_bytes.max(1));
        let step_bytes = if height == 1 && step == 0 { row_bytes } else { u64::from(step) };
        if step_bytes < row_bytes {
            return Err(ConvertError::RowStep { message, width, row_bytes, step });
        }
        let needed_bytes = u128::from(step_bytes) * u128::from(height);
        // Whatever fits into the data fits into a usize too.
        let data_bytes = data.len();
        let rows = usize::try_from(needed_bytes).ok().and_then(|needed| data.get(..needed));
        match (rows, usize::try_from(step_bytes), usize::try_from(row_bytes)) {
            (Some(rows), Ok(step), Ok(row_bytes)) => {
                let records = (rows.len() / step) * width as usize;
                Ok(Self { data: rows, step, row_bytes, records })
            }
            _ => {
                let step = step_bytes;
                Err(ConvertError::DataTooShort { message, height, step, needed_bytes, data_bytes })
            }
        }
    }

    /// How many records there are; each has its own bytes in the data.
    pub(super) fn records(&self) -> usize {
        self.records
    }

    /// Where each record of `record_bytes` begins in the data, row by row.
    pub(super) fn record_starts(&self, record_bytes: usize) -> impl Iterator<Item = usize> + use<> {
        let (step, row_bytes) = (self.step, self.row_bytes);
        let rows = self.data.len() / step;
        let in_row = move |row: usize| {
            (0..row_bytes / record_bytes.max(1)).map(move |at| row * step + at * record_bytes)
        };
        (0..rows).flat_map(in_row)
    }

    /// The rows without what pads them.
    pub(super) fn iter(&self) -> impl Iterator<Item = &'data [u8]> + use<'data> {
        let row_bytes = self.row_bytes;
        self.data.chunks_exact(self.step).filter_map(move |row| row.get(..row_bytes))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn sizes(width: u32, height: u32, record_bytes: u32, step: u32) -> StatedSizes {
        StatedSizes { message: "Test", width, height, record_bytes, step }
    }

    #[test]
    fn rows_come_without_their_padding() {
        let data = [1, 2, 3, 4, 9, 5, 6, 7, 8, 9, 0, 0];
        let rows = Rows::checked(&data, &sizes(2, 2, 2, 5)).unwrap();
        assert_eq!(rows.iter().collect::<Vec<_>>(), [[1, 2, 3, 4], [5, 6, 7, 8]]);
        assert_eq!(rows.records(), 4);
    }

    #[test]
    fn a_single_row_needs_no_step() {
        let rows = Rows::checked(&[1, 2, 3, 4], &sizes(2, 1, 2, 0)).unwrap();
        assert_eq!(rows.iter().collect::<Vec<_>>(), [[1, 2, 3, 4]]);
        assert!(Rows::checked(&[1, 2, 3, 4], &sizes(2, 1, 2, 3)).is_err());
    }

    #[test]
    fn sizes_that_overflow_are_only_too_large() {
        let huge = sizes(u32::MAX, u32::MAX, u32::MAX, 1);
        assert_eq!(
            Rows::checked(&[0; 8], &huge).err(),
            Some(ConvertError::RowStep {
                message: "Test",
                width: u32::MAX,
                row_bytes: 0xFFFF_FFFE_0000_0001,
                step: 1
            })
        );
        assert_eq!(
            Rows::checked(&[0; 8], &sizes(1, u32::MAX, 1, u32::MAX)).err(),
            Some(ConvertError::DataTooShort {
                message: "Test",
                height: u32::MAX,
                step: 0xFFFF_FFFF,
                needed_bytes: 0xFFFF_FFFE_0000_0001,
                data_bytes: 8
            })
        );
    }

    proptest! {
        #[test]
        fn no_more_records_than_bytes(
            data in proptest::collection::vec(any::<u8>(), 0..40),
            width in prop_oneof![0..9_u32, any::<u32>()],
            height in prop_oneof![0..9_u32, any::<u32>()],
            record_bytes in 1..9_u32,
            step in prop_oneof![0..40_u32, any::<u32>()],
        ) {
            let stated = sizes(width, height, record_bytes, step);
            if let Ok(rows) = Rows::checked(&data, &stated) {
                prop_assert!(rows.records() * record_bytes as usize <= data.len());
                prop_assert_eq!(rows.records() as u64, u64::from(width) * u64::from(height));
                let bytes: usize = rows.iter().map(<[u8]>::len).sum();
                prop_assert_eq!(bytes, rows.records() * record_bytes as usize);
            }
        }
    }
}
