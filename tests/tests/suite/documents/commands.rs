//! Commands of the pages: can the program that they start read them?

use std::ffi::OsString;
use std::path::Path;

use node_shell::RosArguments;

use super::root;

/// The nodes' own programs.
const NODES: [&str; 7] = [
    "bag-player",
    "compression",
    "detection",
    "lidar-odometry",
    "pose",
    "reconstruction",
    "segmentation",
];

/// The command lines of a block of code, without comments; what goes on in the next line is one.
pub(super) fn lines(block: &str) -> Vec<String> {
    let joined = block.replace("\\\n", " ");
    let commands =
        joined.lines().flat_map(|line| line.split(" #").next()).flat_map(|line| line.split(" && "));
    commands.map(|line| line.trim().to_owned()).filter(|line| !line.starts_with('#')).collect()
}

/// Whether a command of a block of code can be read, or why not; `None` of commands of other programs and of what is
/// none.
pub(super) fn check(line: &str) -> Option<Result<(), String>> {
    let words = words(line);
    match words.first()?.as_str() {
        // A name alone is the project's or a crate's.
        _ if words.len() == 1 => None,
        "stillmap" => Some(stillmap(&words)),
        "cargo" => Some(cargo(&words, stillmap)),
        "bag-player" => {
            Some(stillmap(&[&["stillmap".to_owned(), "play".to_owned()], &words[1..]].concat()))
        }
        node if NODES.contains(&node) && words[1] == "--ros-args" => Some(ros(&words[1..])),
        _ => None,
    }
}

/// The same of a command that the text mentions, perhaps without what it needs: subcommands and options exist.
pub(super) fn check_mention(span: &str) -> Option<Result<(), String>> {
    let words = words(span);
    match words.first()?.as_str() {
        _ if words.len() == 1 => None,
        "stillmap" => Some(mentioned(&words)),
        "cargo" => Some(cargo(&words, mentioned)),
        _ => None,
    }
}

fn is_of_variable(one: char) -> bool {
    one.is_ascii_uppercase() || one.is_ascii_digit() || one == '_'
}

/// The words of a line as a shell splits it, with single and double quotes, from the program's name on.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut quote = None;
    for one in line.chars() {
        match quote {
            Some(end) if one == end => quote = None,
            None if one == '\'' || one == '"' => {
                quote = Some(one);
                word.get_or_insert_default();
            }
            None if one.is_whitespace() => words.extend(word.take()),
            _ => word.get_or_insert_default().push(one),
        }
    }
    words.extend(word);
    let is_variable = |word: &String| {
        word.split_once('=').is_some_and(|(name, _)| name.chars().all(is_of_variable))
    };
    let program = words.iter().position(|word| !is_variable(word) && word != "sudo");
    words.split_off(program.unwrap_or(words.len()))
}

fn ros(words: &[String]) -> Result<(), String> {
    RosArguments::parse(words.iter().cloned()).map(|_| ()).map_err(|error| error.to_string())
}

/// By the program's own definition of its command line.
fn stillmap(words: &[String]) -> Result<(), String> {
    // `...` is what the reader puts in.
    let words = words.iter().filter(|word| *word != "...").map(OsString::from);
    stillmap::check(words).map_err(|error| error.lines().next().unwrap_or_default().to_owned())
}

fn mentioned(words: &[String]) -> Result<(), String> {
    let mut command = stillmap::command();
    command.build();
    let mut command = &command;
    let mut rest = words[1..].iter();
    for word in rest.by_ref() {
        match command.find_subcommand(word) {
            Some(found) => command = found,
            // What follows is read by the node; a word in capitals stands for any subcommand.
            None if word == "--ros-args" || word.chars().all(is_of_variable) => return Ok(()),
            None if command.has_subcommands() && !word.starts_with('-') => {
                return Err(format!("there is no subcommand {word}"));
            }
            None => {
                option(command, word)?;
                break;
            }
        }
    }
    rest.take_while(|word| *word != "--ros-args").try_for_each(|word| option(command, word))
}

fn option(command: &clap::Command, word: &str) -> Result<(), String> {
    let Some(name) = word.strip_prefix("--").map(|word| word.split('=').next().unwrap()) else {
        return Ok(());
    };
    let is_there =
        name == "ros-args" || command.get_arguments().any(|one| one.get_long() == Some(name));
    is_there.then_some(()).ok_or_else(|| format!("{} has no option --{name}", command.get_name()))
}

/// By what the workspace has: packages, benches, examples, tests; and by the program, of `cargo run`.
fn cargo(words: &[String], program: fn(&[String]) -> Result<(), String>) -> Result<(), String> {
    let command = words.get(1).map_or("", String::as_str);
    if !["bench", "build", "check", "clippy", "deb", "doc", "fmt", "install", "run", "test", "tree"]
        .contains(&command)
    {
        return Err(format!("there is no cargo {command}"));
    }
    let own_end = words.iter().position(|word| word == "--").unwrap_or(words.len());
    let mut folder = None;
    let mut rest = words[2..own_end].iter();
    while let Some(word) = rest.next() {
        let (option, value) =
            word.split_once('=').map_or((&word[..], None), |(option, value)| (option, Some(value)));
        let mut value =
            || value.map(str::to_owned).or_else(|| rest.next().cloned()).unwrap_or_default();
        match option {
            "-p" | "--package" => folder = Some(package(&value())?),
            "--bench" | "--example" | "--test" | "--bin" => {
                let (name, folder) = (value(), folder.clone().unwrap_or_else(root));
                let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap();
                let kind = option.trim_start_matches("--");
                let file = folder.join(format!("{kind}s")).join(&name).with_extension("rs");
                if !file.exists() && !manifest.contains(&format!("name = \"{name}\"")) {
                    return Err(format!("there is no {kind} {name}"));
                }
            }
            "-e" | "-i" | "--edges" | "--invert" | "--features" | "--profile" => drop(value()),
            _ => {}
        }
    }
    if command == "run" && folder.is_none() && own_end < words.len() {
        let own = &words[own_end + 1..];
        return program(&[&["stillmap".to_owned()], own].concat());
    }
    Ok(())
}

/// The folder of a package; `CRATE` and the like stand for any.
fn package(name: &str) -> Result<std::path::PathBuf, String> {
    if name.chars().all(is_of_variable) {
        return Ok(root());
    }
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let members = manifest.split("members = [").nth(1).unwrap().split(']').next().unwrap();
    members
        .split('"')
        .map(|member| root().join(member))
        .find(|folder| is_package(folder, name))
        .ok_or_else(|| format!("there is no package {name}"))
}

fn is_package(folder: &Path, name: &str) -> bool {
    let manifest = std::fs::read_to_string(folder.join("Cargo.toml"));
    manifest.is_ok_and(|manifest| manifest.contains(&format!("[package]\nname = \"{name}\"\n")))
}

#[test]
fn a_block_is_read_as_a_shell_reads_it() {
    let block = "A=1 stillmap run room.mcap \\\n    --out 'a b'   # a comment\n# another\nsudo cp a b && cargo test\n";
    assert_eq!(
        lines(block),
        ["A=1 stillmap run room.mcap      --out 'a b'", "sudo cp a b", "cargo test"]
    );
    assert_eq!(words("run  --out 'a b' \"\""), ["run", "--out", "a b", ""]);
}

#[test]
fn a_command_that_no_program_reads_is_found() {
    assert_eq!(check("stillmap run room.mcap --out room"), Some(Ok(())));
    assert_eq!(check("stillmap node detection --ros-args -r a:=b"), Some(Ok(())));
    assert_eq!(check("cargo test -p stillmap-tests codemap"), Some(Ok(())));
    assert_eq!(check("cargo run --release -- demo"), Some(Ok(())));
    assert_eq!(check("ls -l"), None);
    for wrong in [
        "stillmap rum room.mcap",
        "stillmap run room.mcap --no-such-option",
        "stillmap node detection --ros-args -r nothing",
        "cargo test -p no-such-crate",
        "cargo bench -p pose --bench no-such-bench",
        "cargo run -- no-such-command",
    ] {
        assert!(check(wrong).is_some_and(|result| result.is_err()), "{wrong}");
    }
    assert_eq!(check_mention("stillmap run --pose visual"), Some(Ok(())));
    assert_eq!(check_mention("stillmap eval map --ref"), Some(Ok(())));
    assert_eq!(check_mention("stillmap node NAME"), Some(Ok(())));
    assert_eq!(check_mention("stillmap node pose --ros-args --params-file a.yaml"), Some(Ok(())));
    for wrong in ["stillmap eval maps", "stillmap run --poses", "stillmap rum"] {
        assert!(check_mention(wrong).is_some_and(|result| result.is_err()), "{wrong}");
    }
}
