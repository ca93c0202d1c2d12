//! Bounds of docs/flags.md, checked by its sweep.

use gramian_numerics::surface::geometry::SurfaceModel;
use rayon::prelude::*;

use super::closed::CLOSED_SURFACES;
use super::normals::{NormalTally, tally};
use super::sweep::{KERNELS, Tally, cases};

/// Over 24,000 queries at each length scale and model. The bounds are those of docs/flags.md.
#[test]
fn no_curvature_is_off_by_half_without_a_flag() {
    for (model, scale) in [(SurfaceModel::Signature, 0.4), (SurfaceModel::Auto, 1.0)] {
        let cases = cases();
        let tallies: Vec<Tally> = cases.par_iter().map(|case| case.run(model, scale)).collect();
        for (case, tally) in cases.iter().zip(&tallies) {
            assert_eq!(tally.missed_50, 0, "{case:?} at {scale}: {tally:?}");
        }
        let total = tallies.into_iter().fold(Tally::default(), Tally::add);
        assert!(total.queries > 24_000);
        let share = total.missed_10 as f64 / total.unflagged() as f64;
        assert!(share < 0.03, "{model:?} at {scale}: {total:?}");
        // Flagging everything would pass the assertions above.
        assert!(total.false_alarms * 5 < total.queries && total.unflagged() * 3 > total.queries, "{total:?}");
    }
}

/// Deviations, once there is noise, leave more than three times as many curvatures without a flag as T3 and
/// T4 do. Fewer than one in a hundred of them are off by half (docs/flags.md: 25 of 9,423).
#[test]
fn deviations_know_more_than_confirmations_once_there_is_noise() {
    let cases = cases().into_iter().filter(|case| case.kernel.0 == KERNELS[0].0).collect::<Vec<_>>();
    let add = |a: [Tally; 2], b: [Tally; 2]| [a[0].add(b[0]), a[1].add(b[1])];
    let each = cases.par_iter().map(|case| case.run_with_noise(0.005));
    let [before, after] = each.reduce(Default::default, add);
    assert!(after.unflagged() > 3 * before.unflagged(), "{before:?} {after:?}");
    assert!(100 * after.missed_50 < after.unflagged(), "{after:?}");
}

/// Surfaces whose walls are as thin as the spacing of the points: sides of normals are not checked there.
const UNRESOLVED: [&str; 2] = ["bowl", "two holes"];

#[test]
fn normals_of_closed_surfaces_are_right_or_flagged_and_outward() {
    for (at, (kernel, ..)) in KERNELS.into_iter().enumerate() {
        let mut all = NormalTally::default();
        for (scale, noise) in [(0.4, 0.0), (1.0, 0.0), (0.4, 0.0015)] {
            let found: Vec<NormalTally> =
                CLOSED_SURFACES.par_iter().map(|&surface| tally(surface, at, scale, 500, noise)).collect();
            for ((name, ..), found) in CLOSED_SURFACES.iter().zip(found) {
                let is_outward = found.n_flipped == 0 || UNRESOLVED.contains(name);
                assert!(is_outward, "{kernel}, {scale}, {noise}, {name}: {found:?}");
                all = all.add(found);
            }
        }
        assert!(2000 * all.n_off <= all.n_unflagged(), "{kernel}: {all:?}");
        // Flagging everything would pass the assertion above. 500 random points leave a twentieth of the
        // normals of these shapes, edges included, uncertain by more than 0.4 rad.
        assert!(15 * all.n_flagged <= all.n_points, "{kernel}: {all:?}");
    }
}
