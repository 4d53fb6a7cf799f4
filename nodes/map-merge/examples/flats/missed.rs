//! Why points of furniture that was moved are not found: what the camera of the other visit saw of their places.

use std::fmt;

use map_merge::Group;
use nalgebra::Point3;
use simulator::{Body, Piece};

use crate::mapping::{Look, Visit, nearest_m, signed_distance_m};

/// What is known of the place of a point that is missed.
#[derive(Clone, Copy, Debug, Default)]
struct Causes {
    /// Something else stands there on the other day, so that nobody can see the place to be free.
    inside: usize,
    /// Seen through, next to a surface of the other visit.
    beside: usize,
    /// Seen through, and next to nothing.
    through: usize,
    /// In an image, where something before it, or no return, hides it.
    hidden: usize,
    /// In no image at a distance that is measured.
    unseen: usize,
}

impl fmt::Display for Causes {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { inside, beside, through, hidden, unseen } = self;
        write!(
            formatter,
            "in something of the other day {inside}, hidden {hidden}, never in view {unseen}, seen through {through}, \
             seen through beside a surface {beside}"
        )
    }
}

/// Prints the pieces of which most points are missed, and why.
pub(crate) fn print(own: &Visit, other: &Visit, groups: &[Group]) {
    let mut is_found = vec![false; own.map.points.points_m.len()];
    groups.iter().flat_map(|group| &group.points).for_each(|index| is_found[*index] = true);
    let there: Vec<Body> = other.home.scene().bodies;
    let moved: Vec<&Piece> = own.pieces_not_in(other).collect();
    let rest: Vec<&Body> = own.bodies_also_in(other).collect();
    let mut of_pieces = vec![(0, 0, Causes::default()); moved.len()];
    for (point_m, is_found) in own.map.points.points_m.iter().zip(is_found) {
        let point = own.room_from_map(point_m);
        let distance_m = |piece: &&Piece| nearest_m(piece.bodies.iter(), &point);
        let nearest = (0..moved.len())
            .min_by(|a, b| distance_m(&moved[*a]).total_cmp(&distance_m(&moved[*b])));
        let Some(nearest) = nearest else { return };
        let is_moved = distance_m(&moved[nearest]) < nearest_m(rest.iter().copied(), &point);
        if !is_moved || nearest_m(there.iter(), &point) <= own.map.edge_m {
            continue;
        }
        let (points, missed, causes) = &mut of_pieces[nearest];
        *points += 1;
        if !is_found {
            *missed += 1;
            *causes.of(other, &there, &point, own.map.edge_m) += 1;
        }
    }
    let mut order: Vec<usize> = (0..moved.len()).collect();
    order.sort_by_key(|index| std::cmp::Reverse(of_pieces[*index].1));
    for index in order.into_iter().take(4).filter(|index| of_pieces[*index].1 > 0) {
        let (points, missed, causes) = of_pieces[index];
        let piece = moved[index];
        println!(
            "      room {}, {} bodies at {:.1?}: {missed} of {points} missed: {causes}",
            piece.room,
            piece.bodies.len(),
            &piece.bodies[0].pose[..3]
        );
    }
}

impl Causes {
    fn of(
        &mut self,
        other: &Visit,
        there: &[Body],
        point: &Point3<f64>,
        edge_m: f64,
    ) -> &mut usize {
        if there.iter().any(|body| signed_distance_m(body, point) < 0.0) {
            return &mut self.inside;
        }
        match other.look_at(point) {
            Look::Through if nearest_m(there.iter(), point) <= 2.0 * edge_m => &mut self.beside,
            Look::Through => &mut self.through,
            Look::Hidden => &mut self.hidden,
            Look::Never => &mut self.unseen,
        }
    }
}
