//! GLB, the binary form of glTF 2.0 (Khronos, "glTF 2.0 specification", section 4.4): a chunk of JSON, by `gltf-json`, and one of
//! numbers. One mesh in one node.
//!
//! Colours are `COLOR_0`, linear light as the specification has it (section 3.9.2), with 16 bits: cameras give sRGB.

use std::collections::BTreeMap;

use geometry::TriangleMesh;
use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Target, View};
use gltf_json::material::{PbrMetallicRoughness, StrengthFactor};
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::scene::UnitQuaternion;
use gltf_json::validation::Checked::{self, Valid};
use gltf_json::{Accessor, Buffer, Index, Material, Mesh, Node, Root, Scene, Value};

use super::MeshError;

const MAGIC: &[u8; 4] = b"glTF";
const VERSION: u32 = 2;
const JSON: &[u8; 4] = b"JSON";
const NUMBERS: &[u8; 4] = b"BIN\0";
/// Of the file, and of a chunk: the length and the kind.
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
/// A quarter turn about x, from z up to y up: x, y, z, w.
const Y_UP_FROM_Z_UP: [f32; 4] =
    [-std::f32::consts::FRAC_1_SQRT_2, 0.0, 0.0, std::f32::consts::FRAC_1_SQRT_2];

/// The numbers, and what the JSON says of them.
#[derive(Default)]
struct Numbers {
    bytes: Vec<u8>,
    root: Root,
}

impl Numbers {
    /// Adds the numbers of one kind; each item has a multiple of four bytes.
    fn add(
        &mut self,
        numbers: impl Iterator<Item = u8>,
        count: usize,
        target: Target,
        (component, type_, normalized): (ComponentType, Type, bool),
    ) -> Index<Accessor> {
        let offset = self.bytes.len();
        self.bytes.extend(numbers);
        let view = self.root.push(View {
            buffer: Index::new(0),
            byte_length: (self.bytes.len() - offset).into(),
            byte_offset: Some(offset.into()),
            byte_stride: None,
            target: Some(Valid(target)),
            extensions: None,
            extras: Default::default(),
        });
        self.root.push(Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: count.into(),
            component_type: Valid(GenericComponentType(component)),
            type_: Valid(type_),
            min: None,
            max: None,
            normalized,
            sparse: None,
            extensions: None,
            extras: Default::default(),
        })
    }
}

pub(super) fn encode(mesh: &TriangleMesh) -> Result<Vec<u8>, MeshError> {
    let Numbers { bytes, root } = numbers_of(mesh);
    let mut json =
        root.to_vec().map_err(|error| MeshError::Header { reason: error.to_string() })?;
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = HEADER_BYTES + 2 * CHUNK_HEADER_BYTES + json.len() + bytes.len();
    let too_large = || MeshError::TooLarge { triangles: mesh.triangles.len() };
    let size = |bytes: usize| u32::try_from(bytes).map_err(|_| too_large());
    let mut file = Vec::with_capacity(length);
    file.extend(MAGIC);
    file.extend(VERSION.to_le_bytes());
    file.extend(size(length)?.to_le_bytes());
    for (kind, chunk) in [(JSON, json), (NUMBERS, bytes)] {
        file.extend(size(chunk.len())?.to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    Ok(file)
}

fn numbers_of(mesh: &TriangleMesh) -> Numbers {
    let TriangleMesh { points_m, normals, colours, triangles } = mesh;
    let mut numbers = Numbers::default();
    let count = points_m.len();
    let vector = (ComponentType::F32, Type::Vec3, false);
    let places =
        points_m.iter().flat_map(|point| point.iter()).flat_map(|along| along.to_le_bytes());
    let positions = numbers.add(places, count, Target::ArrayBuffer, vector);
    if let Some(accessor) = numbers.root.accessors.get_mut(positions.value()) {
        let bound = |fold: fn(f32, f32) -> f32, from: f32| {
            let bound = points_m.iter().fold([from; 3], |[x, y, z], point| {
                [fold(x, point.x), fold(y, point.y), fold(z, point.z)]
            });
            Some(Value::from(bound.to_vec()))
        };
        accessor.min = bound(f32::min, f32::INFINITY);
        accessor.max = bound(f32::max, f32::NEG_INFINITY);
    }
    let mut attributes = BTreeMap::from([(Valid(Semantic::Positions), positions)]);
    if normals.len() == count {
        let along =
            normals.iter().flat_map(|normal| normal.iter()).flat_map(|along| along.to_le_bytes());
        let accessor = numbers.add(along, count, Target::ArrayBuffer, vector);
        attributes.insert(Valid(Semantic::Normals), accessor);
    }
    if colours.len() == count {
        let linear = linear_of_srgb();
        let parts = colours.iter().flat_map(|[red, green, blue]| {
            let [red, green, blue] = [red, green, blue].map(|part| linear[usize::from(*part)]);
            [red, green, blue, u16::MAX].into_iter().flat_map(u16::to_le_bytes)
        });
        let kind = (ComponentType::U16, Type::Vec4, true);
        let accessor = numbers.add(parts, count, Target::ArrayBuffer, kind);
        attributes.insert(Valid(Semantic::Colors(0)), accessor);
    }
    let corners = triangles.iter().flatten().flat_map(|index| index.to_le_bytes());
    let kind = (ComponentType::U32, Type::Scalar, false);
    let indices = numbers.add(corners, 3 * triangles.len(), Target::ElementArrayBuffer, kind);
    numbers.add_scene(attributes, indices);
    numbers
}

impl Numbers {
    fn add_scene(
        &mut self,
        attributes: BTreeMap<Checked<Semantic>, Index<Accessor>>,
        indices: Index<Accessor>,
    ) {
        let root = &mut self.root;
        root.asset.generator = Some("stillmap".to_owned());
        root.push(Buffer {
            byte_length: self.bytes.len().into(),
            uri: None,
            extensions: None,
            extras: Default::default(),
        });
        // Walls as a camera shows them, from both sides.
        let material = root.push(Material {
            double_sided: true,
            pbr_metallic_roughness: PbrMetallicRoughness {
                metallic_factor: StrengthFactor(0.0),
                roughness_factor: StrengthFactor(1.0),
                ..PbrMetallicRoughness::default()
            },
            ..Material::default()
        });
        let primitive = Primitive {
            attributes,
            indices: Some(indices),
            material: Some(material),
            mode: Valid(Mode::Triangles),
            targets: None,
            extensions: None,
            extras: Default::default(),
        };
        let mesh = root.push(Mesh {
            primitives: vec![primitive],
            weights: None,
            extensions: None,
            extras: Default::default(),
        });
        let rotation = Some(UnitQuaternion(Y_UP_FROM_Z_UP));
        let node = root.push(Node { mesh: Some(mesh), rotation, ..Node::default() });
        let scene =
            root.push(Scene { nodes: vec![node], extensions: None, extras: Default::default() });
        root.scene = Some(scene);
    }
}

/// Linear light of each part of a colour in sRGB (IEC 61966-2-1), in 65535ths.
fn linear_of_srgb() -> [u16; 256] {
    std::array::from_fn(|part| {
        let part = part as f64 / 255.0;
        let linear =
            if part <= 0.040_45 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) };
        (linear * f64::from(u16::MAX)).round() as u16
    })
}
