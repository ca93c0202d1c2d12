//! Points in random order, each with the nearest of those before it.

use rayon::prelude::*;

use crate::error::Result;
use crate::machine::random::Random;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::neighbours::Neighbours;
use crate::regression::solver::system::System;

/// Number of points that a point is given. More make fewer iterations, but each costs its square.
pub(super) const GIVEN: usize = 63;

/// Seed of the order.
const SEED: u64 = 35;

/// Growth of the set of points that is searched. A point is given those before it alone, so that about one in
/// five of the points found is not used.
const GROWTH: f64 = 1.25;

/// Searches between two looks whether to stop.
const SEARCHES: usize = 4096;

/// The order of the points.
pub(super) struct Order {
    /// Indices of the points.
    pub points: Vec<u32>,
    /// Places in this order of the points that each is given, `[n, GIVEN]`, the nearest first. The first
    /// points have fewer: their rows end with their own place.
    pub given: Vec<u32>,
}

impl Order {
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(super) fn of(system: &System, observer: &dyn Observer) -> Result<Self> {
        let n = system.n_points();
        let stretched = system.kernel().stretched_cloud(system.cloud());
        let cloud: &Cloud = stretched.as_ref().unwrap_or(system.cloud());
        let mut points: Vec<u32> = (0..n as u32).collect();
        points.sort_by_cached_key(|&point| (Random::of(SEED, u64::from(point)).next(), point));
        let ordered = cloud.select(&points.iter().map(|&point| point as usize).collect::<Vec<_>>());
        let mut given = vec![0; n * GIVEN];
        let mut first = 0;
        while first < n {
            observer.checkpoint()?;
            let end = ((first as f64 * GROWTH) as usize).max(first + GIVEN + 1).min(n);
            let searched = ordered.select(&(0..end).collect::<Vec<_>>());
            let tree = Neighbours::of(&searched, observer)?;
            let blocks = given[first * GIVEN..end * GIVEN].chunks_mut(SEARCHES * GIVEN).enumerate();
            for (block, rows) in blocks {
                observer.checkpoint()?;
                let start = first + block * SEARCHES;
                let rows = rows.par_chunks_exact_mut(GIVEN).enumerate();
                rows.for_each(|(at, row)| fill_row(&tree, searched.point(start + at), start + at, row));
            }
            first = end;
        }
        Ok(Self { points, given })
    }

    /// Number of points that the point at a place is given.
    pub(super) fn count(place: usize) -> usize {
        place.min(GIVEN)
    }
}

/// Fills the row of a place with the nearest of the places before it.
fn fill_row(tree: &Neighbours, x: &[f64], place: usize, row: &mut [u32]) {
    let count = Order::count(place);
    row[count..].fill(place as u32);
    let mut asked = (GIVEN as f64 * GROWTH) as usize + 16;
    loop {
        let found = tree.nearest(x, asked);
        let earlier = found.iter().map(|neighbour| neighbour.point).filter(|&point| point < place);
        let n_found = row.iter_mut().zip(earlier.take(count)).map(|(to, point)| *to = point as u32).count();
        if n_found == count {
            return;
        }
        asked *= 2;
    }
}
