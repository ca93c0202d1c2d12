//! A coarse selection of the rows of docs/error-bars.md: every shape, sampling and noise comes several times.

use rayon::prelude::*;

use crate::sampling::SAMPLINGS;
use crate::shapes::SHAPES;
use crate::sweep::{Case, NOISES, Row};

/// Points of each row: a share of 95 % then has a standard error of 0.7 %, were points independent; a few neighbours are not.
const N_POINTS: usize = 1000;

/// What a row may be beyond the bounds of the whole sweep for its few points: three of those standard errors.
const MARGIN: f64 = 2.0;

/// A third of all: the sum of the indices decides, so that any two of shape, sampling and noise meet.
fn selection() -> Vec<Case> {
    let mut cases = Vec::new();
    for (i, shape) in SHAPES.into_iter().enumerate() {
        for (j, sampling) in SAMPLINGS.into_iter().enumerate() {
            for (_, noise) in NOISES.into_iter().enumerate().filter(|(l, _)| (i + j + l) % 3 == 0) {
                cases.push(Case { shape, sampling, n_points: N_POINTS, noise });
            }
        }
    }
    cases
}

#[test]
fn true_values_lie_within_the_error_bars() {
    let cases = selection();
    let rows: Vec<Row> = cases.par_iter().map(|case| case.run(1)).collect();
    for (case, row) in cases.iter().zip(&rows) {
        let least = if case.noise > 0.0 { 90.0 } else { 85.0 };
        let coverages = row.coverages();
        assert!(coverages.iter().all(|&c| c >= least - MARGIN), "{case:?}: {coverages:.1?}");
    }
    // Bars that are too long hold everywhere. Over all rows with noise they leave out what they should: 95 % were they exact.
    let noisy = || cases.iter().zip(&rows).filter(|(case, _)| case.noise > 0.0).map(|(_, row)| row);
    for quantity in 0..4 {
        let n_rows = noisy().count() as f64;
        let mean = noisy().map(|row| row.coverages()[quantity]).sum::<f64>() / n_rows;
        assert!((93.0..99.0).contains(&mean), "{quantity}: {mean}");
    }
}

#[test]
fn few_curvatures_are_off_by_half_without_a_flag() {
    let cases = selection();
    let rows: Vec<Row> = cases.par_iter().filter(|case| case.noise < 0.01).map(|case| case.run(1)).collect();
    let n_off: usize = rows.iter().map(|row| row.n_off).sum();
    let n_points: usize = rows.iter().map(|row| row.errors.len()).sum();
    assert!(100 * n_off <= n_points, "{n_off} of {n_points}");
}
