//! Regions of a tile, in which the normals of neighbours agree.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::error::NumericsError;
use crate::machine::vector::dot;
use crate::observer::{Observer, for_each};
use crate::orientation::consistent::joined;
use crate::orientation::edges::{BLOCK, Edge, edges_around};
use crate::orientation::forest::SignedForest;
use crate::orientation::pieces::{Bounds, area};
use crate::orientation::{n_around, n_neighbours};
use crate::points::cloud::{Cloud, squared_distance};
use crate::points::neighbourhoods::Neighbourhoods;
use crate::points::sampling::Sampling;

/// Part of a cloud that a tile answers for. The other points of the tile surround it.
pub struct Tile<'a> {
    /// Points that the tile answers for, ascending.
    pub own: &'a [usize],
    /// Points whose signature function determines the outward side.
    pub coarse: &'a [usize],
}

/// Points of a tile with normals on the side of the signature function.
pub(crate) struct SignedPoints<'a> {
    pub cloud: &'a Cloud,
    pub sampling: &'a Sampling,
    /// Unit vectors `[n, d]`, zero where there is none.
    pub normals: &'a [f64],
    /// True where the signature function determines the side of a point, `[n]`.
    pub has_sign: &'a [bool],
}

/// Neighbouring points of a tile whose signs agree, with sums over those that the tile answers for.
///
/// a is the area that a point x stands for, and ν its normal. Units are powers of L.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Number of points.
    pub n_points: usize,
    /// Number of points where the signature function determines the side.
    pub n_signed: usize,
    /// Number of points that define the signature function.
    pub n_coarse: usize,
    /// `Σ a`, L^{d−1}.
    pub area: f64,
    /// `c = Σ a x / Σ a`, L.
    pub centre: Vec<f64>,
    /// `Σ a |x − c|²`, L^{d+1}.
    pub spread: f64,
    /// `Σ a ν`, L^{d−1}.
    pub normal: Vec<f64>,
    /// `Σ a (x − c)·ν`, L^d: d times the volume between the region and its centre.
    pub volume: f64,
    /// Lower corner of the box around all points of the region in the tile, L.
    pub lower: Vec<f64>,
    /// Upper corner of that box, L.
    pub upper: Vec<f64>,
}

/// Sums of the weights of the edges between two regions, or within one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Border {
    /// The two regions, the smaller index first.
    pub regions: [usize; 2],
    /// Edges across which the normals agree.
    pub agreeing: f64,
    /// Edges across which the normals are opposite.
    pub opposing: f64,
}

/// Regions of one tile, and the borders between them.
#[derive(Debug, Clone, PartialEq)]
pub struct TileRegions {
    pub regions: Vec<Region>,
    pub borders: Vec<Border>,
    /// Number of edges that the points would have on a surface that is sampled well.
    pub n_edges: usize,
}

/// Regions of a tile with the region of each point.
pub struct LabelledRegions {
    pub tile: TileRegions,
    /// The region of each point, `[n]`. None for points around the tile that no edge leads to.
    pub labels: Vec<Option<usize>>,
}

/// Finds the regions of a tile.
///
/// # Errors
/// [`NumericsError::Cancelled`].
pub(crate) fn regions_of(
    signed: &SignedPoints<'_>,
    tile: &Tile<'_>,
    observer: &dyn Observer,
) -> Result<LabelledRegions, NumericsError> {
    let (cloud, own) = (signed.cloud, tile.own);
    if own.is_empty() {
        let tile = TileRegions { regions: Vec::new(), borders: Vec::new(), n_edges: 0 };
        return Ok(LabelledRegions { tile, labels: vec![None; cloud.n_points()] });
    }
    let neighbours = signed.sampling.neighbours();
    let around = Neighbourhoods::of(neighbours, &cloud.select(own), n_around(cloud), observer)?;
    let edges_of = |(at, &point)| edges_around(cloud, signed.normals, point, around.around(at));
    let mut edges: Vec<Edge> = Vec::new();
    for (block, points) in own.chunks(BLOCK).enumerate() {
        observer.checkpoint()?;
        let first = block * BLOCK;
        edges.par_extend(
            points.par_iter().enumerate().flat_map_iter(|(at, point)| edges_of((first + at, point))),
        );
    }
    observer.checkpoint()?;
    let labels = labels(&mut joined(&edges, signed.has_sign), &edges, own);
    let n_regions = labels.iter().flatten().max().map_or(0, |last| last + 1);
    let mut members = vec![Vec::new(); n_regions];
    for (point, label) in labels.iter().enumerate() {
        label.iter().for_each(|&label: &usize| members[label].push(point));
    }
    let (is_own, is_coarse) = (marked(own, cloud.n_points()), marked(tile.coarse, cloud.n_points()));
    let sums = Sums { signed, is_own, is_coarse };
    let mut regions = Vec::with_capacity(n_regions);
    for_each(&members, observer, |members| regions.push(sums.region(members)))?;
    observer.checkpoint()?;
    let tile =
        TileRegions { regions, borders: borders(&edges, &labels), n_edges: own.len() * n_neighbours(cloud) };
    Ok(LabelledRegions { tile, labels })
}

fn marked(points: &[usize], n: usize) -> Vec<bool> {
    let mut is_marked = vec![false; n];
    points.iter().for_each(|&point| is_marked[point] = true);
    is_marked
}

/// Numbers the regions of own points and of the ends of their edges by their first points.
fn labels(forest: &mut SignedForest, edges: &[Edge], own: &[usize]) -> Vec<Option<usize>> {
    let roots: Vec<usize> = forest.find_all().into_iter().map(|found| found.root).collect();
    let mut is_labelled = marked(own, roots.len());
    edges.iter().for_each(|edge| is_labelled[edge.b()] = true);
    let (mut label_of, mut n_labels) = (vec![None; roots.len()], 0);
    let label = |(&root, is_labelled): (&usize, bool)| {
        is_labelled.then(|| {
            *label_of[root].get_or_insert_with(|| {
                n_labels += 1;
                n_labels - 1
            })
        })
    };
    roots.iter().zip(is_labelled).map(label).collect()
}

/// Sums up the edges by the regions of their ends.
fn borders(edges: &[Edge], labels: &[Option<usize>]) -> Vec<Border> {
    let mut sums = BTreeMap::<[usize; 2], [f64; 2]>::new();
    for edge in edges {
        if let (Some(a), Some(b)) = (labels[edge.a()], labels[edge.b()]) {
            let of_pair = sums.entry([a.min(b), a.max(b)]).or_default();
            of_pair[usize::from(edge.cosine() < 0.0)] += edge.weight();
        }
    }
    sums.into_iter().map(|(regions, [agreeing, opposing])| Border { regions, agreeing, opposing }).collect()
}

/// Points of a tile, to be summed up.
struct Sums<'a> {
    signed: &'a SignedPoints<'a>,
    is_own: Vec<bool>,
    is_coarse: Vec<bool>,
}

impl Sums<'_> {
    fn region(&self, members: &[usize]) -> Region {
        let (cloud, d) = (self.signed.cloud, self.signed.cloud.dimension());
        let own: Vec<usize> = members.iter().copied().filter(|&point| self.is_own[point]).collect();
        let count = |is_such: &[bool]| own.iter().filter(|&&point| is_such[point]).count();
        let centre = self.centre(if own.is_empty() { members } else { &own });
        let bounds = Bounds::of(cloud, members);
        let mut region = Region {
            n_points: own.len(),
            n_signed: count(self.signed.has_sign),
            n_coarse: count(&self.is_coarse),
            area: own.iter().map(|&point| self.area(point)).sum(),
            spread: 0.0,
            normal: vec![0.0; d],
            volume: 0.0,
            lower: bounds.least,
            upper: bounds.greatest,
            centre,
        };
        for &point in &own {
            let (area, normal) = (self.area(point), &self.signed.normals[point * d..][..d]);
            let arm: Vec<f64> = cloud.point(point).iter().zip(&region.centre).map(|(x, c)| x - c).collect();
            region.spread += area * squared_distance(cloud.point(point), &region.centre);
            region.volume += area * dot(&arm, normal);
            region.normal.iter_mut().zip(normal).for_each(|(sum, c)| *sum += area * c);
        }
        region
    }

    /// Mean of the points by area. Points that all coincide have no area, and count equally.
    fn centre(&self, points: &[usize]) -> Vec<f64> {
        let has_area = points.iter().any(|&point| self.area(point) > 0.0);
        let weight = |point: usize| if has_area { self.area(point) } else { 1.0 };
        let total: f64 = points.iter().map(|&point| weight(point)).sum();
        let mut centre = vec![0.0; self.signed.cloud.dimension()];
        for &point in points {
            let share = weight(point) / total;
            centre.iter_mut().zip(self.signed.cloud.point(point)).for_each(|(c, x)| *c += share * x);
        }
        centre
    }

    fn area(&self, point: usize) -> f64 {
        area(self.signed.sampling, point, self.signed.cloud.dimension())
    }
}
