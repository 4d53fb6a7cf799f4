//! Images of maps side by side: the empty scene, without removal, and by each method.

use nalgebra::Point3;
use report::{PagePicture, PictureError, View, cloud_pictures};

use super::figures::{Clouds, RunFigures};
use super::runs::METHODS;
use robot::Failure;

/// The view of a map.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Face {
    /// In the direction of the sensors: right is right, up is up.
    Front,
    /// From above: ahead is right, left is up.
    Above,
    /// From the right-hand side: ahead is right, up is up.
    Side,
}

impl Face {
    fn text(self) -> &'static str {
        match self {
            Self::Front => "from the front",
            Self::Above => "from above",
            Self::Side => "from the side",
        }
    }

    fn view(self) -> View {
        match self {
            // The side view of a cloud that was rotated so that its right is ahead.
            Self::Front | Self::Side => View::Side,
            Self::Above => View::Top,
        }
    }

    fn turned(self, points_m: &[Point3<f32>]) -> Vec<Point3<f32>> {
        match self {
            Self::Front => points_m.iter().map(|p| Point3::new(-p.y, p.x, p.z)).collect(),
            Self::Above | Self::Side => points_m.to_vec(),
        }
    }
}

/// The empty scene, the map without removal, and the map of each method, in one frame. `runs` are one scenario
/// by rec_hv and by free_space; without clouds there is no image.
pub(crate) fn map_pictures(
    face: Face,
    of: &str,
    runs: [Option<&RunFigures>; 2],
) -> Result<Vec<PagePicture>, Failure> {
    let clouds = runs.map(|run| run.and_then(|run| run.clouds.as_ref()));
    let [Some(rec_hv), Some(free_space)] = clouds else { return Ok(Vec::new()) };
    let named: [(&str, &[Point3<f32>]); 4] = [
        ("empty scene, true surface", &rec_hv.empty_scene),
        ("nothing removed", &rec_hv.without_removal),
        (METHODS[0].name(), &rec_hv.map),
        (METHODS[1].name(), &free_space.map),
    ];
    let pictures = draw(face, &named.map(|(_, cloud)| cloud), rec_hv)
        .map_err(|error| Failure::new(format!("cannot draw the maps: {error}")))?;
    let page_picture =
        |(picture, (name, cloud)): (report::CloudPicture, (&str, &[Point3<f32>]))| {
            let points = cloud.len();
            PagePicture {
                png: picture.png,
                size_px: picture.size_px,
                caption: format!("{name}, {}", face.text()),
                alt: format!("Map of {of} {}, {name}: {points} points.", face.text()),
            }
        };
    Ok(pictures.into_iter().zip(named).map(page_picture).collect())
}

fn draw(
    face: Face,
    clouds: &[&[Point3<f32>]],
    frame_of: &Clouds,
) -> Result<Vec<report::CloudPicture>, PictureError> {
    let turned: Vec<Vec<_>> = clouds.iter().map(|cloud| face.turned(cloud)).collect();
    let turned: Vec<&[_]> = turned.iter().map(Vec::as_slice).collect();
    cloud_pictures(face.view(), &turned, &face.turned(&frame_of.path), frame_of.edge_m)
}

#[cfg(test)]
mod tests {
    use super::super::figures::tests::run;
    use super::*;

    #[test]
    fn there_are_four_pictures_where_there_are_clouds() {
        let wall: Vec<_> = (0..10).map(|y| Point3::new(3.0, y as f32 * 0.1, 0.0)).collect();
        let clouds = Clouds {
            edge_m: 0.1,
            map: wall.clone(),
            without_removal: wall.clone(),
            empty_scene: wall,
            path: vec![Point3::origin()],
        };
        let with_clouds = RunFigures { clouds: Some(clouds), ..run(1, Vec::new()) };
        for face in [Face::Front, Face::Above, Face::Side] {
            let pictures = map_pictures(face, "B", [Some(&with_clouds); 2]).unwrap();
            assert_eq!(pictures.len(), 4);
            assert!(pictures[3].caption.starts_with("free_space"), "{}", pictures[3].caption);
        }
        let without = run(1, Vec::new());
        assert!(map_pictures(Face::Front, "B", [Some(&without); 2]).unwrap().is_empty());
    }
}
