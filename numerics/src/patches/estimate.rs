//! Estimate of the surface at one query: the mixture of the models there.

use super::pooled::{WeightedModel, responsibilities};
use super::regression::{ModelResult, Squares, Terms, n_terms};
use crate::machine::eigen::symmetric_eigen;
use crate::machine::small::{Small, zeros};

/// Ratio of the deviations of normals to those of the posterior. It exceeds 1 because neighbours share noise,
/// which the posterior does not know.
const NORMAL_CALIBRATION: f64 = 1.07;

/// Ratio of the deviations of curvatures to those of the posterior, by `bend`, the largest curvature in units
/// of the radius of the neighbourhood.
///
/// Up to a bend of 0.6 the entailed height leaves less of the surface to the process than the process
/// expects. Beyond, it leaves more (docs/error-bars.md).
fn curvature_calibration(bend: f64) -> f64 {
    0.80 + 0.95 * (bend.min(1.2) - 0.6).max(0.0)
}

/// Factor on the deviations of second derivatives under a model, by its ratio of the noise to the process.
///
/// Where nearly all is noise, the posterior is that of a quadric. It has not the slack of a process that
/// expects more bends than surfaces have (docs/error-bars.md).
fn bend_calibration(noise: f64) -> f64 {
    if noise > 3.0 { 1.1 } else { 1.0 }
}

/// Expectation of |x| divided by its deviation, for a normal x of mean 0.
const MEAN_MAGNITUDE: f64 = 0.8;

/// Weight of the variances beside the largest one: `(b/1.96)² − 1`. Here b bounds 95 % of the lengths of an
/// error in the plane with equal deviations of 1.
const SECOND_DIRECTION: f64 = 0.56;

/// Returns the variance of one component of a normal with this deviation, if all k components are known
/// equally well.
pub(super) fn normal_variance(deviation: f64, k: usize) -> f64 {
    (deviation / NORMAL_CALIBRATION).powi(2) / (1.0 + SECOND_DIRECTION * (k - 1) as f64)
}

/// Height over a tangent plane with its derivatives up to second order and their covariance.
///
/// All are in units of the radius of the neighbourhood. Variances of curvatures hold fourth powers of
/// lengths, which would leave the range of float64.
pub(crate) struct Estimate {
    /// Value, slopes, second derivatives, `[p]`.
    pub means: Terms,
    pub covariance: Squares,
    /// σ²: variance of a point across the surface.
    pub noise: f64,
    /// Prior variance of a third derivative along three different axes.
    pub third: f64,
}

impl Estimate {
    /// Mixes the models by their posterior probabilities. Returns `None` if no model has an answer.
    pub(crate) fn of(models: &[WeightedModel], kriged: &[ModelResult], dimension: usize) -> Option<Self> {
        let p = n_terms(dimension);
        let shares = responsibilities(models, kriged);
        let mut means = Terms::from_elem(0.0, p);
        for (share, kriged) in shares.iter().zip(kriged).filter(|(share, _)| **share > 0.0) {
            means.iter_mut().zip(&kriged.means).for_each(|(mean, m)| *mean += share * m);
        }
        let mut covariance = Squares::from_elem(0.0, p * p);
        let (mut noise, mut third) = (0.0, 0.0);
        for ((share, kriged), weighted) in
            shares.iter().zip(kriged).zip(models).filter(|((s, _), _)| **s > 0.0)
        {
            let model = &weighted.model;
            // Student's t distribution is wider than the normal one, because the scale is estimated.
            let widening = kriged.freedom / (kriged.freedom - 2.0).max(1.0);
            let of_bends = widening * bend_calibration(model.noise).powi(2);
            for i in 0..p {
                for j in 0..p {
                    let factor = if i.min(j) >= dimension { of_bends } else { widening };
                    let between = (kriged.means[i] - means[i]) * (kriged.means[j] - means[j]);
                    covariance[i * p + j] += share * (factor * kriged.covariance[i * p + j] + between);
                }
            }
            noise += share * kriged.scale * model.noise;
            third += share * kriged.scale * model.third_derivative_variance();
        }
        if means.iter().chain(&covariance).any(|x| !x.is_finite()) || shares.iter().all(|share| *share == 0.0)
        {
            return None;
        }
        Some(Self { means, covariance, noise, third })
    }

    /// Takes the slopes of `other`. Their covariance is that of `other` plus a quarter of the squared
    /// difference.
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

    /// Standard deviation of the angle of the normal, radians. It is such that 95 % of the angles lie within
    /// 1.96 of it.
    ///
    /// `moves` says that the query itself is a point with noise, which also moves it along the surface.
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

    /// Returns the deviations of the principal curvatures, of their mean and of their product, and the bend.
    /// Principal curvatures are those for the normal of the frame, ascending.
    ///
    /// The deviations follow by the delta method: to first order `dκ_i = −v_iᵀ dH v_i`. Eigenvalues repel
    /// each other. Where two of them are closer than the deviation of the entry between them, the shift that
    /// this causes is added.
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

/// Variances of `∂z_aa` and of `∂(z_ss + z_tt)/2`, each summed over two directions of displacement. The unit
/// is a 15th of the variance of `∂³z` along one axis.
const THIRD_OF_CURVATURE: f64 = 18.0;
const THIRD_OF_MEAN: f64 = 12.0;

/// Deviations of curvatures and the bend, in units of the radius of the neighbourhood.
pub(crate) struct CurvatureEstimate {
    pub principal: Small,
    pub mean: f64,
    pub gaussian: f64,
    /// Largest absolute curvature.
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

/// Index of the second derivative along axes a and b among the terms.
fn second(k: usize, a: usize, b: usize) -> usize {
    let (a, b) = (a.min(b), a.max(b));
    k + 1 + a * k - a * (a + 1) / 2 + b
}
