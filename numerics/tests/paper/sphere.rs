//! Table "Average relative L∞-error": f, ∇f and Δf on the unit sphere, Laplace ε = 1, α = 0.
//!
//! `f(x) = sin(π(1+2x₃))` on Fibonacci points. Each entry is the largest error at 32 random
//! points over the largest exact value there, averaged over 20 draws of these points. Errors and
//! values of a vector are lengths.

use std::f64::consts::PI;

use super::common::clouds::fibonacci_sphere;
use super::errors::{largest, means, norm, relative_max};
use super::shapes::directions;
use super::support::{Cloud, LAPLACE, Surface};
use super::table::{Row, Table};

const PAPER: [(usize, [f64; 3]); 4] = [
    (64, [3.811e-2, 3.857e-1, 5.673e-1]),
    (128, [8.538e-4, 1.579e-1, 1.654e-2]),
    (256, [2.623e-6, 4.271e-5, 3.136e-5]),
    (512, [1.117e-9, 2.971e-8, 1.268e-8]),
];
const DRAWS: u64 = 20;

/// The table for m = 64 … 512.
pub fn table() -> Table {
    let row = |&(m, paper): &(usize, [f64; 3])| Row::beside(format!("m = {m}"), &paper, &errors(m));
    Table {
        title: "Sphere, Laplace eps = 1, alpha = 0: relative error, mean of 20 draws of 32 points",
        columns: vec!["f", "surface gradient", "Laplace-Beltrami"],
        rows: PAPER.iter().map(row).collect(),
    }
}

fn errors(m: usize) -> [f64; 3] {
    let surface = Surface::of(&fibonacci_sphere(m), LAPLACE, 0.0);
    means(&(0..DRAWS).map(|seed| errors_at(&surface, &directions(32, seed))).collect::<Vec<_>>())
}

fn errors_at(surface: &Surface, queries: &Cloud) -> [f64; 3] {
    let f = surface.function(&at(surface.cloud(), value));
    let (gradients, laplacians) = f.surface_derivatives(queries);
    let exact: Vec<f64> = queries.points().flat_map(gradient).collect();
    let lengths = |rows: &[f64]| rows.chunks(3).map(norm).collect::<Vec<f64>>();
    let difference: Vec<f64> = gradients.iter().zip(&exact).map(|(a, b)| a - b).collect();
    [
        relative_max(&f.values(queries), &at(queries, value)),
        largest(&lengths(&difference)) / largest(&lengths(&exact)),
        relative_max(&laplacians, &at(queries, laplacian)),
    ]
}

/// Values of a function at every point.
pub fn at(points: &Cloud, f: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    points.points().map(f).collect()
}

/// The paper's test function.
pub fn value(x: &[f64]) -> f64 {
    (PI * (1.0 + 2.0 * x[2])).sin()
}

/// The surface gradient of the test function. The printed formula is wrong (errata.md, 4).
fn gradient(x: &[f64]) -> [f64; 3] {
    let slope = 2.0 * PI * (PI * (1.0 + 2.0 * x[2])).cos();
    [-x[0] * x[2], -x[1] * x[2], 1.0 - x[2] * x[2]].map(|c| slope * c)
}

/// The Laplace–Beltrami of the test function. The printed formula is wrong (errata.md, 4).
pub fn laplacian(x: &[f64]) -> f64 {
    let (sin, cos) = (PI * (1.0 + 2.0 * x[2])).sin_cos();
    4.0 * PI * PI * (x[2] * x[2] - 1.0) * sin - 4.0 * PI * x[2] * cos
}

#[test]
fn from_256_points_on_errors_are_the_papers_or_smaller() {
    let table = table();
    println!("{table}");
    super::bounds::assert_errors_are_the_papers_or_smaller(&table.rows[2..]);
}
