//! The sweep of docs/degeneracy.md holds its promises.

use gramian::numerics::surface::geometry::SurfaceModel;
use rayon::prelude::*;

use super::sweep::{Tally, cases};

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
