//! The parameters of the grid.

use geometry::{ParameterError, parameter};

use super::{GridPoints, find_floor_m};

geometry::choices! {
    /// What the grid is made of.
    #[derive(Default)]
    pub enum GridSource {
        /// There is no grid.
        None = "none" as default,
        /// Of the scans alone, without the beams that hit what moves: the plan at the scanner's height. With the method
        /// free_space.
        Scan = "scan",
        /// Of the map between two heights above the floor.
        HeightBand = "height_band",
    }
}

impl GridSource {
    /// Its name as a parameter.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Scan => "scan",
            Self::HeightBand => "height_band",
        }
    }
}

geometry::choices! {
    /// How the height of the floor is known.
    #[derive(Default)]
    pub enum GridFloor {
        /// It is found: the lowest level surface of the map that is large enough, or what the robot drives on.
        Found = "found" as default,
        /// It is grid_floor_height_m.
        Given = "given",
    }
}

geometry::parameters! {
    /// The parameters of the occupancy grid.
    #[derive(Clone, PartialEq, Debug)]
    pub struct GridConfig {
        /// What the occupancy grid for navigation on map and in grid_file is made of.
        grid: GridSource = GridSource::None;
        /// Edge of the grid's cells, which lie at its multiples.
        // slam_toolbox's and map_server's usual one.
        grid_resolution_m: f64 = 0.05, between(0.01, 1.0);
        /// Lower end of the band of heights above the floor. What is lower is floor: less than a robot climbs.
        // The noise of depth at 5 m, and a carpet's edge, are below it.
        grid_min_height_m: f64 = 0.1, between(0.02, 100.0), read_with("grid", "height_band");
        /// Upper end of the band: the height of the robot, and some more.
        grid_max_height_m: f64 = 1.5, positive, read_with("grid", "height_band");
        /// A cell is free where a depth image was seen through at this height above the floor, or lower. From a camera that sees
        /// the lower part of a cell never, the cell stays unknown; with grid_max_height_m any height of the band is enough.
        // Below seats (0.45 m) and tables, which a camera above them would look over.
        grid_free_below_m: f64 = 0.4, positive, read_with("grid", "height_band");
        /// How the height of the floor in the map is known.
        grid_floor: GridFloor = GridFloor::Found, read_with("grid", "height_band");
        /// The height of the floor in the map: z.
        grid_floor_height_m: f64 = 0.0, read_with("grid_floor", "given");
        /// The most cells that the grid has; a map that needs more has none. What cycles say of a cell is kept in 16 bytes.
        // 10,000 m2 at 5 cm.
        grid_max_cells: usize = 4_000_000, at_least(1.0);
    }
    check = Self::check_band;
}

impl GridConfig {
    fn check_band(&self) -> Result<(), ParameterError> {
        let (least_m, most_m) = (self.grid_min_height_m, self.grid_max_height_m);
        let accepted = ("above grid_min_height_m", least_m);
        parameter::check("grid_max_height_m", accepted, most_m, least_m < most_m)?;
        let free_m = self.grid_free_below_m;
        parameter::check("grid_free_below_m", accepted, free_m, least_m < free_m)
    }

    /// The height of the floor, given or found in these points.
    pub(crate) fn floor_m(&self, points: GridPoints<'_>) -> Option<f64> {
        match self.grid_floor {
            GridFloor::Given => Some(self.grid_floor_height_m),
            GridFloor::Found => find_floor_m(points),
        }
    }
}
