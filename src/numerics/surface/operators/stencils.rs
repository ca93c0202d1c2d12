//! Operators as sparse matrices: weights of the nodes near each query.
//!
//! In the tangent plane at a query the metric of a surface is the identity up to second order, so the surface gradient is the
//! gradient over tangential coordinates t, and the Laplace–Beltrami operator the Laplacian. Weights for both come from the nearest
//! nodes by polyharmonic splines r⁵ with polynomials up to degree 4 (RBF-FD: Flyer, Fornberg, Bayona and Barnett 2016): exact for
//! these polynomials, without a length scale, and of third order in the spacing for second derivatives.

use faer::Mat;
use faer::linalg::solvers::Solve;
use rayon::prelude::*;

use super::super::degeneracy::Resolution;
use super::super::geometry::Geometry;
use super::Operator;
use super::resolution::resolution;
use crate::numerics::error::NumericsError;
use crate::numerics::machine::small::Small;
use crate::numerics::machine::vector::{dot, norm, tangent_basis};
use crate::numerics::observer::{Observer, Stage};
use crate::numerics::points::cloud::Cloud;
use crate::numerics::points::monomials::{
    MAX_STENCIL_DEGREE, NODES_PER_MONOMIAL, exponents, n_monomials, n_stencil_nodes,
};
use crate::numerics::points::neighbours::{Neighbour, Neighbours};

/// Degree of the polynomials that r⁵ asks for: it is conditionally positive definite of order 3 (Wendland 2005, sec. 8.3).
const LEAST_DEGREE: usize = 2;

/// Slope beyond which a node is on another sheet.
const STEEP: f64 = 1.0;

/// A sparse matrix by rows, one list of numbers per component: entry `at` of row i, `indptr[i] ≤ at < indptr[i + 1]`, is in column
/// `indices[at]`.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseMatrix {
    /// Numbers per entry: 1, or d for a gradient. Not to be told from `data` where all rows are empty.
    pub n_components: usize,
    /// `[m + 1]`
    pub indptr: Vec<i64>,
    /// Ascending within a row.
    pub indices: Vec<i64>,
    /// `[components, entries]`: 1/L² for the Laplace–Beltrami operator, 1/L for the surface gradient.
    pub data: Vec<f64>,
}

/// The weights at all queries, and which of them are to be trusted.
#[derive(Debug)]
pub struct Stencils {
    pub matrix: SparseMatrix,
    /// `[m]`
    pub resolutions: Vec<Resolution>,
}

/// The Laplace–Beltrami operator at the queries of the geometry as a sum over nodes, `[m, n]`, unit 1/L²; rows of null queries, and of
/// queries with too few nodes, are empty.
///
/// # Errors
/// [`NumericsError::DimensionMismatch`], [`NumericsError::Overflow`], [`NumericsError::Cancelled`].
pub fn laplace_beltrami_stencils(
    geometry: &Geometry,
    nodes: &Cloud,
    neighbours: &Neighbours,
    queries: &Cloud,
    observer: &dyn Observer,
) -> Result<Stencils, NumericsError> {
    stencils(geometry, (nodes, neighbours), queries, Operator::LaplaceBeltrami, observer)
}

/// The components of the surface gradient in the same way, `[d, m, n]`, unit 1/L.
///
/// # Errors
/// Those of [`laplace_beltrami_stencils`].
pub fn surface_gradient_stencils(
    geometry: &Geometry,
    nodes: &Cloud,
    neighbours: &Neighbours,
    queries: &Cloud,
    observer: &dyn Observer,
) -> Result<Stencils, NumericsError> {
    stencils(geometry, (nodes, neighbours), queries, Operator::SurfaceGradient, observer)
}

fn stencils(
    geometry: &Geometry,
    (nodes, neighbours): (&Cloud, &Neighbours),
    queries: &Cloud,
    operator: Operator,
    observer: &dyn Observer,
) -> Result<Stencils, NumericsError> {
    nodes.check_same_dimension(queries)?;
    observer.enter(Stage::Evaluate);
    let d = nodes.dimension();
    let row = |nearest: &mut Vec<Neighbour>, query: usize| {
        observer.checkpoint()?;
        if geometry.is_null()[query] {
            return Ok(Row::default());
        }
        let x = queries.point(query);
        neighbours.nearest_positions_into(x, n_stencil_nodes(d), nearest);
        let site = Site { x, normal: geometry.normal(query), curvature: geometry.largest_curvature(query) };
        let row = Row::at(nodes, &site, nearest, operator).unwrap_or_default();
        match row.weights.iter().all(|weight| weight.is_finite()) {
            true => Ok(row),
            false => Err(NumericsError::Overflow { query }),
        }
    };
    let rows = (0..queries.n_points()).into_par_iter().map_init(Vec::new, row);
    let rows: Vec<Row> = rows.collect::<Result<_, NumericsError>>()?;
    let resolutions = rows.iter().map(|row| row.resolution).collect();
    Ok(Stencils { matrix: SparseMatrix::of(&rows, operator.n_components(d)), resolutions })
}

/// Sum of the magnitudes of weights over scaled coordinates, in units of `n^{order/k}` of regular nodes, from which they multiply what the
/// nodes have of noise: regular nodes have about 2 around a point, and ten times that at a rim.
const UNSTABLE: f64 = 200.0;

/// Error of the weights for a polynomial, over the sum of their magnitudes, from which the nodes do not determine them.
const INDETERMINATE: f64 = 1e-9;

/// Distance to a nearer node in units of the spacing up to which a node says nothing new.
const CLOSE: f64 = 0.1;

/// A query on the surface.
struct Site<'a> {
    x: &'a [f64],
    normal: &'a [f64],
    /// Magnitude of the largest principal curvature, 1/L.
    curvature: f64,
}

impl SparseMatrix {
    fn of(rows: &[Row], n_components: usize) -> Self {
        let n_entries = rows.iter().map(|row| row.columns.len()).sum();
        let mut indptr = Vec::with_capacity(rows.len() + 1);
        let mut indices = Vec::with_capacity(n_entries);
        indptr.push(0);
        for row in rows {
            indices.extend(row.columns.iter().map(|&column| i64::from(column)));
            indptr.push(indices.len() as i64);
        }
        let mut data = Vec::with_capacity(n_entries * n_components);
        for component in 0..n_components {
            for row in rows {
                let n = row.columns.len();
                data.extend_from_slice(&row.weights[component * n..][..n]);
            }
        }
        Self { n_components, indptr, indices, data }
    }

    /// The products with values at the nodes, `[components, m]`.
    pub fn apply(&self, values: &[f64]) -> Vec<f64> {
        let (m, n_entries) = (self.indptr.len() - 1, self.indices.len());
        let of_row = |component: usize, row: usize| {
            let range = self.indptr[row] as usize..self.indptr[row + 1] as usize;
            let weights = &self.data[component * n_entries..][range.clone()];
            weights.iter().zip(&self.indices[range]).map(|(w, &column)| w * values[column as usize]).sum()
        };
        (0..self.n_components * m).into_par_iter().map(|at| of_row(at / m, at % m)).collect()
    }
}

/// Weights of one query.
#[derive(Default)]
struct Row {
    columns: Vec<u32>,
    /// `[components, columns]`
    weights: Vec<f64>,
    resolution: Resolution,
}

impl Row {
    /// `None` if too few nodes lie around x.
    fn at(nodes: &Cloud, site: &Site<'_>, nearest: &[Neighbour], operator: Operator) -> Option<Self> {
        let Site { x, normal, curvature } = *site;
        let (d, k) = (x.len(), x.len() - 1);
        let axes = tangent_basis(normal);
        let (mut columns, mut coordinates) = (Vec::new(), Vec::new());
        let reach = nearest.last().map_or(0.0, |found| found.squared_distance.sqrt());
        let close = CLOSE * reach / (nearest.len() as f64).powf(1.0 / k as f64);
        for found in nearest {
            let arm: Small = nodes.point(found.point).iter().zip(x).map(|(p, x)| p - x).collect();
            let local: Small = axes.chunks_exact(d).map(|axis| dot(axis, &arm)).collect();
            let is_on_sheet =
                dot(normal, &arm).abs() <= STEEP * norm(&local) || found.squared_distance == 0.0;
            let is_close = |other: &[f64]| {
                let squared: f64 = other.iter().zip(&local).map(|(a, b)| (a - b).powi(2)).sum();
                squared < close * close
            };
            if is_on_sheet && !coordinates.chunks_exact(k).any(is_close) {
                columns.push(found.point as u32);
                coordinates.extend_from_slice(&local);
            }
        }
        let radius = coordinates.chunks_exact(k).map(norm).fold(0.0, f64::max);
        if radius <= 0.0 {
            return None;
        }
        coordinates.iter_mut().for_each(|t| *t /= radius);
        let has_nodes = |&degree: &usize| {
            columns.len() as f64 >= (NODES_PER_MONOMIAL - 0.5) * n_monomials(k, degree) as f64
        };
        let degrees = (LEAST_DEGREE..=MAX_STENCIL_DEGREE).rev().filter(has_nodes);
        let forms = degrees.into_iter().find_map(|degree| solve(&coordinates, k, degree, operator))?;
        let resolution = resolution(&forms, &coordinates, k, curvature * radius, operator);
        let weights = match operator {
            Operator::LaplaceBeltrami => forms.iter().map(|w| w / (radius * radius)).collect(),
            Operator::SurfaceGradient => in_space(&forms, &axes, radius, d),
        };
        Some(Self { columns, weights, resolution }.sorted(operator.n_components(d)))
    }

    fn sorted(self, n_components: usize) -> Self {
        let n = self.columns.len();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_unstable_by_key(|&at| self.columns[at]);
        let columns = order.iter().map(|&at| self.columns[at]).collect();
        let weight = |component: usize| order.iter().map(move |&at| component * n + at);
        let weights = (0..n_components).flat_map(weight).map(|at| self.weights[at]).collect();
        Self { columns, weights, resolution: self.resolution }
    }
}

/// Weights of the derivatives along the axes, as those of the components in space.
fn in_space(forms: &[f64], axes: &[f64], radius: f64, d: usize) -> Vec<f64> {
    let n = forms.len() / (d - 1);
    let component = |c: usize| {
        (0..n).map(move |j| (0..d - 1).map(|a| forms[a * n + j] * axes[a * d + c]).sum::<f64>() / radius)
    };
    (0..d).flat_map(component).collect()
}

/// Weights of the derivatives at 0 for values at scaled coordinates `[n, k]`: one list for the Laplacian, k for the gradient. Solves
/// `[Φ P; Pᵀ 0] [w; λ] = [Dφ; Dp]`; `None` where the nodes do not determine polynomials of this degree (they lie on a few lines, say), or
/// only by weights that would multiply noise.
fn solve(coordinates: &[f64], k: usize, degree: usize, operator: Operator) -> Option<Vec<f64>> {
    let n = coordinates.len() / k;
    let exponents = exponents(k, degree);
    let size = n + exponents.len();
    let point = |j: usize| &coordinates[j * k..][..k];
    let mut matrix = Mat::<f64>::zeros(size, size);
    for i in 0..n {
        for j in 0..i {
            let squared: f64 = point(i).iter().zip(point(j)).map(|(a, b)| (a - b) * (a - b)).sum();
            let spline = squared * squared * squared.sqrt();
            (matrix[(i, j)], matrix[(j, i)]) = (spline, spline);
        }
        for (term, powers) in exponents.iter().enumerate() {
            let value: f64 = point(i).iter().zip(powers).map(|(t, &p)| t.powi(p as i32)).product();
            (matrix[(i, n + term)], matrix[(n + term, i)]) = (value, value);
        }
    }
    let n_forms = if operator == Operator::LaplaceBeltrami { 1 } else { k };
    let mut right = Mat::<f64>::zeros(size, n_forms);
    for j in 0..n {
        let cubed = dot(point(j), point(j)).powf(1.5);
        for form in 0..n_forms {
            right[(j, form)] = match operator {
                Operator::LaplaceBeltrami => (15 + 5 * k) as f64 * cubed,
                Operator::SurfaceGradient => -5.0 * cubed * point(j)[form],
            };
        }
    }
    for (term, powers) in exponents.iter().enumerate() {
        for form in 0..n_forms {
            right[(n + term, form)] = derivative_at_zero(powers, form, operator);
        }
    }
    let solution = matrix.partial_piv_lu().solve(&right);
    let weights: Vec<f64> =
        (0..n_forms).flat_map(|form| (0..n).map(move |j| (j, form))).map(|at| solution[at]).collect();
    let are_right = |form: usize| {
        let weights = &weights[form * n..][..n];
        let total: f64 = weights.iter().map(|weight| weight.abs()).sum();
        let error = |term: usize| {
            let found: f64 = (0..n).map(|j| weights[j] * matrix[(j, n + term)]).sum();
            (found - right[(n + term, form)]).abs()
        };
        // Not a number where the system is singular.
        total <= UNSTABLE * (n as f64).powf(operator.order() as f64 / k as f64)
            && (0..exponents.len()).all(|term| error(term) <= INDETERMINATE * (1.0 + total))
    };
    (0..n_forms).all(are_right).then_some(weights)
}

fn derivative_at_zero(powers: &[usize], form: usize, operator: Operator) -> f64 {
    let total: usize = powers.iter().sum();
    match operator {
        Operator::LaplaceBeltrami if total == 2 && powers.contains(&2) => 2.0,
        Operator::SurfaceGradient if total == 1 && powers[form] == 1 => 1.0,
        Operator::LaplaceBeltrami | Operator::SurfaceGradient => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;
    use std::sync::Arc;

    use super::*;
    use crate::numerics::observer::Unobserved;
    use crate::numerics::points::sampling::Sampling;
    use crate::numerics::surface::Surface;
    use crate::numerics::surface::geometry::GeometryRequest;
    use crate::numerics::surface::local::LocalSurface;
    use crate::numerics::testing::{Random, circle, fibonacci_sphere};

    fn matrices(cloud: &Cloud) -> (SparseMatrix, SparseMatrix) {
        let (laplacian, gradient) = stencils_of(cloud);
        (laplacian.matrix, gradient.matrix)
    }

    fn stencils_of(cloud: &Cloud) -> (Stencils, Stencils) {
        let cloud = Arc::new(cloud.clone());
        let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
        let surface = LocalSurface::of(cloud.clone(), sampling.clone(), None, &Unobserved).unwrap();
        let surface = Surface::from(surface);
        let geometry = Geometry::of(&surface, &cloud, &GeometryRequest::CURVATURES, &Unobserved).unwrap();
        let tree = sampling.neighbours();
        (
            laplace_beltrami_stencils(&geometry, &cloud, tree, &cloud, &Unobserved).unwrap(),
            surface_gradient_stencils(&geometry, &cloud, tree, &cloud, &Unobserved).unwrap(),
        )
    }

    #[test]
    fn coarse_circles_and_spheres_are_right_or_said_to_be_unresolved() {
        let clouds =
            (8..100).step_by(4).flat_map(|n| [circle(n), fibonacci_sphere(n), fibonacci_sphere(4 * n)]);
        let (mut n_resolved, mut n_unresolved) = (0, 0);
        for cloud in clouds {
            let d = cloud.dimension();
            let (laplacian, gradient) = stencils_of(&cloud);
            // Coordinates are eigenfunctions: Δx = −(d − 1)x, ∇x_c = e_c − x_c x.
            for c in 0..d {
                let values: Vec<f64> = cloud.points().map(|x| x[c]).collect();
                let (found, slopes) = (laplacian.matrix.apply(&values), gradient.matrix.apply(&values));
                for (i, x) in cloud.points().enumerate() {
                    let error = (found[i] / (d as f64 - 1.0) + x[c]).abs();
                    let is_resolved = laplacian.resolutions[i] == Resolution::Resolved;
                    *(if is_resolved { &mut n_resolved } else { &mut n_unresolved }) += 1;
                    // The test function is the one coordinate that is curved, along the normal.
                    assert!(!is_resolved || error < 0.15, "{d} {} {i}: {error}", cloud.n_points());
                    if gradient.resolutions[i] == Resolution::Resolved {
                        for a in 0..d {
                            let exact = f64::from(u8::from(a == c)) - x[a] * x[c];
                            let error = (slopes[a * cloud.n_points() + i] - exact).abs();
                            assert!(error < 0.15, "{d} {} {i}: {error}", cloud.n_points());
                        }
                    }
                }
            }
        }
        assert!(n_resolved > 1000 && n_unresolved > 1000, "{n_resolved} {n_unresolved}");
    }

    #[test]
    fn harmonics_of_the_circle_are_eigenfunctions() {
        let cloud = circle(200);
        let (laplacian, gradient) = matrices(&cloud);
        let values: Vec<f64> = cloud.points().map(|x| x[0] * x[0] - x[1] * x[1]).collect();
        // cos 2θ: Δ = −4, of fourth order in a spacing of 0.03.
        for (found, value) in laplacian.apply(&values).iter().zip(&values) {
            assert!((found + 4.0 * value).abs() < 1e-4, "{found} for {value}");
        }
        let found = gradient.apply(&values);
        for (i, x) in cloud.points().enumerate() {
            // −2 sin 2θ along (−y, x).
            let along = -4.0 * x[0] * x[1];
            assert!((found[i] + along * x[1]).abs() < 1e-5 && (found[200 + i] - along * x[0]).abs() < 1e-5);
        }
    }

    #[test]
    fn stretched_grids_and_near_duplicates_have_right_rows_or_none() {
        // A plane, spacing 1 by a: Δ|x|² = 4, ∇x = (1, 0, 0).
        for a in [1.0, 1.5, 2.0] {
            let points = (0..900).flat_map(|i| [f64::from(i % 30), a * f64::from(i / 30), 0.0]).collect();
            let cloud = Cloud::new(points, 3).unwrap();
            let (laplacian, gradient) = stencils_of(&cloud);
            let squares: Vec<f64> = cloud.points().map(|x| dot(x, x)).collect();
            let firsts: Vec<f64> = cloud.points().map(|x| x[0]).collect();
            let (found, slopes) = (laplacian.matrix.apply(&squares), gradient.matrix.apply(&firsts));
            for i in 0..900 {
                let is_empty = laplacian.resolutions[i] == Resolution::Empty;
                assert!(is_empty || (found[i] - 4.0).abs() < 1e-4, "{a} {i}: {}", found[i]);
                let is_empty = gradient.resolutions[i] == Resolution::Empty;
                assert!(is_empty || (slopes[i] - 1.0).abs() < 1e-6, "{a} {i}: {}", slopes[i]);
            }
            // A few where neither the regression nor a polynomial of degree 2 has enough lines of points.
            let n_empty = laplacian.resolutions.iter().filter(|&&found| found == Resolution::Empty).count();
            assert!(n_empty < 100 && (a > 1.0 || n_empty == 0), "{a}: {n_empty}");
        }
        // Every point of a sphere twice, the second a little beside: Δx = −2x.
        let sphere = fibonacci_sphere(1000);
        for jitter in [1e-3, 1e-5] {
            let mut random = Random(5);
            let beside = sphere.coordinates().iter().map(|x| x + jitter * random.normal());
            let both = sphere.coordinates().iter().copied().chain(beside).collect();
            let cloud = Cloud::new(both, 3).unwrap();
            let (laplacian, _) = stencils_of(&cloud);
            let values: Vec<f64> = cloud.points().map(|x| x[2] / norm(x)).collect();
            let found = laplacian.matrix.apply(&values);
            let is_resolved = |i: usize| laplacian.resolutions[i] == Resolution::Resolved;
            for i in (0..2000).filter(|&i| is_resolved(i)) {
                // The jitter over the square of the spacing, 0.1, at most.
                assert!(
                    (found[i] + 2.0 * values[i]).abs() < 0.15,
                    "{jitter} {i}: {} {}",
                    found[i],
                    values[i]
                );
            }
            assert!((0..2000).filter(|&i| is_resolved(i)).count() > 1900, "{jitter}");
        }
    }

    #[test]
    fn constants_vanish_and_the_operator_converges_on_the_sphere() {
        // f(z) = sin π(1 + 2z): Δ f = (1 − z²) f″ − 2z f′.
        let error = |n: usize| {
            let cloud = fibonacci_sphere(n);
            let (laplacian, _) = matrices(&cloud);
            let largest = laplacian.data.iter().fold(0.0, |a: f64, w| a.max(w.abs()));
            assert!(laplacian.apply(&vec![1.0; n]).iter().all(|x| x.abs() < 1e-9 * largest));
            let values: Vec<f64> = cloud.points().map(|x| (PI * (1.0 + 2.0 * x[2])).sin()).collect();
            let exact = |z: f64| {
                let (sin, cos) = (PI * (1.0 + 2.0 * z)).sin_cos();
                -(1.0 - z * z) * 4.0 * PI * PI * sin - 4.0 * PI * z * cos
            };
            let found = laplacian.apply(&values);
            let differences =
                found.iter().zip(cloud.points()).map(|(found, x)| (found - exact(x[2])).powi(2));
            let squares = cloud.points().map(|x| exact(x[2]).powi(2));
            (differences.sum::<f64>() / squares.sum::<f64>()).sqrt()
        };
        let (coarse, fine) = (error(1000), error(4000));
        // Third order in the spacing, which halves: at least a fifth, say.
        assert!(coarse < 0.05 && fine < 0.2 * coarse, "{coarse:e} and {fine:e}");
    }
}
