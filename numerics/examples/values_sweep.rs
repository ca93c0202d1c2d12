//! Prints a table of docs/error-bars.md: coverage of the error bars of fields, their
//! derivatives and operators.
//!
//! `cargo run --release --example values_sweep [clouds per row] [sizes of clouds]`, by default 6 clouds of
//! 300, of 1,000 and of 4,000 points. It takes some minutes.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/values/fields.rs"]
mod fields;
#[path = "../tests/error_bars/jet.rs"]
mod jet;
#[path = "../tests/error_bars/sampling.rs"]
mod sampling;
#[path = "../tests/error_bars/shapes.rs"]
mod shapes;
#[path = "../tests/values/sweep.rs"]
mod sweep;

use fields::FIELDS;
use rayon::prelude::*;
use sampling::Sampling;
use shapes::Shape;
use sweep::{Case, NOISES, QUANTITIES, Row};

const SHAPES: [Shape; 5] = [Shape::Sphere, Shape::Torus, Shape::Ellipsoid, Shape::Cyclide, Shape::Wave];

/// Column heads. Cells have the percentage covered and the root mean square error, by quantity.
const HEADER: &str = "\
| shape | field | n | noise | value | gradient | Hessian | surface gradient | Laplace–Beltrami | kernels | |
|---|---|---|---|---|---|---|---|---|---|---|";

fn main() {
    let arguments: Vec<usize> = std::env::args().skip(1).filter_map(|n| n.parse().ok()).collect();
    let n_clouds = arguments.first().copied().unwrap_or(6);
    let sizes = if arguments.len() > 1 { arguments[1..].to_vec() } else { vec![300, 1000, 4000] };
    let mut cases = Vec::new();
    for n_points in sizes {
        for shape in SHAPES {
            for field in FIELDS {
                cases.extend(NOISES.map(|noise| Case {
                    shape,
                    sampling: Sampling::Random,
                    field,
                    n_points,
                    noise,
                }));
            }
        }
    }
    let rows: Vec<(Case, Row)> = cases.into_par_iter().map(|case| (case, case.run(n_clouds))).collect();
    println!("{HEADER}");
    rows.iter().for_each(|(case, row)| print_row(case, row));
    println!();
    for noise in NOISES {
        println!("Noise {} %: {}", 100.0 * noise, summary(&rows, |case| case.noise == noise));
    }
    println!("All: {}", summary(&rows, |_| true));
}

fn print_row(case: &Case, row: &Row) {
    let (coverages, errors) = (row.coverages(), row.errors());
    let cells: Vec<String> =
        coverages.iter().zip(errors).map(|(coverage, error)| format!("{coverage:.1} {error:.0e}")).collect();
    let mut kernels: Vec<String> = row
        .learned
        .iter()
        .map(|learned| {
            format!("{:?} {:.2} {:.1}", learned.family, learned.length_scale, learned.ratio.log10())
        })
        .collect();
    kernels.truncate(2);
    println!(
        "| {:?} | {:?} | {} | {} | {} | {} | {} |",
        case.shape,
        case.field,
        case.n_points,
        100.0 * case.noise,
        cells.join(" | "),
        kernels.join(", "),
        if row.holds(case.noise) { "" } else { "!" },
    );
}

fn summary(rows: &[(Case, Row)], keep: impl Fn(&Case) -> bool) -> String {
    let kept: Vec<&(Case, Row)> = rows.iter().filter(|(case, _)| keep(case)).collect();
    let n_held = kept.iter().filter(|(case, row)| row.holds(case.noise)).count();
    let off: Vec<String> = (0..QUANTITIES.len())
        .map(|quantity| {
            let n_off: usize = kept.iter().map(|(_, row)| row.n_off[quantity]).sum();
            let n: usize = kept.iter().map(|(_, row)| row.n_unflagged[quantity]).sum();
            format!("{} {:.2} % of {n}", QUANTITIES[quantity], 100.0 * n_off as f64 / n.max(1) as f64)
        })
        .collect();
    format!("{n_held} of {} rows hold; off by half without a flag: {}.", kept.len(), off.join(", "))
}
