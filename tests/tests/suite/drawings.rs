//! The drawings of a run that need no browser.

use std::process::{Command, Stdio};

use crate::bags::small_room;
use crate::program::succeed;

/// The first bytes of a PNG file, and the chunk that only one that moves has.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
const ANIMATION_CONTROL: &[u8] = b"acTL";

#[test]
fn pictures_and_a_map_of_characters_come_with_a_run_that_is_asked_for_them() {
    let folder = tempfile::tempdir().unwrap();
    let bag = small_room(folder.path());
    let path = |name: &str| folder.path().join(name);
    let (bag, out, animation) = (bag.to_str().unwrap(), path("out"), path("forms.png"));
    let run = ["run", bag, "--out", out.to_str().unwrap()];
    let output = Command::new(env!("CARGO_BIN_EXE_stillmap-under-test"))
        .args(run)
        .args(["--png", "--thumbnail", "--animation", animation.to_str().unwrap()])
        .env("NO_COLOR", "1")
        .stdin(Stdio::null())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for (name, moves) in
        [("out/map.png", false), ("out/before_after.png", false), ("forms.png", true)]
    {
        let bytes = std::fs::read(path(name)).unwrap();
        assert!(bytes.starts_with(PNG), "{name}");
        let is_chunk = |window: &[u8]| window == ANIMATION_CONTROL;
        assert_eq!(bytes.windows(ANIMATION_CONTROL.len()).any(is_chunk), moves, "{name}");
    }
    let text = String::from_utf8(output.stdout).unwrap();
    let is_drawn = |line: &&str| line.contains(['\u{2580}', '\u{2584}', '\u{2588}']);
    assert!(text.lines().filter(is_drawn).count() >= 8, "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 60 || !is_drawn(&line)), "{text}");
    assert!(!text.contains('\x1b'), "{text}");
    assert!(text.lines().any(|line| line.starts_with("the person  ")), "{text}");
    assert!(text.contains("map.png, before_after.png"), "{text}");

    // Pictures of an earlier run would be of another map. Where nobody looks there are the sentences, as ever.
    let text = succeed(run.into_iter().chain(["--overwrite"]));
    assert!(!path("out/map.png").exists() && !path("out/before_after.png").exists());
    assert!(text.lines().filter(is_drawn).count() == 0 && text.starts_with("The person was found"));
}
