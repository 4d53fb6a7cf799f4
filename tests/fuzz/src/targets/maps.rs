//! Saved maps: points, octomaps, keyframes, blocks of a surface, occupancy grids, meshes.

use std::sync::Arc;

use geometry::{GridCell, MapView, OccupancyGrid, OrientedPoints, Stamp, VoxelKey, pcd, ply};
use nalgebra::{Isometry3, Point2, Point3, Vector3};
use pose::feature::lines::{LineDescriptor, LineFeature, LineSegment};
use pose::feature::points::{Corner, Descriptor};
use pose::frame::Frame;
use pose::map::{Map, MapConfig, NewKeyframe};
use pose::saved_map::SavedMap;
use reconstruction::octomap;
use volume::{Surface, SurfaceConfig};

use super::bags::on_disk;
use super::{FAST, OF_FILES, VALUES, samples};
use crate::{MemoryBound, Target, checksums};

/// The most voxels that an octomap may have here: 12 bytes each.
const MOST_VOXELS: usize = 100_000;

const fn target(
    name: &'static str,
    body: fn(&[u8]),
    seeds: fn() -> Vec<Vec<u8>>,
    words: &'static [&'static [u8]],
) -> Target {
    Target { name, body, seeds, words, memory: VALUES, gate_cases: FAST }
}

pub(super) const TARGETS: &[Target] = &[
    target(
        "ply",
        |bytes| {
            let _ = ply::decode(bytes);
            let _ = ply::views_of(bytes);
            if let Ok(points) = ply::decode_with_normals(bytes) {
                check(&points);
            }
        },
        || vec![ply::encode_map(&points(), &views()), ascii_ply()],
        &[
            b"element vertex ",
            b"property float ",
            b"property list uchar int ",
            b"end_header\n",
            b"ascii",
            b"x\n",
            b"double",
            b"comment view ",
        ],
    ),
    Target {
        // Three bytes are up to 264 ones when they were compressed.
        memory: MemoryBound { base_bytes: 4 << 20, per_byte: 88 * 12 },
        ..target(
            "pcd",
            |bytes| {
                let _ = pcd::decode(bytes);
                if let Ok(points) = pcd::decode_with_normals(bytes) {
                    check(&points);
                }
            },
            || vec![pcd_file(), ascii_pcd(), compressed_pcd()],
            &[
                b"POINTS ",
                b"COUNT ",
                b"DATA ascii\n",
                b"DATA binary\n",
                b"DATA binary_compressed\n",
                b"FIELDS ",
                b" x",
                b" F",
                b" 8",
                &[0xe0, 0xff],
            ],
        )
    },
    Target {
        memory: MemoryBound { base_bytes: 4 << 20, per_byte: 96 },
        ..target(
            "octomap",
            |bytes| {
                if let Ok(octree) = octomap::decode(bytes, MOST_VOXELS) {
                    assert!(octree.voxels.len() <= MOST_VOXELS);
                }
            },
            octomaps,
            &[b"size ", b"res ", b"id OcTree\n", b"data\n", &[0xff, 0xff], &[0x55, 0x55]],
        )
    },
    Target {
        memory: MemoryBound { base_bytes: 4 << 20, per_byte: 256 },
        gate_cases: FAST / 4,
        ..target("keyframes", keyframes, keyframe_maps, &[])
    },
    target("surface_block", surface_block, surface_blocks, &[b"SMVB"]),
    Target {
        gate_cases: OF_FILES,
        ..target(
            "occupancy_grid",
            occupancy_grid,
            || vec![grid_file()],
            &[b"image: ", b"resolution: ", b"origin: [", b"P5\n", b"255\n", b"\0", b"&a [", b"*a"],
        )
    },
    Target {
        memory: MemoryBound { base_bytes: 8 << 20, per_byte: 1024 },
        gate_cases: OF_FILES,
        ..target(
            "mesh_file",
            mesh_file,
            mesh_files,
            &[
                b"f 1 2 3\n",
                b"v 0 0 1\n",
                b"solid",
                b"facet normal",
                b"element face ",
                b"property list uchar int vertex_indices\n",
                b"end_header\n",
            ],
        )
    },
];

fn points() -> OrientedPoints {
    OrientedPoints {
        points_m: vec![Point3::new(1.0, -2.0, 0.5), Point3::new(0.0, 3.0, 0.25)],
        normals: vec![Vector3::x(), Vector3::z()],
        colours: vec![[255, 128, 1], [0, 0, 0]],
    }
}

fn views() -> Vec<MapView> {
    let camera =
        geometry::CameraModel { distortion: geometry::Distortion::None, ..samples::camera() };
    vec![MapView {
        stamp: samples::STAMP,
        map_from_camera: Isometry3::translation(1.0, 2.0, 0.5),
        camera,
    }]
}

fn check(points: &OrientedPoints) {
    let OrientedPoints { points_m, normals, colours } = points;
    assert!(points_m.iter().all(geometry::is_finite));
    assert!(normals.is_empty() || normals.len() == points_m.len());
    assert!(colours.is_empty() || colours.len() == points_m.len());
    let again = ply::decode_with_normals(&ply::encode_map(points, &[])).expect("our own file");
    assert_eq!(again.points_m.len(), points_m.len());
}

fn ascii_ply() -> Vec<u8> {
    b"ply\nformat ascii 1.0\ncomment view 1 2 3\nelement vertex 2\nproperty float x\nproperty double y\nproperty float z\n\
      property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n1 2 3 4 5 6\n7 8 9 1 2 3\n"
        .to_vec()
}

fn pcd_file() -> Vec<u8> {
    let OrientedPoints { points_m, normals, colours } = points();
    pcd::encode_with_colours(&points_m, &normals, &colours)
}

fn ascii_pcd() -> Vec<u8> {
    b"# .PCD v.7\nVERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\n\
      VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1.5 -2.5 3.5 4.2e-38\n1 2 3 0\n"
        .to_vec()
}

/// Two points: a byte and its copies, then literal bytes.
fn compressed_pcd() -> Vec<u8> {
    let mut file = b"VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nPOINTS 2\nDATA binary_compressed\n".to_vec();
    file.extend([14, 0, 0, 0, 24, 0, 0, 0]);
    file.extend([0, 0, 0xe0, 5, 0, 8, 0, 0, 64, 63, 1, 2, 3, 4, 5]);
    file
}

fn octomaps() -> Vec<Vec<u8>> {
    let voxel = |x, y, z| VoxelKey { x, y, z };
    let voxels = [voxel(0, 0, 0), voxel(-3, 7, 1), voxel(100, 2, -5)];
    let cube = (0..64).map(|i| voxel(i % 4, i / 4 % 4, i / 16));
    [voxels.to_vec(), cube.collect()]
        .iter()
        .flat_map(|voxels| octomap::encode(0.05, voxels))
        .collect()
}

fn keyframes(bytes: &[u8]) {
    if let Ok(saved) = SavedMap::decode(&checksums::of_keyframes(bytes)) {
        assert_eq!(saved.map.check(), Ok(()));
        let written = saved.encode().expect("a map can be encoded");
        let again = SavedMap::decode(&written).expect("a map can be read");
        assert!(again.encode().as_ref() == Ok(&written), "it is not what was written");
    }
}

/// Two keyframes that see a point and a line.
fn keyframe_maps() -> Vec<Vec<u8>> {
    let corner = Corner {
        pixel: Point2::new(2.0, 1.0),
        level: 0,
        angle_rad: 0.5,
        response: 20.0,
        descriptor: Descriptor([1, 2, 3, 4]),
    };
    let segment = LineSegment { start_px: [0.0, 1.0], end_px: [3.0, 1.0], response: 1.0 };
    let line = LineFeature { segment, descriptor: LineDescriptor([5, 6, 7, 8]) };
    let frame = Arc::new(Frame {
        stamp: Stamp::from_nanos(7),
        corners: vec![corner; 3],
        corner_depths: vec![None; 3],
        lines: vec![line; 2],
        lines_in_space: vec![None; 2],
    });
    let mut map = Map::new(MapConfig::default());
    let camera =
        geometry::CameraModel { distortion: geometry::Distortion::None, ..samples::camera() };
    let keyframe = |shift_m: f64, points, lines| NewKeyframe {
        camera,
        camera_from_map: Isometry3::translation(shift_m, 0.0, 0.0),
        frame: Arc::clone(&frame),
        points,
        lines,
        by_odometry: None,
    };
    let first = map.insert_keyframe(keyframe(0.0, &[], &[])).expect("the map is empty");
    let point = map.insert_point(first, 0, &Point3::new(0.1, 0.1, 2.0)).expect("a free corner");
    let ends_m = [Point3::new(0.1, 0.1, 2.0), Point3::new(0.5, 0.1, 2.0)];
    let line = map.insert_line(first, 0, &ends_m).expect("a free segment");
    map.insert_keyframe(keyframe(0.1, &[(0, point)], &[(1, line)])).expect("there is room");
    let saved = |map: Map| SavedMap { map, world_from_map: Isometry3::identity() };
    let maps = [saved(map), saved(Map::new(MapConfig::default()))];
    maps.iter().flat_map(SavedMap::encode).collect()
}

fn surface() -> Surface {
    let config = SurfaceConfig { max_blocks: 8, has_colour: true, ..SurfaceConfig::default() };
    Surface::new(config).expect("a surface of 2 cm")
}

fn surface_block(bytes: &[u8]) {
    let mut surface = surface();
    if let Ok(key) = surface.put_block(bytes) {
        let written = surface.block_bytes(key).expect("it was put");
        let again = surface.put_block(&written);
        assert_eq!(again, Ok(key));
        let _ = surface.memory_bytes();
        assert!(surface.remove_block(key));
    }
}

/// By the table of `volume/src/surface/bytes.rs`: a block with one node, without colour and with it.
fn surface_blocks() -> Vec<Vec<u8>> {
    let block = |has_colour: bool| {
        let mut bytes = b"SMVB".to_vec();
        bytes.extend([3, 0, u8::from(has_colour), 5]);
        bytes.extend(0.02_f64.to_le_bytes());
        bytes.extend(4.0_f64.to_le_bytes());
        bytes.extend([1_i32, -2, 3].iter().flat_map(|along| along.to_le_bytes()));
        bytes.extend(
            [1_000_000_000_i64, 2_000_000_000, i64::MIN].iter().flat_map(|at| at.to_le_bytes()),
        );
        bytes.extend([0.5_f32; 6].iter().flat_map(|along_m| along_m.to_le_bytes()));
        bytes.push(1);
        bytes.extend([0; 63]);
        bytes.extend([0x10, 0x20, 3, 0]);
        bytes.extend([9, 8, 7].iter().take(if has_colour { 3 } else { 0 }));
        bytes
    };
    vec![block(false), block(true)]
}

/// The YAML file, a zero, the image.
fn occupancy_grid(bytes: &[u8]) {
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    let yaml = parts.next().unwrap_or_default();
    on_disk("grid/map.pgm", parts.next().unwrap_or_default(), |_| ());
    on_disk("grid/map.yaml", yaml, |path| drop(laboratory::read_grid(path)));
}

fn grid_file() -> Vec<u8> {
    let grid = OccupancyGrid {
        resolution_m: 0.05,
        least: [-3, 2],
        width: 3,
        height: 2,
        cells: [GridCell::Free, GridCell::Occupied, GridCell::Unknown].repeat(2),
        ..OccupancyGrid::default()
    };
    [grid.map_yaml("map.pgm").as_bytes(), &[0], &grid.pgm()].concat()
}

/// The first byte says which kind of file the others are.
fn mesh_file(bytes: &[u8]) {
    let Some((kind, file)) = bytes.split_first() else { return };
    let name = ["mesh.ply", "mesh.obj", "mesh.stl"].get(usize::from(*kind) % 3).copied();
    on_disk(name.unwrap_or_default(), file, |path| drop(laboratory::read_mesh(path)));
}

fn mesh_files() -> Vec<Vec<u8>> {
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let ascii = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
    let mut binary = vec![2];
    binary.extend([0; 80]);
    binary.extend(1_u32.to_le_bytes());
    binary.extend([0_u8; 50]);
    let text = |kind: u8, text: &str| [&[kind], text.as_bytes()].concat();
    vec![text(0, ply), text(1, obj), text(2, ascii), binary]
}
