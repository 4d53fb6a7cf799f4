//! Both maps as one.

use std::collections::HashSet;

use geometry::{BuildVoxelHasher, MapViews, NO_COLOUR, OrientedPoints, VoxelGrid, VoxelKey};

use crate::change::{Side, same_within_m};
use crate::saved_map::SavedMap;

/// The first map, and what the second one has besides, one point a voxel of the first; of each what is to be in it. In the first map's
/// frame, with the views of both. There are normals where both maps have them, and colours where one has.
pub(crate) fn merged(
    [of_a, of_b]: [&Side<'_>; 2],
    [is_in_a, is_in_b]: [&[bool]; 2],
) -> Option<SavedMap> {
    let (a, b) = (of_a.map, of_b.map);
    let edge_m = a.edge_m.max(b.edge_m);
    let is_sided = a.is_sided() && b.is_sided();
    let nearby = of_a.nearby(same_within_m(edge_m), is_sided, |index| is_in_a[index])?;
    let grid = VoxelGrid::new(a.edge_m).ok()?;
    let has_normals = a.has_normals() && b.has_normals();
    let has_colours = [a, b].iter().any(|map| !map.points.colours.is_empty());
    let mut points = OrientedPoints::default();
    let mut add = |side: &Side<'_>, index: usize| {
        let Some((point_m, normal)) = side.placed(index) else { return };
        points.points_m.push(point_m);
        points.normals.extend(normal.filter(|_| has_normals));
        if has_colours {
            points.colours.push(side.map.points.colours.get(index).copied().unwrap_or(NO_COLOUR));
        }
    };
    (0..of_a.len()).filter(|index| is_in_a[*index]).for_each(|index| add(of_a, index));
    let mut taken: HashSet<VoxelKey, BuildVoxelHasher> = HashSet::default();
    for index in (0..of_b.len()).filter(|index| is_in_b[*index]) {
        let Some((point_m, normal)) = of_b.placed(index) else { continue };
        if !nearby.has(&point_m, normal.as_ref()) && taken.insert(grid.key(&point_m)) {
            add(of_b, index);
        }
    }
    let mut views: MapViews = a.views.iter().copied().collect();
    for view in &b.views {
        let mut view = *view;
        view.map_from_camera = of_b.a_from_own * view.map_from_camera;
        views.add(view);
    }
    Some(SavedMap { points, views: views.as_slice().to_vec(), edge_m: a.edge_m })
}
