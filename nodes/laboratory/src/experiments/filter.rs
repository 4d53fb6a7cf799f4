//! The selection of cases of the acceptance table.

use clap::{Args, ValueEnum};
use simulator::CrossingObject;

use super::settings::Settings;
use crate::simulate::choice::{PathLetter, SceneLetter};

/// The limits of the acceptance table; without a limit everything is run.
#[derive(Args, Clone, PartialEq, Debug, Default)]
pub(crate) struct FilterArgs {
    /// Scenes of the acceptance table [default: all]
    #[arg(long, num_args = 1.., ignore_case = true, value_name = "SCENE")]
    scenes: Vec<SceneLetter>,
    /// Objects of the acceptance table [default: robot person]
    #[arg(long, num_args = 1.., value_name = "OBJECT")]
    objects: Vec<ObjectName>,
    /// Paths of the acceptance table [default: A B C]
    #[arg(long, num_args = 1.., ignore_case = true, value_name = "PATH")]
    paths: Vec<PathLetter>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum ObjectName {
    /// With its screen, at 0.98 m/s
    Robot,
    /// At 1.4 m/s
    Person,
    /// A plain box, at 0.98 m/s
    Cart,
}

impl FilterArgs {
    /// `settings` with these limits.
    pub(crate) fn of(&self, settings: Settings) -> Settings {
        Settings {
            scenes: chosen(&self.scenes, SceneLetter::scene, settings.scenes),
            objects: chosen(&self.objects, ObjectName::object, settings.objects),
            paths: chosen(&self.paths, PathLetter::path, settings.paths),
            ..settings
        }
    }
}

impl ObjectName {
    fn object(self) -> CrossingObject {
        match self {
            Self::Robot => CrossingObject::Robot,
            Self::Person => CrossingObject::Person,
            Self::Cart => CrossingObject::Cart,
        }
    }
}

/// The named ones, each once and in order, or else `all`.
fn chosen<N: Copy, T: PartialEq>(named: &[N], of: fn(N) -> T, all: Vec<T>) -> Vec<T> {
    if named.is_empty() {
        return all;
    }
    let mut chosen = Vec::new();
    for item in named.iter().map(|name| of(*name)) {
        if !chosen.contains(&item) {
            chosen.push(item);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use simulator::{PathName, SceneName};

    use super::*;

    #[test]
    fn what_is_named_is_run_and_all_where_nothing_is() {
        let all = Settings::new(3);
        assert_eq!(FilterArgs::default().of(all.clone()), all);
        let filter = FilterArgs {
            scenes: vec![SceneLetter::H, SceneLetter::B, SceneLetter::H],
            objects: vec![ObjectName::Person],
            paths: vec![PathLetter::C],
        };
        let limited = filter.of(all.clone());
        assert_eq!(limited.scenes, [SceneName::H, SceneName::B]);
        assert_eq!(limited.objects, [CrossingObject::Person]);
        assert_eq!(limited.paths, [PathName::C]);
        assert_eq!(limited.everyday_scenes, all.everyday_scenes);
    }
}
