//! Markers: what a viewer draws of the tracks.

use geometry::{Stamp, Track};
use nalgebra::{Isometry3, Translation3, Vector3};

use super::pose::{header_of, message_from_point, pose_from_isometry};
use crate::builtin_interfaces::Duration;
use crate::geometry_msgs::Vector3 as Size;
use crate::std_msgs::{ColorRGBA, Header};
use crate::visualization_msgs::{Marker, MarkerArray};

/// A marker that is not renewed is gone after this many seconds: several cycles of a scanner.
const LIFETIME_S: i32 = 1;
/// Slower than this, an object is drawn without an arrow: a direction would be noise.
const SLOWEST_ARROW_M_PER_S: f64 = 0.1;
/// The shaft of an arrow, and its head.
const SHAFT_M: f64 = 0.04;
const HEAD_M: f64 = 0.08;
/// The height of the letters.
const LETTERS_M: f64 = 0.15;
/// A box is never thinner, so that it is seen.
const THINNEST_M: f64 = 0.02;
/// Two tracks of neighbouring numbers are this far apart on the circle of hues: the golden section, which keeps any
/// number of them apart.
const HUE_STEP: f64 = 0.618_033_988_749_895;

/// A box, an arrow of where it will be in a second, and number and speed of each track, in the frame of the map.
/// The markers of the cycle before are taken away first.
#[must_use]
pub fn markers_from_tracks(stamp: Stamp, map_frame_id: &str, tracks: &[Track]) -> MarkerArray {
    let header = header_of(stamp, map_frame_id);
    let clear = Marker { header: header.clone(), action: Marker::DELETEALL, ..Marker::default() };
    let of = |track: &Track| {
        let arrow = arrow(&header, track);
        [Some(cuboid(&header, track)), arrow, Some(text(&header, track))].into_iter().flatten()
    };
    MarkerArray { markers: std::iter::once(clear).chain(tracks.iter().flat_map(of)).collect() }
}

fn marker(header: &Header, track: &Track, ns: &str, kind: i32) -> Marker {
    Marker {
        header: header.clone(),
        ns: ns.to_owned(),
        // A viewer knows a marker by namespace and number; the sign bit does no harm.
        id: track.id as i32,
        r#type: kind,
        action: Marker::ADD,
        lifetime: Duration { sec: LIFETIME_S, nanosec: 0 },
        ..Marker::default()
    }
}

fn cuboid(header: &Header, track: &Track) -> Marker {
    let [x, y, z] = track.extent_m.map(|edge_m| edge_m.max(THINNEST_M)).into();
    let centre = Isometry3::from(Translation3::from(track.position_m.coords));
    Marker {
        pose: pose_from_isometry(&centre),
        scale: Size { x, y, z },
        color: colour(track.id, 0.4),
        ..marker(header, track, "extent", Marker::CUBE)
    }
}

fn arrow(header: &Header, track: &Track) -> Option<Marker> {
    let speed_m_per_s = track.velocity_m_per_s.norm();
    if speed_m_per_s < SLOWEST_ARROW_M_PER_S {
        return None;
    }
    let ahead = track.position_m + track.velocity_m_per_s;
    Some(Marker {
        pose: pose_from_isometry(&Isometry3::identity()),
        scale: Size { x: SHAFT_M, y: HEAD_M, z: 0.0 },
        color: colour(track.id, 1.0),
        points: vec![message_from_point(&track.position_m), message_from_point(&ahead)],
        ..marker(header, track, "velocity", Marker::ARROW)
    })
}

fn text(header: &Header, track: &Track) -> Marker {
    let above = track.position_m + Vector3::z() * (0.5 * track.extent_m.z + LETTERS_M);
    Marker {
        pose: pose_from_isometry(&Isometry3::from(Translation3::from(above.coords))),
        scale: Size { x: 0.0, y: 0.0, z: LETTERS_M },
        color: ColorRGBA { r: 1.0, g: 1.0, b: 1.0, a: 1.0 },
        text: format!("{}: {:.1} m/s", track.id, track.velocity_m_per_s.norm()),
        ..marker(header, track, "label", Marker::TEXT_VIEW_FACING)
    }
}

/// A colour of its own for each number.
fn colour(id: u32, alpha: f32) -> ColorRGBA {
    let sixth = (f64::from(id) * HUE_STEP).fract() * 6.0;
    let of = |shift: f64| (((sixth + shift) % 6.0 - 3.0).abs() - 1.0).clamp(0.0, 1.0) as f32;
    ColorRGBA { r: of(0.0), g: of(4.0), b: of(2.0), a: alpha }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix6, Point3};

    use super::super::time_from_stamp;
    use super::*;

    fn track(id: u32, velocity_m_per_s: Vector3<f64>) -> Track {
        Track {
            id,
            position_m: Point3::new(2.0, 1.0, -0.5),
            velocity_m_per_s,
            extent_m: Vector3::new(0.5, 0.0, 1.0),
            covariance: Matrix6::identity(),
            age_s: 1.0,
            unseen_cycles: 0,
        }
    }

    #[test]
    fn a_moving_object_has_box_arrow_and_label_and_a_resting_one_no_arrow() {
        let tracks = [track(7, Vector3::new(0.0, -1.25, 0.0)), track(8, Vector3::zeros())];
        let stamp = Stamp::from_secs_nanos(3, 4);
        let markers = markers_from_tracks(stamp, "map", &tracks).markers;
        let kinds: Vec<_> = markers.iter().map(|marker| (&*marker.ns, marker.id)).collect();
        let expected =
            [("", 0), ("extent", 7), ("velocity", 7), ("label", 7), ("extent", 8), ("label", 8)];
        assert_eq!(kinds, expected);
        assert_eq!(markers[0].action, Marker::DELETEALL);
        assert!(markers.iter().all(|marker| marker.header.frame_id == "map"));
        assert!(markers.iter().all(|marker| marker.header.stamp == time_from_stamp(stamp)));
        let cuboid = &markers[1];
        assert_eq!((cuboid.pose.position.x, cuboid.pose.orientation.w), (2.0, 1.0));
        assert_eq!((cuboid.scale.x, cuboid.scale.y, cuboid.scale.z), (0.5, THINNEST_M, 1.0));
        assert_eq!(markers[2].points[1].y, -0.25);
        assert_eq!(markers[3].text, "7: 1.2 m/s");
        assert!(markers[3].pose.position.z > 0.0);
    }

    #[test]
    fn neighbours_have_different_colours() {
        let distance = |a: &ColorRGBA, b: &ColorRGBA| {
            (a.r - b.r).abs() + (a.g - b.g).abs() + (a.b - b.b).abs()
        };
        for id in 0..30 {
            let [here, next] = [id, id + 1].map(|id| colour(id, 1.0));
            assert!(distance(&here, &next) > 0.8, "{id}: {here:?} {next:?}");
            assert!(here.r.max(here.g).max(here.b) == 1.0, "{here:?}");
        }
    }
}
