//! Writes sparse Laplace–Beltrami operators of random clouds and of the bunny. examples/rightmost.py prints
//! their rightmost eigenvalues: the tables of docs/numerics.md.
//!
//! `cargo run --release --example stability_sweep FOLDER [seeds] [points]`, by default 20 seeds and 1,000
//! points. Then `python3 numerics/examples/rightmost.py FOLDER`, which needs NumPy and SciPy.

#[path = "../tests/common/mod.rs"]
mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use common::clouds::{cloud, random_sphere, random_torus};
use common::random::Random;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::operators::{Operator, RowKind, Stencils};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};
use gramian_numerics::surface::local::{LocalInputs, LocalSurface};

type Sample = fn(usize, &mut Random) -> Cloud;

const SHAPES: [(&str, Sample); 6] = [
    ("sphere", random_sphere),
    ("torus", random_torus),
    ("two_densities", two_densities),
    ("ellipsoid", ellipsoid),
    ("half_sphere", half_sphere),
    ("bunny", bunny),
];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let folder = PathBuf::from(arguments.first().expect("a folder"));
    let number = |at: usize, default: usize| arguments.get(at).map_or(default, |n| n.parse().unwrap());
    let (n_seeds, n_points) = (number(1, 20), number(2, 1000));
    println!("| cloud | nearest | graded | positive | least norm | empty |\n|---|---|---|---|---|---|");
    for (shape, sample) in SHAPES {
        for seed in 1..=n_seeds {
            let cloud = sample(n_points, &mut Random(seed as u64));
            let found = stencils(&cloud);
            let name = format!("{shape}-{}-{seed}", cloud.n_points());
            print_kinds(&name, &found);
            write(&folder.join(name), &found, &cloud);
        }
    }
}

fn stencils(cloud: &Cloud) -> Stencils {
    let cloud = Arc::new(cloud.clone());
    let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
    let surface =
        LocalSurface::of(cloud.clone(), sampling.clone(), LocalInputs::default(), &Unobserved).unwrap();
    let geometry =
        Geometry::of(&Surface::from(surface), &cloud, &GeometryRequest::CURVATURES, &Unobserved).unwrap();
    Operator::LaplaceBeltrami.stencils(&geometry, &cloud, sampling.neighbours(), &cloud, &Unobserved).unwrap()
}

fn print_kinds(name: &str, found: &Stencils) {
    let kinds = [RowKind::Nearest, RowKind::Graded, RowKind::Positive, RowKind::LeastNorm, RowKind::Empty];
    let counts = kinds.map(|kind| found.n_rows(kind).to_string());
    println!("| {name} | {} |", counts.join(" | "));
}

/// Writes little-endian numbers of eight bytes. Row ends and columns are integers, weights and points floats.
fn write(folder: &Path, found: &Stencils, cloud: &Cloud) {
    fs::create_dir_all(folder).unwrap();
    let integers = |values: &[i64]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let floats = |values: &[f64]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    fs::write(folder.join("indptr"), integers(&found.matrix.indptr)).unwrap();
    fs::write(folder.join("indices"), integers(&found.matrix.indices)).unwrap();
    fs::write(folder.join("data"), floats(&found.matrix.data)).unwrap();
    fs::write(folder.join("points"), floats(cloud.coordinates())).unwrap();
}

/// A sphere that is sixteen times as dense above the equator as below.
fn two_densities(n: usize, random: &mut Random) -> Cloud {
    let mut points = Vec::with_capacity(n);
    while points.len() < n {
        let x = random.on_sphere();
        if x[2] > 0.0 || random.uniform() < 1.0 / 16.0 {
            points.push(x);
        }
    }
    cloud(&points)
}

/// An ellipsoid that is denser towards the ends of its long axis.
fn ellipsoid(n: usize, random: &mut Random) -> Cloud {
    let axes = [1.0, 0.7, 0.4];
    let points: Vec<[f64; 3]> =
        (0..n).map(|_| random.on_sphere()).map(|x| [0, 1, 2].map(|c| axes[c] * x[c])).collect();
    cloud(&points)
}

/// Half a sphere. It is open, and its rim has no rows that are both consistent and stable.
fn half_sphere(n: usize, random: &mut Random) -> Cloud {
    let points: Vec<[f64; 3]> = (0..n).map(|_| random.on_sphere()).map(|[x, y, z]| [x, y, z.abs()]).collect();
    cloud(&points)
}

/// A random choice of at most n points of the scan.
fn bunny(n: usize, random: &mut Random) -> Cloud {
    let path = format!("{}/tests/data/bunny.xyz", env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(path).unwrap();
    let all: Vec<f64> = text.split_whitespace().map(|number| number.parse().unwrap()).collect();
    let mut points: Vec<[f64; 3]> = all.chunks_exact(3).map(|x| [x[0], x[1], x[2]]).collect();
    for at in (1..points.len()).rev() {
        points.swap(at, (random.uniform() * (at + 1) as f64) as usize);
    }
    points.truncate(n);
    cloud(&points)
}
