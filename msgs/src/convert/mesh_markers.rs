//! Markers: what a viewer draws of the map's triangles.

use geometry::{MeshPiece, MeshUpdate, TriangleMesh};
use nalgebra::Point3;

use super::pose::header_of;
use super::{ConvertError, stamp_from_time};
use crate::geometry_msgs::{Point, Pose, Vector3};
use crate::std_msgs::{ColorRGBA, Header};
use crate::visualization_msgs::{Marker, MarkerArray};

/// Blocks along the edge of a region, the one around the origin with as many on both sides: a marker's number has ten bits for each
/// axis of a block within its region, and its namespace is the region.
const REGION_BLOCKS: i32 = 1024;
/// Of what has no colour: a viewer lights it.
const GREY: ColorRGBA = ColorRGBA { r: 0.75, g: 0.75, b: 0.75, a: 1.0 };

/// A list of triangles for each block that has some, and the removal of the marker of one that has none any more. If all
/// triangles go first, all markers do.
#[must_use]
pub fn markers_from_mesh(update: &MeshUpdate) -> MarkerArray {
    let header = header_of(update.stamp, &update.frame_id);
    let clear = Marker { header: header.clone(), action: Marker::DELETEALL, ..Marker::default() };
    let clear = update.is_anew.then_some(clear);
    let pieces = update.pieces.iter().map(|piece| marker(&header, piece));
    MarkerArray { markers: clear.into_iter().chain(pieces).collect() }
}

fn marker(header: &Header, piece: &MeshPiece) -> Marker {
    let (ns, id) = name(piece.block);
    let named = Marker { header: header.clone(), ns, id, ..Marker::default() };
    if piece.mesh.triangles.is_empty() {
        return Marker { action: Marker::DELETE, ..named };
    }
    let mut pose = Pose::default();
    pose.orientation.w = 1.0;
    let (points, colors) = corners(&piece.mesh);
    Marker {
        r#type: Marker::TRIANGLE_LIST,
        action: Marker::ADD,
        pose,
        scale: Vector3 { x: 1.0, y: 1.0, z: 1.0 },
        color: GREY,
        points,
        colors,
        ..named
    }
}

/// The points of the triangles, and a colour for each or none.
fn corners(mesh: &TriangleMesh) -> (Vec<Point>, Vec<ColorRGBA>) {
    let indices = || mesh.triangles.iter().flatten().map(|index| *index as usize);
    let points = indices().filter_map(|index| mesh.points_m.get(index)).map(|point_m| {
        let [x, y, z] = point_m.coords.map(f64::from).into();
        Point { x, y, z }
    });
    let colours = indices().filter_map(|index| mesh.colours.get(index)).map(|colour| {
        let [r, g, b] = colour.map(|part| f32::from(part) / 255.0);
        ColorRGBA { r, g, b, a: 1.0 }
    });
    (points.collect(), colours.collect())
}

/// The namespace and number of a block.
fn name(block: [i32; 3]) -> (String, i32) {
    let shifted = block.map(|along| i64::from(along) + i64::from(REGION_BLOCKS / 2));
    let [x, y, z] = shifted.map(|along| along.div_euclid(REGION_BLOCKS.into()));
    let within = shifted.map(|along| along.rem_euclid(REGION_BLOCKS.into()) as i32);
    let id = (within[2] * REGION_BLOCKS + within[1]) * REGION_BLOCKS + within[0];
    let ns = if [x, y, z] == [0; 3] { "mesh".to_owned() } else { format!("mesh {x} {y} {z}") };
    (ns, id)
}

/// What [`markers_from_mesh`] has made markers of, but that each corner of a triangle is a vertex of its own, without a normal.
///
/// # Errors
/// When a marker is none of those.
pub fn mesh_from_markers(markers: &MarkerArray) -> Result<MeshUpdate, ConvertError> {
    let header = markers.markers.first().map(|marker| &marker.header);
    let mut update = MeshUpdate {
        stamp: header.map(|header| stamp_from_time(header.stamp)).unwrap_or_default(),
        frame_id: header.map(|header| header.frame_id.clone()).unwrap_or_default(),
        ..MeshUpdate::default()
    };
    for marker in &markers.markers {
        if marker.action == Marker::DELETEALL {
            update.is_anew = true;
            update.pieces.clear();
        } else {
            update.pieces.push(piece_of(marker)?);
        }
    }
    Ok(update)
}

fn piece_of(marker: &Marker) -> Result<MeshPiece, ConvertError> {
    let Marker { ns, id, action, points, colors, .. } = marker;
    let is_coloured = !colors.is_empty();
    let is_list = *action == Marker::DELETE
        || marker.r#type == Marker::TRIANGLE_LIST
            && points.len().is_multiple_of(3)
            && (!is_coloured || colors.len() == points.len());
    let block = block_of(ns, *id).filter(|_| is_list);
    let Some(block) = block else {
        let (points, colours) = (points.len(), colors.len());
        return Err(ConvertError::MeshMarker { ns: ns.clone(), id: *id, points, colours });
    };
    if *action == Marker::DELETE {
        return Ok(MeshPiece { block, ..MeshPiece::default() });
    }
    let corner = |Point { x, y, z }: &Point| Point3::new(*x as f32, *y as f32, *z as f32);
    // The casts saturate.
    let shade = |part: f32| (255.0 * part).round() as u8;
    let colour = |colour: &ColorRGBA| [colour.r, colour.g, colour.b].map(shade);
    let mesh = TriangleMesh {
        points_m: points.iter().map(corner).collect(),
        colours: colors.iter().map(colour).collect(),
        triangles: (0..points.len() as u32 / 3).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect(),
        ..TriangleMesh::default()
    };
    Ok(MeshPiece { block, mesh })
}

/// The block of a namespace and number.
fn block_of(ns: &str, id: i32) -> Option<[i32; 3]> {
    let mut words = ns.split(' ');
    let region: Vec<i64> = (words.next()? == "mesh")
        .then(|| words.map(|word| word.parse().ok()).collect::<Option<_>>())??;
    let region: [i64; 3] = if region.is_empty() { [0; 3] } else { region.try_into().ok()? };
    let id = u32::try_from(id).ok()?.cast_signed();
    let within = [id, id / REGION_BLOCKS, id / REGION_BLOCKS / REGION_BLOCKS]
        .map(|along| i64::from(along % REGION_BLOCKS - REGION_BLOCKS / 2));
    let mut block = [0; 3];
    for (along, (region, within)) in block.iter_mut().zip(region.into_iter().zip(within)) {
        let first = region.checked_mul(REGION_BLOCKS.into())?;
        *along = i32::try_from(first.checked_add(within)?).ok()?;
    }
    Some(block)
}

#[cfg(test)]
mod tests {
    use geometry::Stamp;
    use nalgebra::Point3;

    use super::*;

    fn piece(block: [i32; 3], colours: Vec<[u8; 3]>) -> MeshPiece {
        let points_m = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.5], [0.0, 0.0, 0.0]];
        let mesh = TriangleMesh {
            points_m: points_m.map(Point3::from).to_vec(),
            colours,
            triangles: vec![[0, 1, 2], [2, 1, 3]],
            ..TriangleMesh::default()
        };
        MeshPiece { block, mesh }
    }

    #[test]
    fn each_block_is_a_marker_of_its_own() {
        let colours = vec![[255, 0, 0], [0, 51, 0], [0, 0, 255], [0; 3]];
        let gone = MeshPiece { block: [-1, 0, 7], ..MeshPiece::default() };
        let update = MeshUpdate {
            stamp: Stamp::from_secs_nanos(3, 4),
            frame_id: "map".to_owned(),
            is_anew: true,
            pieces: vec![piece([0; 3], colours), piece([1, 0, 0], Vec::new()), gone],
        };
        let markers = markers_from_mesh(&update).markers;
        let actions: Vec<_> = markers.iter().map(|marker| marker.action).collect();
        assert_eq!(actions, [Marker::DELETEALL, Marker::ADD, Marker::ADD, Marker::DELETE]);
        assert!(markers.iter().all(|marker| marker.header.frame_id == "map"));
        let [coloured, plain, gone] = &markers[1..] else { panic!() };
        assert_eq!((coloured.points.len(), coloured.colors.len()), (6, 6));
        assert_eq!((plain.points.len(), plain.colors.len()), (6, 0));
        assert_eq!(coloured.points[3], Point { x: 7.0, y: 8.0, z: 9.5 });
        assert_eq!((coloured.colors[1].g, coloured.colors[3].b), (0.2, 1.0));
        assert_eq!((coloured.r#type, coloured.pose.orientation.w), (Marker::TRIANGLE_LIST, 1.0));
        assert!(coloured.scale.x == 1.0 && plain.color.a == 1.0);
        assert_eq!((&*gone.ns, gone.points.len()), ("mesh", 0));
        assert_eq!(plain.id - coloured.id, 1);
        let back = mesh_from_markers(&MarkerArray { markers: markers.clone() }).unwrap();
        assert!(back.is_anew && back.stamp == update.stamp && back.frame_id == "map");
        let blocks: Vec<_> = back.pieces.iter().map(|piece| piece.block).collect();
        assert_eq!(blocks, [[0; 3], [1, 0, 0], [-1, 0, 7]]);
        let meshes: Vec<_> = back.pieces.iter().map(|piece| &piece.mesh).collect();
        assert_eq!(meshes[0].triangles, [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(meshes[0].points_m[3], Point3::new(7.0, 8.0, 9.5));
        assert_eq!(meshes[0].colours[1], [0, 51, 0]);
        assert!(meshes[1].colours.is_empty() && meshes[2].triangles.is_empty());
    }

    #[test]
    fn a_marker_that_is_no_block_is_an_error_that_names_it() {
        let ok = markers_from_mesh(&MeshUpdate {
            pieces: vec![piece([0; 3], vec![[9; 3]; 4])],
            ..MeshUpdate::default()
        });
        let changes: [fn(&mut Marker); 6] = [
            |marker| marker.ns = "tracks".to_owned(),
            |marker| marker.ns = "mesh 1 2".to_owned(),
            |marker| marker.ns = format!("mesh {} 0 0", i64::MAX),
            |marker| marker.id = -1,
            |marker| marker.r#type = Marker::SPHERE,
            |marker| marker.points.truncate(5),
        ];
        for change in changes {
            let mut markers = ok.clone();
            change(&mut markers.markers[0]);
            let error = mesh_from_markers(&markers).unwrap_err().to_string();
            assert!(error.contains(" is no block of a mesh"), "{error}");
        }
    }

    #[test]
    fn no_two_blocks_have_one_name() {
        let along = [i32::MIN, -1537, -1536, -513, -512, -1, 0, 511, 512, 1535, 1536, i32::MAX];
        let mut names = std::collections::BTreeSet::new();
        for x in along {
            for y in along {
                for z in along {
                    let (ns, id) = name([x, y, z]);
                    assert_eq!(block_of(&ns, id), Some([x, y, z]));
                    assert!(id >= 0 && names.insert((ns, id)), "{x} {y} {z}");
                }
            }
        }
        assert_eq!(name([-512, 511, 0]).0, "mesh");
        assert_eq!(name([512, 0, -513]).0, "mesh 1 0 -1");
    }
}
