//! Surfaces to mesh, and what holds of their meshes.

use std::collections::HashMap;
use std::sync::Arc;

use gramian_numerics::mesh::surface::{MeshOptions, mesh_of_surface};
use gramian_numerics::mesh::{Closedness, LevelSet, Mesh, Quality};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::local::{LocalInputs, LocalSurface};

pub const OPTIONS: MeshOptions =
    MeshOptions { step: None, bounds: None, quality: Quality::Regular, is_open: false, max_nodes: 2_000_000 };

/// The surface of local regressions, with nothing chosen.
pub fn local(cloud: Cloud) -> Surface {
    let cloud = Arc::new(cloud);
    let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
    LocalSurface::of(cloud, sampling, LocalInputs::default(), &Unobserved).unwrap().into()
}

pub fn meshed(surface: &Surface, options: &MeshOptions) -> (LevelSet, Closedness) {
    mesh_of_surface(surface, options, &Unobserved).unwrap()
}

/// The points of the Stanford Bunny, and their median spacing.
pub fn bunny() -> (Arc<Cloud>, f64) {
    let path = format!("{}/tests/data/bunny.xyz", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    let points = text.split_whitespace().map(|number| number.parse().unwrap()).collect();
    let cloud = Cloud::new(points, 3).unwrap();
    let spacing = spacing_of(&cloud);
    (Arc::new(cloud), spacing)
}

/// The median spacing of points.
pub fn spacing_of(cloud: &Cloud) -> f64 {
    Sampling::of(cloud, &Unobserved).unwrap().scales().spacing
}

/// All angles of the triangles in degrees, ascending.
pub fn angles(mesh: &Mesh) -> Vec<f64> {
    let sub = |a: &[f64], b: &[f64]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let dot = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let of_triangle = |cell: &[u32]| {
        [0, 1, 2].map(|k| {
            let [a, b, c] = [0, 1, 2].map(|j| mesh.vertex(cell[(k + j) % 3]));
            let (u, v) = (sub(b, a), sub(c, a));
            (dot(&u, &v) / (dot(&u, &u) * dot(&v, &v)).sqrt()).clamp(-1.0, 1.0).acos().to_degrees()
        })
    };
    let mut angles: Vec<f64> = mesh.cells().flat_map(of_triangle).collect();
    angles.sort_by(f64::total_cmp);
    angles
}

/// The volume enclosed by triangles that run counter-clockwise seen from outside.
pub fn volume(mesh: &Mesh) -> f64 {
    let of_triangle = |cell: &[u32]| {
        let [a, b, c] = [0, 1, 2].map(|k| mesh.vertex(cell[k]));
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        a.iter().zip(cross).map(|(a, c)| a * c).sum::<f64>() / 6.0
    };
    mesh.cells().map(of_triangle).sum()
}

/// Asserts that every directed edge has one opposite, and that the triangles of every vertex are one fan.
pub fn assert_is_manifold(mesh: &Mesh) {
    let mut next = HashMap::new();
    for cell in mesh.cells() {
        for k in 0..3 {
            let (a, b, c) = (cell[k], cell[(k + 1) % 3], cell[(k + 2) % 3]);
            assert_eq!(next.insert((a, b), c), None, "an edge belongs to two triangles on one side");
        }
    }
    let mut stars: HashMap<u32, Vec<u32>> = HashMap::new();
    for &(a, b) in next.keys() {
        assert!(next.contains_key(&(b, a)), "an edge has one triangle");
        stars.entry(a).or_default().push(b);
    }
    for (vertex, around) in stars {
        let (first, mut at, mut n) = (around[0], around[0], 0);
        loop {
            at = next[&(vertex, at)];
            n += 1;
            if at == first {
                break;
            }
        }
        assert_eq!(n, around.len(), "vertex {vertex} has two fans");
    }
}
