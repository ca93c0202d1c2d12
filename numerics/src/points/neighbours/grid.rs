//! The grid to which coordinates are rounded before they are compared.

/// Step of the grid, 2⁻⁵¹¹, unit L. The square of one step is the least normal number of float64.
pub(super) const GRID: f64 = f64::from_bits((1023 - 511) << 52);

/// Magnitude below which coordinates have finer digits than the grid.
const FINER_THAN_GRID: f64 = GRID * (1u64 << 53) as f64;

/// Returns the multiple of [`GRID`] nearest to x.
pub(crate) fn on_grid(x: f64) -> f64 {
    // GRID is a power of two, so only `round` changes digits. Adding 0 turns −0 into 0.
    if x.abs() < FINER_THAN_GRID { (x / GRID).round() * GRID + 0.0 } else { x }
}

/// Returns whether rounding to the grid changes none of the coordinates.
pub(super) fn is_on_grid(coordinates: &[f64]) -> bool {
    coordinates.iter().all(|&x| x == on_grid(x))
}
