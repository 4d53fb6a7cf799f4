//! Bytes as text in a page: four bytes in five characters, where base64 takes three in four.
//!
//! The method is that of Ascii85 (btoa, Rutter 1984), the characters are those that stand for themselves in an element `script`.

/// Characters of a group of bytes.
const CHARACTERS: usize = 5;
/// Bytes of a group.
const BYTES: usize = 4;
/// The characters are those from this one on but `<`, with which the element could end, and the backslash: 85.
const FIRST: u8 = b'(';

/// The bytes as text. A last group of fewer bytes has one character more than bytes.
pub(crate) fn as_text(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len().div_ceil(BYTES) * CHARACTERS);
    for group in bytes.chunks(BYTES) {
        let mut padded = [0; BYTES];
        padded[..group.len()].copy_from_slice(group);
        let mut value = u32::from_be_bytes(padded);
        let mut digits = [0; CHARACTERS];
        for digit in digits.iter_mut().rev() {
            *digit = (value % 85) as u8;
            value /= 85;
        }
        text.extend(digits.iter().take(group.len() + 1).map(|digit| char::from(character(*digit))));
    }
    text
}

fn character(digit: u8) -> u8 {
    let skipped = u8::from(FIRST + digit >= b'<');
    let skipped = skipped + u8::from(FIRST + digit + skipped >= b'\\');
    FIRST + digit + skipped
}

/// What the page reads: the plain twin of `bytesOf` in `page/src/payload.js`.
#[cfg(test)]
pub(crate) fn bytes_of(text: &str) -> Vec<u8> {
    let digit = |character: u8| {
        u64::from(character - FIRST - u8::from(character > b'<') - u8::from(character > b'\\'))
    };
    let group = |group: &[u8]| {
        let padded = group.iter().copied().map(digit).chain(std::iter::repeat(84)).take(CHARACTERS);
        let value = padded.fold(0, |value, digit| value * 85 + digit);
        (value as u32).to_be_bytes().into_iter().take(group.len() - 1)
    };
    text.as_bytes().chunks(CHARACTERS).flat_map(group).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn every_digit_has_a_character_of_its_own_that_ends_no_element() {
        let mut characters: Vec<u8> = (0..85).map(character).collect();
        assert!(characters.iter().all(|of| of.is_ascii_graphic() && !b"<\\&'\"".contains(of)));
        characters.dedup();
        assert_eq!((characters.len(), characters.last()), (85, Some(&b'~')));
    }

    proptest! {
        #[test]
        fn any_bytes_come_back(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
            let text = as_text(&bytes);
            prop_assert_eq!(text.len(), bytes.len() + bytes.len().div_ceil(4));
            prop_assert_eq!(bytes_of(&text), bytes);
        }
    }
}
