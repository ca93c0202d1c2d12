//! Signs of normals over a whole cloud: checked against the neighbours, and repaired.
//!
//! The gradient of the signature function points out of a closed surface while ℓ is not small against its features; for a
//! small ℓ its sign follows the mean curvature and flips where that changes sign (errata.md, 13). Across such a flip the
//! normals of neighbours are opposite although the surface goes on. So: points whose signs agree are joined to regions,
//! regions are joined by what their common border says, and each connected piece gets the sign of most of its gradients or,
//! if they disagree and the piece is closed, or it is bulky, the sign that gives it a positive volume. Propagation over a neighbour graph is
//! that of Hoppe et al. (1992); joining whole regions keeps a single bad edge from deciding.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::numerics::machine::vector::{dot, unit};
use crate::numerics::points::cloud::Cloud;
use crate::numerics::points::local_quadrics::{LocalQuadric, LocalQuadrics};
use crate::numerics::points::neighbourhoods::Neighbourhoods;
use crate::numerics::points::neighbours::Neighbour;

/// Cosine of neighbouring normals above which they belong to one region.
const SAME_REGION: f64 = 0.7;

/// Mean weight of the pairs of neighbours below which a cloud does not resolve its surface: normals turn by as much as they
/// please from point to point, what seems a flip is the surface, and nothing is repaired. The bunny with 1 % of noise has 0.3, a
/// torus of 24 points 0.06.
const RESOLVED: f64 = 0.2;

/// Factor by which the volume may shrink.
const LOST_VOLUME: f64 = 1.05;

/// Share of the edges of a piece, by weight, that gradients may contradict for their volume to count: on separate surfaces that nearly
/// touch it is 0.0002 to 0.005, on noisy ones whose gradients are wrong 0.04 and more, and those enclose more than the truth.
const LOCAL_CONTRADICTION: f64 = 0.02;

/// Share of the edges, by weight, that may contradict repaired signs.
const CONTRADICTION: f64 = 0.1;

/// Share of the gradients that must agree for their sign to be believed without the volume.
const UNANIMITY: f64 = 0.95;

/// Volume over that of a ball of as much surface as far from its centre, above which it is known better than any gradient: those of a wide
/// kernel on an octahedron agree, and point inward. A torus with a tube of a seventh of its radius has twice as much.
const BULKY: f64 = 0.1;

/// What is known of normals before their signs are made consistent.
pub(crate) struct Directions {
    /// Unit vectors at the points, `[n, d]`: outward where that is known, of unknown sign elsewhere, or zero.
    pub normals: Vec<f64>,
    /// Whether the sign means something, `[n]`.
    pub has_sign: Vec<bool>,
    /// Whether the point is at the rim of an open surface, `[n]`.
    pub is_at_rim: Vec<bool>,
}

/// How the signs of normals were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SurfaceOrientation {
    /// Points whose gradient pointed inward.
    pub n_flipped: usize,
    /// Whether part of the surface has a rim, so that outward has no meaning there.
    pub is_open: bool,
    /// Whether the signs are those of normals that came with the cloud.
    pub is_given: bool,
}

/// Outward normals at the points.
pub(crate) struct Oriented {
    /// Unit vectors `[n, d]`; zero where nothing is known.
    pub normals: Vec<f64>,
    pub how: SurfaceOrientation,
    /// Whether neighbours have so much to do with one another that their signs can be compared.
    pub is_consistent: bool,
}

impl Oriented {
    /// Orients what is known of the normals, among the neighbours of the points with their spacings, `[n]`; `given` are normals of
    /// the client, `[n, d]`, of any length but 0, which decide.
    pub(crate) fn of(
        cloud: &Cloud,
        around: (&Neighbourhoods, &[f64]),
        directions: Directions,
        quadrics: &LocalQuadrics,
        given: Option<&Cloud>,
    ) -> Self {
        let directions = match given {
            None => directions,
            Some(given) => Directions { normals: given.points().flat_map(unit).collect(), ..directions },
        };
        let mut oriented = Self::of_directions(cloud, around, directions, given.is_some());
        if given.is_none() {
            oriented.straighten(quadrics, cloud.dimension());
        }
        oriented
    }

    /// The same without quadrics. Directions that are given keep their signs.
    pub(crate) fn of_directions(
        cloud: &Cloud,
        (around, spacings): (&Neighbourhoods, &[f64]),
        directions: Directions,
        is_given: bool,
    ) -> Self {
        let found = consistent_signs(cloud, around, spacings, &directions);
        let (is_open, is_consistent) = (found.is_open, found.is_resolved);
        let n_flipped = if is_given { 0 } else { found.n_flipped };
        let how = SurfaceOrientation { n_flipped, is_open, is_given };
        let mut normals = directions.normals;
        if !is_given {
            for (normal, sign) in normals.chunks_exact_mut(cloud.dimension()).zip(&found.signs) {
                normal.iter_mut().for_each(|c| *c *= sign);
            }
        }
        Self { normals, how, is_consistent }
    }

    /// Positions alone give the better direction where the cloud is dense; the signature function has given the sign.
    fn straighten(&mut self, quadrics: &LocalQuadrics, d: usize) {
        for (point, normal) in self.normals.chunks_exact_mut(d).enumerate() {
            if let Some(quadric) = quadrics.at(point).filter(LocalQuadric::is_reliable) {
                let sign = dot(normal, quadric.normal).signum();
                normal.iter_mut().zip(quadric.normal).for_each(|(c, n)| *c = sign * n);
            }
        }
    }
}

/// Positions that must be known around each point, itself among them.
pub(crate) fn n_around(cloud: &Cloud) -> usize {
    n_neighbours(cloud) + 1
}

/// Signs to multiply the normals of [`Directions`] with.
#[derive(Debug, PartialEq)]
struct Signs {
    pub signs: Vec<f64>,
    /// Points whose gradient pointed the other way.
    pub n_flipped: usize,
    /// Whether a connected piece has a rim, so that it has no outside.
    pub is_open: bool,
    /// Whether neighbours have so much to do with one another that their signs can be compared.
    pub is_resolved: bool,
}

/// Makes the signs of normals consistent; `spacings` are mean distances to the nearest points, unit L, `[n]`.
fn consistent_signs(
    cloud: &Cloud,
    around: &Neighbourhoods,
    spacings: &[f64],
    directions: &Directions,
) -> Signs {
    let n = cloud.n_points();
    let edges = sheet_edges(cloud, around, &directions.normals);
    let mut pieces = SignedForest::new(n);
    for edge in &edges {
        let both_signed = directions.has_sign[edge.a] && directions.has_sign[edge.b];
        if both_signed && edge.cosine > SAME_REGION {
            pieces.join(edge.a, edge.b, 1.0);
        }
    }
    for (a, b, sign) in borders(&mut pieces, &edges) {
        pieces.join(a, b, sign);
    }
    let mut members: HashMap<usize, Vec<usize>> = HashMap::new();
    let mut relative = vec![1.0; n];
    for (point, slot) in relative.iter_mut().enumerate() {
        let (root, sign) = pieces.find(point);
        *slot = sign;
        members.entry(root).or_default().push(point);
    }
    let raw = contradictions(&mut pieces, &edges, &directions.has_sign);
    // A hundred at most.
    let large = members.iter().filter(|(_, piece)| 100 * piece.len() >= n);
    let boxes: Vec<(usize, Bounds)> = large.map(|(root, piece)| (*root, Bounds::of(cloud, piece))).collect();
    let (mut signs, mut is_open) = (relative.clone(), false);
    for (root, piece) in &members {
        let piece = Piece { cloud, directions, spacings, points: piece, relative: &relative };
        let has_rim = piece.has_rim();
        let own = Bounds::of(cloud, piece.points);
        let is_nested = boxes.iter().any(|(other, bounds)| other != root && bounds.contain(&own));
        let sign = piece.sign(has_rim, is_nested);
        is_open |= has_rim;
        piece.points.iter().for_each(|&point| signs[point] *= sign);
        let gradients_agree = raw.get(root).is_none_or(|share| *share < LOCAL_CONTRADICTION);
        if !has_rim && gradients_agree && piece.loses_volume() {
            piece.points.iter().filter(|&&p| directions.has_sign[p]).for_each(|&p| signs[p] = 1.0);
        }
    }
    let mean_weight = edges.iter().map(|edge| edge.weight).sum::<f64>() / (n * n_neighbours(cloud)) as f64;
    let is_resolved = mean_weight >= RESOLVED;
    if !is_resolved || contradiction(&edges, &signs) > CONTRADICTION {
        (0..n).filter(|&point| directions.has_sign[point]).for_each(|point| signs[point] = 1.0);
    }
    let n_flipped = (0..n).filter(|&point| directions.has_sign[point] && signs[point] < 0.0).count();
    Signs { signs, n_flipped, is_open, is_resolved }
}

/// Neighbours that a point shares edges with.
fn n_neighbours(cloud: &Cloud) -> usize {
    2 * cloud.dimension() + 2
}

/// The share of the edges, by weight, across which normals with these signs are opposite.
fn contradiction(edges: &[Edge], signs: &[f64]) -> f64 {
    let is_opposite = |edge: &&Edge| signs[edge.a] * signs[edge.b] * edge.cosine < 0.0;
    let weight = |edge: &Edge| edge.weight;
    let total: f64 = edges.iter().map(weight).sum();
    if total == 0.0 { 0.0 } else { edges.iter().filter(is_opposite).map(weight).sum::<f64>() / total }
}

/// [`contradiction`] of the gradients by themselves, in each piece, by its root.
fn contradictions(pieces: &mut SignedForest, edges: &[Edge], has_sign: &[bool]) -> HashMap<usize, f64> {
    let mut sums: HashMap<usize, (f64, f64)> = HashMap::new();
    for edge in edges.iter().filter(|edge| has_sign[edge.a] && has_sign[edge.b]) {
        let (root, _) = pieces.find(edge.a);
        let (opposite, total) = sums.entry(root).or_default();
        *total += edge.weight;
        *opposite += if edge.cosine < 0.0 { edge.weight } else { 0.0 };
    }
    sums.into_iter().map(|(root, (opposite, total))| (root, opposite / total)).collect()
}

/// Two neighbours on one sheet of the surface.
struct Edge {
    a: usize,
    b: usize,
    /// Of their normals.
    cosine: f64,
    /// 0 to 1: how surely the surface leads from one to the other.
    weight: f64,
}

/// Neighbouring points between which the surface bends like a sphere, up to the sign of the normals.
///
/// On one sheet `D·ν_a ≈ −κ|D|²/2 ≈ −D·ν_b` for consistent normals; two sheets at a distance t have `D·ν_a ≈ D·ν_b ≈ t`.
fn sheet_edges(cloud: &Cloud, around: &Neighbourhoods, normals: &[f64]) -> Vec<Edge> {
    let d = cloud.dimension();
    let edge = |a: usize, found: &Neighbour| {
        let b = found.point;
        let (normal_a, normal_b) = (&normals[a * d..][..d], &normals[b * d..][..d]);
        let cosine = dot(normal_a, normal_b);
        let step = |normal: &[f64]| -> f64 {
            (0..d).map(|c| (cloud.point(b)[c] - cloud.point(a)[c]) * normal[c]).sum()
        };
        let across = (step(normal_a) + cosine.signum() * step(normal_b)).abs();
        let weight = cosine * cosine * (1.0 - 2.0 * across / found.squared_distance.sqrt());
        (weight > 0.01).then_some(Edge { a, b, cosine, weight })
    };
    let edges_of = |a: usize| {
        let elsewhere = around.around(a).iter().filter(|found| found.squared_distance > 0.0);
        elsewhere.take(n_neighbours(cloud)).filter_map(move |found| edge(a, found))
    };
    (0..cloud.n_points()).into_par_iter().flat_map_iter(edges_of).collect()
}

/// Pairs of regions with the relative sign that most of their common edges vote for, surest first.
fn borders(pieces: &mut SignedForest, edges: &[Edge]) -> Vec<(usize, usize, f64)> {
    let mut votes: HashMap<(usize, usize), f64> = HashMap::new();
    for edge in edges {
        let ((a, sign_a), (b, sign_b)) = (pieces.find(edge.a), pieces.find(edge.b));
        if a != b {
            *votes.entry((a.min(b), a.max(b))).or_default() +=
                sign_a * sign_b * edge.cosine.signum() * edge.weight;
        }
    }
    let mut borders: Vec<((usize, usize), f64)> = votes.into_iter().collect();
    // By index where votes tie, so that the answer does not depend on the order of a hash map.
    borders.sort_by(|(p, x), (q, y)| y.abs().total_cmp(&x.abs()).then(p.cmp(q)));
    borders.into_iter().map(|((a, b), vote)| (a, b, vote.signum())).collect()
}

/// A connected part of the surface with signs relative to one another.
struct Piece<'a> {
    cloud: &'a Cloud,
    directions: &'a Directions,
    spacings: &'a [f64],
    points: &'a [usize],
    relative: &'a [f64],
}

impl Piece<'_> {
    /// Two ends of a curve, or a row of rim points of a surface.
    fn has_rim(&self) -> bool {
        let n_rim = self.points.iter().filter(|&&point| self.directions.is_at_rim[point]).count();
        match self.cloud.dimension() {
            2 => n_rim >= 2,
            _ => n_rim >= 4 && 50 * n_rim >= self.points.len(),
        }
    }

    /// The sign of the volume, if there is much and no other piece around it; else that of most gradients by area, or that of the
    /// volume where they disagree.
    fn sign(&self, has_rim: bool, is_nested: bool) -> f64 {
        let signed = || self.points.iter().filter(|&&point| self.directions.has_sign[point]);
        let total: f64 = signed().map(|&point| self.area(point)).sum();
        let vote: f64 = signed().map(|&point| self.relative[point] * self.area(point)).sum();
        let volume = self.volume(|point| self.relative[point]);
        let is_bulky = !is_nested && volume.abs() > BULKY * self.volume_of_ball();
        let is_unanimous = vote.abs() >= (2.0 * UNANIMITY - 1.0) * total;
        let decides_itself = has_rim || is_unanimous && !is_bulky;
        let decisive = if total > 0.0 && decides_itself || volume == 0.0 { vote } else { volume };
        if decisive < 0.0 { -1.0 } else { 1.0 }
    }

    /// Whether consistent signs enclose less than the gradients do by themselves: separate surfaces that nearly touch, each of
    /// them right, were taken for one. Curves cross their own inside too often for this to tell.
    fn loses_volume(&self) -> bool {
        let signed = |sign: f64, point: usize| if self.directions.has_sign[point] { sign } else { 0.0 };
        let by_gradients = self.volume(|point| signed(1.0, point)).abs();
        let repaired = self.volume(|point| signed(self.relative[point], point)).abs();
        self.cloud.dimension() > 2 && by_gradients > LOST_VOLUME * repaired
    }

    /// `Σ a (x − c)·ν`, d times the volume inside by the divergence theorem.
    fn volume(&self, sign: impl Fn(usize) -> f64) -> f64 {
        let d = self.cloud.dimension();
        let centre = self.centre();
        let of_point = |&point: &usize| {
            let normal = &self.directions.normals[point * d..][..d];
            let arm = self.cloud.point(point).iter().zip(&centre).map(|(x, c)| x - c);
            sign(point) * self.area(point) * arm.zip(normal).map(|(a, n)| a * n).sum::<f64>()
        };
        self.points.iter().map(of_point).sum()
    }

    /// `Σ a |x − c|`.
    fn volume_of_ball(&self) -> f64 {
        let centre = self.centre();
        let distance = |x: &[f64]| x.iter().zip(&centre).map(|(x, c)| (x - c).powi(2)).sum::<f64>().sqrt();
        self.points.iter().map(|&point| self.area(point) * distance(self.cloud.point(point))).sum()
    }

    fn centre(&self) -> Vec<f64> {
        let mut centre = vec![0.0; self.cloud.dimension()];
        let total: f64 = self.points.iter().map(|&point| self.area(point)).sum();
        for &point in self.points {
            let share = self.area(point) / total;
            centre.iter_mut().zip(self.cloud.point(point)).for_each(|(c, x)| *c += share * x);
        }
        centre
    }

    fn area(&self, point: usize) -> f64 {
        self.spacings[point].powi(self.cloud.dimension() as i32 - 1)
    }
}

/// The sides of a box around some points.
struct Bounds {
    least: Vec<f64>,
    greatest: Vec<f64>,
}

impl Bounds {
    fn of(cloud: &Cloud, points: &[usize]) -> Self {
        let first = points.first().map_or(&[][..], |&point| cloud.point(point));
        let (mut least, mut greatest) = (first.to_vec(), first.to_vec());
        for &point in points {
            for ((x, l), g) in cloud.point(point).iter().zip(&mut least).zip(&mut greatest) {
                (*l, *g) = (l.min(*x), g.max(*x));
            }
        }
        Self { least, greatest }
    }

    fn contain(&self, other: &Self) -> bool {
        self.least.iter().zip(&other.least).all(|(own, other)| own < other)
            && self.greatest.iter().zip(&other.greatest).all(|(own, other)| own > other)
    }
}

/// Disjoint sets whose members have a sign relative to their root.
struct SignedForest {
    parents: Vec<usize>,
    signs: Vec<f64>,
    sizes: Vec<usize>,
}

impl SignedForest {
    fn new(n: usize) -> Self {
        Self { parents: (0..n).collect(), signs: vec![1.0; n], sizes: vec![1; n] }
    }

    /// The root of a member and the sign relative to it. Depth is logarithmic, since smaller sets join larger ones.
    fn find(&mut self, member: usize) -> (usize, f64) {
        let (mut at, mut sign) = (member, 1.0);
        while self.parents[at] != at {
            sign *= self.signs[at];
            at = self.parents[at];
        }
        (self.parents[member], self.signs[member]) = (at, sign);
        (at, sign)
    }

    /// Joins the sets of two members that have this sign relative to one another; members of one set keep theirs.
    fn join(&mut self, a: usize, b: usize, sign: f64) {
        let ((mut a, sign_a), (mut b, sign_b)) = (self.find(a), self.find(b));
        if a == b {
            return;
        }
        if self.sizes[a] < self.sizes[b] {
            std::mem::swap(&mut a, &mut b);
        }
        self.parents[b] = a;
        self.signs[b] = sign * sign_a * sign_b;
        self.sizes[a] += self.sizes[b];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::observer::Unobserved;
    use crate::numerics::points::neighbours::Neighbours;
    use crate::numerics::testing::fibonacci_sphere;

    fn around(cloud: &Cloud) -> Neighbourhoods {
        let neighbours = Neighbours::of(cloud, &Unobserved).unwrap();
        Neighbourhoods::of(&neighbours, cloud, 18, &Unobserved).unwrap()
    }

    fn directions(cloud: &Cloud, normals: Vec<f64>) -> Directions {
        let n = cloud.n_points();
        Directions { normals, has_sign: vec![true; n], is_at_rim: vec![false; n] }
    }

    #[test]
    fn a_flipped_region_of_a_sphere_is_turned_back() {
        let cloud = fibonacci_sphere(400);
        let around = around(&cloud);
        for (height, expected) in [(0.3, 140), (-0.4, 280)] {
            // Normals point inward above the height: less than half of the sphere, and more.
            let sign = |x: &[f64]| if x[2] > height { -1.0 } else { 1.0 };
            let normals = cloud.points().flat_map(|x| x.iter().map(|c| sign(x) * c).collect::<Vec<_>>());
            let directions = directions(&cloud, normals.collect());
            let signs = consistent_signs(&cloud, &around, &[1.0; 400], &directions);
            assert_eq!(signs.n_flipped, expected);
            assert!(cloud.points().zip(&signs.signs).all(|(x, &s)| s == sign(x)));
            assert!(!signs.is_open);
        }
    }

    #[test]
    fn the_sides_of_a_thin_sheet_keep_their_opposite_signs() {
        // Two layers at a distance of half the spacing.
        let layer = |z: f64| (0..100).flat_map(move |i| [(i % 10) as f64, (i / 10) as f64, z]);
        let cloud = Cloud::new(layer(0.0).chain(layer(0.5)).collect(), 3).unwrap();
        let normals = (0..200).flat_map(|i| [0.0, 0.0, if i < 100 { -1.0 } else { 1.0 }]).collect();
        let signs = consistent_signs(&cloud, &around(&cloud), &[1.0; 200], &directions(&cloud, normals));
        assert_eq!(signs.n_flipped, 0);
    }

    #[test]
    fn points_without_a_sign_follow_their_neighbours() {
        let cloud = fibonacci_sphere(300);
        let normals = cloud
            .points()
            .enumerate()
            .flat_map(|(i, x)| x.iter().map(move |c| if i % 3 == 0 { -c } else { *c }).collect::<Vec<_>>())
            .collect();
        let mut directions = directions(&cloud, normals);
        directions.has_sign = (0..300).map(|i| i % 3 != 0).collect();
        let signs = consistent_signs(&cloud, &around(&cloud), &[1.0; 300], &directions);
        assert_eq!(signs.n_flipped, 0);
        assert!(signs.signs.iter().enumerate().all(|(i, &s)| s == if i % 3 == 0 { -1.0 } else { 1.0 }));
    }
}
