//! Prices of a model and of its answers for each solver, known before anything is computed.

use super::Recipe;
use crate::error::SolverKind;
use crate::machine::price::{Price, Sizes};
use crate::mesh::fields::quadrics::BYTES_PER_POINT;
use crate::mesh::price::{LOCAL_EVALUATION, MeshSize};
use crate::operators::JUDGED_FUNCTIONALS;
use crate::operators::price::applied_price;
use crate::regression::function::COLUMNS_AT_ONCE;
use crate::regression::function::local_kriging::price::{kriged_operator_price, kriging_price, making_price};
use crate::regression::function::price::{
    self as functions, deviations_price, judging_price, many_price, samples_price,
};
use crate::regression::solver::iterative::price::{
    iterative_covariances_price, iterative_fit_price, iterative_price,
};
use crate::regression::solver::landmark::price::{
    LandmarkPrice, landmark_fit_flops, on_centres, on_landmarks,
};
use crate::regression::solver::price::FactorPrice;
use crate::regression::sums::price::pair_flops;
use crate::surface::price::{
    self as surfaces, AskedOfSurface, local_geometry_price, local_surface_price, signature_surface_price,
};

/// Size of a cloud that is fitted.
#[derive(Debug, Clone, Copy)]
pub struct CloudSize {
    pub n_points: usize,
    pub dimension: usize,
    /// Whether the cloud is the client's without its duplicates, so that nothing is known of its neighbours.
    pub is_merged: bool,
}

/// Price of making a model and its surface ready.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MakingPrice {
    /// Price of the model in nearly all cases; `usize::MAX` bytes where they cannot be counted.
    pub expected: Price,
    /// Largest possible price of the model.
    pub at_most: Price,
    /// Price of the surface with its quadrics and normals.
    pub surface: Price,
}

impl Recipe {
    /// The price of making the model and its surface ready.
    pub fn price(&self, size: CloudSize) -> MakingPrice {
        let CloudSize { n_points, dimension, is_merged } = size;
        match self {
            Self::System { .. } => system_price(n_points, dimension),
            Self::Landmark { .. } => {
                let LandmarkPrice { expected, at_most } = LandmarkPrice::of(n_points, dimension);
                MakingPrice { expected, at_most, surface: landmark_surface_price(n_points, dimension) }
            }
            Self::Iterative { .. } => {
                let price = iterative_price(n_points, dimension);
                let surface = signature_surface_price(n_points, dimension)
                    .and(iterative_fit_price(n_points, dimension));
                MakingPrice { expected: price, at_most: price, surface }
            }
            Self::LocalKriging { kernel, .. } => {
                let price = making_price(n_points, dimension, is_merged, kernel.is_stretched());
                MakingPrice { expected: price, at_most: price, surface: Price::default() }
            }
            Self::LocalSurface { .. } => {
                // Small but not zero: a model with a price of zero would not count as missing.
                let trifle = Price { n_bytes: 1 << 10, flops: 0.0 };
                let surface = local_surface_price(n_points, dimension);
                MakingPrice { expected: trifle, at_most: trifle, surface }
            }
        }
    }
}

/// The price of a dense factorization and of the surface of its signature function.
pub fn system_price(n_points: usize, dimension: usize) -> MakingPrice {
    let FactorPrice { expected, at_most } = FactorPrice::of(n_points, dimension);
    MakingPrice { expected, at_most, surface: signature_surface_price(n_points, dimension) }
}

/// The price of a surface by the signature function of landmarks: its fit, its sums at the points, and a
/// search and a quadric at each.
fn landmark_surface_price(n_points: usize, dimension: usize) -> Price {
    let of_all = signature_surface_price(n_points, dimension);
    let centres = on_landmarks(Sizes { n_points, n_queries: 0, dimension }).n_points;
    let fewer = n_points as f64 * (n_points - centres) as f64 * pair_flops(dimension, 2);
    Price { flops: of_all.flops - fewer + landmark_fit_flops(n_points), ..of_all }
}

/// Request for a posterior of k lists of values.
#[derive(Debug, Clone, Copy)]
pub struct PosteriorAsked {
    pub has_variances: bool,
    pub has_covariance: bool,
    pub n_lists: usize,
    /// Number of derivatives of each list at each query.
    pub n_derivatives: usize,
    /// Number of deviations at each query.
    pub n_deviations: usize,
    /// Number of joint samples of each list.
    pub n_samples: usize,
}

/// Request for an operator applied to values over a surface.
#[derive(Debug, Clone, Copy)]
pub struct OperatorAsked {
    pub n_surface_points: usize,
    /// Count of the operator's numbers at all queries together.
    pub n_numbers: usize,
    pub surface: AskedOfSurface,
    pub has_deviations: bool,
}

/// The price of a function at queries, with derivatives up to `order` and `n_deviations` deviations at each.
pub fn function_price(solver: SolverKind, order: usize, n_deviations: usize, sizes: Sizes) -> Price {
    match solver {
        SolverKind::Local => kriging_price(n_deviations, sizes),
        SolverKind::Dense => functions::function_price(order, sizes).and(of_deviations(n_deviations, sizes)),
        SolverKind::Landmark => {
            let fit = Price::of_numbers(6 * sizes.n_points, landmark_fit_flops(sizes.n_points));
            fit.and(functions::function_price(order, on_centres(sizes)))
                .and(of_deviations(n_deviations, on_landmarks(sizes)))
        }
        SolverKind::Iterative => functions::function_price(order, sizes)
            .and(iterative_fit_price(sizes.n_points, sizes.dimension))
            .and(of_covariances(n_deviations, sizes)),
    }
}

/// The price of k lists of values at once besides the first.
pub fn lists_price(solver: SolverKind, n_lists: usize, n_derivatives: usize, sizes: Sizes) -> Price {
    let n_others = n_lists.saturating_sub(1) as f64;
    let fits = match solver {
        SolverKind::Dense | SolverKind::Local => 0.0,
        SolverKind::Landmark => n_others * landmark_fit_flops(sizes.n_points),
        SolverKind::Iterative => n_others * iterative_fit_price(sizes.n_points, sizes.dimension).flops,
    };
    many_price(n_lists, n_derivatives, sizes).and(Price { n_bytes: 0, flops: fits })
}

/// The price of a posterior at queries.
pub fn posterior_price(solver: SolverKind, asked: PosteriorAsked, sizes: Sizes) -> Price {
    let PosteriorAsked { has_variances, has_covariance, n_lists, n_deviations, .. } = asked;
    if solver == SolverKind::Local {
        return kriging_price(n_deviations, sizes);
    }
    if solver == SolverKind::Landmark {
        let fit = landmark_fit_flops(sizes.n_points) * n_lists as f64;
        let of_lists = Price::of_numbers(sizes.n_points.saturating_mul(6 * n_lists), fit);
        return of_lists.and(posterior_price(SolverKind::Dense, asked, on_landmarks(sizes)));
    }
    if solver == SolverKind::Iterative {
        return iterative_posterior_price(asked, sizes);
    }
    let mut price = functions::posterior_price(has_variances, has_covariance, sizes);
    if n_lists > 1 {
        price = price.and(many_price(n_lists, asked.n_derivatives, sizes));
    }
    price = price.and(of_deviations(n_deviations, sizes));
    if asked.n_samples > 0 {
        price = price.and(samples_price(sizes.n_queries, asked.n_samples.saturating_mul(n_lists)));
    }
    price
}

/// The price of a posterior by conjugate gradients, for which each variance is a solve.
fn iterative_posterior_price(asked: PosteriorAsked, sizes: Sizes) -> Price {
    let PosteriorAsked { has_variances, has_covariance, n_lists, n_deviations, n_samples, .. } = asked;
    let fit = iterative_fit_price(sizes.n_points, sizes.dimension);
    let n_solved = usize::from(has_variances || has_covariance) + n_deviations;
    let mut price = functions::function_price(0, sizes)
        .and(Price { flops: fit.flops * n_lists as f64, ..fit })
        .and(of_covariances(n_solved, sizes));
    if has_covariance {
        let columns = sizes.n_points.saturating_mul(10).saturating_add(sizes.n_queries);
        price = price.and(Price::of_numbers(columns.saturating_mul(sizes.n_queries), 0.0));
    }
    if n_samples > 0 {
        price = price.and(samples_price(sizes.n_queries, n_samples.saturating_mul(n_lists)));
    }
    price
}

/// The price of the covariances of `per_query` functionals at each query by conjugate gradients.
fn of_covariances(per_query: usize, sizes: Sizes) -> Price {
    let n_queries = sizes.n_queries.saturating_mul(per_query);
    iterative_covariances_price(COLUMNS_AT_ONCE, Sizes { n_queries, ..sizes })
}

/// The price of the deviations of `per_query` functionals at each query.
fn of_deviations(per_query: usize, sizes: Sizes) -> Price {
    let Sizes { n_points, n_queries, dimension } = sizes;
    match per_query {
        0 => Price::default(),
        _ => deviations_price(n_points, n_queries.saturating_mul(per_query), dimension),
    }
}

/// The price of normals or curvatures at queries.
pub fn geometry_price(surface: SolverKind, asked: AskedOfSurface, sizes: Sizes) -> Price {
    match surface {
        SolverKind::Local => local_geometry_price(sizes),
        SolverKind::Dense | SolverKind::Iterative => surfaces::geometry_price(asked, sizes),
        SolverKind::Landmark => surfaces::geometry_price(asked, on_landmarks(sizes)),
    }
}

/// The price of meshing the surface of a model, or a level of its values.
pub fn level_set_price(solver: SolverKind, size: MeshSize) -> Price {
    match solver {
        SolverKind::Dense | SolverKind::Landmark | SolverKind::Iterative => {
            size.price(size.n_points as f64 * pair_flops(size.dimension, 0))
        }
        SolverKind::Local => {
            let mesh = size.price(LOCAL_EVALUATION);
            let n_bytes = mesh.n_bytes.saturating_add(size.n_points.saturating_mul(BYTES_PER_POINT));
            Price { n_bytes, ..mesh }
        }
    }
}

/// The price of an operator applied to values by one solver on a surface by another.
pub fn operator_price(values: SolverKind, surface: SolverKind, asked: OperatorAsked, sizes: Sizes) -> Price {
    let OperatorAsked { n_surface_points, n_numbers, .. } = asked;
    match values {
        SolverKind::Local => {
            let of_surface = Sizes { n_points: n_surface_points, ..sizes };
            geometry_price(surface, asked.surface, of_surface).and(kriged_operator_price(sizes))
        }
        SolverKind::Landmark => {
            let fit = Price::of_numbers(6 * sizes.n_points, landmark_fit_flops(sizes.n_points));
            fit.and(operator_price(SolverKind::Dense, surface, asked, on_landmarks(sizes)))
        }
        SolverKind::Iterative => {
            let n_judged = n_numbers.min(JUDGED_FUNCTIONALS);
            let n_solved = n_judged + if asked.has_deviations { n_numbers } else { 0 };
            let of_solved = Sizes { n_queries: n_solved, ..sizes };
            applied_price(n_surface_points, asked.surface, sizes)
                .and(judging_price(n_judged, sizes))
                .and(iterative_fit_price(sizes.n_points, sizes.dimension))
                .and(of_covariances(1, of_solved))
        }
        SolverKind::Dense => {
            let applied = applied_price(n_surface_points, asked.surface, sizes);
            let price = applied.and(judging_price(n_numbers.min(JUDGED_FUNCTIONALS), sizes));
            if asked.has_deviations {
                price.and(deviations_price(sizes.n_points, n_numbers, sizes.dimension))
            } else {
                price
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operators::price::matrix_price;
    use crate::surface::price::Offsets;

    #[test]
    fn a_matrix_takes_half_its_square_and_the_fallback_all_of_it() {
        let price = system_price(20_000, 3);
        let square = 20_000usize.pow(2) * 8;
        assert!((square / 2..square * 52 / 100).contains(&price.expected.n_bytes), "{price:?}");
        assert!((square..square * 101 / 100).contains(&price.at_most.n_bytes));
        assert!((price.expected.flops - 8e12 / 3.0).abs() < 1e3);
        assert!(price.at_most.flops > price.expected.flops);
    }

    #[test]
    fn what_cannot_be_counted_costs_everything() {
        assert_eq!(system_price(usize::MAX / 2, 3).at_most.n_bytes, usize::MAX);
        let sizes = Sizes { n_points: 1 << 40, n_queries: 1 << 40, dimension: 3 };
        assert_eq!(functions::posterior_price(true, true, sizes).n_bytes, usize::MAX);
    }

    #[test]
    fn more_of_anything_never_costs_less() {
        let surface = |offsets| AskedOfSurface { offsets, has_own_quadrics: true, has_deviations: true };
        let all = |n: usize, dimension: usize| {
            let sizes = Sizes { n_points: n, n_queries: n, dimension };
            let geometry = |offsets| surfaces::geometry_price(surface(offsets), sizes);
            [
                functions::function_price(0, sizes),
                functions::function_price(2, sizes),
                functions::posterior_price(false, false, sizes),
                functions::posterior_price(true, false, sizes),
                functions::posterior_price(true, true, sizes),
                kriging_price(0, sizes),
                kriging_price(10, sizes),
                geometry(Offsets::Rescues),
                geometry(Offsets::Confirmations),
                geometry(Offsets::Everywhere),
                applied_price(n, surface(Offsets::Confirmations), sizes),
                matrix_price(n, n, surface(Offsets::Confirmations), sizes),
                system_price(n, dimension).expected,
                system_price(n, dimension).surface,
            ]
        };
        let sizes = [1, 10, 600, 30_000];
        for (few, many) in sizes.iter().zip(&sizes[1..]) {
            for d in [1, 3, 16] {
                for (at, (small, large)) in all(*few, d).iter().zip(&all(*many, d)).enumerate() {
                    assert!(
                        small.flops < large.flops && small.n_bytes < large.n_bytes,
                        "price {at}, d = {d}"
                    );
                }
            }
        }
    }
}
