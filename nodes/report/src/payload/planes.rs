//! Numbers as differences of neighbours, their bytes in planes: what deflate makes little of.

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
pub fn push_differences_8(bytes: &mut Vec<u8>, values: impl Iterator<Item = u8>) {
    let mut before = 0_u8;
    bytes.extend(values.map(|value| value.wrapping_sub(std::mem::replace(&mut before, value))));
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
