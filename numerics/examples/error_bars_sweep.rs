//! Prints the table of docs/error-bars.md on normals and curvatures: shares of true
//! values within the error bars.
//!
//! `cargo run --release --example error_bars_sweep [points per row]`, 10,000 by
//! default. It takes about an hour of one core.

#[path = "../tests/error_bars/carved.rs"]
mod carved;
#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/error_bars/jet.rs"]
mod jet;
#[path = "../tests/error_bars/sampling.rs"]
mod sampling;
#[path = "../tests/error_bars/shapes.rs"]
mod shapes;
#[path = "../tests/error_bars/sweep.rs"]
mod sweep;

use carved::{Comparison, carved};
use rayon::prelude::*;
use sampling::SAMPLINGS;
use shapes::{HELD_OUT, SHAPES, Shape};
use sweep::{Case, NOISES, Row, quantile};

const SIZES: [usize; 4] = [300, 1000, 4000, 10_000];

/// Column heads. Numbers are per cent, except the two medians. "error" is that of the larger error of a
/// principal curvature over the larger curvature, "angle" that of the angles of the normals.
const HEADER: &str = "\
| shape | sampling | n | noise | normal | mean | κ₁ | κ₂ | error | angle | flagged | off by half | |
|---|---|---|---|---|---|---|---|---|---|---|---|---|";

/// Noise of carved spheres, in spacings, and the heads of their table.
const NOISES_OF_CARVED: [f64; 3] = [0.1, 0.3, 0.5];
const CARVED: &str = "\
| noise, spacings | learned | normals, median | best plane fit | covered |
|---|---|---|---|---|";

fn main() {
    let n_wanted: usize = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(10_000);
    let run = |shapes: &[Shape]| -> Vec<(Case, Row)> {
        cases(shapes).into_par_iter().map(|case| (case, case.run(n_wanted.div_ceil(case.n_points)))).collect()
    };
    let (rows, held_out) = (run(&SHAPES), run(&HELD_OUT));
    println!("{HEADER}");
    rows.iter().chain(&held_out).for_each(|(case, row)| print_row(case, row));
    println!();
    for noise in NOISES {
        let percent = 100.0 * noise;
        println!("Noise {percent} %: {}", summary(&rows, |case| case.noise == noise));
    }
    for size in SIZES {
        println!("{size} points: {}", summary(&rows, |case| case.n_points == size));
    }
    println!("All: {}", summary(&rows, |_| true));
    println!("Shapes held out: {}", summary(&held_out, |_| true));
    println!("\n{CARVED}");
    NOISES_OF_CARVED.into_iter().for_each(print_carved);
}

fn cases(shapes: &[Shape]) -> Vec<Case> {
    let mut cases = Vec::new();
    for n_points in SIZES {
        for &shape in shapes {
            for sampling in SAMPLINGS {
                cases.extend(NOISES.map(|noise| Case { shape, sampling, n_points, noise }));
            }
        }
    }
    cases
}

fn summary(rows: &[(Case, Row)], keep: impl Fn(&Case) -> bool) -> String {
    let kept: Vec<&(Case, Row)> = rows.iter().filter(|(case, _)| keep(case)).collect();
    let n_held = kept.iter().filter(|(case, row)| row.holds(case.noise)).count();
    let n_unflagged: usize = kept.iter().map(|(_, row)| row.n_unflagged()).sum();
    let n_off: usize = kept.iter().map(|(_, row)| row.n_off).sum();
    let share = 100.0 * n_off as f64 / n_unflagged as f64;
    let n = kept.len();
    format!("{n_held} of {n} rows hold; of {n_unflagged} without a flag {share:.2} % are off by half.")
}

fn print_row(case: &Case, row: &Row) {
    let [normal, mean, first, second] = row.coverages();
    println!(
        "| {:?} | {:?} | {} | {} | {normal:.1} | {mean:.1} | {first:.1} | {second:.1} | {:.1e} | {:.2}° | {:.1} | {:.2} | {} |",
        case.shape,
        case.sampling,
        case.n_points,
        100.0 * case.noise,
        quantile(&row.errors, 0.5),
        quantile(&row.angles, 0.5).to_degrees(),
        row.flagged(),
        row.off(),
        if row.holds(case.noise) { "" } else { "†" }
    );
}

fn print_carved(spacings: f64) {
    let Comparison { noise, median, plane, covered } = carved(spacings);
    let [median, plane] = [median, plane].map(f64::to_degrees);
    println!("| {spacings} | {:.2} | {median:.2}° | {plane:.2}° | {covered:.0} % |", noise * spacings);
}
