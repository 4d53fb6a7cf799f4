//! Databases that are damaged, or that no recorder wrote.

use std::fs;

use msgs::std_msgs::String as Text;
use rusqlite::Connection;

use super::read_all;
use super::samples::{database, insert, insert_text, on_disk, text};
use crate::{Bag, BagError, Loss, LossKind, OfferedQos, Selection};

/// A database of 400 texts, and the path of its folder.
fn recording(folder: &std::path::Path) -> std::path::PathBuf {
    let path = folder.join("bag.db3");
    let connection = database(&path, 4, OfferedQos::reliable(1));
    connection.execute_batch("BEGIN").unwrap();
    for time in 0..400 {
        insert_text(&connection, if time % 2 == 0 { "/a" } else { "/b" }, time);
    }
    connection.execute_batch("COMMIT").unwrap();
    path
}

#[test]
fn rows_that_make_no_sense_are_counted_and_the_others_read() -> Result<(), BagError> {
    let time = "its time is not a number of nanoseconds since 1970";
    let topic = "its topic is not in the table of topics";
    for (row, reason) in [
        ("1, NULL, x'00'", time),
        ("1, -1, x'00'", time),
        ("1, 'noon', x'00'", time),
        ("1, x'07', x'00'", time),
        ("1, 2.5, x'00'", time),
        ("1, 1e300, x'00'", time),
        ("3, 2, x'00'", topic),
        ("NULL, 2, x'00'", topic),
        ("'one', 2, x'00'", topic),
        ("1, 2, NULL", "its data is null, not a blob"),
        ("1, 2, 'text'", "its data is text, not a blob"),
        ("1, 2, 7", "its data is integer, not a blob"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag.db3");
        let connection = database(&path, 4, OfferedQos::reliable(1));
        for time in [1, 3] {
            insert_text(&connection, "/a", time);
        }
        for _ in 0..2 {
            let query = format!("INSERT INTO messages (topic_id, timestamp, data) VALUES ({row})");
            connection.execute(&query, []).unwrap();
        }
        let bag = Bag::open(&path)?;
        let (messages, losses) = read_all(&bag, &Selection::default())?;
        assert_eq!(messages.len(), 2, "{row}");
        let expected = [(Some(2), LossKind::BadMessages { reason: reason.into() })];
        let found = |losses: Vec<Loss>| -> Vec<_> {
            losses.into_iter().map(|loss| (loss.messages, loss.kind)).collect()
        };
        assert_eq!(found(losses), expected, "{row}");
        for info in [bag.info()?, bag.check()?] {
            assert_eq!(info.message_count, 2, "{row}");
            assert_eq!(found(info.losses), expected, "{row}");
        }
    }
    Ok(())
}

#[test]
fn a_damaged_frame_of_a_message_is_a_loss() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.db3");
    let connection = database(&path, 4, OfferedQos::reliable(1));
    insert_text(&connection, "/a", 1);
    insert(&connection, 1, 2, &[0x28, 0xb5, 0x2f, 0xfd, 1, 2, 3]);
    let (messages, losses) = read_all(&Bag::open(&path)?, &Selection::default())?;
    assert_eq!((messages.len(), losses.len(), losses[0].messages), (1, 1, Some(1)));
    assert!(losses[0].to_string().contains("its zstd frame is damaged"), "{}", losses[0]);
    Ok(())
}

#[test]
fn databases_that_are_no_bag_are_refused() {
    let endless = "CREATE VIEW messages AS WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) \
                   SELECT 1 AS topic_id, x AS timestamp, x'00' AS data FROM n";
    for (change, wanted) in [
        ("DROP TABLE messages", "no table `messages`"),
        ("DROP TABLE topics", "no table `topics`"),
        ("ALTER TABLE messages DROP COLUMN data", "`messages` has no column `data`"),
        ("ALTER TABLE topics RENAME COLUMN name TO title", "`topics` has no column `name`"),
        (&format!("DROP TABLE messages; {endless}"), "no table `messages`"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag.db3");
        database(&path, 4, OfferedQos::reliable(1)).execute_batch(change).unwrap();
        let refused = Bag::open(&path).unwrap_err().to_string();
        assert!(refused.contains(wanted) && refused.contains("bag.db3"), "{refused}");
    }
    let (_folder, header) = on_disk(b"SQLite format 3\0 and then a diary");
    let refused = Bag::open(&header).unwrap_err();
    assert!(matches!(refused, BagError::Database { .. }), "{refused}");
}

#[test]
fn a_topic_that_makes_no_sense_is_a_loss() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.db3");
    let connection = database(&path, 1, OfferedQos::reliable(1));
    connection.execute("INSERT INTO topics VALUES (3, x'ff', 'x', 'cdr')", []).unwrap();
    insert_text(&connection, "/a", 1);
    insert(&connection, 3, 1, &[0]);
    let (messages, losses) = read_all(&Bag::open(&path)?, &Selection::default())?;
    assert_eq!((messages.len(), losses.len()), (1, 2));
    Ok(())
}

#[test]
fn a_file_that_was_cut_is_read_as_far_as_it_goes() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let bytes = fs::read(recording(folder.path())).unwrap();
    let mut most = 0;
    for percent in (0..100).step_by(5) {
        let (_folder, path) = on_disk(&bytes[..bytes.len() * percent / 100]);
        match Bag::open(&path) {
            Ok(bag) => {
                let (messages, losses) = read_all(&bag, &Selection::default())?;
                let cut = |loss: &Loss| matches!(loss.kind, LossKind::CutOff { .. });
                assert!(losses.iter().any(cut), "{percent} %: {losses:?}");
                assert!(messages.len() < 400 && messages.len() >= most, "{percent} %");
                for message in &messages {
                    let time = message.log_time.as_nanos().unsigned_abs();
                    assert_eq!(
                        message.decode::<Text>()?,
                        text(&message.topic, time),
                        "{percent} %"
                    );
                }
                most = messages.len();
                let info = bag.info()?;
                assert_eq!(info.message_count, messages.len() as u64, "{percent} %");
                assert!(!info.losses.is_empty());
            }
            Err(BagError::Empty { .. }) => assert_eq!(percent, 0),
            Err(error) => assert!(
                percent < 30 && matches!(error, BagError::Database { .. }),
                "{percent} %: {error}"
            ),
        }
    }
    assert!(most > 200, "{most}");
    Ok(())
}

#[test]
fn a_compressed_file_that_was_cut_is_read_as_far_as_it_goes() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.db3");
    let connection = database(&path, 4, OfferedQos::reliable(1));
    connection.execute_batch("BEGIN").unwrap();
    for time in 0..4000 {
        insert_text(&connection, "/a", time);
    }
    connection.execute_batch("COMMIT").unwrap();
    let packed = zstd::encode_all(fs::read(path).unwrap().as_slice(), 1).unwrap();
    let (_folder, cut) = on_disk(&packed[..packed.len() * 4 / 5]);
    let (messages, losses) = read_all(&Bag::open(&cut)?, &Selection::default())?;
    assert!((500..4000).contains(&messages.len()), "{}", messages.len());
    let is_named = |loss: &Loss| matches!(loss.kind, LossKind::Compression { .. });
    assert!(
        losses.iter().any(is_named) && losses.iter().all(|loss| loss.file == cut),
        "{losses:?}"
    );
    Ok(())
}

#[test]
fn a_journal_that_was_left_is_said_and_not_rolled_back() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = recording(folder.path());
    let journal = folder.path().join("bag.db3-journal");
    fs::write(&journal, [7; 600]).unwrap();
    let (messages, losses) = read_all(&Bag::open(&path)?, &Selection::default())?;
    assert_eq!((messages.len(), losses.len()), (400, 1));
    assert!(losses[0].costs_messages(), "{}", losses[0]);
    assert!(losses[0].to_string().contains("its -journal file"), "{}", losses[0]);
    assert_eq!(fs::read(journal).unwrap(), [7; 600]);
    Ok(())
}

/// The pages of the index of times, by SQLite's own account.
fn index_pages(connection: &Connection) -> Vec<u64> {
    let root = "SELECT rootpage FROM sqlite_schema WHERE name = 'timestamp_idx'";
    vec![connection.query_row(root, [], |row| row.get::<_, i64>(0)).unwrap().unsigned_abs()]
}

#[test]
fn a_damaged_index_costs_no_message() -> Result<(), BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = recording(folder.path());
    let pages = index_pages(&Connection::open(&path).unwrap());
    let mut bytes = fs::read(&path).unwrap();
    for page in pages {
        let start = (page as usize - 1) * 4096;
        bytes[start..start + 4096].fill(0xff);
    }
    let (_folder, damaged) = on_disk(&bytes);
    let (messages, losses) = read_all(&Bag::open(&damaged)?, &Selection::default())?;
    assert_eq!(messages.len(), 400, "{losses:?}");
    assert!(!losses.is_empty() && losses.iter().all(|loss| !loss.costs_messages()), "{losses:?}");
    Ok(())
}

#[test]
fn a_damaged_page_is_a_loss_or_a_refusal_and_never_more_messages() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = fs::read(recording(folder.path())).unwrap();
    let mut partly = 0;
    for page in 0..bytes.len() / 4096 {
        for filling in [0, 0xff, 0x0d] {
            let mut damaged = bytes.clone();
            damaged[page * 4096 + 100..(page + 1) * 4096].fill(filling);
            if page > 0 {
                damaged[page * 4096..page * 4096 + 100].fill(filling);
            }
            let (_folder, path) = on_disk(&damaged);
            let Ok(bag) = Bag::open(&path) else { continue };
            let (messages, losses) = read_all(&bag, &Selection::default()).unwrap();
            let is_whole = messages.len() == 400;
            assert!(is_whole || !losses.is_empty(), "page {page}, {} messages", messages.len());
            assert!(messages.len() <= 400);
            partly += usize::from(!is_whole && !messages.is_empty());
            let _ = (bag.info().unwrap(), bag.check().unwrap());
        }
    }
    assert!(partly > 5, "{partly}");
}

#[test]
fn altered_bytes_cause_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = fs::read(recording(folder.path())).unwrap();
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = |below: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    for _ in 0..150 {
        let mut altered = bytes.clone();
        for _ in 0..20 {
            let at = 16 + random(altered.len() - 16);
            altered[at] = random(256) as u8;
        }
        let (_folder, path) = on_disk(&altered);
        if let Ok(bag) = Bag::open(&path) {
            let _ = bag.info().unwrap();
            let _ = read_all(&bag, &Selection::default()).unwrap();
        }
    }
}
