//! Sums that a writer of hostile bytes would set right: without them nothing behind a reader's check of them would be reached.

/// A PNG file whose chunks have the right CRC.
pub(crate) fn of_png(bytes: &[u8]) -> Vec<u8> {
    const SIGNATURE_BYTES: usize = 8;
    let mut file = bytes.to_vec();
    let mut at = SIGNATURE_BYTES;
    // Length, type, data, CRC of type and data.
    while let Some(length) = file.get(at..at + 4).and_then(|length| length.first_chunk()) {
        let end = (u32::from_be_bytes(*length) as usize).saturating_add(at + 8);
        let Some(crc) = file.get(at + 4..end).map(crc32fast::hash) else { break };
        let Some(place) = file.get_mut(end..end + 4) else { break };
        place.copy_from_slice(&crc.to_be_bytes());
        at = end + 4;
    }
    file
}

/// A map of keyframes with its length and the CRC of its bytes.
pub(crate) fn of_keyframes(bytes: &[u8]) -> Vec<u8> {
    const HEADER_BYTES: usize = 16;
    let mut file = bytes.to_vec();
    let Some(behind) = file.len().checked_sub(4).filter(|behind| *behind >= HEADER_BYTES) else {
        return file;
    };
    file.truncate(behind);
    let length = (behind - HEADER_BYTES) as u64;
    if let Some(place) = file.get_mut(HEADER_BYTES - 8..HEADER_BYTES) {
        place.copy_from_slice(&length.to_le_bytes());
    }
    let crc = crc32fast::hash(&file);
    file.extend(crc.to_le_bytes());
    file
}

/// An MCAP file whose chunks have no CRC, which is allowed.
pub(crate) fn of_mcap(bytes: &[u8]) -> Vec<u8> {
    const MAGIC_BYTES: usize = 8;
    const CHUNK: u8 = 6;
    /// First and last time, and the length of the content stand before it.
    const CRC_AT: usize = 9 + 24;
    let mut file = bytes.to_vec();
    let mut at = MAGIC_BYTES;
    while let Some([opcode, length @ ..]) = file.get(at..at + 9) {
        let (opcode, length) = (*opcode, u64::from_le_bytes(length.try_into().unwrap_or_default()));
        if let Some(crc) = file.get_mut(at + CRC_AT..at + CRC_AT + 4).filter(|_| opcode == CHUNK) {
            crc.fill(0);
        }
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        at = at.saturating_add(9).saturating_add(length);
        if at > file.len() {
            break;
        }
    }
    file
}
