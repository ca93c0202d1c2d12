//! Norms of errors and statistics of repetitions.

/// Largest magnitude, or NaN if any entry is NaN, so that no bound passes it.
pub fn largest(a: &[f64]) -> f64 {
    a.iter().fold(0.0, |a, b| if b.is_nan() || b.abs() > a { b.abs() } else { a })
}

/// `max|a − b| / max|b|`.
pub fn relative_max(found: &[f64], exact: &[f64]) -> f64 {
    largest(&difference(found, exact)) / largest(exact)
}

/// `|a − b|₂ / |b|₂`.
pub fn relative_l2(found: &[f64], exact: &[f64]) -> f64 {
    norm(&difference(found, exact)) / norm(exact)
}

/// `a − b`.
pub fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// `|a|₂`.
pub fn norm(a: &[f64]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The arithmetic mean.
pub fn mean(a: &[f64]) -> f64 {
    a.iter().sum::<f64>() / a.len() as f64
}

/// The middle of the sorted list, or the mean of the two middle entries.
pub fn median(mut a: Vec<f64>) -> f64 {
    a.sort_by(f64::total_cmp);
    (a[(a.len() - 1) / 2] + a[a.len() / 2]) / 2.0
}

/// Medians of the columns.
pub fn medians<const N: usize>(runs: &[[f64; N]]) -> [f64; N] {
    std::array::from_fn(|column| median(runs.iter().map(|run| run[column]).collect()))
}

/// Means of the columns.
pub fn means<const N: usize>(runs: &[[f64; N]]) -> [f64; N] {
    std::array::from_fn(|column| mean(&runs.iter().map(|run| run[column]).collect::<Vec<f64>>()))
}
