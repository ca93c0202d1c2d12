//! Prints the table of docs/flags.md, Orientation: normals on the wrong side, with a flag and without.
//!
//! `cargo run --release --example sides_sweep [largest number of points]`, 3,000 by default.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/scans/sides/mod.rs"]
mod sides;

use sides::cases::{
    Case, cone, curves, folded_curve, folded_sheet, lens, nested_spheres, noisy_curves, plate, pyramid, tube,
    two_spheres,
};
use sides::tally::SideTally;

/// Number of points beyond which the signature function, of cubic cost, is left out.
const MAX_DENSE: usize = 3000;

const HEADER: &str = "\
| cloud | solver | points | flipped | without a flag | of what has none | flagged | for its side | off by 30° without a flag |
|---|---|---|---|---|---|---|---|---|";

fn main() {
    let n_most: usize = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(3000);
    let sizes: Vec<usize> =
        [200, 500, 1500, 3000, 10_000, 20_000].into_iter().filter(|n| *n <= n_most).collect();
    let over_sizes = |case: &dyn Fn(usize) -> Case| sizes.iter().map(|&n| case(n)).collect::<Vec<_>>();
    println!("{HEADER}");
    print_rows("curves", &sizes.iter().flat_map(|&n| curves(n, 1)).collect::<Vec<_>>());
    for noise in [0.1, 0.3, 0.5] {
        let noisy: Vec<Case> = sizes.iter().flat_map(|&n| noisy_curves(n, noise, 1)).collect();
        print_rows(&format!("curves, noise {noise}"), &noisy);
    }
    print_rows("cone", &over_sizes(&|n| cone(n, 1)));
    print_rows("pyramid", &over_sizes(&|n| pyramid(n, 1)));
    print_rows("folded strip, 4", &over_sizes(&|n| folded_curve(n, 4.0, 1)));
    for thickness in [0.5, 0.75, 1.0, 1.26, 1.84, 2.0, 3.0, 4.0] {
        print_rows(&format!("plate, {thickness}"), &over_sizes(&|n| plate(n, thickness, 1)));
    }
    for thickness in [0.5, 1.0, 1.5, 2.0, 3.0, 4.0] {
        print_rows(&format!("lens, {thickness}"), &over_sizes(&|n| lens(n, thickness, 1)));
    }
    for radius in [0.5, 1.0, 1.5, 2.0, 3.0, 4.0] {
        print_rows(&format!("tube, radius {radius}"), &over_sizes(&|n| tube(n, radius, 1)));
    }
    for gap in [0.0, 0.5, 1.0, 2.0, 4.0] {
        print_rows(&format!("two spheres, {gap} apart"), &over_sizes(&|n| two_spheres(n, gap, 1)));
    }
    for share in [0.2, 0.5, 0.8, 0.9] {
        print_rows(&format!("nested spheres, {share}"), &over_sizes(&|n| nested_spheres(n, share, 1)));
    }
    let n_layers = if n_most > 3000 { 6 } else { 3 };
    for thickness in [4.0, 2.0] {
        print_rows(&format!("folded sheet, {thickness}"), &[folded_sheet(n_layers, thickness, 1)]);
    }
}

/// Prints the rows of several clouds together, by both kinds of surfaces.
fn print_rows(name: &str, cases: &[Case]) {
    let is_small = |case: &&Case| case.sided.cloud.n_points() <= MAX_DENSE;
    print_row(name, "dense", cases.iter().filter(is_small).map(|case| SideTally::dense(&case.sided)));
    print_row(name, "local", cases.iter().map(|case| SideTally::local(&case.sided)));
}

fn print_row(name: &str, way: &str, tallies: impl Iterator<Item = SideTally>) {
    let tally = tallies.fold(SideTally::default(), |sum, tally| sum.with(&tally));
    if tally.n_points == 0 {
        return;
    }
    let shares = [
        tally.flipped(),
        tally.flipped_unflagged(),
        tally.wrong_of_unflagged(),
        tally.flagged(),
        tally.ambiguous(),
        tally.off_unflagged(),
    ];
    let shares = shares.map(|share| format!("{:.2} %", 100.0 * share)).join(" | ");
    println!("| {name} | {way} | {} | {shares} |", tally.n_points);
}
