//! Order, selection and memory, over chunks that overlap.

use mcap::{Compression, WriteOptions};
use msgs::std_msgs::String as Text;
use proptest::prelude::*;

use super::read_all;
use super::samples::{on_disk, text, texts_in_chunks};
use crate::{Bag, BagError, Selection};

const SECOND: u64 = 1_000_000_000;

/// All layouts to write the same messages: chunks compressed or not, with an index or without, no
/// chunks at all.
fn every_form() -> Vec<(&'static str, WriteOptions)> {
    let plain = || WriteOptions::new().compression(None);
    vec![
        ("zstd", WriteOptions::new().compression(Some(Compression::Zstd))),
        ("lz4", WriteOptions::new().compression(Some(Compression::Lz4))),
        ("plain", plain()),
        ("unchunked", plain().use_chunks(false)),
        ("no summary", plain().emit_summary_records(false)),
        ("no message index", WriteOptions::new().emit_message_indexes(false)),
        ("no chunk index", WriteOptions::new().emit_chunk_indexes(false)),
        ("no repeated channels", WriteOptions::new().repeat_channels(false).repeat_schemas(false)),
        ("no repeated schemas", WriteOptions::new().repeat_schemas(false)),
        ("no statistics", WriteOptions::new().emit_statistics(false)),
        ("no checksums", WriteOptions::new().calculate_chunk_crcs(false)),
    ]
}

/// Topic and time of what a selection gives.
fn times(bytes: &[u8], selection: &Selection) -> Result<Vec<(String, u64)>, BagError> {
    let (_folder, path) = on_disk(bytes);
    let (messages, losses) = read_all(&Bag::open(&path)?, selection)?;
    assert_eq!(losses, []);
    messages
        .iter()
        .map(|message| {
            let nanos = message.log_time.as_nanos() as u64;
            assert_eq!(message.decode::<Text>()?, text(&message.topic, nanos));
            Ok((message.topic.to_string(), nanos))
        })
        .collect()
}

const OVERLAPPING: &[&[(&str, u64)]] = &[
    &[("/a", SECOND), ("/b", 5 * SECOND), ("/a", 3 * SECOND)],
    &[("/b", 2 * SECOND), ("/a", 4 * SECOND), ("/b", 4 * SECOND)],
    &[("/c", 6 * SECOND), ("/a", 7 * SECOND)],
];

#[test]
fn overlapping_chunks_come_in_the_order_of_time() -> Result<(), BagError> {
    let expected =
        [("/a", 1), ("/b", 2), ("/a", 3), ("/a", 4), ("/b", 4), ("/b", 5), ("/c", 6), ("/a", 7)];
    for (form, options) in every_form() {
        let bytes = texts_in_chunks(options, OVERLAPPING);
        let found = times(&bytes, &Selection::default())?;
        let expected: Vec<_> =
            expected.map(|(topic, second)| (topic.to_owned(), second * SECOND)).into();
        assert_eq!(found, expected, "{form}");
    }
    Ok(())
}

#[test]
fn a_selection_of_time_and_topics_gives_just_that() -> Result<(), BagError> {
    let selection = Selection {
        topics: Some(vec!["a".into(), "/c".into()]),
        // From the first message at 1 s: 3.5 s up to 7 s, exclusive.
        start_s: Some(2.5),
        duration_s: Some(3.5),
        ..Selection::default()
    };
    for (form, options) in every_form() {
        let found = times(&texts_in_chunks(options, OVERLAPPING), &selection)?;
        let expected = [("/a".to_owned(), 4 * SECOND), ("/c".to_owned(), 6 * SECOND)];
        assert_eq!(found, expected, "{form}");
    }
    Ok(())
}

#[test]
fn a_topic_that_is_not_there_is_named_with_those_that_are() {
    let selection = Selection { topics: Some(vec!["/scan".into()]), ..Selection::default() };
    for (form, options) in every_form() {
        let refused = times(&texts_in_chunks(options, OVERLAPPING), &selection).unwrap_err();
        let refused = refused.to_string();
        assert!(refused.ends_with("has no topic /scan; it has: /a, /b, /c"), "{form}: {refused}");
    }
}

#[test]
fn channels_of_an_earlier_chunk_are_found() -> Result<(), BagError> {
    // The second chunk does not repeat the channels of the first, and nor does the summary.
    let chunks: &[&[(&str, u64)]] = &[&[("/a", SECOND)], &[("/a", 9 * SECOND)]];
    let options = || WriteOptions::new().repeat_channels(false).repeat_schemas(false);
    let selection = Selection { start_s: Some(5.0), ..Selection::default() };
    let found = times(&texts_in_chunks(options(), chunks), &selection)?;
    assert_eq!(found, [("/a".to_owned(), 9 * SECOND)]);
    Ok(())
}

#[test]
fn empty_chunks_do_not_make_the_bag_begin_in_1970() -> Result<(), BagError> {
    let chunks: &[&[(&str, u64)]] = &[&[], &[("/a", 9 * SECOND)], &[("/a", 10 * SECOND)]];
    let bytes = texts_in_chunks(WriteOptions::new().emit_summary_records(false), chunks);
    let selection = Selection { start_s: Some(1.0), ..Selection::default() };
    assert_eq!(times(&bytes, &selection)?, [("/a".to_owned(), 10 * SECOND)]);
    Ok(())
}

#[test]
fn a_full_window_gives_early_messages_late_and_counts_them() -> Result<(), BagError> {
    // The first chunk spans everything; the others lie within it.
    let chunks: &[&[(&str, u64)]] =
        &[&[("/a", 1), ("/a", 100)], &[("/a", 2), ("/a", 50)], &[("/a", 3), ("/a", 4)]];
    let (_folder, path) = on_disk(&texts_in_chunks(WriteOptions::new(), chunks));
    let order = |window: u64| -> Result<(Vec<i64>, u64), BagError> {
        let bag = Bag::open(&path)?.with_merge_window(window);
        let mut messages = bag.messages(&Selection::default())?;
        let times = messages
            .by_ref()
            .map(|message| Ok(message?.log_time.as_nanos()))
            .collect::<Result<Vec<i64>, BagError>>()?;
        Ok((times, messages.out_of_order()))
    };
    assert_eq!(order(1 << 20)?, (vec![1, 2, 3, 4, 50, 100], 0));
    let (mut bounded, out_of_order) = order(1)?;
    assert_eq!(bounded, [1, 100, 2, 50, 3, 4]);
    assert_eq!(out_of_order, 4);
    bounded.sort_unstable();
    assert_eq!(bounded, [1, 2, 3, 4, 50, 100], "nothing is lost by it");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever the chunks and the form: everything comes once, in the order of time, and equal times
    /// in the order of the file.
    #[test]
    fn everything_comes_once_and_in_order(
        chunks in proptest::collection::vec(
            proptest::collection::vec((0_usize..3, 1_u64..50), 0..8), 0..6),
        form in 0_usize..11,
    ) {
        let topics = ["/a", "/b", "/c"];
        let chunks: Vec<Vec<(&str, u64)>> = chunks
            .iter()
            .map(|chunk| chunk.iter().map(|(topic, time)| (topics[*topic], *time)).collect())
            .collect();
        let slices: Vec<&[(&str, u64)]> = chunks.iter().map(Vec::as_slice).collect();
        let (name, options) = every_form().swap_remove(form);
        let found = times(&texts_in_chunks(options, &slices), &Selection::default()).unwrap();
        let mut expected: Vec<(String, u64)> =
            chunks.concat().iter().map(|(topic, time)| ((*topic).to_owned(), *time)).collect();
        expected.sort_by_key(|message| message.1);
        prop_assert_eq!(found, expected, "{}", name);
    }
}
