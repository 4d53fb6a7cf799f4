//! rosbag2's own compression with zstd, of whole files or of single messages.

use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;

use crate::error::{BagError, Loss, LossKind};
use crate::message::CDR;
use crate::temporary::Temporary;

/// How a zstd frame begins (RFC 8878, 3.1.1).
pub(crate) const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// Largest content of a compressed file that is unpacked. rosbag2 splits the bags that it compresses; 64 GiB are
/// several hours of raw images.
const MAX_FILE_BYTES: u64 = 64 << 30;
/// The same for each byte of it: of images without a measurement zstd leaves a five thousandth, of a bag with anything in it not a
/// hundredth. A frame of 2 MB could have 64 GiB.
const MAX_FILE_RATIO: u64 = 1000;
/// However small it is, it may have this much.
const SMALL_FILE_BYTES: u64 = 1 << 30;

/// Largest content of a compressed message: one of 20 kB could have 600 MB. An image of 100 megapixels has 200 MB.
const MAX_MESSAGE_BYTES: u64 = 256 << 20;

/// The number of bytes that are unpacked at once.
const BLOCK_BYTES: usize = 128 << 10;

/// Unpacks a file that was compressed as a whole. Of one that is cut or damaged the part before the damage is returned, with
/// the loss.
pub(crate) fn unpack(
    path: &Path,
    goes_on: &dyn Fn() -> bool,
) -> Result<(Temporary, Option<Loss>), BagError> {
    let packed_bytes = std::fs::metadata(path).map_or(0, |metadata| metadata.len());
    unpack_at_most(path, most_bytes_of_file(packed_bytes), goes_on)
}

/// The content that a compressed file of so many bytes may have.
fn most_bytes_of_file(packed_bytes: u64) -> u64 {
    packed_bytes.saturating_mul(MAX_FILE_RATIO).clamp(SMALL_FILE_BYTES, MAX_FILE_BYTES)
}

fn unpack_at_most(
    path: &Path,
    limit_bytes: u64,
    goes_on: &dyn Fn() -> bool,
) -> Result<(Temporary, Option<Loss>), BagError> {
    let refused = |source| BagError::Open { path: path.to_owned(), source };
    let damaged = |reason: String| BagError::Compressed { path: path.to_owned(), reason };
    let file = File::open(path).map_err(refused)?;
    let packed_bytes = file.metadata().map_err(refused)?.len();
    let mut decoder =
        zstd::stream::read::Decoder::new(file).map_err(|error| damaged(error.to_string()))?;
    let temporary = Temporary::place_for(path)?;
    let mut unpacked =
        File::create(temporary.path()).map_err(|error| temporary.refused(path, error))?;
    let mut block = vec![0; BLOCK_BYTES];
    let mut unpacked_bytes = 0;
    loop {
        if !goes_on() {
            return Err(BagError::Interrupted { path: path.to_owned() });
        }
        let length = match decoder.read(&mut block) {
            Ok(0) => return Ok((temporary, None)),
            Ok(length) => length,
            Err(error) if unpacked_bytes == 0 => return Err(damaged(error.to_string())),
            Err(error) => {
                let loss = Loss {
                    file: path.to_owned(),
                    offset_bytes: 0,
                    size_bytes: packed_bytes,
                    messages: None,
                    kind: LossKind::Compression { reason: error.to_string() },
                };
                return Ok((temporary, Some(loss)));
            }
        };
        unpacked_bytes += length as u64;
        if unpacked_bytes > limit_bytes {
            let limit = format!("it unpacks to more than {} MiB", limit_bytes >> 20);
            return Err(damaged(limit));
        }
        let content = block.get(..length).unwrap_or(&block);
        unpacked.write_all(content).map_err(|error| temporary.refused(path, error))?;
    }
}

/// The content of a message, which may be a zstd frame: CDR begins with `00`, so the frame is recognised by its magic
/// number even without metadata.
pub(crate) fn message(encoding: &str, data: Vec<u8>) -> Result<Vec<u8>, String> {
    message_at_most(encoding, data, MAX_MESSAGE_BYTES)
}

fn message_at_most(encoding: &str, data: Vec<u8>, limit_bytes: u64) -> Result<Vec<u8>, String> {
    if encoding != CDR || !data.starts_with(&ZSTD_MAGIC) {
        return Ok(data);
    }
    let damaged = |error: std::io::Error| format!("its zstd frame is damaged: {error}");
    let mut content = Vec::new();
    zstd::stream::read::Decoder::new(data.as_slice())
        .map_err(damaged)?
        .take(limit_bytes.saturating_add(1))
        .read_to_end(&mut content)
        .map_err(damaged)?;
    if content.len() as u64 > limit_bytes {
        return Err(format!("it unpacks to more than {} MiB", limit_bytes >> 20));
    }
    Ok(content)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_beyond_the_limit_is_refused_and_leaves_no_temporary_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag.db3.zstd");
        std::fs::write(&path, zstd::encode_all(vec![7; 300_000].as_slice(), 1).unwrap()).unwrap();
        let refused = unpack_at_most(&path, 299_999, &|| true).unwrap_err().to_string();
        assert!(refused.contains("unpacks to more than"), "{refused}");
        let (whole, loss) = unpack_at_most(&path, 300_000, &|| true).unwrap();
        assert_eq!((std::fs::read(whole.path()).unwrap(), loss), (vec![7; 300_000], None));
        let interrupted = unpack_at_most(&path, 300_000, &|| false).unwrap_err();
        assert!(matches!(interrupted, BagError::Interrupted { .. }), "{interrupted}");
        let place = whole.path().to_owned();
        drop(whole);
        assert!(!place.exists() && !place.parent().unwrap().exists());
    }

    /// A frame of 20 kB had a gigabyte, and a file of 2 MB filled a disk.
    #[test]
    fn a_small_frame_does_not_unpack_without_bound() {
        let bomb = zstd::encode_all(vec![0; 3 << 20].as_slice(), 1).unwrap();
        assert!(bomb.len() < 1000);
        let refused = message_at_most(CDR, bomb.clone(), 2 << 20).unwrap_err();
        assert!(refused.contains("more than 2 MiB"), "{refused}");
        assert_eq!(message_at_most(CDR, bomb, 3 << 20).unwrap().len(), 3 << 20);
        assert_eq!(most_bytes_of_file(100), SMALL_FILE_BYTES);
        assert_eq!(most_bytes_of_file(20 << 20), 20_000 << 20);
        assert_eq!(most_bytes_of_file(u64::MAX), MAX_FILE_BYTES);
    }

    #[test]
    fn only_frames_in_place_of_cdr_are_unpacked() {
        let text = b"\0\x01\0\0some message".to_vec();
        let frame = zstd::encode_all(text.as_slice(), 1).unwrap();
        assert_eq!(message(CDR, frame.clone()), Ok(text.clone()));
        assert_eq!(message(CDR, text.clone()), Ok(text));
        assert_eq!(message("protobuf", frame.clone()), Ok(frame.clone()));
        let cut = frame[..frame.len() - 3].to_vec();
        assert!(message(CDR, cut).unwrap_err().contains("zstd frame is damaged"));
    }
}
