//! Robust kernels: what a squared error costs, and how much its observation weighs.

use serde::{Deserialize, Serialize};

/// How much an observation weighs while outliers may be among them.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RobustKernel {
    /// All weigh the same: least squares.
    None,
    /// Beyond the limit the weight falls with the error (Huber 1964). The cost has one minimum.
    Huber,
    /// The weight falls with the square of the error (Barron 2019, "A general and adaptive robust loss function"). Outliers
    /// pull less and less; there may be more minima.
    Cauchy,
    /// The weight falls with the fourth power of the error (Geman and McClure 1985; the form of KISS-ICP, eq. 7).
    GemanMcClure,
}

impl RobustKernel {
    /// The cost of a squared error, and its derivative, which is the weight. `limit` is the squared error at which
    /// the kernel begins to reduce the weight, in the same unit.
    #[inline]
    #[must_use]
    pub fn loss_and_weight(self, square: f64, limit: f64) -> (f64, f64) {
        match self {
            Self::Huber if square > limit => {
                let product = (square * limit).sqrt();
                (2.0 * product - limit, product / square)
            }
            Self::Cauchy => {
                let share = 1.0 + square / limit;
                (limit * share.ln(), share.recip())
            }
            Self::GemanMcClure => {
                let share = limit / (limit + square);
                (square * share, share * share)
            }
            Self::Huber | Self::None => (square, 1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weight_of_a_kernel_is_the_slope_of_its_loss() {
        const SMALL: f64 = 1e-6;
        let kernels = [
            RobustKernel::None,
            RobustKernel::Huber,
            RobustKernel::Cauchy,
            RobustKernel::GemanMcClure,
        ];
        for kernel in kernels {
            for square in [0.1, 1.0, 5.9, 6.1, 40.0, 1e4] {
                let loss = |square: f64| kernel.loss_and_weight(square, 6.0).0;
                let slope = (loss(square * (1.0 + SMALL)) - loss(square * (1.0 - SMALL)))
                    / (2.0 * SMALL * square);
                let weight = kernel.loss_and_weight(square, 6.0).1;
                assert!((weight - slope).abs() < 1e-6, "{kernel:?} {square}: {weight} {slope}");
            }
        }
    }

    #[test]
    fn a_small_error_costs_itself_and_an_outlier_less() {
        let tail = [
            (RobustKernel::None, 600.0),
            // 2 sqrt(600 * 6) - 6, 6 ln(101), 600 * 6 / 606.
            (RobustKernel::Huber, 114.0),
            (RobustKernel::Cauchy, 27.690_723),
            (RobustKernel::GemanMcClure, 5.940_594),
        ];
        for (kernel, expected) in tail {
            let (loss, weight) = kernel.loss_and_weight(6e-6, 6.0);
            assert!((loss / 6e-6 - 1.0).abs() < 1e-5 && (weight - 1.0).abs() < 1e-5, "{kernel:?}");
            let loss = kernel.loss_and_weight(600.0, 6.0).0;
            assert!((loss - expected).abs() < 1e-6, "{kernel:?}: {loss}");
        }
    }
}
