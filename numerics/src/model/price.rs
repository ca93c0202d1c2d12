//! Prices of what a model is asked, by the solver that it will have: known before anything is made.

use crate::error::SolverKind;
use crate::solver::choose::{
    Asked, AskedOfSurface, Price, deviations_price, judging_price, kriged_operator_price, many_price,
    samples_price, work_price,
};
use crate::surface::operators::JUDGED_FUNCTIONALS;

/// A cloud that is fitted.
#[derive(Debug, Clone, Copy)]
pub struct CloudSize {
    pub n_points: usize,
    pub dimension: usize,
    /// Whether it is the client's cloud without its duplicates, so that nothing is known of its neighbours.
    pub is_merged: bool,
}

/// A cloud and the queries over it.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    pub n_points: usize,
    pub n_queries: usize,
    pub dimension: usize,
}

/// A posterior of k lists of values.
#[derive(Debug, Clone, Copy)]
pub struct PosteriorAsked {
    pub has_variances: bool,
    pub has_covariance: bool,
    pub n_lists: usize,
    /// Derivatives of each list at each query.
    pub n_derivatives: usize,
    /// Deviations at each query.
    pub n_deviations: usize,
    /// Joint samples of each list.
    pub n_samples: usize,
}

/// An operator applied to values over a surface.
#[derive(Debug, Clone, Copy)]
pub struct OperatorAsked {
    pub n_surface_points: usize,
    /// Numbers that the operator has at all queries together.
    pub n_numbers: usize,
    pub surface: AskedOfSurface,
    pub has_deviations: bool,
}

impl Sizes {
    fn price(self, asked: Asked) -> Price {
        work_price(asked, self.n_points, self.n_queries, self.dimension)
    }

    /// Deviations of so many functionals at each query.
    fn deviations(self, per_query: usize) -> Price {
        if per_query == 0 {
            return Price::default();
        }
        deviations_price(self.n_points, self.n_queries.saturating_mul(per_query), self.dimension)
    }
}

/// The price of a function with derivatives up to an order, and so many deviations, at queries.
pub fn function_price(solver: SolverKind, order: usize, n_deviations: usize, sizes: Sizes) -> Price {
    match solver {
        SolverKind::Local => sizes.price(Asked::Moving { n_deviations }),
        SolverKind::Dense => sizes.price(Asked::Function { order }).and(sizes.deviations(n_deviations)),
    }
}

/// The price of a posterior at queries.
pub fn posterior_price(solver: SolverKind, asked: PosteriorAsked, sizes: Sizes) -> Price {
    let PosteriorAsked { has_variances, has_covariance, n_lists, n_deviations, .. } = asked;
    if solver == SolverKind::Local {
        return sizes.price(Asked::Moving { n_deviations });
    }
    let Sizes { n_points, n_queries, .. } = sizes;
    let mut price = sizes.price(Asked::Posterior { variances: has_variances, covariance: has_covariance });
    if n_lists > 1 {
        price = price.and(many_price(n_points, n_queries, n_lists, asked.n_derivatives));
    }
    price = price.and(sizes.deviations(n_deviations));
    if asked.n_samples > 0 {
        price = price.and(samples_price(n_queries, asked.n_samples.saturating_mul(n_lists)));
    }
    price
}

/// The price of normals or curvatures at queries.
pub fn geometry_price(surface: SolverKind, asked: AskedOfSurface, sizes: Sizes) -> Price {
    sizes.price(match surface {
        SolverKind::Local => Asked::LocalGeometry,
        SolverKind::Dense => Asked::Geometry(asked),
    })
}

/// The price of an operator applied to values by one solver on a surface by another.
pub fn operator_price(values: SolverKind, surface: SolverKind, asked: OperatorAsked, sizes: Sizes) -> Price {
    let Sizes { n_points, n_queries, dimension } = sizes;
    let OperatorAsked { n_surface_points, n_numbers, .. } = asked;
    match values {
        SolverKind::Local => {
            let geometry =
                geometry_price(surface, asked.surface, Sizes { n_points: n_surface_points, ..sizes });
            geometry.and(kriged_operator_price(n_points, n_queries, dimension))
        }
        SolverKind::Dense => {
            let applied = sizes.price(Asked::Operator { n_surface_points, surface: asked.surface });
            let n_judged = n_numbers.min(JUDGED_FUNCTIONALS);
            let price = applied.and(judging_price((n_points, dimension), n_queries, n_judged));
            if asked.has_deviations {
                price.and(deviations_price(n_points, n_numbers, dimension))
            } else {
                price
            }
        }
    }
}
