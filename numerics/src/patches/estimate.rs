//! What the models say together of the surface at one query.

use super::pooled::{Weighted, responsibilities};
use super::regression::{Kriged, Squares, Terms, n_terms};
use crate::machine::eigen::symmetric_eigen;
use crate::machine::small::{Small, zeros};

/// Deviations of normals over those of the posterior: noise that neighbours share is more than it says.
const NORMAL_CALIBRATION: f64 = 1.07;

/// Deviations of curvatures over those of the posterior, by the largest curvature in units of the radius of the neighbourhood. Up to
/// 0.6 what the curvature entails leaves less of the surface to the process than this expects; beyond, more (docs/error-bars.md).
fn curvature_calibration(bend: f64) -> f64 {
    0.80 + 0.95 * (bend.min(1.2) - 0.6).max(0.0)
}

/// Expectation of |x| over its deviation, for a normal x of mean 0.
const MEAN_MAGNITUDE: f64 = 0.8;

/// 95 % bound of the length of an error in the plane with equal deviations, against 1.96, squared, minus 1.
const SECOND_DIRECTION: f64 = 0.56;

/// Heights over a tangent plane with derivatives up to second order and their uncertainty, all in units of the radius of the
/// neighbourhood: the fourth powers of lengths that variances of curvatures are would leave the range of float64.
pub(crate) struct Estimate {
    /// Value, slopes, second derivatives, `[p]`.
    pub means: Terms,
    pub covariance: Squares,
    /// σ²: variance of a point across the surface.
    pub noise: f64,
    /// Variance of a third derivative along three axes, by the prior.
    pub third: f64,
}

impl Estimate {
    /// The mixture of what each model says; `None` where none says anything.
    pub(crate) fn of(models: &[Weighted], kriged: &[Kriged], dimension: usize) -> Option<Self> {
        let p = n_terms(dimension);
        let shares = responsibilities(models, kriged);
        let used = || shares.iter().zip(kriged).filter(|(share, _)| **share > 0.0);
        let mut means = Terms::from_elem(0.0, p);
        for (share, kriged) in used() {
            means.iter_mut().zip(&kriged.means).for_each(|(mean, m)| *mean += share * m);
        }
        let mut covariance = Squares::from_elem(0.0, p * p);
        for (share, kriged) in used() {
            // Of Student's t distribution, the scale being estimated.
            let widening = kriged.freedom / (kriged.freedom - 2.0).max(1.0);
            for i in 0..p {
                for j in 0..p {
                    let between = (kriged.means[i] - means[i]) * (kriged.means[j] - means[j]);
                    covariance[i * p + j] += share * (widening * kriged.covariance[i * p + j] + between);
                }
            }
        }
        let (mut noise, mut third) = (0.0, 0.0);
        for ((share, kriged), weighted) in
            shares.iter().zip(kriged).zip(models).filter(|((s, _), _)| **s > 0.0)
        {
            let model = &weighted.model;
            noise += share * kriged.scale * model.noise;
            third += share * kriged.scale * model.third_derivative_variance();
        }
        if means.iter().chain(&covariance).any(|x| !x.is_finite()) || shares.iter().all(|share| *share == 0.0)
        {
            return None;
        }
        Some(Self { means, covariance, noise, third })
    }

    /// Slopes as another mixture has them, as uncertain as there and as two opinions that differ as much as these.
    pub(crate) fn take_slopes(&mut self, other: Option<Self>, dimension: usize) {
        let Some(other) = other else { return };
        let p = n_terms(dimension);
        let apart: Terms = other.means.iter().zip(&self.means).map(|(theirs, ours)| theirs - ours).collect();
        for a in 1..dimension {
            self.means[a] = other.means[a];
            for b in 1..dimension {
                self.covariance[a * p + b] = other.covariance[a * p + b] + apart[a] * apart[b] / 4.0;
            }
        }
    }

    /// Second derivatives as a matrix `[k, k]`.
    pub(crate) fn hessian(&self, dimension: usize) -> Small {
        let k = dimension - 1;
        let mut hessian = zeros(k * k);
        for a in 0..k {
            for b in a..k {
                let entry = self.means[second(k, a, b)];
                (hessian[a * k + b], hessian[b * k + a]) = (entry, entry);
            }
        }
        hessian
    }

    /// Deviation of the angle of the normal, radians: what a normal error within which 95 % of the angles lie would have. `moves`
    /// says whether the query itself is a point with noise, which moves it along the surface too.
    pub(crate) fn normal_deviation(&self, dimension: usize, moves: bool) -> f64 {
        let (k, p) = (dimension - 1, n_terms(dimension));
        let hessian = self.hessian(dimension);
        let mut slopes = zeros(k * k);
        for a in 0..k {
            for b in 0..k {
                let turned: f64 = (0..k).map(|c| hessian[a * k + c] * hessian[c * k + b]).sum();
                let moved = if moves { self.noise * turned } else { 0.0 };
                slopes[a * k + b] = self.covariance[(1 + a) * p + 1 + b] + moved;
            }
        }
        let (variances, _) = symmetric_eigen(&slopes, k);
        let largest = variances[k - 1].max(0.0);
        let others: f64 = variances[..k - 1].iter().map(|v| v.max(0.0)).sum();
        NORMAL_CALIBRATION * (largest + SECOND_DIRECTION * others).sqrt()
    }

    /// Principal curvatures for the normal of the frame, ascending, and the deviations of these, of their mean and of their product.
    ///
    /// By the delta method: to first order `dκ_i = −v_iᵀ dH v_i`. Eigenvalues repel: where two of them are closer than the deviation
    /// of the entry between them, what that moves them by is added.
    pub(crate) fn curvatures(&self, dimension: usize, moves: bool) -> CurvatureEstimate {
        let (k, p) = (dimension - 1, n_terms(dimension));
        let shape: Small = self.hessian(dimension).iter().map(|h| -h).collect();
        let (values, vectors) = symmetric_eigen(&shape, k);
        let bend = values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
        let calibration = curvature_calibration(bend);
        let moved = if moves { self.noise * self.third } else { 0.0 };
        let variance = |form: &[f64]| -> f64 {
            let mut sum = 0.0;
            for (i, a) in form.iter().enumerate() {
                for (j, b) in form.iter().enumerate() {
                    sum += a * b * self.covariance[(dimension + i) * p + dimension + j];
                }
            }
            calibration * calibration * sum.max(0.0)
        };
        let vector = |i: usize| &vectors[i * k..][..k];
        let forms: Vec<Terms> = (0..k).map(|i| form(vector(i), vector(i))).collect();
        let mut principal = Small::new();
        for i in 0..k {
            let mut repelled = 0.0;
            for j in (0..k).filter(|&j| j != i) {
                let between = variance(&form(vector(i), vector(j)));
                let gap = (values[i] - values[j]).abs();
                repelled += (between / gap).min(MEAN_MAGNITUDE * between.sqrt()).powi(2);
            }
            principal.push((variance(&forms[i]) + repelled + THIRD_OF_CURVATURE * moved).sqrt());
        }
        let sum_with = |weights: &dyn Fn(usize) -> f64| -> Terms {
            let mut sum = Terms::from_elem(0.0, p - dimension);
            for (i, form) in forms.iter().enumerate() {
                sum.iter_mut().zip(form).for_each(|(s, f)| *s += weights(i) * f);
            }
            sum
        };
        let mean_variance = variance(&sum_with(&|_| 1.0 / k as f64));
        let mean = (mean_variance + THIRD_OF_MEAN * moved).sqrt();
        let others = |i: usize| (0..k).filter(|&j| j != i).map(|j| values[j]).product::<f64>();
        let beside: f64 = (0..k).map(|i| others(i).powi(2) * THIRD_OF_CURVATURE * moved).sum::<f64>();
        let products: f64 = principal.iter().map(|deviation| deviation * deviation).product();
        let gaussian = (variance(&sum_with(&others)) + beside + products).sqrt();
        CurvatureEstimate { principal, mean, gaussian, bend }
    }
}

/// Sums over two directions of displacement of the variances of `∂z_aa` and of `∂(z_ss + z_tt)/2`, in units of the variance of `∂³z` along
/// one axis over 15.
const THIRD_OF_CURVATURE: f64 = 18.0;
const THIRD_OF_MEAN: f64 = 12.0;

/// In units of the radius of the neighbourhood.
pub(crate) struct CurvatureEstimate {
    pub principal: Small,
    pub mean: f64,
    pub gaussian: f64,
    /// The largest curvature.
    pub bend: f64,
}

/// Coefficients of `uᵀHv` in the second derivatives of the upper triangle.
fn form(u: &[f64], v: &[f64]) -> Terms {
    let k = u.len();
    let mut coefficients = Terms::new();
    for a in 0..k {
        for b in a..k {
            coefficients.push(if a == b { u[a] * v[a] } else { u[a] * v[b] + u[b] * v[a] });
        }
    }
    coefficients
}

/// Index of a second derivative among the terms.
fn second(k: usize, a: usize, b: usize) -> usize {
    let (a, b) = (a.min(b), a.max(b));
    k + 1 + a * k - a * (a + 1) / 2 + b
}
