//! What a map does with a cycle, by each of the methods: chosen once.

use geometry::Method;

use super::blanks::Blanks;
use super::clearing::RayTables;

/// What a map does with a cycle besides adding its static points.
#[derive(Clone, Debug, Default)]
pub(super) enum Behaviour {
    /// Nothing: what was put in stays in.
    #[default]
    RecHv,
    /// Voxels go where rays pass them, and where their directions have gone blank.
    FreeSpace(Box<Clearing>),
}

/// What clears voxels.
#[derive(Clone, Debug, Default)]
pub(super) struct Clearing {
    /// The tables of one cycle, kept for their memory.
    pub(super) rays: RayTables,
    pub(super) blanks: Blanks,
}

impl Behaviour {
    pub(super) fn of(method: Method) -> Self {
        match method {
            Method::RecHv => Self::RecHv,
            Method::FreeSpace => Self::FreeSpace(Box::default()),
        }
    }

    /// Forgets what was seen.
    pub(super) fn clear(&mut self) {
        if let Self::FreeSpace(clearing) = self {
            **clearing = Clearing::default();
        }
    }

    /// The map has moved under what was seen.
    pub(super) fn map_moved(&mut self) {
        if let Self::FreeSpace(clearing) = self {
            clearing.blanks.forget_places();
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        match self {
            Self::RecHv => 0,
            Self::FreeSpace(clearing) => {
                clearing.rays.memory_bytes() + clearing.blanks.memory_bytes()
            }
        }
    }
}
