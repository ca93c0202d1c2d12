//! The layout of a query's results, and of the rows of right-hand sides that they need.

use crate::machine::lanes::triangle;

/// Rows of any query below the triangle: values, and covariances of the value at the query.
///
/// The rows of quantities and of functions of a mean follow, then those that are not solved for.
pub(super) const VALUES: usize = 0;
pub(super) const CROSS: usize = 1;
pub(super) const QUANTITIES: usize = 2;

/// The results to compute besides the value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Parts {
    /// 0, 1 for the gradient, 2 for the Hessian.
    pub order: usize,
    pub variances: bool,
    /// Derivatives whose covariances with the values are needed, for their own variances or those of
    /// functionals.
    ///
    /// None, the d first ones, or these and the upper triangle of the second ones.
    pub n_derivatives: usize,
    /// Functionals of derivatives whose variances are requested, in place of those of derivatives.
    pub n_functionals: usize,
    /// Functions of a mean with uncertain coefficients, which make variances larger.
    pub n_functions: usize,
}

impl Parts {
    /// Quantities besides the value whose variances are requested.
    pub(super) const fn n_quantities(&self) -> usize {
        if self.n_functionals > 0 { self.n_functionals } else { self.n_derivatives }
    }

    /// The first row of the functions of a mean.
    pub(super) const fn functions(&self) -> usize {
        QUANTITIES + self.n_quantities()
    }

    /// Rows that are solved for.
    pub(super) const fn n_solved(&self) -> usize {
        self.functions() + self.n_functions
    }

    /// The row of the weights.
    pub(super) const fn weights(&self) -> usize {
        self.n_solved()
    }

    /// The row of φ′. That of φ″ follows.
    pub(super) const fn slopes(&self) -> usize {
        self.n_solved() + 1
    }

    /// The first row of derivatives, which are either quantities themselves or what functionals are made of.
    pub(super) const fn derivatives(&self) -> usize {
        if self.n_functionals > 0 { self.n_solved() + 3 } else { QUANTITIES }
    }

    /// All rows below the triangle.
    pub(super) const fn n_rows(&self) -> usize {
        self.n_solved() + 3 + if self.n_functionals > 0 { self.n_derivatives } else { 0 }
    }

    /// Numbers per query in dimension d, in the order of [`RowOffsets`].
    pub(super) const fn n_numbers(&self, dimension: usize) -> usize {
        RowOffsets::of(dimension).of_functions(self) + self.n_functions * (1 + self.n_quantities())
    }
}

/// Positions of the results of a query.
///
/// 1. The sums of a jet over the points: `Σλφ`, `Σλφ′D_a`, `Σλφ″D_aD_b`, `Σλφ′`.
/// 2. The three numbers of the fields below.
/// 3. `|L⁻¹c′|²` of each derivative or functional.
/// 4. Function by function of the mean, with f its values at the points: `L⁻¹f·L⁻¹c`, then `L⁻¹f·L⁻¹c′` of
///    each derivative or functional.
pub(super) struct RowOffsets {
    /// `|L⁻¹c|²`.
    pub explained: usize,
    /// `|K⁻¹c|²`.
    pub norm_squared: usize,
    /// Number of points left out.
    pub n_dependent: usize,
}

impl RowOffsets {
    pub(super) const fn of(dimension: usize) -> Self {
        let trace = 1 + dimension + triangle(dimension);
        Self { explained: trace + 1, norm_squared: trace + 2, n_dependent: trace + 3 }
    }

    /// The first position of the quantities besides the value.
    pub(super) const fn of_quantities(&self) -> usize {
        self.n_dependent + 1
    }

    /// The first position of the functions of the mean.
    pub(super) const fn of_functions(&self, parts: &Parts) -> usize {
        self.of_quantities() + parts.n_quantities()
    }
}
