//! Normals of the Stanford Bunny, compared with those of its mesh.

use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::points::cloud::Cloud;

use crate::common::clouds::noisy;
use crate::common::random::Random;
use crate::support::{geometry, quantile};

fn read(name: &str) -> Vec<f64> {
    let path = format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    text.split_whitespace().map(|number| number.parse().unwrap()).collect()
}

/// The points, and the normals of the mesh at them.
pub fn bunny() -> (Cloud, Vec<f64>) {
    (Cloud::new(read("bunny.xyz"), 3).unwrap(), read("bunny.normals"))
}

/// Angles to the normals of the mesh in degrees. A null counts as 180°.
fn angles(cloud: &Cloud, truth: &[f64]) -> Vec<f64> {
    let geometry = geometry(cloud, Purpose::Normals);
    let angle = |(query, truth): (usize, &[f64])| {
        if geometry.is_null()[query] {
            180.0
        } else {
            let cosine: f64 = geometry.normal(query).iter().zip(truth).map(|(a, b)| a * b).sum();
            cosine.clamp(-1.0, 1.0).acos().to_degrees()
        }
    };
    truth.chunks_exact(3).enumerate().map(angle).collect()
}

/// Median, 95th percentile, and the share of normals that point inward.
fn summary(angles: &[f64]) -> (f64, f64, f64) {
    let flipped = angles.iter().filter(|&&angle| angle > 90.0).count() as f64 / angles.len() as f64;
    (quantile(angles, 0.5), quantile(angles, 0.95), flipped)
}

#[test]
fn the_exact_scan_has_the_normals_of_its_mesh() {
    let (cloud, normals) = bunny();
    let (median, p95, flipped) = summary(&angles(&cloud, &normals));
    println!("bunny: median {median:.2}, 95 % {p95:.2}, flipped {flipped}");
    assert!(median <= 2.5 && p95 <= 10.0, "{median}, {p95}");
    assert_eq!(flipped, 0.0);
}

/// A rotation by Euler angles.
fn rotation(a: f64, b: f64, c: f64) -> [[f64; 3]; 3] {
    let ([sa, ca], [sb, cb], [sc, cc]) = ([a.sin(), a.cos()], [b.sin(), b.cos()], [c.sin(), c.cos()]);
    [
        [ca * cc - sa * cb * sc, -ca * sc - sa * cb * cc, sa * sb],
        [sa * cc + ca * cb * sc, -sa * sc + ca * cb * cc, -ca * sb],
        [sb * sc, sb * cc, cb],
    ]
}

fn turned(vectors: &[f64], by: &[[f64; 3]; 3]) -> Vec<f64> {
    let rows = |v: &[f64]| by.map(|row| row.iter().zip(v).map(|(r, x)| r * x).sum());
    vectors.chunks_exact(3).flat_map(rows).collect()
}

#[test]
fn unit_rotation_and_place_do_not_matter() {
    let (cloud, normals) = bunny();
    let expected = summary(&angles(&cloud, &normals));
    // Decimetres converted to millimetres and to kilometres, and a shift by a thousand diameters.
    for (scale, shift, by) in [
        (100.0, 0.0, rotation(0.0, 0.0, 0.0)),
        (1e-4, 0.0, rotation(0.4, 1.1, 2.3)),
        (1.0, 2e4, rotation(1.9, 0.7, -0.6)),
    ] {
        let moved = turned(cloud.coordinates(), &by).iter().map(|x| scale * x + shift).collect();
        let found = summary(&angles(&Cloud::new(moved, 3).unwrap(), &turned(&normals, &by)));
        // Another rotation sums in another order. Angles change far less than they are off.
        assert!((found.0 - expected.0).abs() < 0.01, "{found:?}, not {expected:?}");
        assert!((found.1 - expected.1).abs() < 0.1 && found.2 == 0.0, "{found:?}, not {expected:?}");
    }
}

#[test]
fn noise_is_noticed_and_smoothed() {
    let (cloud, normals) = bunny();
    for (noise, largest_median) in [(0.005, 5.5), (0.01, 8.0)] {
        for seed in 0..3 {
            // Noise is relative to half the diagonal of the bounding box, the larger
            // of the radii that might be meant.
            let moved = noisy(&cloud, noise * cloud.radius(), &mut Random(seed));
            let (median, p95, flipped) = summary(&angles(&moved, &normals));
            println!("bunny, noise {noise}: median {median:.2}, 95 % {p95:.2}, flipped {flipped:.4}");
            assert!(median <= largest_median, "noise {noise}, seed {seed}: {median}");
            assert!(flipped <= 0.002, "noise {noise}, seed {seed}: {flipped}");
        }
    }
}
