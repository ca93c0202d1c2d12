//! Pieces of a surface joined across the gaps between them, along the shortest edges of the cloud.
//!
//! A random curve has gaps that the nearest neighbours of both ends do not reach across: two dozen of them
//! among 6,000 points.

use rayon::prelude::*;

use super::CloudWithNeighbours;
use super::edges::Edge;
use super::forest::{Membership, SignedForest};
use crate::error::NumericsError;
use crate::points::neighbours::Neighbour;

/// Positions around a point among which points of other pieces are looked for.
const REACH: usize = 32;

/// Greatest number of edges between two pieces that vote, shortest first. None is longer than twice the
/// shortest one.
const N_VOTES: usize = 6;

/// Absolute mean of the weighted votes above which two pieces are joined.
const SURE: f64 = 0.3;

/// A short way from one piece to another.
#[derive(Clone, Copy)]
struct Gap {
    a: usize,
    b: usize,
    /// Roots of the pieces, the smaller one first.
    pieces: [usize; 2],
    squared_length: f64,
}

/// Joins pieces where a surface seems to go on across a gap, shortest first. Returns an edge across each gap,
/// in both directions.
///
/// # Errors
/// [`NumericsError::Cancelled`].
pub(super) fn join_across(
    sampled: &CloudWithNeighbours<'_>,
    normals: &[f64],
    forest: &mut SignedForest,
) -> Result<Vec<Edge>, NumericsError> {
    let found = forest.find_all();
    let mut gaps = gaps(sampled, forest, &found)?;
    gaps.sort_by(|p, q| {
        let by_length = p.squared_length.total_cmp(&q.squared_length);
        p.pieces.cmp(&q.pieces).then(by_length).then((p.a, p.b).cmp(&(q.a, q.b)))
    });
    let mut bridges: Vec<Bridge> = gaps
        .chunk_by(|p, q| p.pieces == q.pieces)
        .filter_map(|gaps| bridge(sampled, normals, &found, gaps))
        .collect();
    bridges.sort_by(|p, q| {
        let by_length = p.gap.squared_length.total_cmp(&q.gap.squared_length);
        by_length.then(p.gap.pieces.cmp(&q.gap.pieces))
    });
    for bridge in &bridges {
        let [a, b] = bridge.gap.pieces;
        forest.join(a, b, bridge.sign);
    }
    let edge = |a: usize, b: usize| Edge::between(sampled.cloud, normals, a, b);
    let both = |bridge: &Bridge| [edge(bridge.gap.a, bridge.gap.b), edge(bridge.gap.b, bridge.gap.a)];
    Ok(bridges.iter().flat_map(both).filter(|edge| edge.weight() > 0.0).collect())
}

/// The gap between two pieces that are joined, and their sign relative to one another.
struct Bridge {
    gap: Gap,
    sign: f64,
}

/// Returns the bridge between two pieces if the shortest ways between them agree. `gaps` are shortest first.
fn bridge(
    sampled: &CloudWithNeighbours<'_>,
    normals: &[f64],
    found: &[Membership],
    gaps: &[Gap],
) -> Option<Bridge> {
    let shortest = *gaps.first()?;
    let near = gaps.iter().take(N_VOTES).filter(|gap| gap.squared_length <= 4.0 * shortest.squared_length);
    let (mut vote, mut count) = (0.0, 0.0);
    for gap in near {
        let edge = Edge::between(sampled.cloud, normals, gap.a, gap.b);
        vote += found[gap.a].sign * found[gap.b].sign * edge.cosine().signum() * edge.weight().max(0.0);
        count += 1.0;
    }
    (vote.abs() > SURE * count).then(|| Bridge { gap: shortest, sign: vote.signum() })
}

/// Finds ways from the points of every piece but the largest to the nearest points of other pieces.
fn gaps(
    sampled: &CloudWithNeighbours<'_>,
    forest: &SignedForest,
    found: &[Membership],
) -> Result<Vec<Gap>, NumericsError> {
    let roots = (0..found.len()).filter(|&point| found[point].root == point);
    let Some(largest) = roots.max_by_key(|&root| (forest.size(root), usize::MAX - root)) else {
        return Ok(Vec::new());
    };
    let from_point = |nearest: &mut Vec<Neighbour>, a: usize| -> Result<Vec<Gap>, NumericsError> {
        sampled.observer.checkpoint()?;
        if found[a].root == largest {
            return Ok(Vec::new());
        }
        let x = sampled.cloud.point(a);
        sampled.sampling.neighbours().nearest_positions_into(x, REACH, nearest);
        let mut gaps: Vec<Gap> = Vec::new();
        for &Neighbour { point: b, squared_distance } in nearest.iter() {
            let (own, other) = (found[a].root, found[b].root);
            let pieces = [own.min(other), own.max(other)];
            if own != other && squared_distance > 0.0 && gaps.iter().all(|gap| gap.pieces != pieces) {
                gaps.push(Gap { a, b, pieces, squared_length: squared_distance });
            }
        }
        Ok(gaps)
    };
    let all: Result<Vec<Vec<Gap>>, NumericsError> =
        (0..found.len()).into_par_iter().map_init(Vec::new, from_point).collect();
    Ok(all?.into_iter().flatten().collect())
}
