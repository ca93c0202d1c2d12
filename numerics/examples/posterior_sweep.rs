//! Prints tables of docs/error-bars.md: coverage of posterior bands with default parameters, and with
//! kernels found by other criteria.
//!
//! `cargo run --release --example posterior_sweep [draws]`, 6 by default. It takes some minutes.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/values/fields.rs"]
mod fields;
#[path = "../tests/error_bars/jet.rs"]
mod jet;
#[path = "../tests/values/posterior.rs"]
mod posterior;

use fields::FIELDS;
use gramian_numerics::regression::selection::Criterion;
use posterior::{By, DrawSummary, Sensors};
use rayon::prelude::*;

const SIZES: [usize; 5] = [30, 120, 300, 800, 2000];

/// Noise over the spread of the field, factor of the values, and offset.
const SETTINGS: [(f64, f64, f64); 5] =
    [(0.0, 1.0, 0.0), (0.01, 1.0, 1e6), (0.05, 1e-6, 1.0), (0.1, 1e-6, 0.0), (0.2, 1e6, -1e6)];

/// Sizes at which criteria are compared.
const COMPARED: [usize; 3] = [30, 120, 300];

fn main() {
    let n_draws = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(6);
    println!(
        "Rows that hold, of 15 each: 90 % and more, and where there is noise 99.5 % at most; then the least covered.\n"
    );
    println!("| noise, unit, offset | {} |", SIZES.map(|n| format!("n = {n}")).join(" | "));
    println!("|---|{}", "---|".repeat(SIZES.len()));
    for setting in SETTINGS {
        let cells = SIZES.map(|n_points| cell(&rows(setting, n_points, By::Default, n_draws), setting.0));
        println!("| {} %, {:e}, {:e} | {} |", 100.0 * setting.0, setting.1, setting.2, cells.join(" | "));
    }
    println!(
        "\nRows that hold, least covered, and median of the error over the field, by what kernel and noise are found.\n"
    );
    println!(
        "| noise | n | likelihood, on the grid | marginal likelihood | leave-one-out | generalised cross-validation |"
    );
    println!("|---|---|---|---|---|---|");
    for setting in SETTINGS {
        for n_points in COMPARED {
            let cells = [
                By::Default,
                By::Criterion(Criterion::MarginalLikelihood),
                By::Criterion(Criterion::LeaveOneOut),
                By::Criterion(Criterion::GeneralizedCrossValidation),
            ]
            .map(|by| {
                let rows = rows(setting, n_points, by, n_draws);
                format!("{}, {:.1e}", cell(&rows, setting.0), median(&rows))
            });
            println!("| {} % | {n_points} | {} |", 100.0 * setting.0, cells.join(" | "));
        }
    }
}

/// Coverage and error of all fields in one, two and three dimensions.
fn rows(
    (noise, factor, offset): (f64, f64, f64),
    n_points: usize,
    by: By,
    n_draws: usize,
) -> Vec<DrawSummary> {
    let of = |dimension| FIELDS.map(|field| Sensors { dimension, n_points, field, noise, factor, offset });
    let sensors: Vec<Sensors> = [1, 2, 3].into_iter().flat_map(of).collect();
    sensors.par_iter().map(|sensors| sensors.found(by, n_draws)).collect()
}

fn cell(rows: &[DrawSummary], noise: f64) -> String {
    let most = if noise > 0.0 { 99.5 } else { 100.0 };
    let n_held = rows.iter().filter(|row| (90.0..=most).contains(&row.coverage)).count();
    let least = rows.iter().map(|row| row.coverage).fold(100.0, f64::min);
    format!("{n_held}, {least:.1} %")
}

fn median(rows: &[DrawSummary]) -> f64 {
    let mut errors: Vec<f64> = rows.iter().map(|row| row.error).collect();
    errors.sort_by(f64::total_cmp);
    errors[errors.len() / 2]
}
