//! What is found for a query, and the rows of right-hand sides that it takes.

/// Columns that are solved for at once: with as many rows, 16 chains of products that do not wait for one another.
pub(super) const COLUMNS: usize = 4;

/// Rows below the triangle: values, covariances with the query, weights, φ′ and φ″ at the query, then those of derivatives.
pub(super) const N_ROWS: usize = 5;
pub(super) const VALUES: usize = 0;
pub(super) const CROSS: usize = 1;
pub(super) const WEIGHTS: usize = 2;
pub(super) const SLOPES: usize = 3;
pub(super) const BENDS: usize = 4;

pub(super) const fn triangle(n: usize) -> usize {
    n * (n + 1) / 2
}

/// What is summed up beyond the value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Parts {
    /// 0, 1 for the gradient, 2 for the Hessian.
    pub order: usize,
    pub variances: bool,
    /// Derivatives whose variances are asked for, or those of functionals of them: none, those of first order, or with them the upper triangle
    /// of those of second.
    pub n_derivatives: usize,
    /// Functionals of derivatives whose variances are asked for, instead of theirs.
    pub n_functionals: usize,
    /// Functions of a mean whose coefficients are not known exactly, so that variances are greater.
    pub n_functions: usize,
}

impl Parts {
    /// Quantities beside the value whose variances are asked for.
    pub(super) const fn n_quantities(&self) -> usize {
        if self.n_functionals > 0 { self.n_functionals } else { self.n_derivatives }
    }

    /// Rows of right-hand sides beside those of any query.
    pub(super) const fn n_rows(&self) -> usize {
        self.n_derivatives + self.n_functionals + self.n_functions
    }

    /// The first row of those quantities.
    pub(super) const fn quantities(&self) -> usize {
        N_ROWS + if self.n_functionals > 0 { self.n_derivatives } else { 0 }
    }

    /// The first row of the functions of a mean.
    pub(super) const fn functions(&self) -> usize {
        N_ROWS + self.n_derivatives + self.n_functionals
    }

    /// Numbers of a query, in dimension d.
    pub(super) const fn n_numbers(&self, dimension: usize) -> usize {
        Found::of(dimension).of_functions(self) + self.n_functions * (1 + self.n_quantities())
    }
}

/// Numbers of a query: those of a jet as sums over the points, `Σλφ`, `Σλφ′D_a`, `Σλφ″D_aD_b`, `Σλφ′`, then three more, `|L⁻¹c′|²` of the
/// derivatives or functionals, and with f the values of a function of the mean at the points, `L⁻¹f·L⁻¹c` and all `L⁻¹f·L⁻¹c′`, function by function.
pub(super) struct Found {
    /// `|L⁻¹c|²`.
    pub explained: usize,
    /// `|K⁻¹c|²`.
    pub norm_squared: usize,
    /// Points left out.
    pub n_dependent: usize,
}

impl Found {
    pub(super) const fn of(dimension: usize) -> Self {
        let trace = 1 + dimension + triangle(dimension);
        Self { explained: trace + 1, norm_squared: trace + 2, n_dependent: trace + 3 }
    }

    /// Of the quantities beside the value.
    pub(super) const fn of_quantities(&self) -> usize {
        self.n_dependent + 1
    }

    /// Of the functions of the mean.
    pub(super) const fn of_functions(&self, parts: &Parts) -> usize {
        self.of_quantities() + parts.n_quantities()
    }
}
