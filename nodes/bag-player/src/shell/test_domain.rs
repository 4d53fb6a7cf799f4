//! DDS domains for tests of what hears all topics.

use std::fs::File;
use std::sync::Mutex;

/// Domains that the tests of other crates, which have namespaces of their own, do not use.
const FIRST: u32 = 101;
const COUNT: u32 = 100;

/// A domain that no other test has, of this process or of another one: a lock says so as long as the process lives.
pub(crate) fn own_domain() -> u16 {
    static LOCKS: Mutex<Vec<File>> = Mutex::new(Vec::new());
    let mut locks = LOCKS.lock().unwrap();
    let free = (0..COUNT).find_map(|step| {
        let domain = FIRST + std::process::id().wrapping_add(step) % COUNT;
        let path = std::env::temp_dir().join(format!("stillmap-test-domain-{domain}"));
        // One that another user left may not be opened.
        let file = File::create(path).ok()?;
        file.try_lock().ok().map(|()| (domain, file))
    });
    let (domain, lock) = free.expect("a domain that no test has");
    locks.push(lock);
    domain as u16
}

#[test]
fn two_tests_have_two_domains() {
    let domains = [own_domain(), own_domain(), own_domain()];
    assert!(domains[0] != domains[1] && domains[1] != domains[2] && domains[0] != domains[2]);
}
