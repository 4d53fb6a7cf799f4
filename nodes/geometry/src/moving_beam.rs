//! Which beams of a scan hit something that moves.

/// A beam of a scan that hit something that moves.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MovingBeam {
    /// Its index in the scan.
    pub index: u32,
    /// The range in metres of the static surface behind the object, where that is known.
    pub background_m: Option<f32>,
}

crate::choices! {
    /// What a filtered scan has in place of a range that is taken out of it.
    #[derive(Default)]
    pub enum BeamFill {
        /// NaN: no measurement (REP-117).
        Nan = "nan" as default,
        /// The range of the static surface behind the object, to some centimetres, where that is known; otherwise NaN. It was not
        /// measured in this scan.
        Background = "background",
    }
}
