//! Which object each pixel shows.

use crate::Stamp;

/// For each pixel of a camera the number of the object that it shows: the truth that a simulator
/// writes beside its images, or a mask of a recording.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LabelImage {
    /// When the image was taken.
    pub stamp: Stamp,
    /// The optical frame that it was taken in.
    pub frame_id: String,
    width_px: usize,
    height_px: usize,
    object_ids: Vec<u16>,
}

/// The labels do not make up an image of the stated size.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("a label image of {width_px} x {height_px} pixels cannot hold {labels} labels")]
pub struct LabelSizeError {
    /// The stated width.
    pub width_px: usize,
    /// The stated height.
    pub height_px: usize,
    /// How many labels there are.
    pub labels: usize,
}

impl LabelImage {
    /// The static scene.
    pub const STATIC: u16 = 0;

    /// An image of `width_px * height_px` labels, row by row: 0 for the static scene, otherwise the
    /// number of the object.
    ///
    /// # Errors
    /// When the number of labels is another.
    pub fn new(
        stamp: Stamp,
        frame_id: String,
        (width_px, height_px): (usize, usize),
        object_ids: Vec<u16>,
    ) -> Result<Self, LabelSizeError> {
        if width_px.checked_mul(height_px) == Some(object_ids.len()) {
            Ok(Self { stamp, frame_id, width_px, height_px, object_ids })
        } else {
            Err(LabelSizeError { width_px, height_px, labels: object_ids.len() })
        }
    }

    /// Columns.
    #[must_use]
    pub fn width_px(&self) -> usize {
        self.width_px
    }

    /// Rows.
    #[must_use]
    pub fn height_px(&self) -> usize {
        self.height_px
    }

    /// The labels, row by row; 0 for the static scene.
    #[must_use]
    pub fn object_ids(&self) -> &[u16] {
        &self.object_ids
    }

    /// The label of a pixel; `None` outside the image.
    #[must_use]
    pub fn object_id(&self, column_px: usize, row_px: usize) -> Option<u16> {
        if column_px >= self.width_px || row_px >= self.height_px {
            return None;
        }
        self.object_ids.get(row_px * self.width_px + column_px).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(
        width_px: usize,
        height_px: usize,
        labels: usize,
    ) -> Result<LabelImage, LabelSizeError> {
        let object_ids = (0..labels as u16).collect();
        LabelImage::new(Stamp::default(), "camera".to_owned(), (width_px, height_px), object_ids)
    }

    #[test]
    fn labels_lie_row_by_row() {
        let image = image(3, 2, 6).unwrap();
        assert_eq!(image.object_id(0, 0), Some(LabelImage::STATIC));
        assert_eq!((image.object_id(2, 0), image.object_id(0, 1)), (Some(2), Some(3)));
        assert_eq!((image.object_id(3, 0), image.object_id(0, 2)), (None, None));
        assert_eq!((image.width_px(), image.height_px(), image.object_ids().len()), (3, 2, 6));
    }

    #[test]
    fn a_size_that_the_labels_do_not_fill_is_refused() {
        for (width_px, height_px) in [(2, 2), (6, 2), (usize::MAX, usize::MAX), (0, 6)] {
            let error = image(width_px, height_px, 6).unwrap_err();
            assert_eq!(error, LabelSizeError { width_px, height_px, labels: 6 });
        }
    }
}
