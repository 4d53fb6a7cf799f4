//! The declaration of a parameter: stated once, for all that need it.

use std::ops::Bound;

use super::kind::Parameter;
use super::range::Range;

/// A parameter, or a group of them. The default is that of the struct; [`crate::parameters!`] makes both.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Declaration {
    /// Its name within its group.
    pub name: &'static str,
    /// Its meaning. Lines are separated by a space.
    pub doc: &'static str,
    /// Its values.
    pub kind: Kind,
    /// The numbers that it may be, or those of a list.
    pub range: Range,
    /// Whether it may change while the node runs.
    pub is_changeable: bool,
    /// The setting of another parameter without which it is not read.
    pub read_with: Option<Setting>,
    /// What it was called before, with its groups: accepted, with a warning.
    pub former_name: Option<&'static str>,
}

/// The values of a parameter.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Kind {
    /// True or false.
    Truth,
    /// Whole numbers.
    Whole,
    /// Fractional numbers.
    Real,
    /// Text.
    Text,
    /// One of some texts.
    Choice(&'static [Choice]),
    /// This many fractional numbers.
    Reals(usize),
    /// It is a group.
    Group {
        /// Of which parameters.
        members: &'static [Declaration],
        /// Whether its members have their names without that of the group.
        is_flat: bool,
    },
}

/// One of the texts that a parameter may be.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Choice {
    /// The text.
    pub text: &'static str,
    /// Its meaning.
    pub doc: &'static str,
}

/// A parameter with one of its values.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Setting {
    /// The parameter.
    pub name: &'static str,
    /// The value.
    pub value: &'static str,
}

/// The form in which [`crate::parameters!`] holds the words behind a default.
impl Declaration {
    /// A parameter of the type `T`.
    #[must_use]
    pub const fn new<T: Parameter>(name: &'static str, doc: &'static str) -> Self {
        let doc = doc.trim_ascii();
        Self {
            name,
            doc,
            kind: T::KIND,
            range: T::RANGE,
            is_changeable: false,
            read_with: None,
            former_name: None,
        }
    }

    /// Its members have their names without the group's.
    #[must_use]
    pub const fn flatten(mut self) -> Self {
        if let Kind::Group { members, .. } = self.kind {
            self.kind = Kind::Group { members, is_flat: true };
        }
        self
    }

    /// It is no parameter: a group of none.
    #[must_use]
    pub const fn skip(mut self) -> Self {
        self.kind = Kind::Group { members: &[], is_flat: true };
        self
    }

    /// It may change while the node runs.
    #[must_use]
    pub const fn changeable(mut self) -> Self {
        self.is_changeable = true;
        self
    }

    /// It is not read unless another parameter has this value.
    #[must_use]
    pub const fn read_with(mut self, name: &'static str, value: &'static str) -> Self {
        self.read_with = Some(Setting { name, value });
        self
    }

    /// It was called something else before.
    #[must_use]
    pub const fn formerly(mut self, name: &'static str) -> Self {
        self.former_name = Some(name);
        self
    }

    /// Above 0.
    #[must_use]
    pub const fn positive(self) -> Self {
        self.bounded(Bound::Excluded(0.0), self.range.to)
    }

    /// 0 or more.
    #[must_use]
    pub const fn not_negative(self) -> Self {
        self.at_least(0.0)
    }

    /// This or more.
    #[must_use]
    pub const fn at_least(self, least: f64) -> Self {
        self.bounded(Bound::Included(least), self.range.to)
    }

    /// Both ends included.
    #[must_use]
    pub const fn between(self, least: f64, most: f64) -> Self {
        self.bounded(Bound::Included(least), Bound::Included(most))
    }

    /// Whole numbers, both ends included.
    #[must_use]
    pub const fn whole(self, least: i64, most: i64) -> Self {
        self.between(least as f64, most as f64)
    }

    /// The first end excluded, the second included.
    #[must_use]
    pub const fn above_to(self, bound: f64, most: f64) -> Self {
        self.bounded(Bound::Excluded(bound), Bound::Included(most))
    }

    /// The first end included, the second excluded.
    #[must_use]
    pub const fn from_below(self, least: f64, bound: f64) -> Self {
        self.bounded(Bound::Included(least), Bound::Excluded(bound))
    }

    /// A share of a whole, all of it included.
    #[must_use]
    pub const fn share(self) -> Self {
        self.between(0.0, 1.0)
    }

    /// Above 0, below 1.
    #[must_use]
    pub const fn probability(self) -> Self {
        self.bounded(Bound::Excluded(0.0), Bound::Excluded(1.0))
    }

    const fn bounded(mut self, from: Bound<f64>, to: Bound<f64>) -> Self {
        self.range = Range { from, to };
        self
    }
}

impl Declaration {
    /// The texts that it may be; none where it may be any, or is no text.
    #[must_use]
    pub const fn choices(&self) -> &'static [Choice] {
        match self.kind {
            Kind::Choice(choices) => choices,
            _ => &[],
        }
    }

    /// The unit, which is the end of the name: `m/s2` of `acceleration_m_per_s2`.
    #[must_use]
    pub fn unit(&self) -> Option<String> {
        let parts: Vec<&str> = self.name.split('_').collect();
        let first =
            parts.iter().rposition(|part| !UNITS.contains(part)).map_or(0, |index| index + 1);
        let is_number = matches!(self.kind, Kind::Real | Kind::Whole | Kind::Reals(_));
        let unit = parts.get(first..).filter(|unit| is_number && first > 0 && !unit.is_empty())?;
        let unit = unit.join(" ").replace(" per ", "/").replace("sqrt s", "sqrt(s)");
        Some(unit.strip_prefix("per ").map_or(unit.clone(), |below| format!("1/{below}")))
    }
}

/// The parts of units in names.
const UNITS: [&str; 10] = ["m", "s", "s2", "rad", "deg", "px", "hz", "bits", "per", "sqrt"];

/// A parameter with its full name, as others see it.
#[derive(Clone, PartialEq, Debug)]
pub struct NamedDeclaration {
    /// The names of its groups and its own, with dots between them.
    pub name: String,
    /// Its declaration, by itself or by its group.
    pub declaration: Declaration,
}

/// Every parameter that is declared, those in groups after each other, in their order.
#[must_use]
pub fn all_parameters(declarations: &[Declaration]) -> Vec<NamedDeclaration> {
    let mut all = Vec::new();
    collect(declarations, "", None, &mut all);
    all
}

fn collect(
    declarations: &[Declaration],
    prefix: &str,
    group: Option<&Declaration>,
    all: &mut Vec<NamedDeclaration>,
) {
    for declaration in declarations {
        let mut declaration = *declaration;
        if let Some(group) = group {
            declaration.is_changeable |= group.is_changeable;
            declaration.read_with = declaration.read_with.or(group.read_with);
        }
        let name = format!("{prefix}{}", declaration.name);
        match declaration.kind {
            Kind::Group { members, is_flat: true } => {
                collect(members, prefix, Some(&declaration), all);
            }
            Kind::Group { members, is_flat: false } => {
                collect(members, &format!("{name}."), Some(&declaration), all);
            }
            _ => all.push(NamedDeclaration { name, declaration }),
        }
    }
}
