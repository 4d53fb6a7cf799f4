//! How far places are from the nearest obstacle: for planners. Nothing is computed, and no change is followed, before somebody asks.

use geometry::{DistanceAt, DistanceLattice, Distances};
use nalgebra::Point3;
use volume::{BlockBox, DistanceField};

use super::SurfaceMap;
use crate::distance::{DistanceError, MOST_BOX_PLACES, MOST_PLACES, MapBox, check_finite};

impl SurfaceMap {
    /// How far places of the map are from the nearest point of it, spilled tiles included, and what is recorded of them: see
    /// [`volume::DistanceField`]. An empty `frame_id` is that of the map.
    ///
    /// # Errors
    /// When the map is empty, the places are in another frame, too many or no numbers, or a spilled tile cannot be read for now.
    /// What is lost of the map is not known there: its places are unknown.
    pub fn distances(
        &mut self,
        frame_id: &str,
        places_m: &[Point3<f64>],
    ) -> Result<Distances, DistanceError> {
        let frame_id = self.frame_asked(frame_id)?;
        if places_m.len() > MOST_PLACES {
            let (places, most) = (places_m.len() as u64, MOST_PLACES as u64);
            return Err(DistanceError::TooManyPlaces { places, most });
        }
        check_finite(places_m)?;
        let at = self.distances_at(places_m.iter().copied())?;
        Ok(Distances { stamp: self.stamp, frame_id, at })
    }

    /// The same of the places within a box, `distance_edge_m` apart, at its multiples. Along an axis where none is within the box
    /// they are those nearest to its middle.
    ///
    /// # Errors
    /// As of [`SurfaceMap::distances`], and when the box ends before it begins.
    pub fn distance_lattice(
        &mut self,
        frame_id: &str,
        asked: &MapBox,
    ) -> Result<DistanceLattice, DistanceError> {
        let frame_id = self.frame_asked(frame_id)?;
        let MapBox { least_m, most_m } = *asked;
        check_finite(&[least_m, most_m])?;
        if (0..3).any(|axis| least_m[axis] > most_m[axis]) {
            let [least_m, most_m] = [least_m, most_m].map(|corner| corner.coords.into());
            return Err(DistanceError::TurnedBox { least_m, most_m });
        }
        let field = self.distance_field()?;
        let (lattice, max_distance_m) =
            (field.lattice(&least_m, &most_m), field.config().max_distance_m);
        let (edge_m, origin_m) = (field.config().edge_m, field.node_m(lattice.first));
        if lattice.nodes() > MOST_BOX_PLACES {
            let (places, most) = (lattice.nodes(), MOST_BOX_PLACES);
            return Err(DistanceError::TooManyPlaces { places, most });
        }
        let places_m: Vec<Point3<f64>> = lattice.keys().map(|node| field.node_m(node)).collect();
        let at = self.distances_at(places_m)?;
        let size = lattice.size.map(|along| along as usize);
        let stamp = self.stamp;
        Ok(DistanceLattice { stamp, frame_id, origin_m, edge_m, size, max_distance_m, at })
    }

    /// Nobody asks for distances any more: what was computed goes, and changes are no longer followed.
    pub fn forget_distances(&mut self) {
        self.followers.distances = None;
    }

    /// The frame of the map, if that is the one of the request.
    fn frame_asked(&self, asked: &str) -> Result<String, DistanceError> {
        let map = self.frame_id.as_deref().filter(|_| !self.is_empty());
        let map = map.ok_or(DistanceError::EmptyMap)?.to_owned();
        if asked.is_empty() || asked == map {
            Ok(map)
        } else {
            Err(DistanceError::AnotherFrame { map, asked: asked.to_owned() })
        }
    }

    fn distance_field(&mut self) -> Result<&mut DistanceField, DistanceError> {
        let field = match self.followers.distances.take() {
            Some(field) => field,
            None => DistanceField::of(&self.surface, self.distance_config)?,
        };
        Ok(self.followers.distances.insert(field))
    }

    fn distances_at(
        &mut self,
        places_m: impl IntoIterator<Item = Point3<f64>>,
    ) -> Result<Vec<DistanceAt>, DistanceError> {
        self.begin_round();
        self.distance_field()?;
        if let Some(field) = &mut self.followers.distances {
            field.update(&self.surface);
        }
        let mut at = Vec::new();
        for place_m in places_m {
            self.fetch_for(&place_m)?;
            at.extend(
                self.followers.distances.as_mut().map(|field| field.at(&self.surface, &place_m)),
            );
        }
        Ok(at)
    }

    /// Brings back the tile of a place, and unless it is computed already those that its distance depends on.
    fn fetch_for(&mut self, place_m: &Point3<f64>) -> Result<(), DistanceError> {
        if self.spill.is_none() {
            return Ok(());
        }
        let needed = self.followers.distances.as_ref().and_then(|field| field.needed_for(place_m));
        let own = self.surface.block_of(place_m);
        if self.fetch(needed.unwrap_or(BlockBox { least: own, most: own })) {
            return Ok(());
        }
        let [x_m, y_m, z_m] = place_m.coords.into();
        Err(DistanceError::Spilled { x_m, y_m, z_m })
    }
}
