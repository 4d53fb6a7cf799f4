//! Existing files are replaced only with `--overwrite`.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use clap::Args;
use node_shell::{check_folder_of, folder_of};

use crate::failure::Failure;
use crate::sensor_bag::SensorBag;

/// Refuses to replace the first of `paths` that exists, unless `overwrite`. `option` is the option that names the path.
///
/// # Errors
/// With the path, and what to do.
pub fn refuse_to_replace(
    paths: impl IntoIterator<Item = PathBuf>,
    overwrite: bool,
    option: &str,
) -> Result<(), Failure> {
    let is_there = |path: &PathBuf| path.is_file() || path.is_dir();
    match paths.into_iter().find(|path| !overwrite && is_there(path)) {
        None => Ok(()),
        Some(path) => Err(Failure::new(format!("{} already exists", path.display())).fix(format!(
            "the same command with --overwrite replaces it; {option} names another place"
        ))),
    }
}

/// Refuses, before any work is done, an output file that exists, unless `overwrite`, or whose folder is not there or may not be written.
///
/// # Errors
/// With the path, and what to do.
pub(crate) fn check_output_file(path: &Path, overwrite: bool, option: &str) -> Result<(), Failure> {
    refuse_to_replace([path.to_owned()], overwrite, option)?;
    check_folder(path, option)
}

/// Refuses an output file whose folder is not there or may not be written, before the work for it begins.
///
/// # Errors
/// With the path, and what to do.
pub(crate) fn check_folder(path: &Path, option: &str) -> Result<(), Failure> {
    check_folder_of(path).map_err(|error| {
        let why = match error.kind() {
            ErrorKind::NotFound => {
                format!("the folder {} does not exist", folder_of(path).display())
            }
            _ => error.to_string(),
        };
        Failure::new(format!("cannot write {}: {why}", path.display()))
            .fix(format!("{option} names another place"))
    })
}

/// A bag that a subcommand writes.
#[derive(Args, Clone, Debug)]
pub struct BagOutput {
    /// The bag to write
    #[arg(short, long, value_name = "BAG")]
    output: PathBuf,
    /// Replace a bag of this name
    #[arg(long)]
    overwrite: bool,
}

/// Whether two files that are to be written are one, however they are spelt.
pub(crate) fn is_same_file(one: &Path, other: &Path) -> bool {
    // A file need not be there, but its folder is.
    let whole = |path: &Path| {
        let there = path.canonicalize().ok();
        there.or_else(|| Some(folder_of(path).canonicalize().ok()?.join(path.file_name()?)))
    };
    one == other || whole(one).is_some_and(|path| whole(other) == Some(path))
}

/// Refuses two options that name one file.
///
/// # Errors
/// When they do.
pub(crate) fn refuse_same_file(
    (one, option): (&Path, &str),
    (other, other_option): (&Path, &str),
) -> Result<(), Failure> {
    if is_same_file(one, other) {
        return Err(Failure::new(format!("{} cannot be both", one.display()))
            .fix(format!("{option} and {other_option} are to name two files")));
    }
    Ok(())
}

impl BagOutput {
    /// A bag that must not exist yet.
    #[must_use]
    pub fn new(output: PathBuf) -> Self {
        Self { output, overwrite: false }
    }

    /// The path of the bag.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.output
    }

    /// Refuses to replace a bag, before any work is done.
    ///
    /// # Errors
    /// When there is one and `--overwrite` was not given.
    pub fn check(&self) -> Result<(), Failure> {
        check_output_file(&self.output, self.overwrite, "-o")
    }

    /// Refuses to replace the bag that is read.
    ///
    /// # Errors
    /// When it is the same file, or one in the folder that is the bag.
    pub fn refuse_itself(&self, bag: &Path) -> Result<(), Failure> {
        let real = bag.canonicalize();
        // The whole path of a file begins with itself, too.
        let is_of =
            |real: PathBuf| self.output.canonicalize().is_ok_and(|output| output.starts_with(real));
        if real.is_ok_and(is_of) {
            return Err(Failure::new(format!("{} cannot replace itself", bag.display()))
                .fix("-o names another place"));
        }
        Ok(())
    }

    /// Creates the bag.
    ///
    /// # Errors
    /// When its file cannot be created.
    pub fn create(&self) -> Result<SensorBag, Failure> {
        SensorBag::create(&self.output)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_for_which_there_is_no_folder_is_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("file"), "").unwrap();
        check_output_file(&at("a.txt"), false, "-o").unwrap();
        for nowhere in ["no/a.txt", "file/a.txt"] {
            let refused = check_output_file(&at(nowhere), true, "-o").unwrap_err().to_string();
            assert!(refused.contains("-o names another place"), "{refused}");
        }
    }

    /// `./m.ply` and `m.ply` passed for two files, and a folder did not hold its own files.
    #[test]
    fn one_file_is_known_by_all_its_names() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("bag")).unwrap();
        std::fs::write(at("bag/0.mcap"), "").unwrap();
        std::os::unix::fs::symlink(at("bag"), at("link")).unwrap();
        for (one, other, is_same) in [
            ("bag/new", "bag/./new", true),
            ("bag/new", "link/new", true),
            ("bag/0.mcap", "link/0.mcap", true),
            ("bag/new", "bag/other", false),
            ("bag/new", "new", false),
        ] {
            let refused = refuse_same_file((&at(one), "-o"), (&at(other), "--changes")).is_err();
            assert_eq!(refused, is_same, "{one} {other}");
        }
        for (bag, output, is_refused) in [
            ("bag", "bag/0.mcap", true),
            ("link", "bag/0.mcap", true),
            ("bag/0.mcap", "link/0.mcap", true),
            ("bag/0.mcap", "bag/1.mcap", false),
            ("bag", "bag/1.mcap", false),
        ] {
            let refused = BagOutput::new(at(output)).refuse_itself(&at(bag)).is_err();
            assert_eq!(refused, is_refused, "{bag} {output}");
        }
    }

    #[test]
    fn existing_files_are_replaced_only_with_overwrite() {
        let folder = tempfile::tempdir().unwrap();
        let (file, none) = (folder.path().join("a.txt"), folder.path().join("b.txt"));
        std::fs::write(&file, "").unwrap();
        let paths = || [none.clone(), file.clone()];
        let refused = refuse_to_replace(paths(), false, "--out").unwrap_err().to_string();
        assert!(refused.contains("a.txt already exists"), "{refused}");
        assert!(refused.contains("--overwrite") && refused.contains("--out"), "{refused}");
        refuse_to_replace(paths(), true, "--out").unwrap();
        refuse_to_replace([none], false, "--out").unwrap();
    }
}
