//! Table "Gauss curvature error for an ellipsoid": axes 2, ½, 1, Fibonacci points, Laplace ε = 1, α = 0.
//!
//! Errors are taken at 32 random points, uniform on the sphere and then stretched, and averaged over
//! 20 draws. The paper does not define its relative error, so both `max|K − K*|/max|K*|` and the mean
//! of `|K − K*|/K*` are shown.

use super::common::clouds::{fibonacci_sphere, stretched};
use super::errors::{mean, means, relative_max};
use super::shapes::directions;
use super::support::{Cloud, LAPLACE, Orientation, Surface};
use super::table::{Row, Table};

const AXES: [f64; 3] = [2.0, 0.5, 1.0];
const PAPER: [(usize, f64); 5] =
    [(64, 2.428e-1), (128, 8.408e-2), (256, 1.186e-2), (512, 5.439e-4), (1024, 4.995e-5)];

/// The table for m = 64 … 1,024.
pub fn table() -> Table {
    let row = |&(m, paper): &(usize, f64)| Row::beside(format!("m = {m}"), &[paper; 2], &errors(m));
    Table {
        title: "Ellipsoid (2, 1/2, 1), Laplace eps = 1, alpha = 0: error of the Gauss curvature, mean of 20 draws",
        columns: vec!["max / max", "mean relative"],
        rows: PAPER.iter().map(row).collect(),
    }
}

fn errors(m: usize) -> [f64; 2] {
    let surface = Surface::of(&stretched(&fibonacci_sphere(m), &AXES), LAPLACE, 0.0);
    means(&(0..20).map(|seed| errors_at(&surface, seed)).collect::<Vec<_>>())
}

fn errors_at(surface: &Surface, seed: u64) -> [f64; 2] {
    let queries = stretched(&directions(32, 500 + seed), &AXES);
    let gauss = |k: Option<Vec<f64>>| k.map_or(f64::NAN, |k| k[0] * k[1]);
    let found: Vec<f64> = surface.curvatures(&queries, Orientation::Outward).into_iter().map(gauss).collect();
    let exact = exact(&queries);
    let relative: Vec<f64> = found.iter().zip(&exact).map(|(a, b)| (a / b - 1.0).abs()).collect();
    [relative_max(&found, &exact), mean(&relative)]
}

/// Exact Gaussian curvatures of the ellipsoid, `K = 1/(a²b²c² (x₁²/a⁴ + x₂²/b⁴ + x₃²/c⁴)²)`.
fn exact(points: &Cloud) -> Vec<f64> {
    let product: f64 = AXES.iter().map(|a| a * a).product();
    let sum = |x: &[f64]| x.iter().zip(AXES).map(|(x, a)| x * x / a.powi(4)).sum::<f64>();
    points.points().map(|x| 1.0 / (product * sum(x).powi(2))).collect()
}

#[test]
fn from_256_points_on_errors_are_the_papers_or_smaller() {
    let table = table();
    println!("{table}");
    super::bounds::assert_errors_are_the_papers_or_smaller(&table.rows[2..]);
}
