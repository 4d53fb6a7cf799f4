//! Lines and dots on a square of pixels.

/// A picture.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Picture {
    /// Columns and rows.
    pub edge_px: usize,
    /// Red, green and blue of each pixel, row by row.
    pub rgb: Vec<u8>,
}

pub(super) struct Canvas {
    picture: Picture,
}

impl Canvas {
    pub(super) fn new(edge_px: usize, background: [u8; 3]) -> Self {
        Self { picture: Picture { edge_px, rgb: background.repeat(edge_px * edge_px) } }
    }

    pub(super) fn into_picture(self) -> Picture {
        self.picture
    }

    fn set(&mut self, column: i64, row: i64, colour: [u8; 3]) {
        let edge = self.picture.edge_px as i64;
        if !(0..edge).contains(&column) || !(0..edge).contains(&row) {
            return;
        }
        let start = (row * edge + column) as usize * 3;
        if let Some(pixel) = self.picture.rgb.get_mut(start..start + 3) {
            pixel.copy_from_slice(&colour);
        }
    }

    /// A disc with this radius in pixels about a pixel.
    pub(super) fn dot(&mut self, at_px: [f64; 2], radius_px: i64, colour: [u8; 3]) {
        // The float-to-int cast saturates.
        let [column, row] = at_px.map(|value| value.floor() as i64);
        for down in -radius_px..=radius_px {
            for right in -radius_px..=radius_px {
                if down * down + right * right <= radius_px * radius_px {
                    self.set(column.saturating_add(right), row.saturating_add(down), colour);
                }
            }
        }
    }

    /// A line as thick as its dots; what is outside of the picture costs nothing.
    pub(super) fn line(
        &mut self,
        from_px: [f64; 2],
        to_px: [f64; 2],
        radius_px: i64,
        colour: [u8; 3],
    ) {
        let Some([from_px, to_px]) = self.within(from_px, to_px) else { return };
        let steps =
            (to_px[0] - from_px[0]).abs().max((to_px[1] - from_px[1]).abs()).ceil().max(1.0);
        for step in 0..=steps as u32 {
            let share = f64::from(step) / steps;
            let at = |axis: usize| from_px[axis] + share * (to_px[axis] - from_px[axis]);
            self.dot([at(0), at(1)], radius_px, colour);
        }
    }

    /// The part of a line that lies in the picture (Liang and Barsky 1984).
    fn within(&self, from_px: [f64; 2], to_px: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        let edge_px = self.picture.edge_px as f64;
        let (mut first, mut last) = (0.0_f64, 1.0_f64);
        for axis in 0..2 {
            let step_px = to_px[axis] - from_px[axis];
            if !step_px.is_finite() {
                return None;
            }
            for (towards, room_px) in
                [(-step_px, from_px[axis]), (step_px, edge_px - from_px[axis])]
            {
                if towards == 0.0 {
                    if room_px < 0.0 {
                        return None;
                    }
                } else if towards < 0.0 {
                    first = first.max(room_px / towards);
                } else {
                    last = last.min(room_px / towards);
                }
            }
        }
        let at = |share: f64| {
            std::array::from_fn(|axis| from_px[axis] + share * (to_px[axis] - from_px[axis]))
        };
        (first <= last).then(|| [at(first), at(last)])
    }

    /// A line from place to place.
    pub(super) fn trajectory(&mut self, places_px: &[[f64; 2]], radius_px: i64, colour: [u8; 3]) {
        for pair in places_px.windows(2) {
            if let [from, to] = pair {
                self.line(*from, *to, radius_px, colour);
            }
        }
    }

    /// A filled triangle.
    pub(super) fn triangle(&mut self, corners_px: [[f64; 2]; 3], colour: [u8; 3]) {
        let edge_px = self.picture.edge_px as f64;
        let bound = |axis: usize, pick: fn(f64, f64) -> f64| {
            let [a, b, c] = corners_px.map(|corner| corner[axis]);
            pick(pick(a, b), c).clamp(0.0, edge_px) as i64
        };
        let side = |from: [f64; 2], to: [f64; 2], at: [f64; 2]| {
            (to[0] - from[0]) * (at[1] - from[1]) - (to[1] - from[1]) * (at[0] - from[0])
        };
        let [a, b, c] = corners_px;
        for row in bound(1, f64::min)..=bound(1, f64::max) {
            for column in bound(0, f64::min)..=bound(0, f64::max) {
                let at = [column as f64 + 0.5, row as f64 + 0.5];
                let sides = [side(a, b, at), side(b, c, at), side(c, a, at)];
                if sides.iter().all(|side| *side >= 0.0) || sides.iter().all(|side| *side <= 0.0) {
                    self.set(column, row, colour);
                }
            }
        }
    }
}
