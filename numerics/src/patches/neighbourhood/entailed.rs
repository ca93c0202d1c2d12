//! The entailed height: the part of a surface's height beyond second order that follows from its curvature.
//!
//! If the shape operator S stays the same along the surface, the height is `z = II(t,t)/(1 + √(1 − |St|²))`.
//! II is the second fundamental form. The formula is exact on spheres, cylinders and planes. Its part of
//! second order is `½ II(t,t)`. The rest is the entailed height.

use super::grown::GrowingNeighbourhood;
use super::quadric::{add_products, backward, factorize, forward, second_derivatives};
use super::{Scratch, Support};
use crate::points::neighbours::Neighbour;

/// Greatest |St|² at which the closed form is evaluated. Larger values are clamped to it. The form ends at 1.
const MAX_TURN: f64 = 0.8;

/// Number of rounds in which the curvature and the entailed height are made to agree.
const ROUNDS: usize = 3;

impl<const D: usize, const P: usize> GrowingNeighbourhood<D, P> {
    /// Subtracts the entailed height from the heights.
    ///
    /// The entailed height depends on the curvature, and the curvature is fitted to what is left. So the two
    /// are computed in turn.
    pub(super) fn entail(
        &mut self,
        support: &Support,
        nearest: &[Neighbour],
        scratch: &mut Scratch,
    ) -> Option<()> {
        self.look(support, nearest, scratch);
        std::mem::swap(&mut scratch.raw, &mut scratch.heights);
        scratch.heights.clone_from(&scratch.raw);
        // Every mean counts once: the fit is not to average noise but to show what a quadric lacks.
        let mut matrix = [[0.0; P]; P];
        scratch.terms.as_chunks::<P>().0.iter().for_each(|terms| add_products(&mut matrix, terms, 1.0));
        factorize(&mut matrix)?;
        self.refit(&matrix, scratch);
        for round in 0..=ROUNDS {
            self.take_off(scratch, support.has_moments());
            if round < ROUNDS {
                self.refit(&matrix, scratch);
            }
        }
        Some(())
    }

    fn take_off(&self, scratch: &mut Scratch, has_moments: bool) {
        let bend = self.bend().max(1.0);
        let mut shape = self.hessian();
        shape.as_flattened_mut().iter_mut().for_each(|h| *h /= bend);
        let terms = scratch.terms.as_chunks::<P>().0;
        for ((height, raw), terms) in scratch.heights.iter_mut().zip(&scratch.raw).zip(terms) {
            let beyond =
                if has_moments { averaged(&shape, terms) } else { beyond_second_order(&shape, terms) };
            *height = raw - beyond;
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
}

/// Entailed height at a point: `f/(1 + √(1 − u)) − f/2` for f = tᵀSt and u = |St|².
#[inline(always)]
fn beyond_second_order<const D: usize, const P: usize>(shape: &[[f64; D]; D], terms: &[f64; P]) -> f64 {
    let (t, turned) = (&terms[1..D], turn(shape, &terms[1..D]));
    let form: f64 = t.iter().zip(&turned).map(|(t, s)| t * s).sum();
    let root = (1.0 - turned.iter().map(|s| s * s).sum::<f64>().min(MAX_TURN)).sqrt();
    0.5 * form * (1.0 - root) / (1.0 + root)
}

/// Mean of [`beyond_second_order`] over the points of a mean: exact in f, to first order in their moments in
/// the rest.
fn averaged<const D: usize, const P: usize>(shape: &[[f64; D]; D], terms: &[f64; P]) -> f64 {
    let t = &terms[1..D];
    let turned = turn(shape, t);
    let twice = turn(shape, &turned[..D - 1]);
    let mut form: f64 = t.iter().zip(&turned).map(|(t, s)| t * s).sum();
    let mut turn: f64 = turned.iter().map(|s| s * s).sum();
    let mut mixed = 0.0;
    for (next, (a, b)) in second_derivatives(D - 1).enumerate() {
        // Moments about the mean, in units of the radius. An entry off the diagonal stands for two.
        let product = terms[D + next] * if a == b { 2.0 } else { 1.0 };
        let moment = (product - t[a] * t[b]) * if a == b { 1.0 } else { 2.0 };
        form += moment * shape[a][b];
        turn += moment * (0..D - 1).map(|c| shape[a][c] * shape[c][b]).sum::<f64>();
        mixed += moment * 0.5 * (turned[a] * twice[b] + turned[b] * twice[a]);
    }
    let root = (1.0 - turn.min(MAX_TURN)).sqrt();
    let share = (1.0 - root) / (1.0 + root);
    let slope = 1.0 / (root * (1.0 + root).powi(2));
    0.5 * form * share + 2.0 * slope * mixed
}

/// The product St.
#[inline(always)]
fn turn<const D: usize>(shape: &[[f64; D]; D], t: &[f64]) -> [f64; D] {
    let mut product = [0.0; D];
    for (slot, row) in product.iter_mut().zip(&shape[..D - 1]) {
        *slot = row[..D - 1].iter().zip(t).map(|(s, x)| s * x).sum();
    }
    product
}
