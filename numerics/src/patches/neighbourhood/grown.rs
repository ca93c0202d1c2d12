//! Construction of a neighbourhood, which grows while the surface over it bends little.

use super::growth::Growth;
use super::quadric::{Sums, largest_curvature, principal_axes};
use super::sheet::Sheet;
use super::{Batch, Neighbourhood, Scratch, Support};
use crate::machine::vector::{dot, norm, tangent_basis};
use crate::points::neighbours::Neighbour;
use crate::points::patch::is_at_rim;

/// Greatest standard error of the bend of the first points, by the noise of the cloud. With a larger one more
/// points are taken: the frame would be turned by chance.
const MOST_DOUBT: f64 = 0.5;

/// A growing neighbourhood in D dimensions with P terms of the trend.
pub(super) struct GrowingNeighbourhood<const D: usize, const P: usize> {
    /// Number of points in use: the first ones of the scratch.
    n_used: usize,
    radius: f64,
    /// Axes of the frame as rows: D − 1 tangents, then the normal.
    frame: [[f64; D]; D],
    /// Coefficients of the quadric, in units of the radius: value, slopes, second derivatives.
    pub(super) quadric: [f64; P],
}

impl<const D: usize, const P: usize> GrowingNeighbourhood<D, P> {
    pub(super) fn put(
        support: &Support,
        x: &[f64],
        nearest: &mut [Neighbour],
        batch: &mut Batch,
        lane: usize,
        scratch: &mut Scratch,
    ) -> Option<Neighbourhood> {
        scratch.arms.clear();
        for found in nearest.iter() {
            let point = support.cloud().point(found.point);
            (0..D).for_each(|c| scratch.arms.push(point[c] - x[c]));
        }
        let (mut grown, reach) = Self::start(support, nearest, scratch)?;
        grown.grow(reach, support, nearest, scratch);
        grown.entail(support, nearest, scratch)?;
        grown.put_into(support, nearest, batch, lane, scratch);
        let radius = grown.radius;
        let frame = grown.frame.as_flattened().iter().copied().collect();
        let terms = scratch.terms.as_chunks::<P>().0;
        let is_at_rim = is_at_rim(terms.iter().map(|terms| &terms[1..D]), D - 1);
        Some(Neighbourhood { frame, radius, is_at_rim })
    }

    /// Makes the first frame from the nearest points: their principal axes, turned to the tangent plane of
    /// their quadric.
    ///
    /// Where there are two sheets, the frame is that of the sheet of the query, whose points are moved to the
    /// front. The second result is then the height up to which points belong to that sheet.
    fn start(
        support: &Support,
        nearest: &mut [Neighbour],
        scratch: &mut Scratch,
    ) -> Option<(Self, Option<f64>)> {
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
        let sheet = Sheet::of_two(&scratch.arms, &frame[D - 1]);
        if let Some(sheet) = &sheet {
            // A sheet has more than half of the points examined: enough to start from.
            bring_forward(sheet, nearest, &mut scratch.arms);
            frame.as_flattened_mut()[..D * (D - 1)].copy_from_slice(&tangent_basis(&sheet.normal));
            frame[D - 1] = sheet.normal;
        }
        let mut grown = Self { n_used, radius, frame, quadric: [0.0; P] };
        while grown.fit(support, nearest, scratch)? > MOST_DOUBT && grown.n_used < nearest.len() {
            grown.n_used = (2 * grown.n_used).min(nearest.len());
            if sheet.is_none() {
                let radius = nearest[grown.n_used - 1].squared_distance.sqrt();
                let axes = principal_axes(&scratch.arms[..grown.n_used * D], D, radius);
                grown.frame.as_flattened_mut().copy_from_slice(&axes);
            }
        }
        grown.turn();
        Some((grown, sheet.map(|sheet| sheet.reach)))
    }

    /// Fits the quadric to the points in use. Returns the standard error of its bend by the noise of the
    /// cloud.
    fn fit(&mut self, support: &Support, nearest: &[Neighbour], scratch: &mut Scratch) -> Option<f64> {
        self.radius = nearest[self.n_used - 1].squared_distance.sqrt();
        self.look(support, nearest, scratch);
        let mut sums = Sums::<P>::default();
        for (at, found) in nearest[..self.n_used].iter().enumerate() {
            sums.add(scratch.terms_at(at), scratch.heights[at], support.count(found.point));
        }
        let fit = sums.fit()?;
        self.quadric = fit.quadric;
        let noise = scratch.noise / self.radius;
        Some(if noise > 0.0 { noise * fit.unit_error::<D>() } else { 0.0 })
    }

    /// Takes in more points while the surface known so far bends little over them. Points of other sheets are
    /// left out.
    fn grow(
        &mut self,
        reach: Option<f64>,
        support: &Support,
        nearest: &mut [Neighbour],
        scratch: &mut Scratch,
    ) {
        let unit = nearest.iter().fold(0.0, |unit: f64, found| unit.max(found.squared_distance)).sqrt();
        (self.n_used, self.radius) = (nearest.len(), unit);
        self.look(support, nearest, scratch);
        let mut growth =
            Growth::<D, P>::up_to(reach.map_or(f64::INFINITY, |reach| reach / unit), scratch.noise / unit);
        for count in [P + 3, 8 * P / 3, 4 * P, 5 * P, 6 * P, nearest.len()] {
            if growth.take(count.min(nearest.len()), unit, support, nearest, scratch).is_none() {
                break;
            }
        }
        self.quadric = growth.quadric();
        self.turn();
        let kept = growth.keep(nearest, &mut scratch.arms);
        (self.n_used, self.radius) = (kept, nearest[kept - 1].squared_distance.sqrt());
    }

    /// Computes the terms and heights of the points in the frame, in units of the radius.
    pub(super) fn look(&self, support: &Support, nearest: &[Neighbour], scratch: &mut Scratch) {
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

    /// Adds the moments of the points of a mean to the products of its coordinates.
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

    /// Largest absolute curvature times radius.
    pub(super) fn bend(&self) -> f64 {
        largest_curvature::<D, P>(&self.quadric)
    }

    /// Second derivatives as a matrix, in the upper left part.
    pub(super) fn hessian(&self) -> [[f64; D]; D] {
        super::quadric::hessian(&self.quadric)
    }

    /// Turns the frame so that its tangents span the tangent plane of the quadric at the query.
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

/// Moves the points of a sheet to the front. Both parts stay ascending by distance.
fn bring_forward<const D: usize>(sheet: &Sheet<D>, nearest: &mut [Neighbour], arms: &mut [f64]) {
    let is_of_sheet = |arm: &[f64; D]| dot(arm, &sheet.normal).abs() <= sheet.reach;
    let mut order: Vec<(bool, Neighbour, [f64; D])> = nearest
        .iter()
        .zip(arms.as_chunks::<D>().0)
        .map(|(found, arm)| (!is_of_sheet(arm), *found, *arm))
        .collect();
    // The sort is stable, so the order by distance stays.
    order.sort_by_key(|(is_of_other, ..)| *is_of_other);
    for ((slot, place), (_, found, arm)) in nearest.iter_mut().zip(arms.as_chunks_mut::<D>().0).zip(&order) {
        (*slot, *place) = (*found, *arm);
    }
}
