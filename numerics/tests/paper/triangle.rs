//! Figure "Reconstruction of a triangle from 48 sample points": Gauss and Laplace ε = 1e-5, α = 0.
//!
//! The triangle is equilateral with vertices on the unit circle, 16 points per edge, vertices included.
//! Normals are compared with those of the edges at the 45 points that are no vertices. The level line is
//! compared half way between neighbouring points. According to the paper, Gauss has useful normals but
//! "complicated level lines", and Laplace takes the abrupt turns.

use std::f64::consts::TAU;

use super::curves::{Station, angles_on_curve, crossings, lengths, points, rays_crossed_once};
use super::errors::{largest, median};
use super::support::{Family, GAUSS, Surface};
use super::table::{Paper, Row, Table};

/// The table of both halves of the figure.
pub fn table() -> Table {
    Table {
        title: "Triangle, 48 points, alpha = 0: normals at the points, level 1 half way between, rays it crosses once",
        columns: vec!["angle/deg, median", "angle/deg, worst", "distance, worst", "rays of 360"],
        rows: vec![
            Row::of("Gauss", Paper::Figure, &facts(GAUSS)),
            Row::of("Laplace eps = 1e-5", Paper::Figure, &facts(Family::Laplace { epsilon: 1e-5 })),
        ],
    }
}

fn facts(family: Family) -> [f64; 4] {
    let stations = |shift: f64| (0..48).map(move |i| triangle((f64::from(i) + shift) / 16.0));
    let (sample, between): (Vec<Station>, Vec<Station>) = (stations(0.0).collect(), stations(0.5).collect());
    let inner: Vec<Station> = (0..48).filter(|i| i % 16 != 0).map(|i| sample[i]).collect();
    let surface = Surface::of(&points(&sample), family, 0.0);
    let angles = angles_on_curve(&surface, &inner);
    let distances = lengths(&crossings(&surface, &between, 1.0, 0.2));
    let rays = rays_crossed_once(&surface, 1.5) as f64;
    [median(angles.clone()), largest(&angles), largest(&distances), rays]
}

/// The point at a parameter in [0, 3), one unit per edge, with the normal of its edge.
fn triangle(s: f64) -> Station {
    let vertex = |i: f64| [(TAU * i / 3.0).cos(), (TAU * i / 3.0).sin()];
    let (edge, along) = (s.floor(), s.fract());
    let (a, b) = (vertex(edge), vertex(edge + 1.0));
    let point = [0, 1].map(|c| (1.0 - along) * a[c] + along * b[c]);
    Station::new(point, [b[1] - a[1], a[0] - b[0]])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Edges are analytic, so Gauss is right on them up to the rounding of an ill-conditioned fit. But its
    /// level 1 contains the extensions of the edges beyond the vertices, and rays cross these a second time.
    #[test]
    fn gauss_has_useful_normals_and_complicated_level_lines() {
        let table = table();
        println!("{table}");
        let [median, worst, distance, rays] = table.row("Gauss").ours()[..] else { unreachable!() };
        assert!(median < 1e-4 && worst < 1e-2 && distance < 1e-5);
        assert!(rays < 330.0, "{rays}");
    }

    /// Level 1 sags between the points by at most 5 % of their distance, 0.108. Next to the
    /// vertices this tilts the normals.
    #[test]
    fn laplace_takes_the_turns_with_one_simple_curve() {
        let table = table();
        let [median, worst, distance, rays] = table.row("Laplace eps = 1e-5").ours()[..] else {
            unreachable!()
        };
        assert!(median < 0.5 && worst < 3.0, "{median} {worst}");
        assert!(distance < 0.05 * 0.108, "{distance}");
        assert_eq!(rays, 360.0);
    }
}
