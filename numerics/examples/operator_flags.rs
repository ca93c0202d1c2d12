//! Prints a table of docs/error-bars.md: answers of operators on values that are off by half without a flag,
//! for every kernel and for the defaults.
//!
//! `cargo run --release --example operator_flags [clouds per case] [sizes of clouds]`, by default 2 clouds of
//! 300 and of 1,000 points. It takes some minutes.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/values/fields.rs"]
mod fields;
#[path = "../tests/values/flags.rs"]
mod flags;
#[path = "../tests/error_bars/jet.rs"]
mod jet;
#[path = "../tests/error_bars/sampling.rs"]
mod sampling;
#[path = "../tests/error_bars/shapes.rs"]
mod shapes;
#[path = "../tests/values/sweep.rs"]
mod sweep;

use common::kernels::all_families;
use fields::FIELDS;
use flags::{Counts, KernelChoice, Values};
use rayon::prelude::*;
use shapes::Shape;
use sweep::NOISES;

const SHAPES: [Shape; 5] = [Shape::Sphere, Shape::Torus, Shape::Ellipsoid, Shape::Cyclide, Shape::Wave];

fn main() {
    let arguments: Vec<usize> = std::env::args().skip(1).filter_map(|n| n.parse().ok()).collect();
    let n_clouds = arguments.first().copied().unwrap_or(2);
    let sizes = if arguments.len() > 1 { arguments[1..].to_vec() } else { vec![300, 1000] };
    let mut asked = vec![KernelChoice::Nothing];
    for family in all_families().into_iter().filter(|family| !family.has_kink()) {
        asked.push(KernelChoice::Family(family));
        asked.extend([0.3, 3.0].map(|factor| KernelChoice::Width(family, factor)));
    }
    println!("Per cent without a flag, and of these off by half: surface gradient; Laplace–Beltrami.\n");
    let of_noises: Vec<String> = NOISES.iter().map(|noise| format!("noise {} %", 100.0 * noise)).collect();
    println!("| kernel | {} | refused |", of_noises.join(" | "));
    println!("|---|{}---|", "---|".repeat(NOISES.len()));
    let of_noise = |noise: f64| {
        let mut values = Vec::new();
        for &n_points in &sizes {
            for shape in SHAPES {
                values.extend(FIELDS.map(|field| Values { shape, field, n_points, noise }));
            }
        }
        let counts: Vec<Vec<Counts>> = values.par_iter().map(|values| values.run(&asked, n_clouds)).collect();
        let sum = |at: usize| counts.iter().map(|of| &of[at]).fold(Counts::default(), Counts::plus);
        (0..asked.len()).map(sum).collect::<Vec<_>>()
    };
    let counts = NOISES.map(of_noise);
    for (at, asked) in asked.iter().enumerate() {
        let cells: Vec<String> = counts.iter().map(|of_noise| cell(&of_noise[at])).collect();
        let n_refused: usize = counts.iter().map(|of_noise| of_noise[at].n_refused).sum();
        println!("| {asked:?} | {} | {n_refused} |", cells.join(" | "));
    }
    let all = counts.map(|of_noise| of_noise.iter().fold(Counts::default(), Counts::plus));
    println!("| all | {} | |", all.map(|counts| cell(&counts)).join(" | "));
}

fn cell(counts: &Counts) -> String {
    let of = |operator: usize| {
        let unflagged = 100.0 * counts.n_unflagged[operator] as f64 / counts.n[operator].max(1) as f64;
        let off = 100.0 * counts.n_off[operator] as f64 / counts.n_unflagged[operator].max(1) as f64;
        format!("{unflagged:.0}, {off:.2}")
    };
    format!("{}; {}", of(0), of(1))
}
