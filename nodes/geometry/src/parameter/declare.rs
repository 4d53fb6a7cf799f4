//! The macros that declare parameters.

/// Declares a struct of parameters, each once: its meaning, name, type, default, and behind the default what else is to be
/// known of it, in the words of [`Declaration`](crate::parameter::Declaration)'s methods. The struct gets `Default`,
/// serde's `Serialize` and `Deserialize`, `DECLARATIONS` and `validate`; the crate needs `serde`.
///
/// - A field whose type is such a struct is a group: `edge_m` of the field `voxel` is the parameter `voxel.edge_m`.
///   Without a default it has that of its type.
/// - With `as flatten` its parameters are among the others, without its name; with `as skip` it is no parameter.
/// - `check` at the end names a function for what several parameters must be together; it runs when each has passed.
///
/// ```
/// use geometry::{ParameterError, parameter};
///
/// geometry::choices! {
///     /// How far apart voxels are.
///     pub enum Spacing {
///         /// As given.
///         Even = "even",
///         /// Twice that for each metre.
///         Growing = "growing",
///     }
/// }
///
/// geometry::parameters! {
///     /// Voxels.
///     #[derive(Clone, PartialEq, Debug)]
///     pub struct VoxelConfig {
///         /// The shortest edge of a voxel.
///         // Rec-HV, experiment 4.
///         least_edge_m: f64 = 0.08, positive;
///         /// The longest edge of a voxel.
///         most_edge_m: f64 = 1.0, positive, read_with("spacing", "growing");
///         /// How far apart they are.
///         spacing: Spacing = Spacing::Even;
///         /// No more voxels are kept.
///         max_voxels: usize = 1000, whole(1, 1_000_000), changeable;
///     }
///     check = Self::check_edges;
/// }
///
/// impl VoxelConfig {
///     fn check_edges(&self) -> Result<(), ParameterError> {
///         let (least, most) = (self.least_edge_m, self.most_edge_m);
///         parameter::check("most_edge_m", ("at least least_edge_m", least), most, least <= most)
///     }
/// }
///
/// let refused = |config: VoxelConfig| config.validate().unwrap_err().to_string();
/// let config = VoxelConfig { least_edge_m: -0.1, ..VoxelConfig::default() };
/// assert_eq!(refused(config), "parameter least_edge_m must be above 0, not -0.1");
/// let config = VoxelConfig { most_edge_m: 0.01, ..VoxelConfig::default() };
/// assert_eq!(refused(config), "parameter most_edge_m must be at least least_edge_m (0.08), not 0.01");
/// assert_eq!(VoxelConfig::DECLARATIONS[0].unit().as_deref(), Some("m"));
/// ```
#[macro_export]
macro_rules! parameters {
    (
        $(#[$attribute:meta])*
        $visibility:vis struct $struct:ident {
            $(
                $(#[doc = $doc:literal])*
                $name:ident: $type:ty $(as $how:ident)? $(= $default:expr)? $(, $word:ident $(($($value:expr),*))?)*;
            )*
        }
        $(check = $check:expr;)?
    ) => {
        $(#[$attribute])*
        #[derive(::serde::Serialize, ::serde::Deserialize)]
        #[serde(default)]
        $visibility struct $struct {
            $(
                $(#[doc = $doc])*
                $(#[serde($how)])?
                $visibility $name: $type,
            )*
        }

        impl Default for $struct {
            fn default() -> Self {
                Self { $($name: $crate::parameters!(@default $($default)?),)* }
            }
        }

        impl $struct {
            /// The declaration of each parameter.
            $visibility const DECLARATIONS: &'static [$crate::parameter::Declaration] = &[$(
                $crate::parameter::Declaration::new::<$type>(stringify!($name), concat!($($doc),*))
                    $(.$how())?
                    $(.$word($($($value),*)?))*,
            )*];

            /// Checks every parameter, and then what several of them must be together.
            ///
            /// # Errors
            /// The first one that does not hold, with its name, its value and what is accepted.
            $visibility fn validate(&self) -> Result<(), $crate::ParameterError> {
                let mut declarations = Self::DECLARATIONS.iter();
                $(
                    if let Some(declaration) = declarations.next() {
                        $crate::parameter::Parameter::check(&self.$name, declaration)?;
                    }
                )*
                $(
                    let check: fn(&Self) -> Result<(), $crate::ParameterError> = $check;
                    check(self)?;
                )?
                Ok(())
            }
        }

        impl $crate::parameter::Parameter for $struct {
            const KIND: $crate::parameter::Kind =
                $crate::parameter::Kind::Group { members: Self::DECLARATIONS, is_flat: false };

            fn check(
                &self,
                declaration: &'static $crate::parameter::Declaration,
            ) -> Result<(), $crate::ParameterError> {
                self.validate().map_err(|error| error.in_group(declaration))
            }
        }

        impl $crate::parameter::Parameters for $struct {
            const DECLARATIONS: &'static [$crate::parameter::Declaration] = Self::DECLARATIONS;

            fn validate(&self) -> Result<(), $crate::ParameterError> {
                Self::validate(self)
            }
        }
    };
    (@default $default:expr) => { $default };
    (@default) => { Default::default() };
}

/// Declares a type of parameters that are one of some texts, each once: what it means, its name in the program, and the
/// text; further texts behind `|` are accepted, too. With `#[derive(Default)]` one is marked by `as default`. See [`parameters!`](crate::parameters).
#[macro_export]
macro_rules! choices {
    (
        $(#[$attribute:meta])*
        $visibility:vis enum $enum:ident {
            $(
                $(#[doc = $doc:literal])*
                $variant:ident = $text:literal $(| $alias:literal)* $(as $default:ident)?
            ),* $(,)?
        }
    ) => {
        $(#[$attribute])*
        #[derive(Clone, Copy, PartialEq, Eq, Debug, ::serde::Serialize, ::serde::Deserialize)]
        $visibility enum $enum {
            $(
                $(#[doc = $doc])*
                #[serde(rename = $text $(, alias = $alias)*)]
                $(#[$default])?
                $variant,
            )*
        }

        impl $crate::parameter::Parameter for $enum {
            const KIND: $crate::parameter::Kind = $crate::parameter::Kind::Choice(&[$(
                $crate::parameter::Choice { text: $text, doc: concat!($($doc),*).trim_ascii() },
            )*]);

            fn check(
                &self,
                _: &'static $crate::parameter::Declaration,
            ) -> Result<(), $crate::ParameterError> {
                Ok(())
            }
        }
    };
}
