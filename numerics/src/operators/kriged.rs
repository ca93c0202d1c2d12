//! Operators on values that are kriged around each query, for clouds of any size.
//!
//! Value and derivatives at a query are those of the function that its neighbourhood defines. Deviations come
//! from the same weights. Where the values are noisy, the neighbourhood is one of means of near points, which
//! reaches further.

use super::deviations::functionals;
use super::doubts::Findings;
use super::{Operator, regular};
use crate::error::Result;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::function::functionals::JetFunctional;
use crate::regression::function::local_kriging::{FunctionalsRequest, KrigedFunctionals, LocalKriging};
use crate::regression::solver::trend::Trend;
use crate::surface::geometry::Geometry;

/// A function through values, kriged around each query.
#[derive(Clone, Copy)]
pub struct KrigedFunction<'a> {
    pub moving: &'a LocalKriging,
    /// `[n]`, unit V.
    pub values: &'a [f64],
    pub trend: Option<&'a Trend>,
    /// Factor by which kernel and noise are multiplied.
    pub factor: f64,
}

/// Answers of an operator on a kriged function.
pub struct OfKriged {
    /// Answers, `[m, k]`, 0 at null queries.
    pub values: Vec<f64>,
    /// Standard deviations, `[m, k]`, 0 at null queries.
    pub deviations: Vec<f64>,
    /// Queries, ascending, whose answers are uncertain.
    pub uncertain: Vec<usize>,
    /// Number of queries where neighbours were left out because they follow from nearer ones to rounding.
    pub n_dependent: usize,
}

impl Operator {
    /// Applies the operator to a kriged function at the queries of a geometry, `[m, d]` or `[m]`.
    ///
    /// # Errors
    /// `NumericsError::DerivativesVary` where the process has no such derivatives, and the errors of
    /// [`LocalKriging::at`].
    pub fn on_kriged(
        self,
        geometry: &Geometry,
        function: KrigedFunction<'_>,
        queries: &Cloud,
        observer: &dyn Observer,
    ) -> Result<OfKriged> {
        function.with(self, geometry, queries, observer)
    }
}

impl KrigedFunction<'_> {
    fn with(
        self,
        operator: Operator,
        geometry: &Geometry,
        queries: &Cloud,
        observer: &dyn Observer,
    ) -> Result<OfKriged> {
        let order = operator.order();
        let (d, count) = (queries.dimension(), operator.n_components(queries.dimension()));
        let of_query = |query: usize| {
            if geometry.is_null()[query] {
                vec![JetFunctional::derivative(query, &vec![0.0; d]); count]
            } else {
                functionals(geometry, operator, query)
            }
        };
        let asked = FunctionalsRequest { order, functionals: &of_query, count, trend: self.trend };
        let coarse = self.moving.surest(queries, order, observer)?;
        let found = match &coarse {
            None => self.moving.functionals_at(self.values, queries, asked, observer)?,
            Some(coarse) => {
                let means = coarse.means(self.values);
                coarse.moving().functionals_at(&means, queries, asked, observer)?
            }
        };
        Ok(self.judged(operator, geometry, found))
    }

    fn judged(self, operator: Operator, geometry: &Geometry, found: KrigedFunctionals) -> OfKriged {
        let KrigedFunctionals { jets, mut deviations, n_dependent } = found;
        let values = operator.of_jets(geometry, &jets);
        let root = self.factor.sqrt();
        deviations.iter_mut().for_each(|deviation| *deviation *= root);
        operator.add_surface(geometry, &jets, &mut deviations);
        let kernel = self.moving.system().kernel();
        let findings = Findings { geometry, found: &values, kernel, factor: self.factor };
        let some: Vec<JetFunctional> = regular(geometry)
            .take(findings.n_judged())
            .flat_map(|q| functionals(geometry, operator, q))
            .collect();
        let uncertain = findings.doubtful(&deviations, &some);
        OfKriged { values, deviations, uncertain, n_dependent }
    }
}
