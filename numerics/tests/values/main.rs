//! Values without a described kernel: bands, error bars and flags must hold, by rows of docs/error-bars.md.

#[path = "../common/mod.rs"]
mod common;
#[path = "../error_bars/jet.rs"]
mod jet;
#[path = "../error_bars/sampling.rs"]
mod sampling;
#[path = "../error_bars/shapes.rs"]
mod shapes;

mod copies;
mod features;
mod fields;
mod flags;
mod posterior;
mod sweep;
mod tables;

use copies::RepeatedRows;
use features::{Bands, Feature, MeasuredField};
use fields::{FIELDS, Field};
use flags::{Counts, KernelChoice, Values};
use gramian_numerics::kernel::Family;
use gramian_numerics::regression::selection::Criterion;
use posterior::{By, Sensors};
use rayon::prelude::*;
use sampling::Sampling;
use shapes::Shape;
use sweep::{Case, NOISES, ON_SURFACE, QUANTITIES, Row};
use tables::Table;

/// Closed surfaces, and one with a rim.
const SHAPES: [Shape; 5] = [Shape::Sphere, Shape::Torus, Shape::Ellipsoid, Shape::Cyclide, Shape::Wave];

fn rows(n_points: usize) -> Vec<(Case, Row)> {
    let of_field =
        |shape, field| NOISES.map(|noise| Case { shape, sampling: Sampling::Random, field, n_points, noise });
    let cases: Vec<Case> = SHAPES
        .iter()
        .flat_map(|&shape| FIELDS.iter().flat_map(move |&field| of_field(shape, field)))
        .collect();
    cases.into_par_iter().map(|case| (case, case.run(2))).collect()
}

#[test]
fn fields_and_operators_have_bars_that_hold_and_few_are_off_without_a_flag() {
    for n_points in [300, 500] {
        let rows = rows(n_points);
        // Errors within a cloud are correlated, so single rows of two clouds scatter by some per cent.
        let n_short = rows.iter().filter(|(_, row)| {
            let coverages = row.coverages();
            ON_SURFACE.iter().any(|&quantity| coverages[quantity] < 85.0)
        });
        // The front is left out: it is three spacings wide, and noise hides in it.
        let n_short = n_short.filter(|(case, _)| case.field != Field::Front).count();
        assert!(n_short <= 2, "{n_points}: {n_short} of {} rows", rows.len());
        for quantity in ON_SURFACE {
            let n_off: usize = rows.iter().map(|(_, row)| row.n_off[quantity]).sum();
            let n: usize = rows.iter().map(|(_, row)| row.n_unflagged[quantity]).sum();
            let name = QUANTITIES[quantity];
            assert!(n > 10_000 && n_off * 200 <= n, "{n_points}: {name}: {n_off} of {n} off by half");
        }
    }
}

#[test]
fn sensors_have_posteriors_whose_bands_cover() {
    let mut cases = Vec::new();
    for dimension in [1, 2, 3] {
        for n_points in [30, 120, 300] {
            for field in FIELDS {
                for (noise, factor, offset) in [(0.0, 1.0, 0.0), (0.05, 1e-6, 1.0), (0.2, 1e6, -1e6)] {
                    cases.push(Sensors { dimension, n_points, field, noise, factor, offset });
                }
            }
        }
    }
    let rows: Vec<(&Sensors, f64)> = cases.par_iter().map(|sensors| (sensors, sensors.coverage(6))).collect();
    let short: Vec<_> = rows.iter().filter(|(_, coverage)| *coverage < 88.0).collect();
    // The short rows are those of thirty values of a field that they do not resolve.
    assert!(short.len() * 20 <= rows.len(), "{short:?}");
    assert!(short.iter().all(|(_, coverage)| *coverage > 70.0), "{short:?}");
    let all = rows.iter().map(|(_, coverage)| coverage).sum::<f64>() / rows.len() as f64;
    assert!((94.0..99.5).contains(&all), "{all}");
}

#[test]
fn rows_that_repeat_change_neither_errors_nor_bars() {
    for (n_points, noise) in [(500, 0.3), (200, 0.1)] {
        let plain = RepeatedRows { n_points, noise, n_copies: 0, n_differing: 0, by: By::Default };
        let repeats = [(0, 3), (0, 20), (10, 0), (10, 1), (50, 0), (50, 3), (200, 0), (200, 20)];
        let case = |(n_copies, n_differing)| RepeatedRows { n_copies, n_differing, ..plain };
        let cases: Vec<RepeatedRows> = std::iter::once((0, 0)).chain(repeats).map(case).collect();
        let found: Vec<_> = cases.par_iter().map(|case| (case, case.found(10))).collect();
        let without = found[0].1.error;
        for (case, found) in found {
            // Copies were taken for measurements without noise: errors of three times as much, or bars of
            // thousands of times their length.
            assert!((88.0..=99.5).contains(&found.coverage), "{case:?}: {found:?}");
            assert!(found.error <= 1.1 * without, "{case:?}: {found:?}, without copies {without}");
        }
    }
}

#[test]
fn rows_that_repeat_change_no_search() {
    for criterion in [Criterion::MarginalLikelihood, Criterion::LeaveOneOut] {
        let by = By::Criterion(criterion);
        let plain = RepeatedRows { n_points: 150, noise: 0.1, n_copies: 0, n_differing: 0, by };
        let case = |(n_copies, n_differing)| RepeatedRows { n_copies, n_differing, ..plain };
        let cases = [(0, 0), (3, 0), (60, 0), (0, 20), (30, 3)].map(case);
        let found: Vec<_> = cases.par_iter().map(|case| (case, case.found(3))).collect();
        let without = found[0].1;
        for (case, found) in found {
            // With copies for measurements, the noise vanished. A search is not asked for sure bars: those
            // with copies must be as good as those without.
            assert!(found.coverage >= without.coverage - 3.0, "{case:?}: {found:?}, without {without:?}");
            assert!(found.error <= 1.1 * without.error, "{case:?}: {found:?}, without {without:?}");
        }
    }
}

#[test]
fn columns_of_tables_may_have_any_units() {
    // With one length scale for all columns, errors are 0.7 to 0.9 of the spread.
    for (n_rows, noise, most) in [(150, 1.0, 0.35), (500, 1.0, 0.25), (500, 0.1, 0.1)] {
        let table = Table { n_rows, noise };
        let found = table.found(3);
        assert!(found.error < most, "{table:?}: {found:?}");
        assert!((85.0..=99.5).contains(&found.coverage), "{table:?}: {found:?}");
    }
}

#[test]
fn what_is_local_or_drowned_in_noise_is_learned() {
    // The cases guard against two former faults. From 256 values the bump was taken for noise, and 6 % of it
    // was covered. With noise beyond the field, no kernel of less variance than the values was considered.
    let cases = [
        (Feature::Bump(0.03), 2000, 0.01),
        (Feature::Bump(0.05), 1000, 0.01),
        (Feature::Bump(0.1), 1000, 0.01),
        (Feature::Spot(0.1), 3000, 0.01),
        (Feature::Spot(0.2), 3000, 0.01),
        (Feature::Sine(3), 1000, 0.1),
        (Feature::Sine(3), 300, 2.0),
        (Feature::Sine(6), 300, 2.0),
        (Feature::Draw(0.3), 1000, 1.0),
        (Feature::Draw(0.1), 1000, 0.1),
        (Feature::Clusters, 1000, 0.01),
    ];
    let cases = cases.map(|(feature, n_points, noise)| MeasuredField { feature, n_points, noise });
    let bands: Vec<Bands> = cases.par_iter().map(|case| case.bands(By::Default, 4)).collect();
    for (case, bands) in cases.iter().zip(bands) {
        // Of ten seeds 86 to 98 % are covered inside and at least 89 % everywhere. Four seeds scatter by some
        // per cent. By likelihood alone 42 to 55 % were covered within the narrow bump and spot.
        assert!(
            bands.coverage > 85.0 && bands.inside.is_none_or(|inside| inside > 70.0),
            "{case:?}: {bands:?}"
        );
    }
}

#[test]
fn detail_that_is_taken_for_noise_is_named() {
    // With two to four points a wave, the likelihood prefers a long length scale and more noise. Then 14 to
    // 46 % of the function is covered, which nothing told before. Of ten draws, nine or ten are named.
    let ripple = |dimension, length| Feature::Ripple { dimension, length };
    let ripples = [
        (ripple(1, 0.01), 300),
        (ripple(1, 0.003), 1000),
        (ripple(2, 0.0632), 1000),
        (ripple(3, 0.2988), 300),
        (ripple(3, 0.2), 1000),
    ];
    // Noise that is as large as the field or larger is no detail.
    let noisy = [(Feature::Sine(3), 1.0), (Feature::Sine(2), 0.1), (Feature::Draw(0.3), 1.0)];
    let ripples = ripples.map(|(feature, n_points)| MeasuredField { feature, n_points, noise: 0.01 });
    let noisy = noisy.map(|(feature, noise)| MeasuredField { feature, n_points: 1000, noise });
    let cases: Vec<MeasuredField> = ripples.into_iter().chain(noisy).collect();
    let bands: Vec<Bands> = cases.par_iter().map(|case| case.bands(By::Default, 6)).collect();
    let (of_ripples, of_noisy) = bands.split_at(ripples.len());
    for (case, bands) in ripples.iter().zip(of_ripples) {
        assert!(bands.misfits > 0.6, "{case:?}: {bands:?}");
    }
    for (case, bands) in noisy.iter().zip(of_noisy) {
        assert!(bands.misfits == 0.0, "{case:?}: {bands:?}");
    }
}

#[test]
fn operators_that_are_off_by_half_are_flagged_whatever_the_kernel() {
    let smooth = [Family::Gauss, Family::InverseMultiquadric, Family::Laplace { epsilon: 1.0 }];
    let rough = [Family::Matern { order: 1 }, Family::Matern { order: 2 }, Family::Matern { order: 4 }];
    let families = smooth.into_iter().chain(rough);
    let mut asked = vec![KernelChoice::Nothing];
    asked.extend(families.flat_map(|family| {
        [KernelChoice::Family(family), KernelChoice::Width(family, 0.3), KernelChoice::Width(family, 3.0)]
    }));
    for noise in NOISES {
        let mut values = Vec::new();
        for shape in [Shape::Sphere, Shape::Torus, Shape::Wave] {
            for field in [Field::Low, Field::Mid, Field::Front] {
                values.push(Values { shape, field, n_points: 250, noise });
            }
        }
        let counts: Vec<Vec<Counts>> = values.par_iter().map(|values| values.run(&asked, 1)).collect();
        let all = counts.iter().flatten().fold(Counts::default(), Counts::plus);
        // Without judging, between a tenth and nine tenths of the unflagged were off where there is noise.
        for operator in [0, 1] {
            assert!(
                all.n_off[operator] * 100 <= all.n_unflagged[operator].max(100),
                "noise {noise}: {all:?}"
            );
        }
        // Flagging everything would pass the assertion above. Without noise a quarter of all answers is
        // served without a flag, although none on a torus of 250 points is.
        assert!(noise > 0.0 || all.n_unflagged[1] * 5 > all.n[1], "{all:?}");
    }
}
