//! Numbers as differences of neighbours, their bytes in planes: what deflate makes little of.

/// Parts of colours of 8 bits that are one shade.
const COLOURS_IN_SHADE: u8 = 4;

/// Appends numbers of 16 bits: first the low bytes of all differences, then the high ones. A difference is folded (0, -1, 1, -2, ...), so
/// that small ones of either sign have a high byte of 0.
pub fn push_differences_16(bytes: &mut Vec<u8>, values: impl Iterator<Item = u16>) {
    let mut high = Vec::new();
    let mut before = 0;
    for value in values {
        let difference = value.wrapping_sub(before).cast_signed();
        before = value;
        let folded = (difference << 1 ^ difference >> 15).cast_unsigned();
        let [low, upper] = folded.to_le_bytes();
        bytes.push(low);
        high.push(upper);
    }
    bytes.append(&mut high);
}

/// Appends the differences of numbers of 8 bits.
fn push_differences_8(bytes: &mut Vec<u8>, values: impl Iterator<Item = u8>) {
    let mut before = 0_u8;
    bytes.extend(values.map(|value| value.wrapping_sub(std::mem::replace(&mut before, value))));
}

/// Appends colours (red, green, blue), each part in 64 shades, which no eye tells from 256 on points: first green, then by how much red and blue are more.
pub fn push_colours(bytes: &mut Vec<u8>, colours: impl Iterator<Item = [u8; 3]> + Clone) {
    let shades = colours.map(|colour| colour.map(|part| part / COLOURS_IN_SHADE));
    push_differences_8(bytes, shades.clone().map(|[_, green, _]| green));
    push_differences_8(bytes, shades.clone().map(|[red, green, _]| red.wrapping_sub(green)));
    push_differences_8(bytes, shades.map(|[_, green, blue]| blue.wrapping_sub(green)));
}

/// Appends the numbers of an image, row by row, each less what its neighbours to the left and above let expect: the median of the two and of their
/// sum less the one between them, which follows edges and slopes (Weinberger, Seroussi and Sapiro 2000).
pub fn push_image_8(bytes: &mut Vec<u8>, columns: usize, values: &[u8]) {
    let columns = columns.max(1);
    bytes.extend(values.iter().enumerate().map(|(at, value)| {
        let before = |back: usize| at.checked_sub(back).map_or(0, |at| values[at]);
        let expected = match (at % columns, at < columns) {
            (0, _) => before(columns),
            (_, true) => before(1),
            _ => expected(before(1), before(columns), before(columns + 1)),
        };
        value.wrapping_sub(expected)
    }));
}

fn expected(left: u8, above: u8, between: u8) -> u8 {
    let (least, most) = (left.min(above), left.max(above));
    if between >= most {
        least
    } else if between <= least {
        most
    } else {
        // Between the two, and so of 8 bits.
        left.wrapping_add(above).wrapping_sub(between)
    }
}

/// Appends a number, seven bits a byte, the lowest first; the upper bit says that another byte follows.
pub fn push_varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value > 0x7f {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_of_a_slope_and_an_edge_is_nearly_all_zeros() {
        let columns = 8;
        let value = |at: usize| match (at % columns, at / columns) {
            (column, row) if column < 4 => (20 + 3 * column - 2 * row) as u8,
            (_, row) => 200 - row as u8,
        };
        let values: Vec<u8> = (0..64).map(value).collect();
        let mut bytes = Vec::new();
        push_image_8(&mut bytes, columns, &values);
        assert_eq!(bytes[..4], [20, 3, 3, 3]);
        assert!(bytes[columns..].iter().filter(|byte| **byte == 0).count() > 40, "{bytes:?}");
        // What the page reads: the plain twin of `Reader.image8`.
        let mut read: Vec<u8> = Vec::new();
        for (at, byte) in bytes.iter().enumerate() {
            let expected = match at {
                0 => 0,
                at if at < columns => read[at - 1],
                at if at % columns == 0 => read[at - columns],
                at => expected(read[at - 1], read[at - columns], read[at - columns - 1]),
            };
            read.push(byte.wrapping_add(expected));
        }
        assert_eq!(read, values);
        push_image_8(&mut bytes, 0, &[]);
    }

    #[test]
    fn small_steps_of_either_sign_have_small_bytes() {
        let mut bytes = Vec::new();
        push_differences_16(&mut bytes, [0, 1, 0, 65_535, 0, 32_768].into_iter());
        assert_eq!(bytes, [0, 2, 1, 1, 2, 255, 0, 0, 0, 0, 0, 255]);
        bytes.clear();
        push_differences_8(&mut bytes, [5, 4, 255, 0].into_iter());
        assert_eq!(bytes, [5, 255, 251, 1]);
        bytes.clear();
        [0, 127, 128, 300].into_iter().for_each(|value| push_varint(&mut bytes, value));
        assert_eq!(bytes, [0, 127, 0x80, 1, 0xac, 2]);
    }
}
