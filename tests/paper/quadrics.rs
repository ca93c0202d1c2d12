//! Tables "Quadratic surface": z = ax²/2 − by²/2 over [−½, ½]², 256 points, principal curvatures at the origin, α = 1e-10.
//!
//! κ for ν = +∇u/|∇u|, as in the paper: a and −b.

use super::errors::medians;
use super::random::Random;
use super::support::{Cloud, Family, GAUSS, LAPLACE, Orientation, Surface, cloud};
use super::table::{Cell, Paper, Row, Table};

const ALPHA: f64 = 1e-10;

/// a = 1, b = 2 and a = b = 1, on the grid and on random points.
pub fn table() -> Table {
    let nothing = [Paper::Nothing; 2];
    Table {
        title: "Quadrics z = (a x^2 - b y^2)/2: curvatures at the origin, alpha = 1e-10; random: median of 20 clouds",
        columns: vec!["kappa = a", "kappa = -b", "null clouds"],
        rows: vec![
            row("a = 1, b = 2, grid, Gauss", &grids(2.0), GAUSS, numbers(1.0, -2.0)),
            row("a = 1, b = 2, grid, Laplace", &grids(2.0), LAPLACE, numbers(1.003, -1.992)),
            row("a = 1, b = 2, random, Gauss", &random_patches(2.0), GAUSS, nothing),
            row("a = 1, b = 2, random, Laplace", &random_patches(2.0), LAPLACE, nothing),
            row("a = b = 1, grid, Gauss", &grids(1.0), GAUSS, numbers(-3.1650e5, -4.4615e10)),
            row("a = b = 1, grid, Laplace", &grids(1.0), LAPLACE, numbers(3.5405e7, -3.8913e9)),
            row("a = b = 1, random, Gauss", &random_patches(1.0), GAUSS, nothing),
            row("a = b = 1, random, Laplace", &random_patches(1.0), LAPLACE, numbers(0.98534, -1.0138)),
        ],
    }
}

fn numbers(a: f64, b: f64) -> [Paper; 2] {
    [Paper::Number(a), Paper::Number(b)]
}

/// The median over the clouds, null where the gradient vanishes in most of them, and how many those are.
fn row(label: &str, clouds: &[Cloud], family: Family, paper: [Paper; 2]) -> Row {
    let found: Vec<Option<[f64; 2]>> = clouds.iter().map(|cloud| curvatures(cloud, family)).collect();
    let regular: Vec<[f64; 2]> = found.iter().copied().flatten().collect();
    let flagged = (found.len() - regular.len()) as f64;
    let ours = (2 * regular.len() > found.len()).then(|| medians(&regular));
    let cell = |n: usize| Cell { paper: paper[n], ours: ours.map(|ours| ours[n]) };
    let count = Cell { paper: Paper::Nothing, ours: Some(flagged) };
    Row { label: label.to_owned(), cells: vec![cell(0), cell(1), count] }
}

/// The curvatures at the origin, the larger first; `None` where the signature function has no gradient there.
fn curvatures(cloud: &Cloud, family: Family) -> Option<[f64; 2]> {
    let origin = Cloud::new(vec![0.0; 3], 3).unwrap();
    let found = Surface::of(cloud, family, ALPHA).curvatures(&origin, Orientation::Gradient);
    found[0].as_ref().map(|k| [k[1], k[0]])
}

/// The patch over the paper's regular 16 × 16 discretization, which contains the boundary.
fn grids(b: f64) -> Vec<Cloud> {
    let coordinate = |i: usize| i as f64 / 15.0 - 0.5;
    vec![patch(b, (0..256).map(|i| [coordinate(i / 16), coordinate(i % 16)]))]
}

fn random_patches(b: f64) -> Vec<Cloud> {
    let patch_of = |seed: u64| {
        let mut random = Random::of_seed(2000 + seed);
        patch(b, (0..256).map(|_| [random.uniform() - 0.5, random.uniform() - 0.5]))
    };
    (0..20).map(patch_of).collect()
}

/// a = 1.
fn patch(b: f64, points: impl Iterator<Item = [f64; 2]>) -> Cloud {
    cloud(&points.map(|[x, y]| [x, y, (x * x - b * y * y) / 2.0]).collect::<Vec<_>>())
}
