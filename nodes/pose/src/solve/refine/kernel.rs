//! What an error costs, and how much its observation counts.

use crate::solve::config::RobustKernel;

impl RobustKernel {
    /// What a squared error costs, and the derivative of that, which is its weight. `doubt` is the squared error at which
    /// the kernel begins to doubt.
    #[inline]
    pub(crate) fn loss_and_weight(self, chi2: f64, doubt: f64) -> (f64, f64) {
        match self {
            Self::Huber if chi2 > doubt => {
                let product = (chi2 * doubt).sqrt();
                (2.0 * product - doubt, product / chi2)
            }
            Self::Cauchy => {
                let share = 1.0 + chi2 / doubt;
                (doubt * share.ln(), share.recip())
            }
            Self::Huber | Self::None => (chi2, 1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weight_of_a_kernel_is_the_slope_of_its_loss() {
        const SMALL: f64 = 1e-6;
        for kernel in [RobustKernel::Huber, RobustKernel::Cauchy, RobustKernel::None] {
            for chi2 in [0.1, 1.0, 5.9, 6.1, 40.0, 1e4] {
                let loss = |chi2: f64| kernel.loss_and_weight(chi2, 6.0).0;
                let slope = (loss(chi2 * (1.0 + SMALL)) - loss(chi2 * (1.0 - SMALL)))
                    / (2.0 * SMALL * chi2);
                let weight = kernel.loss_and_weight(chi2, 6.0).1;
                assert!((weight - slope).abs() < 1e-6, "{kernel:?} {chi2}: {weight} {slope}");
            }
        }
    }
}
