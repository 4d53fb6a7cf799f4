//! Published figures as data files of this crate.

use std::sync::LazyLock;

use robot::Failure;
use serde::de::DeserializeOwned;

/// A YAML file that is part of the program, read at its first use.
pub(crate) struct PublishedFile<T> {
    name: &'static str,
    content: LazyLock<Result<T, String>>,
}

impl<T: DeserializeOwned> PublishedFile<T> {
    /// The file of this name, for messages. `read` is `|| of_yaml(include_str!(...))`.
    pub(crate) const fn new(name: &'static str, read: fn() -> Result<T, String>) -> Self {
        Self { name, content: LazyLock::new(read) }
    }

    /// The content of the file, read at the first call.
    ///
    /// # Errors
    /// When it cannot be read as a `T`, which a test of each file excludes.
    pub(crate) fn get(&self) -> Result<&T, Failure> {
        let content = self.content.as_ref();
        content.map_err(|reason| Failure::new(format!("{} cannot be read: {reason}", self.name)))
    }
}

/// The content of a file.
pub(crate) fn of_yaml<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    serde_saphyr::from_str(text).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_another_form_is_an_error_that_names_it() {
        static FILE: PublishedFile<Vec<f64>> =
            PublishedFile::new("figures.yaml", || of_yaml("- one"));
        let error = FILE.get().unwrap_err().to_string();
        assert!(error.starts_with("figures.yaml cannot be read: "), "{error}");
    }
}
