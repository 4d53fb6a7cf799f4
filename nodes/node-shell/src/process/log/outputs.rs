//! Where the log goes: stderr or stdout, `/rosout` and, as ROS 2 has it, a file in the folder that `ROS_LOG_DIR` names.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::process::status_line::LogLines;

/// The folder of log files. Unlike in ROS 2 there are none without it.
const FOLDER: &str = "ROS_LOG_DIR";
/// Whether lines have colours: `0` or `1`; by default where a person sees them.
const COLOURS: &str = "RCUTILS_COLORIZED_OUTPUT";
/// What systemd sets for a service whose stderr is its journal: the device and inode of that (systemd.exec(5)). Programs that it starts
/// inherit it, also with another stderr.
const JOURNAL: &str = "JOURNAL_STREAM";

/// Where the log goes, by the arguments.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LogOutputs {
    /// To stderr, or to stdout where `RCUTILS_LOGGING_USE_STDOUT` is 1: all but `--disable-stdout-logs`.
    pub stderr: bool,
    /// To `/rosout`: all but `--disable-rosout-logs`.
    pub rosout: bool,
    /// To a file, where `ROS_LOG_DIR` is set: all but `--disable-external-lib-logs`.
    pub file: bool,
    /// How the file's name begins: `--log-file-name`; by default as the node is called.
    pub file_name: Option<String>,
}

impl Default for LogOutputs {
    fn default() -> Self {
        Self { stderr: true, rosout: true, file: true, file_name: None }
    }
}

impl LogOutputs {
    /// The file of this process, whose logger is `logger`; `None` where there is to be none.
    pub(super) fn open_file(&self, logger: &str) -> io::Result<Option<(PathBuf, File)>> {
        match std::env::var_os(FOLDER).filter(|folder| self.file && !folder.is_empty()) {
            Some(folder) => self.create(Path::new(&folder), logger).map(Some),
            None => Ok(None),
        }
    }

    /// Named as ROS 2 names it: what it is of, the process, the milliseconds since 1970.
    fn create(&self, folder: &Path, logger: &str) -> io::Result<(PathBuf, File)> {
        fs::create_dir_all(folder)?;
        let what = self.file_name.as_deref().unwrap_or(logger);
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let name = format!("{what}_{}_{}.log", std::process::id(), since.as_millis());
        let path = folder.join(name);
        Ok((path.clone(), File::create(path)?))
    }
}

/// Whether lines have colours.
pub(super) fn has_colours(is_watched: bool) -> bool {
    colours(std::env::var_os(COLOURS).as_deref(), is_watched)
}

fn colours(variable: Option<&OsStr>, is_watched: bool) -> bool {
    match variable.and_then(OsStr::to_str) {
        Some("0") => false,
        Some("1") => true,
        _ => is_watched,
    }
}

/// Whether the lines go to the journal of systemd, which takes how grave each is from a prefix (sd-daemon(3)).
pub(super) fn go_to_journal(stream: LogLines) -> bool {
    let stream = fs::metadata(format!("/proc/self/fd/{}", stream.descriptor())).ok();
    stream.is_some_and(|stream| is_journal(std::env::var_os(JOURNAL).as_deref(), &stream))
}

fn is_journal(variable: Option<&OsStr>, stream: &fs::Metadata) -> bool {
    variable.is_some_and(|named| named == &*format!("{}:{}", stream.dev(), stream.ino()))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn colours_are_where_a_person_sees_them_unless_the_variable_says_otherwise() {
        for is_watched in [false, true] {
            let coloured = |text: &str| colours(Some(OsStr::new(text)), is_watched);
            assert!(coloured("1") && !coloured("0"));
            assert_eq!((coloured(""), colours(None, is_watched)), (is_watched, is_watched));
        }
    }

    #[test]
    fn lines_go_to_the_journal_where_it_is_this_stream() {
        let folder = tempfile::tempdir().unwrap();
        let [stream, other] = ["a", "b"].map(|name| {
            fs::write(folder.path().join(name), "").unwrap();
            fs::metadata(folder.path().join(name)).unwrap()
        });
        let named = format!("{}:{}", stream.dev(), stream.ino());
        assert!(is_journal(Some(OsStr::new(&named)), &stream));
        assert!(!is_journal(Some(OsStr::new(&named)), &other));
        assert!(!is_journal(Some(OsStr::new("")), &stream) && !is_journal(None, &stream));
    }

    #[test]
    fn a_file_is_named_as_ros_2_names_it() {
        let folder = tempfile::tempdir().unwrap();
        let below = folder.path().join("a/b");
        let start = |outputs: LogOutputs| {
            let (path, mut file) = outputs.create(&below, "robot.detection").unwrap();
            file.write_all(b"a line").unwrap();
            assert_eq!(fs::read(&path).unwrap(), b"a line");
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            name.split_once(&format!("_{}_", std::process::id())).unwrap().0.to_owned()
        };
        assert_eq!(start(LogOutputs::default()), "robot.detection");
        let file_name = Some("mapping".to_owned());
        assert_eq!(start(LogOutputs { file_name, ..LogOutputs::default() }), "mapping");
    }
}
