//! The sweep of docs/degeneracy.md holds its promises.

use gramian::numerics::surface::geometry::SurfaceModel;
use rayon::prelude::*;

use super::closed::CLOSED_SURFACES;
use super::normals::{self, NormalTally};
use super::sweep::{KERNELS, Tally, cases};

/// 24,000 queries at each length scale and model: the bounds are those of docs/degeneracy.md.
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
        // Flagging everything would pass the above.
        assert!(total.false_alarms * 5 < total.queries && total.unflagged() * 3 > total.queries, "{total:?}");
    }
}

#[test]
fn normals_of_closed_surfaces_are_right_or_flagged() {
    for (at, (name, ..)) in KERNELS.into_iter().enumerate() {
        let runs = [(0.4, 500, 0.0), (1.0, 500, 0.0), (0.4, 500, 0.0015)];
        let tallies = runs.map(|(scale, n, noise)| normals::tally_all(at, scale, n, noise));
        let all = tallies.into_iter().fold(NormalTally::default(), NormalTally::add);
        assert!(1000 * all.n_off <= 3 * all.n_unflagged(), "{name}: {all:?}");
        // Half of them may be flagged were the flag worth nothing.
        assert!(20 * all.n_flagged <= all.n_points, "{name}: {all:?}");
    }
}

#[test]
fn closed_surfaces_are_not_turned_inside_out() {
    // The walls of the bowl and of the plate with two holes are as thin as the points are apart.
    let resolved = || CLOSED_SURFACES.into_iter().filter(|(name, ..)| !["bowl", "two holes"].contains(name));
    for (at, (kernel, ..)) in KERNELS.into_iter().enumerate() {
        for surface in resolved() {
            for (scale, noise) in [(0.4, 0.0), (1.0, 0.0), (0.4, 0.0015)] {
                let found = normals::tally(surface, at, scale, 500, noise);
                assert_eq!(found.n_flipped, 0, "{kernel}, {scale}, {noise}, {}: {found:?}", surface.0);
            }
        }
    }
}
