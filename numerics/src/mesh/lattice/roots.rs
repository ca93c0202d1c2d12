//! Vertices of the mesh: where edges of the lattice cross the level.

use rayon::prelude::*;

use super::follow::{SurfaceCells, is_inside};
use super::nodes::{Corner, Edge, Lattice};
use crate::error::Result;
use crate::machine::small::Small;
use crate::mesh::field::Field;
use crate::observer::Observer;

/// Rounds of the Illinois method (Dowell and Jarratt 1971), after which an interval is halved instead.
const ILLINOIS_ROUNDS: usize = 8;

/// Rounds in all. Where f jumps, halving leaves the place of the jump to a part 1e-4 of the edge.
const MAX_ROUNDS: usize = ILLINOIS_ROUNDS + 14;

/// The edges of a lattice that the surface crosses.
pub struct Crossings<'a> {
    lattice: &'a Lattice,
    followed: &'a SurfaceCells,
    /// Edges of simplices whose ends differ in sign, sorted.
    pub edges: Vec<Edge>,
}

impl<'a> Crossings<'a> {
    pub fn of(followed: &'a SurfaceCells, lattice: &'a Lattice) -> Self {
        Self { lattice, followed, edges: crossed_edges(followed, lattice) }
    }

    /// Finds the place on each edge where f is 0, `[edges, d]`. Where f jumps over 0, it is the place of the
    /// jump.
    ///
    /// `precision` is the part of the difference of f along an edge up to which a place counts as found.
    ///
    /// # Errors
    /// Those of the field.
    pub fn roots(&self, field: &dyn Field, precision: f64, observer: &dyn Observer) -> Result<Vec<f64>> {
        let Self { lattice, followed, edges } = self;
        let bracket = |(edge, ends): (usize, &Edge)| {
            let [f_low, f_high] = ends.ends().map(|node| followed.samples.value(node));
            let tolerance = field.tolerance().max(precision * (f_low - f_high).abs());
            Bracket { edge, low: 0.0, high: 1.0, f_low, f_high, tolerance }
        };
        let mut open: Vec<Bracket> = edges.par_iter().enumerate().map(bracket).collect();
        let mut roots = vec![0.0; edges.len()];
        for round in 0..MAX_ROUNDS {
            if open.is_empty() {
                break;
            }
            observer.checkpoint()?;
            let guesses: Vec<f64> = open.iter().map(|bracket| bracket.guess(round)).collect();
            let on_edges = open.par_iter().zip(&guesses);
            let places: Vec<f64> =
                on_edges.flat_map_iter(|(bracket, &t)| along(lattice, edges[bracket.edge], t)).collect();
            let values = field.values(&places, observer)?;
            for (bracket, (&t, &f)) in open.iter_mut().zip(guesses.iter().zip(&values)) {
                roots[bracket.edge] = t;
                bracket.narrow(t, f);
            }
            let mut magnitudes = values.iter().map(|f| f.abs());
            open.retain(|bracket| magnitudes.next().is_some_and(|f| f > bracket.tolerance));
        }
        Ok(edges.par_iter().zip(roots).flat_map_iter(|(&edge, t)| along(lattice, edge, t)).collect())
    }
}

fn crossed_edges(followed: &SurfaceCells, lattice: &Lattice) -> Vec<Edge> {
    let n_corners = 1 << lattice.dimension();
    let pairs = nested_corners(n_corners);
    let of_cell = |cell: &_| {
        let values = followed.samples.corners(*cell, n_corners);
        let is_crossed =
            move |&&(from, to): &&(Corner, Corner)| is_inside(values[from]) != is_inside(values[to]);
        let edges = pairs.iter().filter(is_crossed).map(|&(from, to)| Edge::of(*cell, from, to));
        edges.collect::<Vec<Edge>>()
    };
    let mut edges: Vec<Edge> = followed.cells.par_iter().flat_map_iter(of_cell).collect();
    edges.par_sort_unstable();
    edges.dedup();
    edges
}

/// Pairs of corners that an edge of a simplex joins: one contains the other.
fn nested_corners(n_corners: usize) -> Vec<(Corner, Corner)> {
    let pairs = (0..n_corners).flat_map(|to| (0..to).map(move |from| (from, to)));
    pairs.filter(|(from, to)| from & to == *from).collect()
}

/// A part of an edge whose ends differ in sign.
#[derive(Clone, Copy)]
struct Bracket {
    edge: usize,
    /// Ends in parts of the edge.
    low: f64,
    high: f64,
    /// f at the ends. The Illinois method halves one that stays.
    f_low: f64,
    f_high: f64,
    /// Magnitude of f up to which the place is found.
    tolerance: f64,
}

impl Bracket {
    fn guess(&self, round: usize) -> f64 {
        let middle = 0.5 * (self.low + self.high);
        if round >= ILLINOIS_ROUNDS {
            return middle;
        }
        let t = (self.low * self.f_high - self.high * self.f_low) / (self.f_high - self.f_low);
        // NaN and values outside, from infinite f or rounding, are replaced.
        if t > self.low && t < self.high { t } else { middle }
    }

    /// Replaces the end of the sign of f by t.
    fn narrow(&mut self, t: f64, f: f64) {
        if is_inside(f) == is_inside(self.f_low) {
            (self.low, self.f_low) = (t, f);
            self.f_high *= 0.5;
        } else {
            (self.high, self.f_high) = (t, f);
            self.f_low *= 0.5;
        }
    }
}

/// The place a part t of the way along an edge.
fn along(lattice: &Lattice, edge: Edge, t: f64) -> Small {
    let [first, last] = edge.ends().map(|node| lattice.position(node));
    first.iter().zip(&last).map(|(a, b)| a + t * (b - a)).collect()
}
