//! How many descriptors the process may have: each end of a topic takes two to four of them.

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// Asks for as many as the system allows. A process that does not ask has 1,024 on most machines; the suite in one process with a pose
/// node, the live view and Foxglove takes 900 before anybody listens. Where it is refused, the end that finds no room says so.
pub(crate) fn allow_all() {
    let limit = getrlimit(Resource::Nofile);
    if let Err(error) = setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, ..limit }) {
        tracing::debug!("the limit of open files stays at {:?}: {error}", limit.current);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_the_system_allows_is_asked_for() {
        let limit = getrlimit(Resource::Nofile);
        let less = limit.maximum.map_or(1 << 20, |maximum| maximum - 1);
        setrlimit(Resource::Nofile, Rlimit { current: Some(less), ..limit }).unwrap();
        allow_all();
        assert_eq!(getrlimit(Resource::Nofile).current, limit.maximum);
    }
}
