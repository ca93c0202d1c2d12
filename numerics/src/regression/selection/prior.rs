//! Prior on the length scales of axes. Without one, a few hundred values fit noise by a scale for each axis.

use crate::points::cloud::Cloud;

/// Prior distribution of the length scales of axes. It counts where a search varies the
/// length scales of single axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum ScalePrior {
    /// Nothing: the criterion alone decides.
    Flat,
    /// The jointly robust prior of the inverse length scales `β_c = 1/ℓ_c` (Gu 2019, Bayesian Analysis 14,
    /// 857–885): `p(β) ∝ t^a exp(−bt)`, `t = Σ_c C_c β_c`, with `a = 0.2` and `b = n^(−1/d) (a + d)`.
    ///
    /// `C_c` is `n^(−1/d)` times the width of the cloud along axis c, so units do not matter. The prior holds
    /// scales away from 0 together, and lets those of axes that do not matter become long. Many values in
    /// few dimensions outweigh it.
    #[default]
    JointlyRobust,
}

/// The exponent a.
const EXPONENT: f64 = 0.2;

/// The jointly robust prior for a cloud.
#[derive(Debug, Clone)]
pub(super) struct JointlyRobust {
    /// `C_c`, `[d]`, unit L.
    separations: Vec<f64>,
    /// b.
    rate: f64,
}

impl JointlyRobust {
    pub(super) fn of(cloud: &Cloud) -> Self {
        let d = cloud.dimension() as f64;
        let shrunk = (cloud.n_points() as f64).powf(-1.0 / d);
        let (min, max) = cloud.bounding_box();
        let separations = min.iter().zip(&max).map(|(min, max)| shrunk * (max - min)).collect();
        Self { separations, rate: shrunk * (EXPONENT + d) }
    }

    /// Returns `a ln t − bt` at some length scales, `[d]`.
    pub(super) fn log_density(&self, length_scales: &[f64]) -> f64 {
        let t = self.sum(length_scales);
        EXPONENT * t.max(f64::MIN_POSITIVE).ln() - self.rate * t
    }

    /// Returns the derivative of [`Self::log_density`] by the logarithm of the length scale of an axis:
    /// `(b − a/t) C_c/ℓ_c`.
    pub(super) fn slope(&self, length_scales: &[f64], axis: usize) -> f64 {
        let t = self.sum(length_scales).max(f64::MIN_POSITIVE);
        (self.rate - EXPONENT / t) * self.separations[axis] / length_scales[axis]
    }

    /// Returns t.
    fn sum(&self, length_scales: &[f64]) -> f64 {
        self.separations.iter().zip(length_scales).map(|(c, length_scale)| c / length_scale).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_the_density_in_any_unit() {
        let plain = Cloud::new(vec![0.0, 0.0, 1.0, 2.0, 0.5, 3.0, 0.2, 1.0], 2).unwrap();
        let scaled = plain.stretched(&[1e3, 1e-3]);
        let (a, b) = (JointlyRobust::of(&plain), JointlyRobust::of(&scaled));
        for scales in [[0.1, 5.0], [1.0, 1.0], [40.0, 0.02]] {
            let in_units = [1e3 * scales[0], 1e-3 * scales[1]];
            assert!((a.log_density(&scales) - b.log_density(&in_units)).abs() < 1e-9);
            for axis in 0..2 {
                let moved = |sign: f64| {
                    let mut moved = scales;
                    moved[axis] *= (sign * 1e-5f64).exp();
                    a.log_density(&moved)
                };
                let difference = (moved(1.0) - moved(-1.0)) / 2e-5;
                let slope = a.slope(&scales, axis);
                assert!((slope - difference).abs() < 1e-6 * (1.0 + slope.abs()), "{slope} {difference}");
            }
        }
    }
}
