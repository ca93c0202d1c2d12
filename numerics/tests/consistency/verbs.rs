//! Verbs: questions to a solver, answered as numbers whose order does not depend on that of the points.

use std::sync::Arc;

use gramian_numerics::error::NumericsError;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::operators::Operator;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::function::posterior::{covariance, log_marginal_likelihood, variances};
use gramian_numerics::regression::solver::Solver;
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::sums::jets::{JetOrder, Jets};
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::geometry::{Curvatures, Geometry, GeometryRequest, SurfaceModel};

/// A solver, and values at its points.
pub struct Setting {
    pub solver: Arc<Solver>,
    pub values: Vec<f64>,
}

type Outcome = Result<Vec<f64>, NumericsError>;

pub struct Verb {
    pub name: &'static str,
    pub ask: fn(&Setting) -> Outcome,
    /// Whether the answer consists of rows with one column per point.
    pub has_column_per_point: bool,
}

const fn verb(name: &'static str, ask: fn(&Setting) -> Outcome) -> Verb {
    Verb { name, ask, has_column_per_point: false }
}

const fn matrix(name: &'static str, ask: fn(&Setting) -> Outcome) -> Verb {
    Verb { name, ask, has_column_per_point: true }
}

pub const VERBS: [Verb; 13] = [
    verb("values", |setting| jets(setting, JetOrder::Value).map(|jets| jets.values())),
    verb("gradients", |setting| jets(setting, JetOrder::Gradient).map(|jets| jets.gradients())),
    verb("hessians", |setting| jets(setting, JetOrder::Hessian).map(|jets| jets.hessians())),
    verb("native norm", |setting| Ok(vec![fit(setting)?.solution.native_norm_squared])),
    verb("normals", |setting| Ok(geometry(setting)?.normals().to_vec())),
    verb("principal curvatures", |setting| Ok(curvatures(setting)?.principal)),
    verb("surface gradient", |setting| {
        Operator::SurfaceGradient.apply(&geometry(setting)?, &fit(setting)?, &queries(), &Unobserved)
    }),
    verb("Laplace–Beltrami operator", |setting| {
        Operator::LaplaceBeltrami.apply(&geometry(setting)?, &fit(setting)?, &queries(), &Unobserved)
    }),
    matrix("surface gradient as matrices", |setting| {
        Operator::SurfaceGradient.matrix(
            &geometry(setting)?,
            &setting.solver,
            &queries(),
            Mean::Zero,
            &Unobserved,
        )
    }),
    matrix("Laplace–Beltrami operator as matrix", |setting| {
        Operator::LaplaceBeltrami.matrix(
            &geometry(setting)?,
            &setting.solver,
            &queries(),
            Mean::Zero,
            &Unobserved,
        )
    }),
    verb("variances", |setting| Ok(variances(&setting.solver, &queries(), &Unobserved)?.latent)),
    verb("covariance", |setting| Ok(covariance(&setting.solver, &queries(), &Unobserved)?.latent)),
    verb("log marginal likelihood", |setting| {
        let solution = fit(setting)?.solution;
        Ok(vec![log_marginal_likelihood(&setting.solver, &solution, 1.0)?])
    }),
];

/// Three queries among the points: on the unit sphere, at radius 0.9 and at radius 1.2.
fn queries() -> Cloud {
    let on_sphere = [[0.6, 0.8, 0.0], [0.0, -0.6, 0.8], [-0.48, 0.64, 0.6]];
    let scaled = [1.0, 0.9, 1.2].into_iter().zip(on_sphere);
    Cloud::new(scaled.flat_map(|(r, x)| x.map(|c| r * c)).collect(), 3).unwrap()
}

fn fit(setting: &Setting) -> Result<Interpolant, NumericsError> {
    Interpolant::fit(setting.solver.clone(), &setting.values, &Unobserved)
}

fn jets(setting: &Setting, order: JetOrder) -> Result<Jets, NumericsError> {
    fit(setting)?.at(&queries(), order, &Unobserved)
}

fn geometry(setting: &Setting) -> Result<Geometry, NumericsError> {
    let signature = Interpolant::signature(setting.solver.clone(), &Unobserved)?;
    let surface = Surface::of(signature, None, &Unobserved)?;
    let request = GeometryRequest { model: SurfaceModel::Signature, ..GeometryRequest::CURVATURES };
    Geometry::of(&surface, &queries(), &request, &Unobserved)
}

fn curvatures(setting: &Setting) -> Result<Curvatures, NumericsError> {
    geometry(setting)?.curvatures(&Unobserved)
}
