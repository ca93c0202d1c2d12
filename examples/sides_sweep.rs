//! Prints how many normals point to the wrong side, with a flag and without: the table of docs/degeneracy.md,
//! Sides.
//!
//! `cargo run --release --example sides_sweep [largest number of points, 3,000 if not said]`

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/scans/sides/mod.rs"]
mod sides;

use sides::cases::{
    Case, curves, folded_curve, folded_sheet, lens, nested_spheres, plate, tube, two_spheres,
};
use sides::tally::SideTally;

/// Points beyond which the signature function, of cubic cost, is left out.
const MAX_DENSE: usize = 3000;

const HEADER: &str = "\
| cloud | n | surface | flipped | without a flag | flagged | for its side | off by 30° without a flag |
|---|---|---|---|---|---|---|---|";

fn main() {
    let n_most: usize = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(3000);
    println!("{HEADER}");
    for n in [200, 500, 1500, 3000, 10_000, 20_000].into_iter().filter(|n| *n <= n_most) {
        curves(n, 1).iter().for_each(print_rows);
        print_rows(&folded_curve(n, 4.0, 1));
        [0.5, 0.75, 1.0, 1.26, 1.84, 2.0, 3.0, 4.0].into_iter().for_each(|t| print_rows(&plate(n, t, 1)));
        [0.5, 1.0, 1.5, 2.0, 3.0, 4.0].into_iter().for_each(|t| print_rows(&lens(n, t, 1)));
        [0.5, 1.0, 1.5, 2.0, 3.0, 4.0].into_iter().for_each(|r| print_rows(&tube(n, r, 1)));
        [0.0, 0.5, 1.0, 2.0, 4.0].into_iter().for_each(|gap| print_rows(&two_spheres(n, gap, 1)));
        [0.2, 0.5, 0.8, 0.9].into_iter().for_each(|share| print_rows(&nested_spheres(n, share, 1)));
    }
    let n_layers = if n_most > 3000 { 6 } else { 3 };
    [4.0, 2.0].into_iter().for_each(|thickness| print_rows(&folded_sheet(n_layers, thickness, 1)));
}

fn print_rows(case: &Case) {
    if case.sided.cloud.n_points() <= MAX_DENSE {
        print_row(case, "dense", &SideTally::dense(&case.sided));
    }
    print_row(case, "local", &SideTally::local(&case.sided));
}

fn print_row(case: &Case, way: &str, tally: &SideTally) {
    let shares = [
        tally.flipped(),
        tally.flipped_unflagged(),
        tally.flagged(),
        tally.ambiguous(),
        tally.off_unflagged(),
    ];
    let shares = shares.map(|share| format!("{:.2} %", 100.0 * share)).join(" | ");
    println!("| {} | {} | {way} | {shares} |", case.name, tally.n_points);
}
