//! Prints the tables of docs/flags.md: how many wrong and how many right
//! curvatures and normals are flagged.

#[path = "../tests/flags/closed.rs"]
mod closed;
#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/flags/normals.rs"]
mod normals;
#[path = "../tests/flags/shapes.rs"]
mod shapes;
#[path = "../tests/flags/sweep.rs"]
mod sweep;

use gramian_numerics::surface::geometry::SurfaceModel;
use normals::NormalTally;
use rayon::prelude::*;
use sweep::{Tally, cases};

/// Column heads of curvatures. Flagged answers are served with a flag, missed ones without.
const HEADER: &str = "\
| | queries | null | flagged | of them off by > 50 % | right to 10 % | offset | unflagged | missed > 10 % | > 50 % | worst |
|---|---|---|---|---|---|---|---|---|---|---|";

/// Column heads of normals. Off are lines by more than 30°.
const NORMALS_HEADER: &str = "\
| kernel | length scale | n | noise | points | flagged | of them off | unflagged off | | flipped |
|---|---|---|---|---|---|---|---|---|---|";

fn main() {
    println!("normals of closed surfaces\n\n{NORMALS_HEADER}");
    for (at, (name, ..)) in sweep::KERNELS.into_iter().enumerate() {
        for (scale, n, noise) in [(0.4, 500, 0.0), (1.0, 500, 0.0), (0.4, 1500, 0.0), (0.4, 500, 0.0015)] {
            let each = closed::CLOSED_SURFACES.par_iter();
            let each = each.map(|&surface| normals::tally(surface, at, scale, n, noise));
            let tally = each.reduce(NormalTally::default, NormalTally::add);
            println!(
                "| {name} | {scale} | {n} | {noise} | {} | {} | {} | {} | {:.2} % | {} |",
                tally.n_points,
                tally.n_flagged,
                tally.n_off_flagged,
                tally.n_off,
                100.0 * tally.n_off as f64 / tally.n_unflagged().max(1) as f64,
                tally.n_flipped
            );
        }
    }
    for (name, model) in [("signature", SurfaceModel::Signature), ("auto", SurfaceModel::Auto)] {
        for scale in [0.4, 1.0] {
            println!("\n{name}, length scale {scale}\n");
            let cases = cases();
            let tallies: Vec<Tally> = cases.par_iter().map(|case| case.run(model, scale)).collect();
            let group = |label: String, keep: &dyn Fn(&sweep::Case) -> bool| {
                let total = cases.iter().zip(&tallies).filter(|(case, _)| keep(case)).map(|(_, t)| *t);
                print_row(&label, total.fold(Tally::default(), Tally::add));
            };
            println!("{HEADER}");
            for shape in shapes::SHAPES {
                group(format!("{shape:?}").to_lowercase(), &|case| case.shape == shape);
            }
            for kernel in sweep::KERNELS {
                group(kernel.0.to_owned(), &|case| case.kernel.0 == kernel.0);
            }
            for n in sweep::SIZES {
                group(format!("n = {n}, regular"), &|case| case.n_points == n && !case.is_random);
                group(format!("n = {n}, random"), &|case| case.n_points == n && case.is_random);
            }
            group("all".to_owned(), &|_| true);
        }
    }
    print_retirement();
}

/// Prints rows of the same points with noise, flagged by T3 and T4 and by deviations.
fn print_retirement() {
    println!("\nnoise, flags by\n\n{HEADER}");
    let cases: Vec<_> = cases().into_iter().filter(|case| case.kernel.0 == sweep::KERNELS[0].0).collect();
    for noise in [0.0, 0.002, 0.005, 0.01, 0.02] {
        let tallies: Vec<[Tally; 2]> = cases.par_iter().map(|case| case.run_with_noise(noise)).collect();
        let total = |way: usize| tallies.iter().map(|both| both[way]).fold(Tally::default(), Tally::add);
        print_row(&format!("{noise}, T3 and T4"), total(0));
        print_row(&format!("{noise}, deviations"), total(1));
    }
}

fn print_row(label: &str, t: Tally) {
    println!(
        "| {label} | {} | {} | {} | {} | {} | {} | {} | {} ({:.1} %) | {} | {:.2} |",
        t.queries,
        t.null,
        t.flagged,
        t.caught_50,
        t.false_alarms,
        t.offset,
        t.unflagged(),
        t.missed_10,
        100.0 * t.missed_10 as f64 / t.unflagged().max(1) as f64,
        t.missed_50,
        t.worst
    );
}
