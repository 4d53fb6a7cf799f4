//! `stillmap export`: a saved map in another form.

mod georeference;
mod selection;

use std::io::Cursor;
use std::path::{Path, PathBuf};

use clap::Args;
use geometry::{OccupancyGrid, OrientedPoints, Stamp, VoxelGrid, VoxelKey, pcd, ply};
use nalgebra::{Point3, Vector3};
use reconstruction::grid::{GridConfig, GridFloor, GridPoints, GridSource, grid_of_points};
use reconstruction::mesh::{self, mesh_of_points};
use reconstruction::{MeshForm, octomap};

use self::georeference::{Georeference, Holds};
use self::selection::Selection;
use crate::console;
use crate::e57_file;
use crate::existing::{check_folder, refuse_to_replace};
use crate::failure::{Failure, Outcome};
use crate::las_file::{LasError, LasFile, LasKind};
use crate::map_file::{MapFile, write};

/// The edge of an octomap's voxels by default.
const OCTOMAP_EDGE_M: f64 = 0.05;

/// Arguments of `stillmap export`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap export house.ply -o house.yaml
  stillmap export house.bt -o house.yaml --heights 0.1 0.6 --floor 0
  stillmap export house.ply -o house.bt --edge 0.05
  stillmap export house.ply -o house.glb
  stillmap export house.ply -o kitchen.laz --crop 0 -3 -inf 4 1 inf --thin 0.05
  stillmap export road.ply -o road.laz --transform 0 0 0 0 0 1.2 --origin 458000 5428000 112 --epsg 25832

house.yaml is what map_server of Nav2 loads; its image is house.pgm, beside it. The map's points say where it is occupied, and
free is where they show floor and nothing in the band: space that was seen free without its floor is in the grid of a running node
alone.

house.glb is the surface as triangles, as are .obj and with --mesh .ply. A saved map has points and normals, but no distances: the
triangles are put together from these. Those of the distances themselves are written by `stillmap run --mesh` and by the parameter
mesh_file of a running node.")]
pub struct ExportArgs {
    /// The map: a .ply, .pcd or octomap .bt file
    map: PathBuf,
    /// The file to write: .yaml for the occupancy grid (with its image, .pgm), .glb or .obj for triangles, or .ply, .pcd, .bt, .las, .laz, .e57
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Edge of the grid's cells
    #[arg(long, value_name = "METRES", default_value_t = GridConfig::default().grid_resolution_m)]
    resolution: f64,
    /// The heights above the floor between which something is an obstacle
    #[arg(long, num_args = 2, value_names = ["FROM", "TO"])]
    heights: Option<Vec<f64>>,
    /// The height of the floor in the map; found where it is not given
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    floor: Option<f64>,
    /// Edge of the voxels: of an octomap 0.05 m by default, of triangles that of the map
    #[arg(long, value_name = "METRES")]
    edge: Option<f64>,
    /// Write triangles to a .ply file, and not points
    #[arg(long)]
    mesh: bool,
    /// Replace a file of this name
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    selection: Selection,
    #[command(flatten)]
    georeference: Georeference,
}

/// The forms of a map, by the ending of the file's name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Form {
    Ply,
    Pcd,
    Octomap,
    Las { is_compressed: bool },
    E57,
    Grid,
    Mesh(MeshForm),
}

impl Form {
    fn of(path: &Path) -> Option<Self> {
        let extension = path.extension().and_then(|extension| extension.to_str());
        match extension?.to_ascii_lowercase().as_str() {
            "ply" => Some(Self::Ply),
            "pcd" => Some(Self::Pcd),
            "bt" => Some(Self::Octomap),
            "las" => Some(Self::Las { is_compressed: false }),
            "laz" => Some(Self::Las { is_compressed: true }),
            "e57" => Some(Self::E57),
            "yaml" => Some(Self::Grid),
            "obj" => Some(Self::Mesh(MeshForm::Obj)),
            "glb" => Some(Self::Mesh(MeshForm::Glb)),
            _ => None,
        }
    }

    /// What a file of this form can say of the earth.
    fn holds(self) -> Holds {
        match self {
            Self::Las { .. } => Holds::System,
            Self::E57 => Holds::Origin,
            Self::Ply | Self::Pcd | Self::Octomap | Self::Grid | Self::Mesh(_) => Holds::Nothing,
        }
    }
}

pub(crate) fn run(args: &ExportArgs) -> Result<Outcome, Failure> {
    let form = Form::of(&args.output).ok_or_else(|| {
        Failure::new(format!("{} is no map that is known", args.output.display()))
            .fix("-o must end in .yaml, .glb, .obj, .ply, .pcd, .bt, .las, .laz or .e57")
    })?;
    let form = match form {
        Form::Ply if args.mesh => Form::Mesh(MeshForm::Ply),
        Form::Mesh(_) => form,
        _ if args.mesh => {
            return Err(Failure::new(format!("{} holds no triangles", args.output.display()))
                .fix("with --mesh -o must end in .ply, .obj or .glb"));
        }
        _ => form,
    };
    args.georeference.check(form.holds())?;
    args.refuse_without_effect(form)?;
    let image = args.output.with_extension("pgm");
    let outputs =
        std::iter::once(args.output.clone()).chain((form == Form::Grid).then(|| image.clone()));
    refuse_to_replace(outputs, args.overwrite, "-o")?;
    check_folder(&args.output, "-o")?;
    let map = MapFile::read(&args.map)?;
    let points = args.selection.of(map.points)?;
    let views = args.selection.views_of(map.views)?;
    let OrientedPoints { points_m, normals, colours } = &points;
    let failed =
        |error: &dyn std::fmt::Display| Failure::new(format!("{}: {error}", args.map.display()));
    let mut size = String::new();
    let bytes = match form {
        Form::Ply => ply::encode_map(&points, &views),
        Form::Pcd => pcd::encode_with_colours(points_m, normals, colours),
        Form::Octomap => octomap_of(points_m, args.edge.unwrap_or(OCTOMAP_EDGE_M))?,
        Form::Las { is_compressed } => {
            las_of(&points, &args.georeference, is_compressed).map_err(|error| failed(&error))?
        }
        Form::E57 => e57_file::encode(&points, args.georeference.origin_m())
            .map_err(|error| failed(&error))?,
        Form::Mesh(form) => {
            let mesh = mesh_of_points(&points, args.edge).map_err(|error| failed(&error))?;
            size = format!(" of {} triangles", mesh.triangles.len());
            mesh::encode(&mesh, form).map_err(|error| failed(&error))?
        }
        Form::Grid => {
            let grid = grid(args, &points)?;
            let name = image.file_name().and_then(|name| name.to_str());
            let name = name.ok_or_else(|| Failure::new("the name of -o is no UTF-8"))?;
            write(&image, &grid.pgm())?;
            size = format!(" of {} x {} cells", grid.width, grid.height);
            grid.map_yaml(name).into_bytes()
        }
    };
    write(&args.output, &bytes)?;
    console::print(format_args!(
        "{}{size}, from {} points of {}",
        args.output.display(),
        points_m.len(),
        args.map.display()
    ))?;
    Ok(Outcome::Complete)
}

impl ExportArgs {
    /// Refuses options that a form does not have.
    fn refuse_without_effect(&self, form: Form) -> Result<(), Failure> {
        let is_grid = form == Form::Grid;
        let has_edge = matches!(form, Form::Octomap | Form::Mesh(_));
        let is_other = self.resolution != GridConfig::default().grid_resolution_m;
        let option = [
            (is_other && !is_grid, "--resolution is of the occupancy grid (.yaml)"),
            (self.heights.is_some() && !is_grid, "--heights are of the occupancy grid (.yaml)"),
            (self.floor.is_some() && !is_grid, "--floor is of the occupancy grid (.yaml)"),
            (self.edge.is_some() && !has_edge, "--edge is of an octomap (.bt) and of triangles"),
        ]
        .into_iter()
        .find_map(|(is_useless, what)| is_useless.then_some(what));
        match option {
            Some(what) => {
                Err(Failure::unusable(format!("{what}, and not of {}", self.output.display()))
                    .fix("leave it out; --thin METRES keeps one point for each voxel"))
            }
            None => Ok(()),
        }
    }
}

fn grid(args: &ExportArgs, points: &OrientedPoints) -> Result<OccupancyGrid, Failure> {
    let mut config = GridConfig {
        grid: GridSource::HeightBand,
        grid_resolution_m: args.resolution,
        ..GridConfig::default()
    };
    if let Some([from_m, to_m]) = args.heights.as_deref() {
        (config.grid_min_height_m, config.grid_max_height_m) = (*from_m, *to_m);
        // Of points it is not used, and must lie above the lower end.
        config.grid_free_below_m = *to_m;
    }
    if let Some(floor_m) = args.floor {
        (config.grid_floor, config.grid_floor_height_m) = (GridFloor::Given, floor_m);
    }
    config.validate().map_err(|error| Failure::unusable(error.to_string()))?;
    let OrientedPoints { points_m, normals, .. } = points;
    let points = GridPoints { points_m, normals };
    grid_of_points(&config, points, ("map", Stamp::default())).map_err(|error| {
        Failure::new(format!("{}: {error}", args.map.display()))
            .fix("--floor says how high the floor is in the map, --resolution how large a cell")
    })
}

/// The points with their colours, where they have some. A file of this kind has no normals.
fn las_of(
    points: &OrientedPoints,
    georeference: &Georeference,
    is_compressed: bool,
) -> Result<Vec<u8>, LasError> {
    let OrientedPoints { points_m, colours, .. } = points;
    let origin_m = Vector3::from(georeference.origin_m());
    let on_earth_m = |point_m: &Point3<f32>| (point_m.cast() + origin_m).into();
    let first_m = on_earth_m(points_m.first().unwrap_or(&Point3::origin()));
    let (has_colour, epsg) = (!colours.is_empty(), georeference.epsg());
    let kind = LasKind { has_colour, is_compressed, epsg };
    let mut file = LasFile::new(Cursor::new(Vec::new()), first_m, kind)?;
    for (index, point_m) in points_m.iter().enumerate() {
        file.push(on_earth_m(point_m), 0, colours.get(index).copied())?;
    }
    Ok(file.finish()?.into_inner())
}

fn octomap_of(points_m: &[Point3<f32>], edge_m: f64) -> Result<Vec<u8>, Failure> {
    let wrong = |error: &dyn std::fmt::Display| Failure::unusable(format!("--edge: {error}"));
    let grid = VoxelGrid::new(edge_m).map_err(|error| wrong(&error))?;
    let voxels: Vec<VoxelKey> = points_m.iter().map(|point| grid.key(point)).collect();
    octomap::encode(edge_m, &voxels).map_err(|error| wrong(&error))
}

/// Options from a command line.
#[cfg(test)]
fn options_for_test<T: Args>(options: &str) -> T {
    let words = std::iter::once("test").chain(options.split_whitespace());
    let matches = T::augment_args(clap::Command::new("test")).get_matches_from(words);
    T::from_arg_matches(&matches).unwrap()
}

#[cfg(test)]
mod tests;
