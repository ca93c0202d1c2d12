//! Prints a table of docs/error-bars.md: coverage of posterior bands with default parameters, for fields that
//! are local, rough, in many dimensions, or drowned in noise.
//!
//! `cargo run --release --example features_sweep [seeds] [only] [full]`.
//!
//! 10 seeds by default. `only` is a part of the names of rows. `full` adds a comparison with the likelihood
//! of all values where there are at most 1,000. It takes some minutes.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/values/features.rs"]
mod features;
#[path = "../tests/values/fields.rs"]
#[allow(dead_code, reason = "the fields of posterior.rs are others")]
mod fields;
#[path = "../tests/error_bars/jet.rs"]
mod jet;
#[path = "../tests/values/posterior.rs"]
mod posterior;

use features::{Bands, Feature, MeasuredField};
use gramian_numerics::regression::selection::Criterion;
use posterior::By;
use rayon::prelude::*;

fn rows() -> Vec<MeasuredField> {
    let mut rows = Vec::new();
    let mut add = |feature, sizes: &[usize], noises: &[f64]| {
        for &n_points in sizes {
            rows.extend(noises.iter().map(|&noise| MeasuredField { feature, n_points, noise }));
        }
    };
    for width in [0.02, 0.03, 0.05, 0.1] {
        add(Feature::Bump(width), &[1000, 2000, 4000], &[0.01]);
    }
    for width in [0.1, 0.2] {
        add(Feature::Spot(width), &[1000, 3000], &[0.01]);
    }
    for dimension in [1, 2] {
        add(Feature::Step(dimension), &[100, 300, 1000, 3000], &[0.01, 0.1]);
        add(Feature::Kink(dimension), &[100, 300, 1000, 3000], &[0.01, 0.1]);
    }
    add(Feature::Sine(3), &[20, 100, 300, 1000, 3000], &[0.0, 0.1, 0.5, 2.0]);
    add(Feature::Sine(6), &[20, 100, 300, 1000, 3000], &[0.0, 0.1, 0.5, 2.0]);
    for length in [0.1, 0.3] {
        add(Feature::Draw(length), &[20, 100, 300, 1000, 3000], &[0.1, 1.0]);
    }
    add(Feature::Clusters, &[100, 300, 1000, 3000], &[0.01, 0.1]);
    for dimension in [1, 2, 3] {
        for n_points in [100u32, 300, 1000] {
            for n_per_wave in [2.0, 3.0, 4.0, 5.0] {
                let length = n_per_wave / f64::powf(f64::from(n_points), 1.0 / dimension as f64);
                let length = (1e4 * length).round() / 1e4;
                add(Feature::Ripple { dimension, length }, &[n_points as usize], &[0.01]);
            }
        }
    }
    rows
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let n_seeds = arguments.first().and_then(|n| n.parse().ok()).unwrap_or(10);
    let only = arguments.get(1).map_or("", String::as_str);
    let is_compared = arguments.get(2).is_some_and(|word| word == "full");
    let name = |row: &MeasuredField| format!("{:?}", row.feature);
    let rows: Vec<MeasuredField> = rows().into_iter().filter(|row| name(row).contains(only)).collect();
    println!("Covered all over, inside; error over the spread.\n");
    println!("| field | n | noise | learned | likelihood of all values |\n|---|---|---|---|---|");
    let found: Vec<(Bands, Option<Bands>)> = rows
        .par_iter()
        .map(|row| {
            let full = By::Criterion(Criterion::MarginalLikelihood);
            let full = (is_compared && row.n_points <= 1000).then(|| row.bands(full, n_seeds));
            (row.bands(By::Default, n_seeds), full)
        })
        .collect();
    for (row, (bands, full)) in rows.iter().zip(&found) {
        let verdict = if bands.hold(row.noise) { "" } else { " ✗" };
        let full = full.as_ref().map_or(String::new(), cell);
        let noise = 100.0 * row.noise;
        println!("| {} | {} | {noise} % | {}{verdict} | {full} |", name(row), row.n_points, cell(bands));
    }
    let n_held = rows.iter().zip(&found).filter(|(row, (bands, _))| bands.hold(row.noise)).count();
    println!("\n{n_held} of {} hold.", rows.len());
}

fn cell(bands: &Bands) -> String {
    let inside = bands.inside.map_or(String::new(), |inside| format!("{inside:.0} %, "));
    let misfits =
        if bands.misfits > 0.0 { format!(", {:.0} %", 100.0 * bands.misfits) } else { String::new() };
    format!("{:.1} %, {inside}{:.3}{misfits}", bands.coverage, bands.error)
}
