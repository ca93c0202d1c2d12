//! The surface around a query as a height over a tangent plane of its own.

use super::means::Support;
use super::regression::{Batch, n_terms};
use crate::numerics::machine::eigen::symmetric_eigen;
use crate::numerics::machine::small::{Small, zeros};
use crate::numerics::machine::vector::{norm, tangent_basis};
use crate::numerics::points::neighbours::Neighbour;

/// Points per term of the trend in a whole neighbourhood: 40 for surfaces in space.
const POINTS_PER_TERM: usize = 7;

/// Curvature times radius up to which a neighbourhood may grow: about the angle by which the normal turns.
const MAX_BEND: f64 = 0.9;

/// Standard error of a second derivative times √k, from k heights of unit noise over the unit disc.
const DISC_ERROR: f64 = 8.5;

/// |St|² up to which the closed form of a surface of parallel shape operator is asked; it ends at 1.
const MAX_TURN: f64 = 0.8;

/// Rounds in which curvature and what it entails in higher orders are made to agree.
const ROUNDS: usize = 3;

/// Cosine of 75°, and distance in units of the radius below which points have no direction.
const RIM_COSINE: f64 = 0.26;
const RIM_LEAST: f64 = 0.01;

/// Pivot against the diagonal below which points do not determine a quadric.
const SINGULAR: f64 = 1e-10;

/// Points, or means, in a neighbourhood: even, and at most as many as there are.
pub(crate) fn n_neighbours(dimension: usize, available: usize) -> usize {
    (POINTS_PER_TERM * n_terms(dimension)).next_multiple_of(2).min(available / 2 * 2)
}

/// A frame at a query with the quadric of the heights above it, in units of its radius.
pub(crate) struct Neighbourhood {
    /// d − 1 tangents, then the normal, `[d, d]`.
    pub frame: Small,
    /// R: greatest distance of a point that is used, unit L.
    pub radius: f64,
    /// Points used.
    pub n_used: usize,
    /// Whether no neighbour lies within 75° of the direction opposite to most of them.
    pub is_at_rim: bool,
}

/// Room for the coordinates of one neighbourhood.
#[derive(Default)]
pub(crate) struct Scratch {
    /// x_j − x, `[count, d]`, unit L.
    arms: Vec<f64>,
    /// Terms of the trend, 1 left out: tangential coordinates and their products in units of the radius at hand, `[count, p]`.
    terms: Vec<f64>,
    /// Heights without what curvature entails, and as they are.
    heights: Vec<f64>,
    raw: Vec<f64>,
}

impl Neighbourhood {
    /// The neighbourhood of x, put into one lane of a batch; `None` if the nearest points determine no surface.
    pub(crate) fn put(
        support: &Support,
        x: &[f64],
        nearest: &[Neighbour],
        batch: &mut Batch,
        lane: usize,
        scratch: &mut Scratch,
    ) -> Option<Self> {
        match x.len() {
            2 => Grown::<2, { n_terms(2) }>::put(support, x, nearest, batch, lane, scratch),
            3 => Grown::<3, { n_terms(3) }>::put(support, x, nearest, batch, lane, scratch),
            4 => Grown::<4, { n_terms(4) }>::put(support, x, nearest, batch, lane, scratch),
            _ => None,
        }
    }
}

/// A neighbourhood that grows, in D dimensions with P terms of the trend.
struct Grown<const D: usize, const P: usize> {
    n_used: usize,
    radius: f64,
    /// D − 1 tangents, then the normal.
    frame: [[f64; D]; D],
    /// Coefficients of the quadric, in units of the radius: value, slopes, second derivatives.
    quadric: [f64; P],
    /// Largest curvature that noise does not explain, 1/L.
    curvature: f64,
}

impl<const D: usize, const P: usize> Grown<D, P> {
    fn put(
        support: &Support,
        x: &[f64],
        nearest: &[Neighbour],
        batch: &mut Batch,
        lane: usize,
        scratch: &mut Scratch,
    ) -> Option<Neighbourhood> {
        scratch.arms.clear();
        for found in nearest {
            let point = support.cloud().point(found.point);
            (0..D).for_each(|c| scratch.arms.push(point[c] - x[c]));
        }
        let mut grown = Self::start(support, nearest, scratch)?;
        grown.grow(support, nearest, scratch);
        grown.entail(support, nearest, scratch)?;
        grown.put_into(support, nearest, batch, lane, scratch);
        let (radius, n_used) = (grown.radius, grown.n_used);
        let frame = grown.frame.as_flattened().iter().copied().collect();
        let is_at_rim = grown.is_at_rim(scratch);
        Some(Neighbourhood { frame, radius, n_used, is_at_rim })
    }

    /// The frame of the principal axes of the nearest points, turned to the tangent plane of their quadric.
    fn start(support: &Support, nearest: &[Neighbour], scratch: &mut Scratch) -> Option<Self> {
        let n_used = (P + 3).min(nearest.len());
        if n_used < P {
            return None;
        }
        let radius = nearest[n_used - 1].squared_distance.sqrt();
        if radius <= 0.0 {
            return None;
        }
        let axes = principal_axes(&scratch.arms[..n_used * D], D, radius);
        let mut frame = [[0.0; D]; D];
        frame.as_flattened_mut().copy_from_slice(&axes);
        let mut grown = Self { n_used, radius, frame, quadric: [0.0; P], curvature: 0.0 };
        grown.settle(support, nearest, scratch)?;
        Some(grown)
    }

    /// Takes in more points while the surface that is known bends little over them.
    fn grow(&mut self, support: &Support, nearest: &[Neighbour], scratch: &mut Scratch) {
        for count in [8 * P / 3, 4 * P, 5 * P, 6 * P, nearest.len()] {
            let count = count.min(nearest.len());
            let radius = nearest[count - 1].squared_distance.sqrt();
            if count <= self.n_used || self.curvature * radius > MAX_BEND {
                continue;
            }
            let mut larger = Self { n_used: count, radius, ..*self };
            if larger.settle(support, nearest, scratch).is_none() || larger.curvature * radius > MAX_BEND {
                return;
            }
            larger.curvature = larger.curvature.max(self.curvature);
            *self = larger;
        }
    }

    /// Fits a quadric, and turns the frame into its tangent plane at the query.
    fn settle(&mut self, support: &Support, nearest: &[Neighbour], scratch: &mut Scratch) -> Option<()> {
        let known = self.quadric;
        self.look(support, nearest, scratch);
        let (quadric, residual) = self.fit(support, nearest, scratch)?;
        self.quadric = quadric;
        let freedom = (self.n_used as f64 - P as f64).max(1.0);
        let noise = DISC_ERROR * (residual / freedom / self.n_used as f64).sqrt();
        let bend = self.bend();
        if !bend.is_finite() {
            self.quadric = known;
            return None;
        }
        self.curvature = (bend - 2.0 * noise).max(0.0) / self.radius;
        self.turn();
        Some(())
    }

    /// Coordinates in the frame, in units of the radius.
    fn look(&self, support: &Support, nearest: &[Neighbour], scratch: &mut Scratch) {
        scratch.terms.clear();
        scratch.heights.clear();
        let inverse = 1.0 / self.radius;
        for (arm, found) in scratch.arms.chunks_exact(D).zip(nearest).take(self.n_used) {
            let mut local = [0.0; D];
            for (slot, axis) in local.iter_mut().zip(&self.frame) {
                *slot = (0..D).map(|c| axis[c] * arm[c]).sum::<f64>() * inverse;
            }
            let mut terms = [1.0; P];
            terms[1..D].copy_from_slice(&local[..D - 1]);
            let mut next = D;
            for a in 0..D - 1 {
                for b in a..D - 1 {
                    terms[next] = local[a] * local[b] * if a == b { 0.5 } else { 1.0 };
                    next += 1;
                }
            }
            if support.count(found.point) > 1.0 {
                self.spread(support, found.point, &mut terms);
            }
            scratch.terms.extend_from_slice(&terms);
            scratch.heights.push(local[D - 1]);
        }
    }

    /// Adds to products of the coordinates of a mean those of its points about it.
    fn spread(&self, support: &Support, at: usize, terms: &mut [f64; P]) {
        let mut next = D;
        for a in 0..D - 1 {
            for b in a..D - 1 {
                let moment = support.moment(at, &self.frame[a], &self.frame[b]);
                terms[next] += moment / self.radius.powi(2) * if a == b { 0.5 } else { 1.0 };
                next += 1;
            }
        }
    }

    /// The quadric of the heights by normal equations, each mean counting as so many points, and the sum of squares that it leaves
    /// per point.
    fn fit(&self, support: &Support, nearest: &[Neighbour], scratch: &Scratch) -> Option<([f64; P], f64)> {
        let (mut matrix, mut right) = ([[0.0; P]; P], [0.0; P]);
        let (mut squares, mut total) = (0.0, 0.0);
        for (j, (terms, height)) in scratch.terms.as_chunks::<P>().0.iter().zip(&scratch.heights).enumerate()
        {
            let weight = support.count(nearest[j].point);
            add_products(&mut matrix, terms, weight);
            for (slot, term) in right.iter_mut().zip(terms) {
                *slot += weight * term * height;
            }
            squares += weight * height * height;
            total += weight;
        }
        factorize(&mut matrix)?;
        forward(&matrix, &mut right);
        let explained: f64 = right.iter().map(|r| r * r).sum();
        let residual = (squares - explained).max(0.0) * scratch.heights.len() as f64 / total;
        backward(&matrix, &mut right);
        Some((right, residual))
    }

    /// Largest absolute curvature times radius.
    fn bend(&self) -> f64 {
        if D == 3 {
            let [a, b, c] = [self.quadric[P - 3], self.quadric[P - 2], self.quadric[P - 1]];
            return (0.5 * (a + c)).abs() + (0.25 * (a - c) * (a - c) + b * b).sqrt();
        }
        let hessian = self.hessian();
        let flat: Small = hessian.iter().take(D - 1).flat_map(|row| &row[..D - 1]).copied().collect();
        let (values, _) = symmetric_eigen(&flat, D - 1);
        values.iter().fold(0.0, |a: f64, v| a.max(v.abs()))
    }

    /// Second derivatives as a matrix, in the upper left part.
    fn hessian(&self) -> [[f64; D]; D] {
        let mut matrix = [[0.0; D]; D];
        for (next, (a, b)) in second_derivatives(D - 1).enumerate() {
            (matrix[a][b], matrix[b][a]) = (self.quadric[D + next], self.quadric[D + next]);
        }
        matrix
    }

    fn turn(&mut self) {
        let mut normal = self.frame[D - 1];
        for (slope, tangent) in self.quadric[1..D].iter().zip(&self.frame) {
            normal.iter_mut().zip(tangent).for_each(|(n, t)| *n -= slope * t);
        }
        let length = norm(&normal);
        normal.iter_mut().for_each(|n| *n /= length);
        self.frame.as_flattened_mut()[..D * (D - 1)].copy_from_slice(&tangent_basis(&normal));
        self.frame[D - 1] = normal;
    }

    /// Takes off the heights what the curvature entails beyond second order: a surface whose shape operator S goes along unchanged is
    /// `z = II(t,t)/(1 + √(1 − |St|²))`, for spheres, cylinders and planes exactly.
    fn entail(&mut self, support: &Support, nearest: &[Neighbour], scratch: &mut Scratch) -> Option<()> {
        self.look(support, nearest, scratch);
        std::mem::swap(&mut scratch.raw, &mut scratch.heights);
        scratch.heights.clone_from(&scratch.raw);
        // Every mean counts once: what is wanted here is not noise but what a quadric lacks.
        let mut matrix = [[0.0; P]; P];
        scratch.terms.as_chunks::<P>().0.iter().for_each(|terms| add_products(&mut matrix, terms, 1.0));
        factorize(&mut matrix)?;
        self.refit(&matrix, scratch);
        for round in 0..=ROUNDS {
            self.take_off(scratch);
            if round < ROUNDS {
                self.refit(&matrix, scratch);
            }
        }
        Some(())
    }

    fn take_off(&self, scratch: &mut Scratch) {
        let bend = self.bend().max(1.0);
        let mut shape = self.hessian();
        shape.as_flattened_mut().iter_mut().for_each(|h| *h /= bend);
        let terms = scratch.terms.as_chunks::<P>().0;
        for ((height, raw), terms) in scratch.heights.iter_mut().zip(&scratch.raw).zip(terms) {
            *height = raw - beyond_second_order(&shape, terms);
        }
    }

    fn refit(&mut self, factor: &[[f64; P]; P], scratch: &Scratch) {
        let mut right = [0.0; P];
        for (terms, height) in scratch.terms.as_chunks::<P>().0.iter().zip(&scratch.heights) {
            for (slot, term) in right.iter_mut().zip(terms) {
                *slot += term * height;
            }
        }
        forward(factor, &mut right);
        backward(factor, &mut right);
        self.quadric = right;
    }

    /// Whether the query is at the rim: in the plane, a sector of 150° has no points (see [`crate::numerics::points`], patches).
    fn is_at_rim(&self, scratch: &Scratch) -> bool {
        let terms = scratch.terms.as_chunks::<P>().0;
        let mut away = [0.0; D];
        for terms in terms {
            (0..D - 1).for_each(|a| away[a] -= terms[1 + a]);
        }
        let length = norm(&away);
        let along = |terms: &[f64; P]| (0..D - 1).map(|a| away[a] * terms[1 + a]).sum::<f64>();
        let size = |terms: &[f64; P]| (0..D - 1).map(|a| terms[1 + a].powi(2)).sum::<f64>().sqrt();
        // Points closer than a hundredth of the neighbourhood have no direction to speak of.
        length > 0.0
            && terms
                .iter()
                .filter(|terms| size(terms) > RIM_LEAST)
                .all(|terms| along(terms) < RIM_COSINE * length * size(terms))
    }

    fn put_into(
        &self,
        support: &Support,
        nearest: &[Neighbour],
        batch: &mut Batch,
        lane: usize,
        scratch: &Scratch,
    ) {
        let terms = scratch.terms.as_chunks::<P>().0;
        for (j, terms) in terms.iter().enumerate() {
            batch.set_point(j, lane, true);
            for a in 0..D - 1 {
                batch.set_coordinate(a, j, lane, terms[1 + a]);
            }
            batch.set_coordinate(D - 1, j, lane, scratch.heights[j]);
            batch.set_entailed(j, lane, scratch.raw[j] - scratch.heights[j]);
            for (term, product) in terms[D..].iter().enumerate() {
                batch.set_product(term, j, lane, *product);
            }
            batch.set_weight(j, lane, 1.0 / support.count(nearest[j].point));
        }
        batch.keep(lane, terms.len());
    }
}

/// `f/(1 + √(1 − u)) − f/2` for f = tᵀSt and u = |St|², averaged over the points of a mean to second order in their moments.
fn beyond_second_order<const D: usize, const P: usize>(shape: &[[f64; D]; D], terms: &[f64; P]) -> f64 {
    let times = |x: &[f64; D]| {
        let mut product = [0.0; D];
        for a in 0..D - 1 {
            product[a] = (0..D - 1).map(|b| shape[a][b] * x[b]).sum();
        }
        product
    };
    let mut t = [0.0; D];
    t[..D - 1].copy_from_slice(&terms[1..D]);
    let turned = times(&t);
    let twice = times(&turned);
    let (mut form, mut turn) = (0.0, 0.0);
    for a in 0..D - 1 {
        form += t[a] * turned[a];
        turn += turned[a] * turned[a];
    }
    // Moments about the mean, in units of the radius.
    let (mut in_form, mut in_turn, mut mixed, mut in_twice, mut next) = (0.0, 0.0, 0.0, 0.0, D);
    for a in 0..D - 1 {
        for b in a..D - 1 {
            let product = terms[next] * if a == b { 2.0 } else { 1.0 };
            let moment = (product - t[a] * t[b]) * if a == b { 1.0 } else { 2.0 };
            in_form += moment * shape[a][b];
            in_turn += moment * (0..D - 1).map(|c| shape[a][c] * shape[c][b]).sum::<f64>();
            mixed += moment * 0.5 * (turned[a] * twice[b] + turned[b] * twice[a]);
            in_twice += moment * twice[a] * twice[b];
            next += 1;
        }
    }
    let root = (1.0 - (turn + in_turn).min(MAX_TURN)).sqrt();
    let share = (1.0 - root) / (1.0 + root);
    let slope = 1.0 / (root * (1.0 + root).powi(2));
    let bend = 0.5 * (1.0 + 3.0 * root) / (root * (1.0 + root)).powi(3);
    0.5 * (form + in_form) * share + 2.0 * slope * mixed + 0.0 * bend * form * in_twice
}

/// Pairs of tangential axes of the second derivatives, in order.
fn second_derivatives(k: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..k).flat_map(move |a| (a..k).map(move |b| (a, b)))
}

/// Adds `weight · terms termsᵀ` to an upper triangle.
fn add_products<const P: usize>(matrix: &mut [[f64; P]; P], terms: &[f64; P], weight: f64) {
    for i in 0..P {
        let scaled = weight * terms[i];
        // All of the row: shorter to compute than to decide where it begins.
        for l in 0..P {
            matrix[i][l] += scaled * terms[l];
        }
    }
}

/// RᵀR = A in the upper triangle; `None` if singular.
fn factorize<const P: usize>(a: &mut [[f64; P]; P]) -> Option<()> {
    for i in 0..P {
        let diagonal = a[i][i];
        let (above, rest) = a.split_at_mut(i);
        for row in above {
            let factor = row[i];
            rest[0][i..].iter_mut().zip(&row[i..]).for_each(|(x, r)| *x -= factor * r);
        }
        // Not finite is not greater either.
        let is_determined = a[i][i] > SINGULAR * diagonal;
        if !is_determined {
            return None;
        }
        let inverse = 1.0 / a[i][i].sqrt();
        a[i][i..].iter_mut().for_each(|x| *x *= inverse);
    }
    Some(())
}

/// R⁻ᵀb.
fn forward<const P: usize>(r: &[[f64; P]; P], b: &mut [f64; P]) {
    for i in 0..P {
        b[i] /= r[i][i];
        for l in i + 1..P {
            b[l] -= r[i][l] * b[i];
        }
    }
}

/// R⁻¹b.
fn backward<const P: usize>(r: &[[f64; P]; P], b: &mut [f64; P]) {
    for i in (0..P).rev() {
        let known: f64 = (i + 1..P).map(|l| r[i][l] * b[l]).sum();
        b[i] = (b[i] - known) / r[i][i];
    }
}

/// Principal axes of arms about their mean, the direction of least variance last.
fn principal_axes(arms: &[f64], d: usize, radius: f64) -> Small {
    let n = (arms.len() / d) as f64;
    let mut mean = zeros(d);
    for arm in arms.chunks_exact(d) {
        mean.iter_mut().zip(arm).for_each(|(m, a)| *m += a / (n * radius));
    }
    let mut covariance = zeros(d * d);
    for arm in arms.chunks_exact(d) {
        for a in 0..d {
            for b in a..d {
                covariance[a * d + b] += (arm[a] / radius - mean[a]) * (arm[b] / radius - mean[b]);
            }
        }
    }
    let (_, vectors) = symmetric_eigen(&covariance, d);
    vectors.chunks_exact(d).rev().flatten().copied().collect()
}
