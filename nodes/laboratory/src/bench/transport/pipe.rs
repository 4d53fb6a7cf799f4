//! Reads the output of a process while it runs: a pipe that is not read fills up and blocks its writer.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read};
use std::thread::JoinHandle;

/// The longest line; the rest of a longer one is read as another line.
const LONGEST_LINE: u64 = 64 << 10;

/// Folds the lines of a pipe into a value, on a separate thread.
pub(in crate::bench) struct Lines<T> {
    reader: Option<JoinHandle<T>>,
}

impl<T: Default + Send + 'static> Lines<T> {
    /// Reads until the pipe's other end closes.
    pub(in crate::bench) fn fold(
        pipe: Option<impl Read + Send + 'static>,
        mut take: impl FnMut(&mut T, &str) + Send + 'static,
    ) -> Self {
        let reader = pipe.map(|pipe| {
            std::thread::spawn(move || {
                let mut folded = T::default();
                let mut pipe = BufReader::new(pipe);
                let mut line = Vec::new();
                // A broken pipe ends the output.
                while let Ok(1..) = pipe.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line) {
                    take(&mut folded, String::from_utf8_lossy(&line).trim_end());
                    line.clear();
                }
                folded
            })
        });
        Self { reader }
    }

    /// Waits for the end of the pipe. Call it after the process has ended.
    pub(in crate::bench) fn finish(self) -> T {
        self.reader.and_then(|reader| reader.join().ok()).unwrap_or_default()
    }
}

/// The number of lines that are kept for the error message of a failed process.
const LAST_LINES: usize = 5;

/// The last lines of a pipe.
pub(in crate::bench) fn last_lines(
    pipe: Option<impl Read + Send + 'static>,
) -> Lines<VecDeque<String>> {
    Lines::fold(pipe, |lines: &mut VecDeque<String>, line| {
        if lines.len() == LAST_LINES {
            lines.pop_front();
        }
        lines.push_back(line.to_owned());
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_lines_are_kept() {
        let text: String = (0..100).map(|line| format!("{line}\n")).collect();
        let lines = last_lines(Some(std::io::Cursor::new(text))).finish();
        assert_eq!(lines, ["95", "96", "97", "98", "99"]);
        assert!(last_lines(None::<std::io::Empty>).finish().is_empty());
    }

    #[test]
    fn a_line_without_end_takes_no_memory_without_end() {
        let longest =
            Lines::fold(Some(std::io::repeat(b'x').take(1 << 20)), |most: &mut usize, line| {
                *most = (*most).max(line.len());
            });
        assert_eq!(longest.finish(), LONGEST_LINE as usize);
    }
}
