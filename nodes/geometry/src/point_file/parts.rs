//! What is written of points.

use nalgebra::{Point3, Vector3};

/// What there is to write of points: normals and colours only where there is one for each of them.
pub(crate) struct Parts<'a> {
    points_m: &'a [Point3<f32>],
    pub(crate) normals: Option<&'a [Vector3<f32>]>,
    pub(crate) colours: Option<&'a [[u8; 3]]>,
}

impl<'a> Parts<'a> {
    pub(crate) fn of(
        points_m: &'a [Point3<f32>],
        normals: &'a [Vector3<f32>],
        colours: &'a [[u8; 3]],
    ) -> Self {
        let count = points_m.len();
        let has = |parts: usize| count > 0 && parts == count;
        Self {
            points_m,
            normals: has(normals.len()).then_some(normals),
            colours: has(colours.len()).then_some(colours),
        }
    }

    /// Appends each point with what it has; `append_colour` writes a colour.
    pub(crate) fn append(
        &self,
        bytes: &mut Vec<u8>,
        append_colour: impl Fn(&mut Vec<u8>, [u8; 3]),
    ) {
        bytes.reserve(self.points_m.len() * 7 * size_of::<f32>());
        for (index, point_m) in self.points_m.iter().enumerate() {
            let normal = self.normals.and_then(|normals| normals.get(index));
            for value in point_m.iter().chain(normal.into_iter().flat_map(|normal| normal.iter())) {
                bytes.extend_from_slice(&value.to_le_bytes());
            }
            if let Some(colour) = self.colours.and_then(|colours| colours.get(index)) {
                append_colour(bytes, *colour);
            }
        }
    }
}
