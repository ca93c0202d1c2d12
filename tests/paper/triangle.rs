//! Figure "Reconstruction of a triangle from 48 sample points": Gauss and Laplace ε = 1e-5, α = 0.
//!
//! Equilateral, vertices on the unit circle, 16 points per edge, the vertices among them. Normals are compared with those of the
//! edges at the 45 points that are no vertices, the level line half way between neighbouring points.

use std::f64::consts::TAU;

use super::curves::{Station, angles_on_curve, crossings, lengths, points};
use super::errors::{largest, median};
use super::support::{Family, GAUSS, Surface};
use super::table::Table;

/// Both halves of the figure.
pub fn table() -> Table {
    let title = "Triangle, 48 points, alpha = 0";
    let laplace = facts(Family::Laplace { epsilon: 1e-5 });
    let gauss = facts(GAUSS);
    Table::of_figure(
        title,
        &[
            ("Gauss: median angle of the normals at the points, deg", gauss[0]),
            ("Gauss: worst angle of the normals at the points, deg", gauss[1]),
            ("Gauss: largest distance of level 1, half way between them", gauss[2]),
            ("Laplace: median angle of the normals at the points, deg", laplace[0]),
            ("Laplace: worst angle of the normals at the points, deg", laplace[1]),
            ("Laplace: largest distance of level 1, half way between them", laplace[2]),
        ],
    )
}

fn facts(family: Family) -> [f64; 3] {
    let sample: Vec<Station> = (0..48).map(|i| triangle(f64::from(i) / 16.0)).collect();
    let inner: Vec<Station> = (0..48).filter(|i| i % 16 != 0).map(|i| sample[i]).collect();
    let between: Vec<Station> = (0..48).map(|i| triangle((f64::from(i) + 0.5) / 16.0)).collect();
    let surface = Surface::of(&points(&sample), family, 0.0);
    let angles = angles_on_curve(&surface, &inner);
    let distances = lengths(&crossings(&surface, &between, 1.0, 0.2));
    println!("{angles:?} {distances:?}");
    [median(angles.clone()), largest(&angles), largest(&distances)]
}

/// The point at a parameter in [0, 3), one per edge, with the normal of its edge.
fn triangle(s: f64) -> Station {
    let vertex = |i: f64| [(TAU * i / 3.0).cos(), (TAU * i / 3.0).sin()];
    let (edge, along) = (s.floor(), s.fract());
    let (a, b) = (vertex(edge), vertex(edge + 1.0));
    let point = [0, 1].map(|c| (1.0 - along) * a[c] + along * b[c]);
    Station::new(point, [b[1] - a[1], a[0] - b[0]])
}
