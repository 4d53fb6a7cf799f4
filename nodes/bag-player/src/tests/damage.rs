//! Damaged bags: everything that can be read is, and what cannot is reported.

use std::path::Path;

use mcap::{Compression, WriteOptions};
use proptest::prelude::*;

use super::samples::{on_disk, texts_in_chunks};
use super::{committed, every_encoding, read_all};
use crate::{Bag, BagError, BagMessage, Loss, LossKind, Selection};

const CHUNKS: &[&[(&str, u64)]] =
    &[&[("/a", 1), ("/b", 2), ("/a", 3)], &[("/a", 4), ("/b", 5)], &[("/a", 6), ("/a", 7)]];

fn every_compression() -> [(&'static str, WriteOptions); 4] {
    let plain = || WriteOptions::new().compression(None);
    [
        ("zstd", WriteOptions::new().compression(Some(Compression::Zstd))),
        ("lz4", WriteOptions::new().compression(Some(Compression::Lz4))),
        ("plain", plain()),
        ("unchunked", plain().use_chunks(false)),
    ]
}

fn read(bytes: &[u8]) -> Result<(Vec<BagMessage>, Vec<Loss>), BagError> {
    let (_folder, path) = on_disk(bytes);
    read_all(&Bag::open(&path)?, &Selection::default())
}

fn times(messages: &[BagMessage]) -> Vec<i64> {
    messages.iter().map(|message| message.log_time.as_nanos()).collect()
}

/// Where the chunks of a bag are.
fn chunk_extents(bytes: &[u8]) -> Vec<(usize, usize)> {
    let mut chunks = mcap::Summary::read(bytes).unwrap().unwrap().chunk_indexes;
    chunks.sort_by_key(|chunk| chunk.chunk_start_offset);
    chunks
        .iter()
        .map(|chunk| {
            let start = chunk.chunk_start_offset as usize;
            (start, start + chunk.chunk_length as usize)
        })
        .collect()
}

#[test]
fn wherever_a_bag_is_cut_its_beginning_is_read_and_the_cut_reported() {
    for (form, options) in every_compression() {
        let whole = texts_in_chunks(options, CHUNKS);
        let (all, _) = read(&whole).unwrap();
        let mut most = 0;
        for length in 8..whole.len() {
            let (messages, losses) = read(&whole[..length]).unwrap();
            assert_eq!(messages, all[..messages.len()], "{form} cut at {length}");
            assert!(messages.len() >= most, "{form}: {length} bytes give less than fewer bytes");
            most = messages.len();
            assert!(!losses.is_empty(), "{form} cut at {length}: nothing reported");
            let costly = losses.iter().any(Loss::costs_messages);
            assert!(costly || messages.len() == all.len(), "{form} cut at {length}: {losses:?}");
            for loss in &losses {
                assert!(matches!(loss.kind, LossKind::CutOff { .. }), "{form} {length}: {loss}");
                assert_eq!(loss.offset_bytes + loss.size_bytes, length as u64, "{form}: {loss}");
            }
        }
        assert_eq!(most, all.len(), "{form}: all of it before the summary is complete");
    }
}

#[test]
fn less_than_the_magic_bytes_is_no_bag() {
    let whole = texts_in_chunks(WriteOptions::new(), CHUNKS);
    assert!(matches!(read(&[]), Err(BagError::Empty { .. })));
    assert!(matches!(read(&whole[..7]), Err(BagError::NotABag { .. })));
}

#[test]
fn a_chunk_cut_in_the_middle_gives_the_messages_before_the_cut() {
    // One chunk of many messages: zstd and lz4 give what they have decoded up to the cut.
    let many: Vec<(&str, u64)> = (1..20_000).map(|time| ("/a", time)).collect();
    for (form, options) in every_compression() {
        let whole = texts_in_chunks(options, &[&many]);
        let (messages, losses) = read(&whole[..whole.len() / 2]).unwrap();
        let share = messages.len() as f64 / many.len() as f64;
        assert!(share > 0.3 && share < 0.7, "{form}: {share} of the messages of half the file");
        let [loss] = losses.as_slice() else { panic!("{form}: {losses:?}") };
        if form != "unchunked" {
            let recovered_messages = messages.len() as u64;
            assert_eq!(loss.kind, LossKind::CutOff { recovered_messages }, "{form}");
        }
    }
}

#[test]
fn any_flipped_bit_is_harmless_or_reported() {
    for (form, options) in every_compression().into_iter().take(3) {
        let whole = texts_in_chunks(options, CHUNKS);
        let (all, _) = read(&whole).unwrap();
        let chunks = chunk_extents(&whole);
        for position in 8..whole.len() {
            let mut altered = whole.clone();
            altered[position] ^= 1 << (position % 8);
            let (messages, losses) = read(&altered).unwrap();
            for message in &messages {
                assert!(all.contains(message), "{form}, byte {position}: an altered message");
            }
            if messages.len() != all.len() {
                assert!(!losses.is_empty(), "{form}, byte {position}: lost in silence");
                // The index leads on to the chunks behind the damage: one is lost at most.
                let hit = chunks.iter().position(|(start, end)| (*start..*end).contains(&position));
                let lost = all.len() - messages.len();
                let most = hit.map_or(0, |chunk| CHUNKS[chunk].len());
                assert!(lost <= most, "{form}, byte {position}: {lost} messages lost");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// When the power fails, the pages that were not on the disk yet are zeros, in whatever order they were written; the file
    /// may end anywhere. What was whole on the disk is read.
    #[test]
    fn a_power_cut_costs_what_was_not_on_the_disk_and_no_earlier_message(
        which in 0_usize..3,
        cut in any::<u32>(),
        lost_pages in proptest::collection::vec(0_usize..12, 0..6),
    ) {
        const PAGE: usize = 128;
        let (form, options) = every_compression()[which].clone();
        let rows: Vec<[(&str, u64); 2]> = (0..12).map(|at| [("/a", 2 * at), ("/b", 2 * at + 1)]).collect();
        let chunks: Vec<&[(&str, u64)]> = rows.iter().map(|row| &row[..]).collect();
        let whole = texts_in_chunks(options, &chunks);
        let (all, _) = read(&whole).unwrap();
        let extents = chunk_extents(&whole);
        let last_end = extents.last().unwrap().1;
        // At least a page: the file's first bytes are older than the power cut.
        let mut bytes = whole[..PAGE + cut as usize % (last_end - PAGE)].to_vec();
        let pages = bytes.len().div_ceil(PAGE);
        let mut first_lost = bytes.len();
        for back in lost_pages {
            let start = pages.saturating_sub(back + 1).max(1) * PAGE;
            let end = (start + PAGE).min(bytes.len());
            if start < end {
                bytes[start..end].fill(0);
                first_lost = first_lost.min(start);
            }
        }
        let on_disk = extents.iter().take_while(|(_, end)| *end <= first_lost).count();
        let (messages, losses) = read(&bytes).unwrap();
        prop_assert!(messages.len() >= 2 * on_disk, "{}: {} of {}", form, messages.len(), 2 * on_disk);
        prop_assert_eq!(&messages[..2 * on_disk], &all[..2 * on_disk]);
        // The checksum of a chunk is over all of it: where an uncompressed one is cut, its zeros cannot be told from a message.
        let is_told = |message| all.contains(message) || form == "plain";
        prop_assert!(messages.iter().all(is_told), "{}: a message that was never written", form);
        prop_assert!(!losses.is_empty(), "{}: lost in silence", form);
    }

    /// Whatever is written over a recorded file, however it is cut: reading ends, without a panic.
    #[test]
    fn any_damage_to_a_recorded_file_is_survived(
        which in 0_usize..5,
        edits in proptest::collection::vec((any::<u32>(), any::<u64>(), 1_usize..9), 1..6),
        cut in proptest::option::of(any::<u32>()),
    ) {
        let name = [
            "conformance/TenMessages-ch-chx-mx-pad-rch-rsh-st-sum.mcap",
            "conformance/TenMessages.mcap",
            "conformance/OneAttachment-ax-st-sum.mcap",
            "rosbag2/talker/talker.mcap",
            "rosbag2/multiple_files/multiple_files_2.mcap",
        ][which];
        let mut bytes = std::fs::read(committed(name)).unwrap();
        for (position, value, width) in edits {
            // The magic stays, or it would be no bag at all.
            let position = 8 + position as usize % (bytes.len() - 8);
            let end = (position + width).min(bytes.len());
            let value = value.to_le_bytes();
            bytes[position..end].copy_from_slice(&value[..end - position]);
        }
        if let Some(cut) = cut {
            bytes.truncate(8 + cut as usize % (bytes.len() - 8));
        }
        let (_folder, path) = on_disk(&bytes);
        let bag = Bag::open(&path).unwrap();
        let (messages, _) = read_all(&bag, &every_encoding()).unwrap();
        prop_assert!(messages.len() < 10_000);
        bag.info().unwrap();
        bag.check().unwrap();
    }
}

#[test]
fn a_damaged_chunk_is_reported_with_its_messages_and_the_rest_is_read() {
    let whole = texts_in_chunks(WriteOptions::new().compression(None), CHUNKS);
    let (start, end) = chunk_extents(&whole)[1];
    let mut altered = whole.clone();
    altered[end - 3] ^= 0x10;
    let (messages, losses) = read(&altered).unwrap();
    assert_eq!(times(&messages), [1, 2, 3, 6, 7]);
    let [loss] = losses.as_slice() else { panic!("{losses:?}") };
    assert!(matches!(loss.kind, LossKind::ChunkChecksum { .. }), "{loss}");
    assert_eq!(loss.messages, Some(2));
    assert_eq!((loss.offset_bytes, loss.size_bytes), (start as u64, (end - start) as u64));
    assert!(loss.to_string().ends_with("; 2 messages lost"), "{loss}");

    let (_folder, path) = on_disk(&altered);
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.info().unwrap().losses, [], "the index alone does not show it");
    let checked = bag.check().unwrap();
    assert_eq!(checked.message_count, 5);
    assert_eq!(checked.losses.len(), 1);
}

#[test]
fn an_unknown_compression_is_named() {
    let mut whole =
        texts_in_chunks(WriteOptions::new().compression(Some(Compression::Lz4)), CHUNKS);
    let (start, end) = chunk_extents(&whole)[0];
    let name = whole[start..end].windows(3).position(|bytes| bytes == b"lz4").unwrap() + start;
    whole[name..name + 3].copy_from_slice(b"xyz");
    let (messages, losses) = read(&whole).unwrap();
    assert_eq!(times(&messages), [4, 5, 6, 7]);
    assert!(
        losses[0].to_string().contains("Unsupported compression format `xyz`"),
        "{}",
        losses[0]
    );
}

#[test]
fn a_claim_to_decompress_to_more_than_possible_is_refused() {
    let mut whole = texts_in_chunks(WriteOptions::new(), &[&[("/a", 1)]]);
    let (start, _) = chunk_extents(&whole)[0];
    // The uncompressed size stands behind opcode, length and the two times.
    let size = start + 9 + 16;
    whole[size..size + 8].copy_from_slice(&(1_u64 << 62).to_le_bytes());
    let (messages, losses) = read(&whole).unwrap();
    assert_eq!(messages, []);
    assert!(losses[0].to_string().contains("claim to decompress to"), "{}", losses[0]);
}

#[test]
fn a_damaged_index_is_read_without() {
    let mut whole = texts_in_chunks(WriteOptions::new(), CHUNKS);
    let (all, _) = read(&whole).unwrap();
    let summary = whole.len() - 60;
    whole[summary] ^= 0xff;
    let (messages, losses) = read(&whole).unwrap();
    assert_eq!(messages, all);
    assert!(matches!(losses[0].kind, LossKind::Summary { .. }), "{:?}", losses[0]);
    assert!(!losses[0].costs_messages());
}

#[test]
fn a_tail_of_zeros_is_reported() {
    let whole = texts_in_chunks(WriteOptions::new(), CHUNKS);
    let (_, end) = *chunk_extents(&whole).last().unwrap();
    let mut altered = whole[..end].to_vec();
    altered.extend([0; 4096]);
    let (messages, losses) = read(&altered).unwrap();
    assert_eq!(times(&messages), [1, 2, 3, 4, 5, 6, 7]);
    let [loss] = losses.as_slice() else { panic!("{losses:?}") };
    assert!(matches!(loss.kind, LossKind::BadRecord { .. }), "{loss}");
    assert_eq!((loss.offset_bytes, loss.size_bytes), (end as u64, 4096));
}

#[test]
fn other_encodings_are_skipped_and_counted() -> Result<(), BagError> {
    let bag = Bag::open(&committed("conformance/TenMessages-ch.mcap"))?;
    let mut messages = bag.messages(&Selection::default())?;
    assert_eq!(messages.by_ref().count(), 0);
    let skipped = &messages.skipped()["example"];
    assert_eq!((skipped.encoding.as_str(), skipped.messages), ("a", 10));
    assert!(bag.info()?.to_string().contains("Example [a, not played]"));
    let (messages, _) = read_all(&bag, &every_encoding())?;
    let refused = messages[0].decode::<msgs::std_msgs::String>().unwrap_err().to_string();
    assert_eq!(refused, "topic example is encoded as `a`; only cdr (ROS 2) is decoded");
    Ok(())
}

#[test]
fn a_file_that_is_no_bag_is_named_with_the_fix() {
    let said = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
    assert!(said(b"").contains("is empty (0 bytes)"));
    assert!(
        said(b"#ROSBAG V2.0\n...").contains("as a bag of ROS 1: it does not begin as a bag does")
    );
    assert!(said(b"SQLite format 3\0...").contains("of the storage sqlite3: "));
    assert!(said(b"\x28\xb5\x2f\xfd....").contains("cannot be unpacked (zstd)"));
    assert!(said(b"version https://git-lfs.github.com/spec/v1").contains("git lfs pull"));
    assert!(said(b"hello, bag").contains("it begins with 68 65 6c 6c 6f 2c 20 62"));
    let missing = Bag::open(Path::new("/nowhere/bag.mcap")).unwrap_err().to_string();
    assert!(missing.starts_with("cannot open /nowhere/bag.mcap"), "{missing}");
}
