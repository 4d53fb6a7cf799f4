//! The receive buffer that the kernel grants, and the size of message that follows from it.

use std::fmt;

use super::WANTED_RECEIVE_BUFFER;

/// How much larger than its receive buffer a message may be over the loopback, whose datagrams hold
/// 64 kB and therefore waste less of the buffer than those of 1.4 kB (measured).
const LOOPBACK_GAIN: f64 = 1.9;

/// The setting that lets the kernel grant the receive buffer that is requested.
pub const RAISE_RECEIVE_BUFFER: &str = "sudo sysctl -w net.core.rmem_max=33554432";

/// The receive buffer that the kernel grants, and so what size of message arrives whole.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct GrantedBuffer {
    bytes: usize,
    asked: usize,
    loopback_only: bool,
}

impl GrantedBuffer {
    pub(crate) const fn new(bytes: usize, asked: usize, loopback_only: bool) -> Self {
        Self { bytes, asked, loopback_only }
    }

    /// The buffer.
    #[must_use]
    pub const fn bytes(&self) -> usize {
        self.bytes
    }

    /// The requested size.
    #[must_use]
    pub const fn asked(&self) -> usize {
        self.asked
    }

    /// The size up to which messages arrive whole. Above it some arrive, the fewer the larger.
    #[must_use]
    pub fn largest_safe_message(&self) -> usize {
        if self.loopback_only { (self.bytes as f64 * LOOPBACK_GAIN) as usize } else { self.bytes }
    }

    /// Whether a message of `bytes` arrives whole.
    ///
    /// # Errors
    /// When it does not; the error says how to fix that.
    pub fn check(&self, topic: &str, bytes: usize) -> Result<(), MessageTooLarge> {
        if bytes <= self.largest_safe_message() {
            return Ok(());
        }
        Err(MessageTooLarge {
            topic: topic.to_owned(),
            bytes,
            largest_safe: self.largest_safe_message(),
        })
    }

    /// How to make the buffer larger, in words; `None` when it is as large as this suite ever asks for.
    #[must_use]
    pub fn fix(&self) -> Option<String> {
        if self.bytes >= WANTED_RECEIVE_BUFFER {
            None
        } else if self.bytes < self.asked {
            Some(format!("raise the kernel's limit on this machine: {RAISE_RECEIVE_BUFFER}"))
        } else {
            Some("unset STILLMAP_RECEIVE_BUFFER_KIB, which limits it".to_owned())
        }
    }
}

impl fmt::Display for GrantedBuffer {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kib = |bytes: usize| bytes / 1024;
        write!(formatter, "{} KiB", kib(self.bytes))?;
        if self.bytes < self.asked {
            write!(formatter, " of {} KiB requested", kib(self.asked))?;
        }
        Ok(())
    }
}

/// A message is larger than what arrives whole.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "messages of {} kB on {topic} are larger than the {} kB that the kernel lets a socket receive at \
     once, so most will be lost; raise the limit on this machine: {}",
    bytes / 1000, largest_safe / 1000, RAISE_RECEIVE_BUFFER
)]
pub struct MessageTooLarge {
    /// The topic.
    pub topic: String,
    /// The size of the message.
    pub bytes: usize,
    /// The size up to which messages arrive whole.
    pub largest_safe: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_that_does_not_fit_comes_with_its_fix() {
        let small = GrantedBuffer::new(208 * 1024, WANTED_RECEIVE_BUFFER, false);
        assert!(small.check("/scan", 5_000).is_ok());
        let error = small.check("/depth/image", 614_400).unwrap_err().to_string();
        for part in ["614 kB", "/depth/image", "212 kB", "net.core.rmem_max=33554432"] {
            assert!(error.contains(part), "{error}");
        }
        let loopback = GrantedBuffer::new(4 << 20, WANTED_RECEIVE_BUFFER, true);
        assert!(loopback.check("/points", 4_915_200).is_ok());
        assert!(loopback.check("/points", 9_830_400).is_err());
    }

    #[test]
    fn the_fix_fits_the_limit_of_the_buffer() {
        let fix = |bytes, asked| GrantedBuffer::new(bytes, asked, false).fix();
        assert!(fix(4 << 20, WANTED_RECEIVE_BUFFER).unwrap().contains("sysctl"));
        assert!(fix(1 << 20, 1 << 20).unwrap().contains("STILLMAP_RECEIVE_BUFFER_KIB"));
        assert_eq!(fix(WANTED_RECEIVE_BUFFER, WANTED_RECEIVE_BUFFER), None);
    }

    #[test]
    fn what_was_not_granted_is_shown() {
        let shown = |bytes| GrantedBuffer::new(bytes, WANTED_RECEIVE_BUFFER, false).to_string();
        assert_eq!(shown(WANTED_RECEIVE_BUFFER), "32768 KiB");
        assert_eq!(shown(208 * 1024), "208 KiB of 32768 KiB requested");
    }
}
