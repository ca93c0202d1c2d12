//! Prints a table of docs/error-bars.md: coverage of error bars and errors without a flag, for operators on
//! values that are kriged around each query.
//!
//! `cargo run --release --example kriged_sweep [points per cloud …]`, 2,000 and 25,000 by
//! default. It takes some minutes.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/values/fields.rs"]
#[allow(dead_code, reason = "other sweeps have more fields")]
mod fields;
#[path = "../tests/error_bars/jet.rs"]
mod jet;
#[path = "../tests/values/kriged.rs"]
mod kriged;
#[path = "../tests/error_bars/sampling.rs"]
mod sampling;
#[path = "../tests/error_bars/shapes.rs"]
mod shapes;
#[path = "../tests/values/sweep.rs"]
mod sweep;

use std::time::Instant;

use fields::Field;
use kriged::{Case, Outcome};
use shapes::Shape;

const SHAPES: [Shape; 4] = [Shape::Sphere, Shape::Torus, Shape::Ellipsoid, Shape::Wave];
const FIELDS: [Field; 3] = [Field::Low, Field::Mid, Field::High];
const NOISES: [f64; 5] = [0.0, 0.0002, 0.003, 0.02, 0.05];

fn main() {
    let mut sizes: Vec<usize> = std::env::args().skip(1).filter_map(|n| n.parse().ok()).collect();
    if sizes.is_empty() {
        sizes = vec![2000, 25_000];
    }
    println!("Covered, flagged, off among the others, median error over the largest; per cent.\n");
    println!("| shape | field | n | noise | surface gradient | Laplace–Beltrami | kernel | s |");
    println!("|---|---|---|---|---|---|---|---|");
    for n_points in sizes {
        for shape in SHAPES {
            for field in FIELDS {
                for noise in NOISES {
                    let begun = Instant::now();
                    let ([gradient, operator], learned) = Case { shape, field, n_points, noise }.run(0);
                    println!(
                        "| {shape:?} | {field:?} | {n_points} | {} % | {} | {} | {:?} {:.2} {:.1} | {:.1} |",
                        100.0 * noise,
                        cell(&gradient),
                        cell(&operator),
                        learned.family,
                        learned.length_scale,
                        learned.ratio.log10(),
                        begun.elapsed().as_secs_f64(),
                    );
                }
            }
        }
    }
}

fn cell(outcome: &Outcome) -> String {
    let Outcome { coverage, flagged, off, error } = outcome;
    format!("{coverage:.1}, {flagged:.1}, {off:.2}, {error:.2}")
}
