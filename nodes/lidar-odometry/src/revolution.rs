//! One organised cloud for each revolution of the scanner, and the motion of the vehicle taken out of it.
//!
//! | file | what |
//! |---|---|
//! | `assembly` | datagrams to revolutions, with counts of what is missing |
//! | `builder` | packets to revolutions, cut where the head passes an azimuth |
//! | `deskew` | a revolution as if measured at one moment, by a constant velocity |
//! | `twist` | that velocity, and the motion that it comes to |

mod assembly;
mod builder;
mod deskew;

pub use assembly::{AssemblyConfigError, AssemblyCounts, PacketClock, RevolutionAssembly};
pub(crate) use builder::LONGEST_S;
pub use builder::{
    BuiltRevolution, KeptEcho, RevolutionBuilder, RevolutionConfig, RevolutionConfigError,
};
pub use deskew::deskewed;
