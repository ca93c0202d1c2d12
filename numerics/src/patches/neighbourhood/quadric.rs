//! Least squares with a few terms, and principal axes.

use crate::machine::eigen::symmetric_eigen;
use crate::machine::small::{Small, zeros};

/// Least ratio of a pivot to its diagonal entry. Below it, the points do not determine a quadric.
const SINGULAR: f64 = 1e-10;

/// Normal equations of a quadric: weighted sums of products of terms and heights.
#[derive(Clone, Copy)]
pub(super) struct Sums<const P: usize> {
    matrix: [[f64; P]; P],
    right: [f64; P],
    squares: f64,
    weight: f64,
    n: f64,
}

/// A quadric fitted to heights.
#[derive(Clone, Copy)]
pub(super) struct Fit<const P: usize> {
    pub(super) quadric: [f64; P],
    /// Sum of squared residuals, in which each mean counts once.
    pub(super) residuals: f64,
    /// R of the normal equations RᵀR, in the upper triangle.
    factor: [[f64; P]; P],
}

impl<const P: usize> Default for Sums<P> {
    fn default() -> Self {
        Self { matrix: [[0.0; P]; P], right: [0.0; P], squares: 0.0, weight: 0.0, n: 0.0 }
    }
}

impl<const P: usize> Sums<P> {
    pub(super) fn add(&mut self, terms: &[f64; P], height: f64, weight: f64) {
        add_products(&mut self.matrix, terms, weight);
        let scaled = weight * height;
        self.right.iter_mut().zip(terms).for_each(|(slot, term)| *slot += scaled * term);
        self.squares += scaled * height;
        self.weight += weight;
        self.n += 1.0;
    }

    /// Fits the quadric. Returns `None` if the points do not determine one.
    pub(super) fn fit(&self) -> Option<Fit<P>> {
        let (mut matrix, mut right) = (self.matrix, self.right);
        factorize(&mut matrix)?;
        forward(&matrix, &mut right);
        let explained: f64 = right.iter().map(|r| r * r).sum();
        backward(&matrix, &mut right);
        let residuals = (self.squares - explained).max(0.0) * self.n / self.weight;
        Some(Fit { quadric: right, residuals, factor: matrix })
    }
}

impl<const P: usize> Fit<P> {
    /// Returns the standard error of the height at a place with these terms if a point has unit noise.
    pub(super) fn height_error(&self, terms: &[f64; P]) -> f64 {
        let mut column = *terms;
        forward(&self.factor, &mut column);
        column.iter().map(|c| c * c).sum::<f64>().sqrt()
    }

    /// Returns the standard error of the second derivatives together, as a matrix, if a point has unit noise.
    /// It does not depend on the axes.
    pub(super) fn unit_error<const D: usize>(&self) -> f64 {
        let variance = |at: usize| {
            let mut column = [0.0; P];
            column[at] = 1.0;
            forward(&self.factor, &mut column);
            column.iter().map(|c| c * c).sum::<f64>()
        };
        let entries = second_derivatives(D - 1).enumerate();
        entries.map(|(at, (a, b))| if a == b { 1.0 } else { 2.0 } * variance(D + at)).sum::<f64>().sqrt()
    }
}

/// Largest absolute eigenvalue of the second derivatives.
pub(super) fn largest_curvature<const D: usize, const P: usize>(quadric: &[f64; P]) -> f64 {
    if D == 3 {
        let [a, b, c] = [quadric[P - 3], quadric[P - 2], quadric[P - 1]];
        return (0.5 * (a + c)).abs() + (0.25 * (a - c) * (a - c) + b * b).sqrt();
    }
    let hessian = hessian::<D, P>(quadric);
    let flat: Small = hessian.iter().take(D - 1).flat_map(|row| &row[..D - 1]).copied().collect();
    let (values, _) = symmetric_eigen(&flat, D - 1);
    values.iter().fold(0.0, |a: f64, v| a.max(v.abs()))
}

/// Second derivatives as a matrix, in the upper left part.
pub(super) fn hessian<const D: usize, const P: usize>(quadric: &[f64; P]) -> [[f64; D]; D] {
    let mut matrix = [[0.0; D]; D];
    for (next, (a, b)) in second_derivatives(D - 1).enumerate() {
        (matrix[a][b], matrix[b][a]) = (quadric[D + next], quadric[D + next]);
    }
    matrix
}

/// Pairs of tangential axes of the second derivatives, in the order of the terms.
pub(super) fn second_derivatives(k: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..k).flat_map(move |a| (a..k).map(move |b| (a, b)))
}

/// Adds `weight · terms termsᵀ` to a matrix, of which the upper triangle is used.
pub(super) fn add_products<const P: usize>(matrix: &mut [[f64; P]; P], terms: &[f64; P], weight: f64) {
    for i in 0..P {
        let scaled = weight * terms[i];
        // The whole row: computing it is shorter than deciding where it begins.
        for l in 0..P {
            matrix[i][l] += scaled * terms[l];
        }
    }
}

/// Factorizes RᵀR = A in the upper triangle. Returns `None` if A is singular.
pub(super) fn factorize<const P: usize>(a: &mut [[f64; P]; P]) -> Option<()> {
    for i in 0..P {
        let diagonal = a[i][i];
        let (above, rest) = a.split_at_mut(i);
        for row in above {
            let factor = row[i];
            rest[0][i..].iter_mut().zip(&row[i..]).for_each(|(x, r)| *x -= factor * r);
        }
        // NaN fails this comparison too.
        let is_determined = a[i][i] > SINGULAR * diagonal;
        if !is_determined {
            return None;
        }
        let inverse = 1.0 / a[i][i].sqrt();
        a[i][i..].iter_mut().for_each(|x| *x *= inverse);
    }
    Some(())
}

/// Replaces b by R⁻ᵀb.
pub(super) fn forward<const P: usize>(r: &[[f64; P]; P], b: &mut [f64; P]) {
    for i in 0..P {
        b[i] /= r[i][i];
        for l in i + 1..P {
            b[l] -= r[i][l] * b[i];
        }
    }
}

/// Replaces b by R⁻¹b.
pub(super) fn backward<const P: usize>(r: &[[f64; P]; P], b: &mut [f64; P]) {
    for i in (0..P).rev() {
        let known: f64 = (i + 1..P).map(|l| r[i][l] * b[l]).sum();
        b[i] = (b[i] - known) / r[i][i];
    }
}

/// Principal axes of arms about their mean, the direction of least variance last, `[d, d]`.
pub(super) fn principal_axes(arms: &[f64], d: usize, radius: f64) -> Small {
    let n = (arms.len() / d) as f64;
    let mut mean = zeros(d);
    for arm in arms.chunks_exact(d) {
        mean.iter_mut().zip(arm).for_each(|(m, a)| *m += a / (n * radius));
    }
    let mut covariance = zeros(d * d);
    for arm in arms.chunks_exact(d) {
        for a in 0..d {
            for b in a..d {
                covariance[a * d + b] += (arm[a] / radius - mean[a]) * (arm[b] / radius - mean[b]);
            }
        }
    }
    let (_, vectors) = symmetric_eigen(&covariance, d);
    vectors.chunks_exact(d).rev().flatten().copied().collect()
}
