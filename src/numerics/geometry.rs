//! Normals, shape operator and curvatures of the level surfaces of the signature function.

use rayon::prelude::*;

use super::cloud::Cloud;
use super::eigen::symmetric_eigen;
use super::error::NumericsError;
use super::interpolant::Interpolant;
use super::jets::{JetOrder, Jets};
use super::neighbours::Neighbours;
use super::observer::Observer;

/// Which way normals point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orientation {
    /// ν = −∇u/|∇u|: out of closed surfaces while u > 1 inside (errata.md, 2).
    Outward,
    /// ν = +∇u/|∇u|.
    Gradient,
}

impl Orientation {
    fn sign(self) -> f64 {
        match self {
            Self::Outward => -1.0,
            Self::Gradient => 1.0,
        }
    }
}

/// Why a query has no normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DegeneracyReason {
    /// |∇u| is rounding (T1), or too small against the Hessian at the scale of the sampling (T2).
    VanishingGradient,
}

/// A query at which geometry has no meaning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Degeneracy {
    pub query: usize,
    pub reason: DegeneracyReason,
    /// |∇u|, unit 1/L.
    pub gradient_norm: f64,
}

/// T1: multiple of the rounding bound under which a gradient is rounding (numerics.md, Geometry).
const ROUNDING_FACTOR: f64 = 64.0;
/// T2: fraction of `h_q ‖D²u‖_F` under which the direction of ∇u turns within the sampling distance.
const SCALE_FACTOR: f64 = 0.05;
/// T2: neighbours that define the sampling distance h_q.
const SPACING_NEIGHBOURS: usize = 4;

/// First and second order geometry of the surface at m queries, d ≥ 2.
///
/// At degenerate queries normals are zero and meaningless: ask [`Geometry::is_degenerate`] first.
pub struct Geometry {
    jets: Jets,
    sign: f64,
    gradient_norms: Vec<f64>,
    /// `[m, d]`, norm 1.
    normals: Vec<f64>,
    degenerate: Vec<Degeneracy>,
    is_degenerate: Vec<bool>,
}

/// Curvatures at m queries, in the order of the queries; entries of degenerate queries are zero and meaningless.
pub struct Curvatures {
    /// `[m, d−1]`, ascending by value, 1/L.
    pub principal: Vec<f64>,
    /// `[m, d−1, d]`, orthonormal and tangent, the component of largest magnitude positive.
    pub directions: Vec<f64>,
    /// `[m]`, their average, 1/L.
    pub mean: Vec<f64>,
    /// `[m]`, their product, 1/L^{d−1}.
    pub gaussian: Vec<f64>,
}

impl Geometry {
    /// Evaluates the signature function at the queries, `neighbours` being those of its cloud.
    ///
    /// `ν = σ∇u/|∇u|`; a query is degenerate where T1 or T2 of numerics.md holds.
    ///
    /// # Errors
    /// [`NumericsError::DimensionTooSmall`] for d = 1; those of [`Interpolant::at`].
    pub fn of(
        signature: &Interpolant,
        neighbours: &Neighbours,
        queries: &Cloud,
        orientation: Orientation,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let (d, m) = (queries.dimension(), queries.n_points());
        if signature.factor.cloud().dimension() < 2 {
            return Err(NumericsError::DimensionTooSmall { found: signature.factor.cloud().dimension() });
        }
        let jets = signature.at(queries, JetOrder::HessianWithMagnitudes, observer)?;
        let sign = orientation.sign();
        let gradient_norms: Vec<f64> = (0..m).map(|query| norm(jets.gradient(query))).collect();
        let criterion = VanishingGradient { signature, neighbours, jets: &jets };
        let is_degenerate: Vec<bool> = (0..m)
            .into_par_iter()
            .map(|query| {
                observer.checkpoint()?;
                Ok(criterion.holds(query, queries.point(query), gradient_norms[query]))
            })
            .collect::<Result<_, NumericsError>>()?;
        let mut normals = vec![0.0; m * d];
        let mut degenerate = Vec::new();
        for query in 0..m {
            let gradient_norm = gradient_norms[query];
            if is_degenerate[query] {
                let reason = DegeneracyReason::VanishingGradient;
                degenerate.push(Degeneracy { query, reason, gradient_norm });
                continue;
            }
            for (slot, g) in normals[query * d..].iter_mut().zip(jets.gradient(query)) {
                // Adding 0 turns −0 into 0.
                *slot = sign * g / gradient_norm + 0.0;
            }
        }
        Ok(Self { jets, sign, gradient_norms, normals, degenerate, is_degenerate })
    }

    pub fn n_queries(&self) -> usize {
        self.gradient_norms.len()
    }

    pub fn dimension(&self) -> usize {
        self.jets.dimension()
    }

    /// Whether each query is degenerate, `[m]`.
    pub fn is_degenerate(&self) -> &[bool] {
        &self.is_degenerate
    }

    /// The degenerate queries with their reasons, ascending.
    pub fn degenerate(&self) -> &[Degeneracy] {
        &self.degenerate
    }

    /// u at the queries, `[m]`: 1 on the surface at α = 0.
    pub fn levels(&self) -> Vec<f64> {
        self.jets.values()
    }

    /// |∇u|, `[m]`, 1/L.
    pub fn gradient_norms(&self) -> &[f64] {
        &self.gradient_norms
    }

    /// ν, `[m, d]`.
    pub fn normals(&self) -> &[f64] {
        &self.normals
    }

    /// ν at one query.
    pub fn normal(&self, query: usize) -> &[f64] {
        let d = self.dimension();
        &self.normals[query * d..][..d]
    }

    /// `tr(Dν) = σ(tr D²u − νᵀD²uν)/|∇u|` at a query: the sum of the principal curvatures, 1/L.
    pub fn trace_of_shape_operator(&self, query: usize) -> f64 {
        let (hessian, normal) = (self.jets.hessian(query), self.normal(query));
        self.sign * tangential_trace(&hessian, normal) / self.gradient_norms[query]
    }

    /// Eigenvalues of `S = σ P D²u P/|∇u|`, `P = I − ννᵀ`, on the tangent space (errata.md, 3).
    ///
    /// Sphere of radius r, outward: all +1/r.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub fn curvatures(&self, observer: &dyn Observer) -> Result<Curvatures, NumericsError> {
        let (d, m) = (self.dimension(), self.n_queries());
        let k = d - 1;
        let mut curvatures = Curvatures {
            principal: vec![0.0; m * k],
            directions: vec![0.0; m * k * d],
            mean: vec![0.0; m],
            gaussian: vec![0.0; m],
        };
        curvatures
            .principal
            .par_chunks_mut(k)
            .zip(curvatures.directions.par_chunks_mut(k * d))
            .zip(curvatures.mean.par_iter_mut().zip(&mut curvatures.gaussian))
            .enumerate()
            .filter(|(query, _)| !self.is_degenerate[*query])
            .try_for_each(|(query, ((principal, directions), (mean, gaussian)))| {
                observer.checkpoint()?;
                self.principal_frame(query, principal, directions);
                *mean = principal.iter().sum::<f64>() / k as f64;
                *gaussian = principal.iter().product();
                Ok(())
            })?;
        Ok(curvatures)
    }

    /// Writes principal curvatures `[d−1]` and directions `[d−1, d]` at one query.
    fn principal_frame(&self, query: usize, principal: &mut [f64], directions: &mut [f64]) {
        let d = self.dimension();
        let basis = tangent_basis(self.normal(query));
        let (values, vectors) = symmetric_eigen(&self.shape_operator(query, &basis), d - 1);
        principal.copy_from_slice(&values);
        for (slot, vector) in directions.chunks_exact_mut(d).zip(&vectors) {
            for (basis_vector, &coefficient) in basis.iter().zip(vector) {
                for (x, b) in slot.iter_mut().zip(basis_vector) {
                    *x += coefficient * b;
                }
            }
            make_largest_positive(slot);
        }
    }

    /// S in a basis of the tangent space, `[d−1, d−1]`.
    fn shape_operator(&self, query: usize, basis: &[Vec<f64>]) -> Vec<f64> {
        let (hessian, d) = (self.jets.hessian(query), self.dimension());
        let scale = self.sign / self.gradient_norms[query];
        let image = |v: &[f64]| (0..d).map(|i| dot(&hessian[i * d..][..d], v)).collect::<Vec<f64>>();
        let images: Vec<Vec<f64>> = basis.iter().map(|v| image(v)).collect();
        basis.iter().flat_map(|a| images.iter().map(move |b| scale * dot(a, b))).collect()
    }
}

/// Criteria T1 and T2 of numerics.md.
struct VanishingGradient<'a> {
    signature: &'a Interpolant,
    neighbours: &'a Neighbours,
    jets: &'a Jets,
}

impl VanishingGradient<'_> {
    fn holds(&self, query: usize, x: &[f64], gradient_norm: f64) -> bool {
        self.is_rounding(query, gradient_norm) || self.turns_within_spacing(query, x, gradient_norm)
    }

    /// T1: `ℓ|∇u| ≤ 64 [ε(ℓΣ|λ_j||∇k_j| + Σ|λ_j||k_j|) + ‖Y − (K+αI)Λ‖_∞]`.
    fn is_rounding(&self, query: usize, gradient_norm: f64) -> bool {
        let length_scale = self.signature.factor.kernel().length_scale();
        let (value, slope) = self.jets.magnitudes(query);
        let rounding = f64::EPSILON * (length_scale * slope + value) + self.signature.solution.residual_max;
        length_scale * gradient_norm <= ROUNDING_FACTOR * rounding
    }

    /// T2: `|∇u| < 0.05 h_q ‖D²u‖_F`, h_q the mean distance to the 4 neighbours of the nearest point.
    fn turns_within_spacing(&self, query: usize, x: &[f64], gradient_norm: f64) -> bool {
        let cloud = self.signature.factor.cloud();
        let nearest = self.neighbours.nearest(cloud, x, 1);
        let spacing = nearest
            .first()
            .and_then(|found| self.neighbours.mean_spacing(cloud, found.point, SPACING_NEIGHBOURS))
            .unwrap_or(0.0);
        gradient_norm < SCALE_FACTOR * spacing * norm(&self.jets.hessian(query))
    }
}

/// `tr H − νᵀHν`: the trace over the tangent space.
pub(crate) fn tangential_trace(hessian: &[f64], normal: &[f64]) -> f64 {
    let d = normal.len();
    let trace: f64 = (0..d).map(|i| hessian[i * d + i]).sum();
    let normal_part: f64 = (0..d).map(|i| normal[i] * dot(&hessian[i * d..][..d], normal)).sum();
    trace - normal_part
}

/// An orthonormal basis of ν's complement: the other columns of the Householder reflection that maps ν to ±e₁.
fn tangent_basis(normal: &[f64]) -> Vec<Vec<f64>> {
    let d = normal.len();
    let sign = if normal[0] < 0.0 { -1.0 } else { 1.0 };
    let mut w = normal.to_vec();
    w[0] += sign;
    // |w|² = 2(1 + |ν₁|) for a unit ν: no cancellation by the choice of sign.
    let factor = 1.0 / (1.0 + normal[0].abs());
    (1..d)
        .map(|axis| (0..d).map(|i| f64::from(u8::from(i == axis)) - factor * w[i] * w[axis]).collect())
        .collect()
}

/// Flips a vector so that its component of largest magnitude is positive; the first of several.
fn make_largest_positive(v: &mut [f64]) {
    let largest = v.iter().fold(0.0, |a: f64, &b| if b.abs() > a.abs() { b } else { a });
    if largest < 0.0 {
        for x in v {
            *x = -*x;
        }
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(v: &[f64]) -> f64 {
    dot(v, v).sqrt()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::numerics::kernel::{Family, Kernel};
    use crate::numerics::observer::Unobserved;
    use crate::numerics::regularization::Regularization;
    use crate::numerics::solver::GramFactor;
    use crate::numerics::testing::{circle, fibonacci_sphere};

    fn geometry(cloud: &Cloud, length_scale: f64, queries: &Cloud, orientation: Orientation) -> Geometry {
        let kernel = Kernel::new(Family::Laplace { epsilon: 1.0 }, length_scale, 1.0).unwrap();
        let cloud = Arc::new(cloud.clone());
        let alpha = Regularization::Uniform(0.0);
        let factor = GramFactor::factorize(cloud.clone(), kernel, alpha, &Unobserved).unwrap();
        let signature = Interpolant::signature(Arc::new(factor), &Unobserved).unwrap();
        Geometry::of(&signature, &Neighbours::of(&cloud), queries, orientation, &Unobserved).unwrap()
    }

    #[test]
    fn normals_of_a_sphere_are_radial_and_its_curvatures_one() {
        // The interpolation error of Laplace ε = 1 on 256 points is about 1e-5 in the curvatures (errata.md).
        let cloud = fibonacci_sphere(256);
        let geometry = geometry(&cloud, 1.0, &cloud, Orientation::Outward);
        let curvatures = geometry.curvatures(&Unobserved).unwrap();
        assert!(geometry.degenerate().is_empty());
        for query in 0..256 {
            assert!(dot(geometry.normal(query), cloud.point(query)) > 1.0 - 1e-6);
            assert!((geometry.trace_of_shape_operator(query) - 2.0 * curvatures.mean[query]).abs() < 1e-12);
            assert!((curvatures.mean[query] - 1.0).abs() < 1e-3, "{}", curvatures.mean[query]);
            assert!((curvatures.gaussian[query] - 1.0).abs() < 2e-3);
        }
    }

    #[test]
    fn directions_are_tangent_orthonormal_and_normalised_in_sign() {
        let cloud = fibonacci_sphere(200);
        let stretched: Vec<f64> = cloud.points().flat_map(|x| [2.0 * x[0], x[1], 0.7 * x[2]]).collect();
        let cloud = Cloud::new(stretched, 3).unwrap();
        let geometry = geometry(&cloud, 1.0, &cloud, Orientation::Outward);
        let curvatures = geometry.curvatures(&Unobserved).unwrap();
        for query in 0..200 {
            let directions: Vec<&[f64]> = curvatures.directions[query * 6..][..6].chunks(3).collect();
            assert!(dot(directions[0], directions[1]).abs() < 1e-14);
            for direction in directions {
                assert!((norm(direction) - 1.0).abs() < 1e-14);
                assert!(dot(direction, geometry.normal(query)).abs() < 1e-14);
                assert!(direction.iter().fold(0.0f64, |a, &b| if b.abs() > a.abs() { b } else { a }) > 0.0);
            }
        }
    }

    #[test]
    fn the_gradient_orientation_is_the_opposite_of_outward() {
        let cloud = circle(40);
        let outward = geometry(&cloud, 1.0, &cloud, Orientation::Outward).curvatures(&Unobserved).unwrap();
        let gradient = geometry(&cloud, 1.0, &cloud, Orientation::Gradient).curvatures(&Unobserved).unwrap();
        for query in 0..40 {
            assert!((outward.principal[query] - 1.0).abs() < 1e-6);
            assert_eq!(outward.principal[query], -gradient.principal[query]);
        }
    }

    #[test]
    fn the_gradient_vanishes_at_the_centre_of_a_sphere() {
        let cloud = fibonacci_sphere(100);
        let queries = Cloud::new(vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0], 3).unwrap();
        let geometry = geometry(&cloud, 1.0, &queries, Orientation::Outward);
        assert_eq!(geometry.is_degenerate(), [true, false]);
        assert_eq!(geometry.degenerate()[0].query, 0);
        assert_eq!(geometry.degenerate()[0].gradient_norm, geometry.gradient_norms()[0]);
    }

    #[test]
    fn tangent_bases_are_orthonormal_for_every_normal() {
        for normal in [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.6, -0.8], [-0.48, 0.6, 0.64]] {
            let basis = tangent_basis(&normal);
            for (i, a) in basis.iter().enumerate() {
                assert!(dot(a, &normal).abs() < 1e-15);
                for (j, b) in basis.iter().enumerate() {
                    assert!((dot(a, b) - f64::from(u8::from(i == j))).abs() < 1e-15);
                }
            }
        }
    }
}
