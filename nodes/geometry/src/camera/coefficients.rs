//! Lens distortion as drivers and calibration files state it: the name of a model, and coefficients.

use super::Distortion;

/// Names of the models (`sensor_msgs/distortion_models.hpp`).
const PLUMB_BOB: &str = "plumb_bob";
const RATIONAL: &str = "rational_polynomial";
const EQUIDISTANT: &str = "equidistant";

/// Longer names are of no model, and are cut off in messages.
const LONGEST_NAME: usize = 40;

/// Why a model and its coefficients are no lens.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum DistortionError {
    /// The model is not known.
    #[error(
        "the distortion model {model:?} is not supported; plumb_bob, rational_polynomial and equidistant are, and no coefficients for a \
         rectified image"
    )]
    Model {
        /// The start of its name.
        model: String,
    },
    /// The coefficients are not those of the model.
    #[error("{model} has {wanted} coefficients, and there are {count}")]
    Count {
        /// The model.
        model: &'static str,
        /// How many it has.
        wanted: &'static str,
        /// How many there are.
        count: usize,
    },
    /// The lens is tilted.
    #[error("coefficient {index} is {value}; the tilt of a sensor is not supported")]
    Tilted {
        /// Which coefficient.
        index: usize,
        /// Its value.
        value: f64,
    },
}

impl Distortion {
    /// The lens with the coefficients of a model, in the order of `sensor_msgs/CameraInfo`.
    ///
    /// `plumb_bob` and `rational_polynomial` are one family, and drivers call each of it by either name. The number of coefficients decides, as it
    /// does for OpenCV: 4 or 5; 8; 12, with a thin prism; or more, where the rest, a tilted sensor, is zero. None, or zeros alone, are no
    /// distortion, also without a model's name. `equidistant`, of a fisheye lens, has 4; with zeros it is no pinhole camera either.
    ///
    /// # Errors
    /// When the model is not known, or has other coefficients.
    pub fn of_model(model: &str, coefficients: &[f64]) -> Result<Self, DistortionError> {
        let are_zeros = coefficients.iter().all(|coefficient| *coefficient == 0.0);
        match (model, coefficients) {
            (EQUIDISTANT, [k1, k2, k3, k4]) => Ok(Self::Equidistant([*k1, *k2, *k3, *k4])),
            (EQUIDISTANT, _) => {
                let (model, count) = (EQUIDISTANT, coefficients.len());
                Err(DistortionError::Count { model, wanted: "4", count })
            }
            ("" | "none" | PLUMB_BOB | RATIONAL, _) if are_zeros => Ok(Self::None),
            (PLUMB_BOB, _) => brown_conrady(PLUMB_BOB, coefficients),
            (RATIONAL, _) => brown_conrady(RATIONAL, coefficients),
            _ => Err(DistortionError::Model { model: model.chars().take(LONGEST_NAME).collect() }),
        }
    }
}

fn brown_conrady(model: &'static str, coefficients: &[f64]) -> Result<Distortion, DistortionError> {
    if let [k1, k2, t1, t2] = coefficients {
        return Ok(Distortion::PlumbBob([*k1, *k2, *t1, *t2, 0.0]));
    }
    if let Ok(five) = coefficients.try_into() {
        return Ok(Distortion::PlumbBob(five));
    }
    let used = coefficients.iter().rposition(|number| *number != 0.0).map_or(0, |last| last + 1);
    match (coefficients.first_chunk::<8>(), coefficients.first_chunk::<12>()) {
        (Some([k1, k2, t1, t2, k3, ..]), _) if used <= 5 => {
            Ok(Distortion::PlumbBob([*k1, *k2, *t1, *t2, *k3]))
        }
        (Some(eight), _) if used <= 8 => Ok(Distortion::Rational(*eight)),
        (_, Some(twelve)) if used <= 12 => Ok(Distortion::RationalPrism(*twelve)),
        (_, Some(_)) => {
            let index = used - 1;
            let value = coefficients.get(index).copied().unwrap_or_default();
            Err(DistortionError::Tilted { index, value })
        }
        (_, None) => {
            let (wanted, count) = ("4, 5, 8 or 12", coefficients.len());
            Err(DistortionError::Count { model, wanted, count })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_are_no_distortion_by_whatever_name() {
        for model in ["plumb_bob", "rational_polynomial", "", "none"] {
            for count in [0, 3, 4, 5, 8, 14] {
                let lens = Distortion::of_model(model, &vec![0.0; count]);
                assert_eq!(lens, Ok(Distortion::None), "{model} {count}");
            }
        }
        for four in [[0.0; 4], [0.1, 0.2, 0.3, 0.4]] {
            let lens = Distortion::of_model("equidistant", &four);
            assert_eq!(lens, Ok(Distortion::Equidistant(four)));
        }
    }

    /// Regression: OrbbecSDK_ROS2 sends a plumb_bob with 8 coefficients, of which the last three are zero, or with 8 of the rational
    /// model: all of these cameras were refused.
    #[test]
    fn the_number_of_coefficients_decides_and_not_the_name() {
        let eight = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
        let twelve = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.0, 0.0, 0.01, 0.0];
        let with_zeros = |numbers: &[f64], count: usize| {
            let mut all = numbers.to_vec();
            all.resize(count, 0.0);
            all
        };
        let five = Distortion::PlumbBob([0.1, 0.2, 0.3, 0.4, 0.5]);
        for model in ["plumb_bob", "rational_polynomial"] {
            for (numbers, lens) in [
                (eight[..4].to_vec(), Distortion::PlumbBob([0.1, 0.2, 0.3, 0.4, 0.0])),
                (eight[..5].to_vec(), five),
                (with_zeros(&eight[..5], 8), five),
                (with_zeros(&eight[..5], 14), five),
                (eight.to_vec(), Distortion::Rational(eight)),
                (with_zeros(&eight, 14), Distortion::Rational(eight)),
                (twelve.to_vec(), Distortion::RationalPrism(twelve)),
                (with_zeros(&twelve, 14), Distortion::RationalPrism(twelve)),
            ] {
                assert_eq!(Distortion::of_model(model, &numbers), Ok(lens), "{model} {numbers:?}");
            }
        }
    }

    #[test]
    fn what_is_no_lens_is_named() {
        let long = "f".repeat(1 << 20);
        for (model, count) in [("none", 1), ("", 5), ("fov", 1), (&long, 0)] {
            let error = Distortion::of_model(model, &vec![0.1; count]).unwrap_err();
            assert!(matches!(&error, DistortionError::Model { .. }), "{error}");
            assert!(error.to_string().len() < 300, "{error}");
        }
        for (model, count) in [
            ("plumb_bob", 3),
            ("plumb_bob", 6),
            ("rational_polynomial", 7),
            ("rational_polynomial", 9),
            ("equidistant", 0),
            ("equidistant", 5),
        ] {
            let error = Distortion::of_model(model, &vec![0.1; count]).unwrap_err();
            assert!(matches!(error, DistortionError::Count { .. }), "{error}");
            assert!(error.to_string().contains(&format!("there are {count}")), "{error}");
        }
        let mut tilted = vec![0.1; 14];
        tilted[13] = 0.0;
        let error = Distortion::of_model("rational_polynomial", &tilted).unwrap_err();
        assert_eq!(error, DistortionError::Tilted { index: 12, value: 0.1 });
    }
}
