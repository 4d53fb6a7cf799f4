//! The true objects of each depth image, as tracks.

use std::collections::BTreeMap;

use geometry::Stamp;
use msgs::convert::time_from_stamp;
use msgs::geometry_msgs::{Point, Vector3};
use msgs::std_msgs::Header;
use msgs::stillmap_msgs::{Track, Tracks};
use simulator::{ObjectPose, ObjectPoses};

/// Remembers when each object was seen.
///
/// A track has the object's label as its id and the cuboid of the whole object, seen or not, as its extent.
/// Its position is the mean of what the image shows of the object; of one that it does not show, the middle of
/// that cuboid, with the images since it was last seen (or since the start) in `unseen_cycles`.
#[derive(Default)]
pub(super) struct TrueTracks {
    image: u32,
    seen: BTreeMap<u16, Sightings>,
}

#[derive(Clone, Copy)]
struct Sightings {
    first: Stamp,
    last_image: u32,
}

impl TrueTracks {
    /// The message of the next image.
    pub(super) fn of(&mut self, poses: &ObjectPoses) -> Tracks {
        let tracks = poses.objects.iter().map(|object| self.track(object, poses.stamp)).collect();
        let message = Tracks {
            header: Header {
                stamp: time_from_stamp(poses.stamp),
                frame_id: poses.frame_id.clone(),
            },
            cycle: self.image,
            tracks,
        };
        self.image += 1;
        message
    }

    fn track(&mut self, object: &ObjectPose, stamp: Stamp) -> Track {
        let image = self.image;
        if object.visible_pixels > 0 {
            let sightings =
                self.seen.entry(object.id).or_insert(Sightings { first: stamp, last_image: image });
            sightings.last_image = image;
        }
        let sightings = self.seen.get(&object.id);
        let position_m = object.visible_centroid_m.unwrap_or(object.centre_m);
        let vector =
            |vector: &nalgebra::Vector3<f64>| Vector3 { x: vector.x, y: vector.y, z: vector.z };
        Track {
            id: u32::from(object.id),
            position: Point { x: position_m.x, y: position_m.y, z: position_m.z },
            velocity: vector(&object.velocity_m_per_s),
            extent: vector(&object.extent_m),
            // Ground truth: no variance.
            covariance: [0.0; 36],
            age_s: sightings.map_or(0.0, |sightings| stamp.seconds_since(sightings.first)),
            unseen_cycles: sightings.map_or(image + 1, |sightings| image - sightings.last_image),
        }
    }
}
