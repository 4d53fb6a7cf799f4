//! `map_msgs`: changes of maps.

use serde::{Deserialize, Serialize};

use crate::std_msgs::Header;

/// New cells of a part of a grid.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct OccupancyGridUpdate {
    /// The moment, and the frame of the map.
    pub header: Header,
    /// The column of its first cell in the grid.
    pub x: i32,
    /// The row of its first cell in the grid.
    pub y: i32,
    /// Columns of the part.
    pub width: u32,
    /// Rows of the part.
    pub height: u32,
    /// The cells row by row, as in [`crate::nav_msgs::OccupancyGrid`].
    pub data: Vec<i8>,
}
ros_message!(OccupancyGridUpdate, "map_msgs");
