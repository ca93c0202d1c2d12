//! Edges between neighbouring points on one sheet of the surface, and how their normals agree.

use rayon::prelude::*;

use super::forest::SignedForest;
use super::{CloudWithNeighbours, n_neighbours};
use crate::error::Result;
use crate::machine::vector::dot;
use crate::points::cloud::{Cloud, squared_distance};

/// Weight up to which two points do not count as neighbours on one sheet.
const LEAST_WEIGHT: f64 = 0.01;

/// Mean weight of the edges between two regions from which the surface surely leads from one to the other.
/// Along an edge of a body where normals turn by 120 degrees it is 0.25, with the wrong sign.
const SURE_BORDER: f64 = 0.5;

/// Points whose edges are found at once.
pub(super) const BLOCK: usize = 1 << 16;

/// Two neighbours on one sheet of the surface. There are several for each point, so that their bytes count.
pub(super) struct Edge {
    a: u32,
    b: u32,
    cosine: f32,
    weight: f32,
}

impl Edge {
    /// Returns the edge from one point to another, up to the sign of the normals.
    ///
    /// A weight of 0 or less says that the points are on different sheets. With D the step from a to b,
    /// consistent normals on one sheet have `D·ν_a ≈ −κ|D|²/2 ≈ −D·ν_b`. Two sheets at a distance t have
    /// `D·ν_a ≈ D·ν_b ≈ t`.
    pub(super) fn between(cloud: &Cloud, normals: &[f64], a: usize, b: usize) -> Self {
        let cosine = cosine(cloud, normals, a, b);
        let weight = cosine * cosine * (1.0 - 2.0 * across(cloud, normals, a, b));
        Self { a: a as u32, b: b as u32, cosine: cosine as f32, weight: weight as f32 }
    }

    /// The first point, a.
    pub(super) fn a(&self) -> usize {
        self.a as usize
    }

    /// The second point, b.
    pub(super) fn b(&self) -> usize {
        self.b as usize
    }

    /// Cosine of the angle between the two normals.
    pub(super) fn cosine(&self) -> f64 {
        self.cosine.into()
    }

    /// Certainty, 0 to 1, that the surface leads from one point to the other.
    pub(super) fn weight(&self) -> f64 {
        self.weight.into()
    }

    /// Returns the weight, negative where normals with these signs are opposite.
    pub(super) fn agreement(&self, signs: &[f64]) -> f64 {
        self.weight() * (signs[self.a()] * signs[self.b()] * self.cosine()).signum()
    }
}

/// Returns `|D·ν_a ± D·ν_b| / |D|` of two points, with the sign of `ν_a·ν_b`. It is 0 on a sphere.
pub(super) fn across(cloud: &Cloud, normals: &[f64], a: usize, b: usize) -> f64 {
    let d = cloud.dimension();
    let (x, y) = (cloud.point(a), cloud.point(b));
    let step = |at: usize| -> f64 {
        normals[at * d..][..d].iter().zip(x).zip(y).map(|((n, x), y)| n * (y - x)).sum()
    };
    (step(a) + cosine(cloud, normals, a, b).signum() * step(b)).abs() / squared_distance(x, y).sqrt()
}

fn cosine(cloud: &Cloud, normals: &[f64], a: usize, b: usize) -> f64 {
    let d = cloud.dimension();
    dot(&normals[a * d..][..d], &normals[b * d..][..d])
}

/// Returns the edges between neighbouring points where the surface bends like a sphere, ordered by first
/// point.
///
/// The sign of the normals does not matter.
///
/// # Errors
/// [`crate::error::NumericsError::Cancelled`].
pub(super) fn sheet_edges(sampled: &CloudWithNeighbours<'_>, normals: &[f64]) -> Result<Vec<Edge>> {
    let edges_of = |a: usize| edges_around(sampled.cloud, normals, a, sampled.around.around(a));
    let n = sampled.cloud.n_points();
    // Block by block, so that they are not held twice.
    let mut edges = Vec::with_capacity(n * n_neighbours(sampled.cloud));
    for first in (0..n).step_by(BLOCK) {
        sampled.observer.checkpoint()?;
        let block = first..(first + BLOCK).min(n);
        edges.extend(block.into_par_iter().flat_map_iter(edges_of).collect::<Vec<Edge>>());
    }
    Ok(edges)
}

/// Returns the edges of [`sheet_edges`] that begin at a point. `around` has the nearest positions to it,
/// nearest first.
pub(super) fn edges_around<'a>(
    cloud: &'a Cloud,
    normals: &'a [f64],
    a: usize,
    around: &'a [u32],
) -> impl Iterator<Item = Edge> + 'a {
    let is_elsewhere = move |b: &usize| squared_distance(cloud.point(a), cloud.point(*b)) > 0.0;
    let elsewhere = around.iter().map(|&b| b as usize).filter(is_elsewhere).take(n_neighbours(cloud));
    let edges = elsewhere.map(move |b| Edge::between(cloud, normals, a, b));
    edges.filter(|edge| edge.weight() > LEAST_WEIGHT)
}

/// Returns the edges of a point. `edges` are ordered by first point.
pub(super) fn edges_of(edges: &[Edge], point: usize) -> &[Edge] {
    let start = edges.partition_point(|edge| edge.a() < point);
    let rest = &edges[start..];
    &rest[..rest.partition_point(|edge| edge.a() == point)]
}

/// Returns means of values `[n]` over each point and its neighbours on the sheet, `[n]`.
pub(super) fn averaged(edges: &[Edge], values: &[f64]) -> Vec<f64> {
    let mut means = values.to_vec();
    let mut counts = vec![1.0; values.len()];
    for edge in edges {
        means[edge.a()] += values[edge.b()];
        counts[edge.a()] += 1.0;
    }
    means.iter_mut().zip(&counts).for_each(|(mean, count)| *mean /= count);
    means
}

/// Returns the share of the edges, by weight, across which normals with these signs are opposite.
pub(super) fn contradiction(edges: &[Edge], signs: &[f64]) -> f64 {
    let total: f64 = edges.iter().map(|edge| edge.weight()).sum();
    let opposite: f64 = edges.iter().map(|edge| edge.agreement(signs).min(0.0).abs()).sum();
    if total == 0.0 { 0.0 } else { opposite / total }
}

/// Two sets, with the vote of their common edges for the sign relative to one another.
struct Border {
    a: usize,
    b: usize,
    vote: f64,
    count: f64,
}

/// Joins sets of a forest by the vote of their common edges, surest first.
pub(super) fn join_borders(forest: &mut SignedForest, edges: &[Edge]) {
    join(forest, edges, |_| true);
}

/// Joins sets of a forest whose common edges are sure in the mean, so that no sharp edge of a body lies
/// between them.
pub(super) fn join_sure_borders(forest: &mut SignedForest, edges: &[Edge]) {
    join(forest, edges, |border| border.vote.abs() > SURE_BORDER * border.count);
}

fn join(forest: &mut SignedForest, edges: &[Edge], is_joined: impl Fn(&Border) -> bool) {
    for border in borders(forest, edges).iter().filter(|border| is_joined(border)) {
        forest.join(border.a, border.b, border.vote.signum());
    }
}

fn borders(forest: &mut SignedForest, edges: &[Edge]) -> Vec<Border> {
    let found = forest.find_all();
    let mut votes: Vec<Border> = Vec::new();
    for edge in edges {
        let (a, b) = (found[edge.a()], found[edge.b()]);
        if a.root != b.root {
            let vote = a.sign * b.sign * edge.cosine().signum() * edge.weight();
            votes.push(Border { a: a.root.min(b.root), b: a.root.max(b.root), vote, count: 1.0 });
        }
    }
    // The sort is stable, so that votes of a border are added in the order of the edges.
    votes.sort_by_key(|border| (border.a, border.b));
    let same = |p: &Border, q: &Border| (p.a, p.b) == (q.a, q.b);
    let total = |chunk: &[Border]| {
        let vote = chunk.iter().map(|border| border.vote).sum();
        Border { vote, count: chunk.len() as f64, ..chunk[0] }
    };
    let mut borders: Vec<Border> = votes.chunk_by(same).map(total).collect();
    // Ties are ordered by index.
    borders.sort_by(|p, q| q.vote.abs().total_cmp(&p.vote.abs()).then((p.a, p.b).cmp(&(q.a, q.b))));
    borders
}
