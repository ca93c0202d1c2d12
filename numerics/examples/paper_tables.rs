//! Prints the tables of docs/paper.md, with the paper's numbers beside ours.
//!
//! `cargo run --release --example paper_tables`.

#[path = "../tests/paper/main.rs"]
mod paper;

fn main() {
    let tables = [
        paper::inflections::table,
        paper::triangle::table,
        paper::half_ellipse::table,
        paper::square::table,
        paper::quadrics::table,
        paper::sphere::table,
        paper::sphere_orders::table,
        paper::torus_random::table_gauss,
        paper::torus_random::table_laplace,
        paper::torus_fibonacci::table_gauss,
        paper::torus_fibonacci::table_laplace,
        paper::ellipsoid::table,
        paper::noisy_ellipse::table,
        paper::posterior_coverage::table,
    ];
    println!(
        "\"figure\": the paper shows a picture without numbers; \"-\": it has nothing; \"null\": no answer, and said so\n"
    );
    for table in tables {
        println!("{}", table());
    }
}
