//! The floor plan in cells.

use geometry::{GridCell, GridPart, OccupancyGrid};

use super::{header_of, time_from_stamp};
use crate::geometry_msgs::{Point, Pose, Quaternion};
use crate::map_msgs::OccupancyGridUpdate;
use crate::nav_msgs::{self, MapMetaData};

/// The numbers of `nav_msgs/OccupancyGrid`.
const FREE: i8 = 0;
const OCCUPIED: i8 = 100;
const UNKNOWN: i8 = -1;

/// The message of a grid.
#[must_use]
pub fn message_from_grid(grid: &OccupancyGrid) -> nav_msgs::OccupancyGrid {
    let origin_m = grid.origin_m();
    nav_msgs::OccupancyGrid {
        header: header_of(grid.stamp, &grid.frame_id),
        info: MapMetaData {
            map_load_time: time_from_stamp(grid.stamp),
            resolution: grid.resolution_m as f32,
            width: grid.width as u32,
            height: grid.height as u32,
            origin: Pose {
                position: Point { x: origin_m.x, y: origin_m.y, z: 0.0 },
                orientation: Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 },
            },
        },
        data: grid.cells.iter().map(number).collect(),
    }
}

/// The message of a part of a grid, for those who have the rest.
#[must_use]
pub fn update_of_grid(grid: &OccupancyGrid, part: GridPart) -> OccupancyGridUpdate {
    OccupancyGridUpdate {
        header: header_of(grid.stamp, &grid.frame_id),
        x: part.x as i32,
        y: part.y as i32,
        width: part.width as u32,
        height: part.height as u32,
        data: grid.cells_of(part).iter().map(number).collect(),
    }
}

fn number(cell: &GridCell) -> i8 {
    match cell {
        GridCell::Free => FREE,
        GridCell::Occupied => OCCUPIED,
        GridCell::Unknown => UNKNOWN,
    }
}

#[cfg(test)]
mod tests {
    use geometry::Stamp;

    use super::*;
    use crate::cdr;

    fn grid() -> OccupancyGrid {
        use GridCell::{Free, Occupied, Unknown};
        OccupancyGrid {
            stamp: Stamp::from_nanos(1_700_000_000_100_000_000),
            frame_id: "map".to_owned(),
            resolution_m: 0.05,
            least: [-32, 64],
            width: 3,
            height: 2,
            cells: vec![Unknown, Free, Occupied, Free, Occupied, Unknown],
        }
    }

    #[test]
    fn a_grid_has_the_numbers_of_its_message_and_comes_back_from_the_wire() {
        let message = message_from_grid(&grid());
        assert_eq!(message.data, [-1, 0, 100, 0, 100, -1]);
        assert_eq!(
            (message.info.width, message.info.height, message.info.resolution),
            (3, 2, 0.05)
        );
        let origin = &message.info.origin;
        assert_eq!((origin.position.x, origin.position.y, origin.orientation.w), (-1.6, 3.2, 1.0));
        let bytes = cdr::encode(&message).unwrap();
        assert_eq!(cdr::decode::<nav_msgs::OccupancyGrid>(&bytes).unwrap(), message);
    }

    #[test]
    fn an_update_has_the_cells_of_its_part() {
        let part = GridPart { x: 1, y: 0, width: 2, height: 2 };
        let update = update_of_grid(&grid(), part);
        assert_eq!((update.x, update.y, update.width, update.height), (1, 0, 2, 2));
        assert_eq!(update.data, [0, 100, 100, -1]);
    }
}
