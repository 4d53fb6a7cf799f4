//! The filter by the road's intensity: the thesis' own.

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::registration::{ParameterError, check, check_positive};

/// Fewer points of the road give no estimate of it.
const LEAST_ROAD_POINTS: usize = 30;

/// Leaves out what is as bright as the road about the vehicle, wherever it is (Road LiDAR, section 4.2.1.2).
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RoadIntensityFilter {
    /// The sensor's height over the road.
    pub sensor_height_m: f64,
    /// Points are of the road when they are this near to its height ...
    pub height_tolerance_m: f64,
    /// ... and this near to the vehicle.
    pub radius_m: f64,
    /// Points whose intensity is within this many standard deviations of the road's mean are left out.
    pub deviations: f64,
}

impl Default for RoadIntensityFilter {
    fn default() -> Self {
        Self {
            // KITTI's car (Geiger et al. 2012).
            sensor_height_m: 1.73,
            // The slope of a cambered road over the radius (2.5 %), and a few centimetres of noise.
            height_tolerance_m: 0.2,
            // The thesis': "some 5 metres", and 1.25 as the best between 1 and 1.5.
            radius_m: 5.0,
            deviations: 1.25,
        }
    }
}

/// How bright the road is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RoadIntensity {
    /// The mean over its points.
    pub mean: f64,
    /// Their standard deviation.
    pub std_dev: f64,
    /// How many there are.
    pub points: usize,
}

impl RoadIntensityFilter {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range.
    pub fn validate(&self) -> Result<(), ParameterError> {
        check_positive(&[
            ("sensor_height_m", self.sensor_height_m),
            ("height_tolerance_m", self.height_tolerance_m),
            ("radius_m", self.radius_m),
        ])?;
        let deviations = self.deviations;
        check("deviations", "0 or more", deviations, deviations.is_finite() && deviations >= 0.0)
    }

    /// How bright the road about the vehicle is; `None` where too little of it is seen. Points are in the sensor's frame, z
    /// up.
    #[must_use]
    pub fn road(&self, points_m: &[Point3<f32>], intensities: &[f32]) -> Option<RoadIntensity> {
        let of_road = |point: &Point3<f32>| {
            let (x_m, y_m, z_m) = (f64::from(point.x), f64::from(point.y), f64::from(point.z));
            x_m.hypot(y_m) < self.radius_m
                && (z_m + self.sensor_height_m).abs() < self.height_tolerance_m
        };
        let road: Vec<f64> = points_m
            .iter()
            .zip(intensities)
            .filter(|(point, intensity)| of_road(point) && intensity.is_finite())
            .map(|(_, intensity)| f64::from(*intensity))
            .collect();
        if road.len() < LEAST_ROAD_POINTS {
            return None;
        }
        let points = road.len() as f64;
        let mean = road.iter().sum::<f64>() / points;
        let variance =
            road.iter().map(|intensity| (intensity - mean).powi(2)).sum::<f64>() / points;
        Some(RoadIntensity { mean, std_dev: variance.sqrt(), points: road.len() })
    }

    /// Whether each point is kept. All are where the road is not seen.
    #[must_use]
    pub fn keeps(&self, points_m: &[Point3<f32>], intensities: &[f32]) -> Vec<bool> {
        let Some(road) = self.road(points_m, intensities) else {
            return vec![true; points_m.len()];
        };
        let as_bright = self.deviations * road.std_dev;
        let keep = |intensity: &f32| (f64::from(*intensity) - road.mean).abs() > as_bright;
        intensities.iter().map(keep).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn what_is_as_bright_as_the_road_goes() {
        let mut random = Random::new(3);
        let filter = RoadIntensityFilter::default();
        let (mut points, mut intensities) = (Vec::new(), Vec::new());
        for _ in 0..4000 {
            points.push(
                Point3::new(random.between(-4.0, 4.0), random.between(-3.0, 3.0), -1.73).cast(),
            );
            intensities.push((20.0 + 4.0 * random.normal()) as f32);
        }
        // A wall, the road farther out, and a wall as bright as the road.
        for (z_m, intensity) in [(1.0, 60.0), (-1.7, 20.0), (1.0, 21.0)] {
            points.push(Point3::new(20.0, 0.0, z_m));
            intensities.push(intensity);
        }
        let road = filter.road(&points, &intensities).unwrap();
        assert!((road.mean - 20.0).abs() < 0.3 && (road.std_dev - 4.0).abs() < 0.2, "{road:?}");
        assert_eq!(road.points, 4000);
        let keep = filter.keeps(&points, &intensities);
        assert_eq!(keep[4000..], [true, false, false]);
        // Of a normal distribution 21 % lie beyond 1.25 deviations.
        let share = keep[..4000].iter().filter(|keep| **keep).count() as f64 / 4000.0;
        assert!((share - 0.21).abs() < 0.03, "{share}");
    }

    #[test]
    fn without_a_road_everything_is_kept() {
        let points = [Point3::new(1.0, 1.0, -1.7), Point3::new(f32::NAN, 1.0, -1.7)];
        assert_eq!(RoadIntensityFilter::default().keeps(&points, &[3.0, 4.0]), [true, true]);
        assert_eq!(RoadIntensityFilter::default().road(&points, &[3.0, 4.0]), None);
        let bad = RoadIntensityFilter { radius_m: 0.0, ..Default::default() };
        assert!(bad.validate().unwrap_err().to_string().contains("radius_m"));
    }
}
