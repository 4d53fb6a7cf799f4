use proptest::prelude::*;

use super::*;

fn stream(pixels: &[u16]) -> Vec<u8> {
    let mut data = Vec::new();
    compress(pixels, &mut data);
    data
}

#[test]
fn a_stream_worked_out_by_hand_is_read_and_written() {
    // 2 zeros, 2 others: 5 (difference 5, folded 10 = 0o12: digits 2 and 1), 6 (1, folded 2);
    // 1 zero, 1 other: 4 (-2, folded 3). Nibbles: 2 2 A 1 2 1 1 3, the word 0x22A12113.
    let pixels = [0, 0, 5, 6, 0, 4];
    let data = [0x13, 0x21, 0xA1, 0x22];
    assert_eq!(stream(&pixels), data);
    assert_eq!(decompress(&data, 6), Ok(pixels.to_vec()));

    // No zeros, 3 others: 1500 (folded 3000 = 0o5670: digits 0, 7, 6, 5), 1499 (-1, folded 1), 1500
    // (folded 2). Nibbles: 0 3 8 F E 5 1 2.
    let pixels = [1500, 1499, 1500];
    let data = [0x12, 0xE5, 0x8F, 0x03];
    assert_eq!(stream(&pixels), data);
    assert_eq!(decompress(&data, 3), Ok(pixels.to_vec()));

    // 9 zeros (0o11: digits 1 and 1) and the count of the others that follow, none. Nibbles: 9 1 0.
    assert_eq!(stream(&[0; 9]), [0x00, 0x00, 0x00, 0x91]);
    assert_eq!(decompress(&[0x00, 0x00, 0x00, 0x91], 9), Ok(vec![0; 9]));
}

#[test]
fn the_count_behind_the_last_zeros_is_written_though_it_is_none() {
    // No zeros, 5 others: 3 (folded 6) and four times the same; 1 zero; the count of others, none, in
    // a word of its own. Readers that want it would read on behind the data without it.
    let data = [0x01, 0x00, 0x60, 0x05, 0x00, 0x00, 0x00, 0x00];
    assert_eq!(stream(&[3, 3, 3, 3, 3, 0]), data);
}

#[test]
fn the_largest_differences_take_six_digits() {
    // No zeros, 2 others: 65535 (folded 131070 = 0o377776), 1 (-65534, folded 131067 = 0o377773).
    // Nibbles: 0 2 E F F F F 3, B F F F F 3 0 0.
    let pixels = [65_535, 1];
    let data = [0xF3, 0xFF, 0xEF, 0x02, 0x00, 0xF3, 0xFF, 0xBF];
    assert_eq!(stream(&pixels), data);
    assert_eq!(decompress(&data, 2), Ok(pixels.to_vec()));
}

#[test]
fn writers_that_take_depths_as_signed_are_read() {
    // 40000 as a signed number is -25536, folded 51071 = 0o143577: digits 7 7 5 3 4 1.
    // Nibbles: 0 1 F F D B C 1.
    assert_eq!(decompress(&[0xC1, 0xDB, 0xFF, 0x01], 1), Ok(vec![40_000]));
}

#[test]
fn nothing_is_a_stream_too() {
    assert_eq!(stream(&[]), []);
    assert_eq!(decompress(&[], 0), Ok(Vec::new()));
}

#[test]
fn long_runs_are_counted_in_full() {
    let mut pixels = vec![0; 300_000];
    pixels.extend(vec![700; 300_000]);
    pixels.push(0);
    assert_eq!(decompress(&stream(&pixels), pixels.len()), Ok(pixels));
}

#[test]
fn data_behind_the_image_are_ignored() {
    let mut data = stream(&[3, 0, 4]);
    data.extend([0xFF; 9]);
    assert_eq!(decompress(&data, 3), Ok(vec![3, 0, 4]));
}

#[test]
fn damage_is_named_with_its_place() {
    // The image is larger than the stream.
    assert_eq!(
        decompress(&[0x13, 0x21, 0xA1, 0x22], 7),
        Err(RvlError::Ends { at_px: 6, pixels: 7 })
    );
    assert_eq!(decompress(&[], 1), Err(RvlError::Ends { at_px: 0, pixels: 1 }));
    // Smaller than its first runs: 2 zeros of 1; 2 others where 1 is left.
    let data = [0x13, 0x21, 0xA1, 0x22];
    assert_eq!(decompress(&data, 1), Err(RvlError::Run { at_px: 0, run: 2, pixels: 1 }));
    assert_eq!(decompress(&data, 3), Err(RvlError::Run { at_px: 2, run: 2, pixels: 3 }));
    // A difference of seven digits. Nibbles: 0 1 8 8 8 8 8 8, 1.
    let data = [0x88, 0x88, 0x88, 0x01, 0x00, 0x00, 0x00, 0x10];
    assert_eq!(decompress(&data, 1), Err(RvlError::Number { at_px: 0, most_digits: 6 }));
    // A run of ten digits, and one without end.
    let data = [0x88, 0x88, 0x88, 0x88, 0x00, 0x00, 0x00, 0x81];
    for data in [&data[..], &[0xFF; 40]] {
        assert_eq!(decompress(data, 1), Err(RvlError::Number { at_px: 0, most_digits: 9 }));
    }
    // The longest run that an image can have, of nine digits, and the image is smaller.
    let data = [0x88, 0x88, 0x88, 0x88, 0x00, 0x00, 0x00, 0x10];
    assert_eq!(decompress(&data, 9), Err(RvlError::Run { at_px: 0, run: 1 << 24, pixels: 9 }));
    // A number that the end of the stream cuts.
    assert_eq!(decompress(&[0xFF; 4], 1), Err(RvlError::Ends { at_px: 0, pixels: 1 }));
}

proptest! {
    #[test]
    fn any_image_comes_back(
        runs in proptest::collection::vec((0..20_usize, any::<u16>(), 0..700_u16), 0..60),
    ) {
        // Runs of one value, of small steps, and with zeros between them.
        let pixels: Vec<u16> = runs
            .iter()
            .flat_map(|(length, first, step)| {
                (0..*length as u16).map(|index| first.wrapping_add(index.wrapping_mul(*step)))
                    .chain(std::iter::repeat_n(0, usize::from(*step % 5)))
            })
            .collect();
        let data = stream(&pixels);
        prop_assert!(data.len().is_multiple_of(WORD_BYTES));
        prop_assert_eq!(decompress(&data, pixels.len()), Ok(pixels));
    }

    #[test]
    fn any_bytes_are_survived(
        data in proptest::collection::vec(any::<u8>(), 0..80),
        pixels in 0..400_usize,
    ) {
        match decompress(&data, pixels) {
            Ok(image) => prop_assert_eq!(image.len(), pixels),
            Err(RvlError::Ends { at_px, .. } | RvlError::Number { at_px, .. }) => {
                prop_assert!(at_px < pixels);
            }
            Err(RvlError::Run { at_px, run, .. }) => {
                prop_assert!(at_px < pixels && run as usize > pixels - at_px);
            }
        }
    }
}
