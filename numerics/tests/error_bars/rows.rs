//! A coarse selection of the rows of docs/error-bars.md. Every shape, sampling and
//! noise occurs several times.

use std::sync::LazyLock;

use rayon::prelude::*;

use crate::sampling::SAMPLINGS;
use crate::shapes::{HELD_OUT, SHAPES};
use crate::sweep::{Case, NOISES, Row};

/// Points of each row. The standard error of a share of 95 % is 0.7 % if points are independent,
/// which near neighbours are not.
const N_POINTS: usize = 1000;

/// Percentage points by which a row may miss the bounds of the whole sweep: three standard
/// errors of its few points.
const MARGIN: f64 = 2.0;

/// A third of all cases: the sum of the indices decides, so that any two of shape, sampling and noise meet.
fn selection() -> Vec<Case> {
    let mut cases = Vec::new();
    for (i, shape) in SHAPES.into_iter().chain(HELD_OUT).enumerate() {
        for (j, sampling) in SAMPLINGS.into_iter().enumerate() {
            for (_, noise) in NOISES.into_iter().enumerate().filter(|(l, _)| (i + j + l) % 3 == 0) {
                cases.push(Case { shape, sampling, n_points: N_POINTS, noise });
            }
        }
    }
    cases
}

/// All cases with their rows, for every test here.
static ROWS: LazyLock<Vec<(Case, Row)>> =
    LazyLock::new(|| selection().into_par_iter().map(|case| (case, case.run(1))).collect());

#[test]
fn true_values_lie_within_the_error_bars() {
    for (case, row) in &*ROWS {
        let least = if case.noise > 0.0 { 90.0 } else { 85.0 };
        let coverages = row.coverages();
        assert!(coverages.iter().all(|&c| c >= least - MARGIN), "{case:?}: {coverages:.1?}");
    }
    // Bars that are too long cover everything. Over all noisy rows the mean coverage must
    // be near the nominal 95 %.
    let noisy = || ROWS.iter().filter(|(case, _)| case.noise > 0.0).map(|(_, row)| row);
    for quantity in 0..4 {
        let n_rows = noisy().count() as f64;
        let mean = noisy().map(|row| row.coverages()[quantity]).sum::<f64>() / n_rows;
        assert!((93.0..99.0).contains(&mean), "{quantity}: {mean}");
    }
}

#[test]
fn of_curvatures_without_a_flag_one_in_a_hundred_is_off_by_half_at_most() {
    for noise in NOISES {
        let of_noise = || ROWS.iter().filter(|(case, _)| case.noise == noise).map(|(_, row)| row);
        let n_off: usize = of_noise().map(|row| row.n_off).sum();
        let n_unflagged: usize = of_noise().map(Row::n_unflagged).sum();
        // The count may exceed one in a hundred by three of its standard errors.
        let expected = 0.01 * n_unflagged as f64;
        assert!((n_off as f64) < expected + 3.0 * expected.sqrt(), "{noise}: {n_off} of {n_unflagged}");
    }
}
