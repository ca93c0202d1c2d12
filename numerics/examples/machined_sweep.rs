//! Prints the tables of docs/error-bars.md on machined parts: planes, fillets, corners and sharp edges.
//!
//! `cargo run --release -p gramian-numerics --example machined_sweep`. It takes a minute.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/error_bars/edges.rs"]
mod edges;
#[path = "../tests/error_bars/machined.rs"]
mod machined;

use edges::{BODIES, Body, body_answered};
use machined::rounded_box_answered;

/// Sizes and noise, in spacings, of rounded boxes, and the heads of their table.
const BOXES: [(usize, f64); 4] = [(6_000, 0.0), (6_000, 0.05), (20_000, 0.05), (20_000, 0.3)];
const ROUNDED: &str = "\
| points | noise, spacings | planes | fillets | corners | planes far from fillets, flagged |
|---|---|---|---|---|---|";

const N_OF_SHARP: usize = 8_000;
const NOISES_OF_SHARP: [f64; 4] = [0.0, 0.02, 0.1, 0.3];
const SHARP: &str = "\
| body | noise, spacings | at edges: flagged | sure and wrong | far from edges: flagged |
|---|---|---|---|---|";

fn main() {
    println!("{ROUNDED}");
    BOXES.into_iter().for_each(|(n, noise)| print_box(n, noise));
    println!("\n{SHARP}");
    BODIES
        .into_iter()
        .for_each(|body| NOISES_OF_SHARP.into_iter().for_each(|noise| print_sharp(body, noise)));
}

fn print_box(n: usize, noise: f64) {
    let machined::BoxShares { covered: [planes, fillets, corners], far_flagged } =
        rounded_box_answered(n, noise);
    println!("| {n} | {noise} | {planes:.0} % | {fillets:.0} % | {corners:.0} % | {far_flagged:.0} % |");
}

fn print_sharp(body: Body, noise: f64) {
    let edges::BodyShares { flagged, wrong, far_flagged } = body_answered(body, N_OF_SHARP, noise);
    println!("| {body:?} | {noise} | {flagged:.0} % | {wrong:.1} % | {far_flagged:.1} % |");
}
