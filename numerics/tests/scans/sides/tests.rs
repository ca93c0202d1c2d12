//! Bounds on the sides of normals of closed curves and surfaces.

use std::sync::Arc;

use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::surface::local::{LocalInputs, LocalSurface};

use super::cases::{
    Case, box_faces, cone, curves, folded_curve, folded_sheet, lens, nested_spheres, noisy_curves, plate,
    pyramid, tube, two_spheres,
};
use super::clouds::{OrientedCloud, faceted};
use super::tally::SideTally;
use crate::common::random::Random;

/// Checks the counts of a cloud against bounds by the distance of its sheets.
///
/// - From two spacings on, at most 0.1 % of the points are flipped without a flag. Below, at most 1 % of the
///   points without a flag are.
/// - From four spacings on, the sides of at most 1 % of the points are in doubt.
/// - From one spacing on, at most 0.5 % of the points are off by 30° without a flag, whatever their side.
///   Thinner plates have more around their rims.
fn check(case: &Case, way: &str, tally: SideTally) {
    println!("{}, {way}: {tally:?}", case.name);
    if case.thickness >= 2.0 {
        assert!(tally.flipped_unflagged() <= 0.001, "{}, {way}: {tally:?}", case.name);
    } else {
        assert!(tally.wrong_of_unflagged() <= 0.01, "{}, {way}: {tally:?}", case.name);
    }
    if case.thickness >= 1.0 {
        assert!(tally.off_unflagged() <= 0.005, "{}, {way}: {tally:?}", case.name);
    }
    if case.thickness >= 4.0 {
        assert!(tally.ambiguous() <= 0.01, "{}, {way}: {tally:?}", case.name);
    }
}

fn check_local(case: Case) {
    check(&case, "local", SideTally::local(&case.sided));
}

fn check_both(case: Case) {
    check(&case, "dense", SideTally::dense(&case.sided));
    check_local(case);
}

#[test]
fn plane_curves_have_no_piece_turned_over() {
    curves(500, 1).into_iter().for_each(check_both);
    curves(3000, 2).into_iter().for_each(check_local);
}

/// Noise of three tenths of a step turns the steps between the points of a curve. By the signature function
/// 1 to 38 % of what had no flag was flipped, and half of the points had one.
#[test]
fn noisy_plane_curves_have_right_sides() {
    for (n, noise, n_seeds) in [(300, 0.3, 2), (600, 0.5, 1)] {
        for way in [SideTally::dense, SideTally::local] {
            let mut all = SideTally::default();
            for case in (1..=n_seeds).flat_map(|seed| noisy_curves(n, noise, seed)) {
                let tally = way(&case.sided);
                // Two points of eight lobes with 37 each may be lost where they turn.
                assert!(tally.wrong_of_unflagged() <= 0.05, "{}: {tally:?}", case.name);
                all = all.with(&tally);
            }
            assert!(all.wrong_of_unflagged() <= 0.01, "{n} points, noise {noise}: {all:?}");
            assert!(all.off_unflagged() <= 0.01 && all.ambiguous() <= 0.03, "{n}, {noise}: {all:?}");
        }
    }
}

#[test]
fn unit_and_place_of_a_noisy_curve_do_not_matter() {
    let sided = noisy_curves(300, 0.3, 1).remove(0).sided;
    for way in [SideTally::dense, SideTally::local] {
        let own = way(&sided);
        for (unit, offset) in [(1.0, 1e6), (1e-9, 0.0), (1e9, -1e12)] {
            let moved = sided.cloud.coordinates().iter().map(|x| unit * x + offset).collect();
            let normals = sided.normals.clone();
            let tally = way(&OrientedCloud { cloud: Cloud::new(moved, 2).unwrap(), normals });
            let is_same = tally.n_flipped == own.n_flipped && tally.n_flagged.abs_diff(own.n_flagged) <= 2;
            assert!(is_same, "{unit}, {offset}: {tally:?} and {own:?}");
        }
    }
}

#[test]
fn plates_have_right_sides_or_flags() {
    for thickness in [0.75, 1.26, 1.84, 2.0, 4.0] {
        check_both(plate(1000, thickness, 1));
    }
}

/// Lenses are nearly everywhere thinner than their nominal thickness. They thin out to nothing at
/// their edge, where both sides have about the same normals. Before pieces were cut, both sides
/// pointed the same way all over.
#[test]
fn both_sides_of_a_lens_point_apart_or_have_flags() {
    for thickness in [1.0, 1.5, 2.0, 3.0] {
        // Single clouds scatter: one in six has 1.3 % flipped without a flag, all
        // together have half a per cent.
        let cases: Vec<Case> = (1..=3).map(|seed| lens(1500, thickness, seed)).collect();
        for way in [SideTally::dense, SideTally::local] {
            let tally = cases.iter().map(|case| way(&case.sided)).reduce(|a, b| a.with(&b)).unwrap();
            assert!(tally.flipped_unflagged() <= 0.01, "{thickness}: {tally:?}");
            // One spacing thick, half of the points have a flag, and a quarter is flipped.
            let most = if thickness > 1.0 { 0.2 } else { 0.25 };
            assert!(tally.flipped() <= most && tally.off_unflagged() <= 0.003, "{thickness}: {tally:?}");
        }
    }
}

#[test]
fn a_folded_strip_has_right_sides_or_flags() {
    // Gaps between random points of a curve are as wide as the strip is thick, so more
    // is in doubt than elsewhere.
    let case = folded_curve(1500, 4.0, 1);
    let (dense, local) = (SideTally::dense(&case.sided), SideTally::local(&case.sided));
    assert!(dense.flipped_unflagged() <= 0.01, "{dense:?}");
    assert!(local.flipped_unflagged() <= 0.001, "{local:?}");
}

#[test]
fn tubes_have_right_sides_or_flags() {
    for radius in [1.0, 1.5, 2.0, 4.0] {
        check_both(tube(1000, radius, 1));
    }
}

#[test]
fn spheres_that_touch_are_outward_each() {
    for gap in [0.0, 1.0, 4.0] {
        check_both(two_spheres(1000, gap, 1));
    }
}

#[test]
fn normals_of_a_hollow_ball_point_out_of_its_wall() {
    for share in [0.2, 0.5] {
        check_both(nested_spheres(1000, share, 1));
    }
}

#[test]
fn folded_sheets_have_right_sides() {
    check_local(folded_sheet(3, 4.0, 1));
}

fn is_open(sided: &OrientedCloud) -> bool {
    let cloud = Arc::new(sided.cloud.clone());
    let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
    LocalSurface::of(cloud, sampling, LocalInputs::default(), &Unobserved).unwrap().orientation().is_open
}

/// Each face of a box ends at its edges, but only a box without a lid has a rim. With a few hundred points,
/// one of three cones still seems to have one.
#[test]
fn bodies_with_sharp_edges_are_closed_and_without_a_face_open() {
    let faces = box_faces();
    let of_box = |faces: &[_], n: usize, seed: u64| is_open(&faceted(faces, n, &mut Random(seed + n as u64)));
    let seeds = [1, 2, 3];
    for n in [300, 1000] {
        assert!(seeds.iter().all(|&seed| !of_box(&faces, n, seed)), "{n} points of a box");
        assert!(seeds.iter().filter(|&&seed| of_box(&faces[2..], n, seed)).count() >= 2, "{n} without a lid");
    }
    assert!(
        seeds.iter().all(|&seed| !is_open(&cone(1000, seed).sided) && !is_open(&pyramid(1000, seed).sided))
    );
}

/// Across an edge at which normals turn by 120 degrees, neighbours seem to lie on a surface with the opposite
/// side. The base of a pyramid was turned over, and all of its sides had flags.
#[test]
fn bodies_with_sharp_edges_have_right_sides() {
    // Points on an edge may have the normal of either side, and those of few points are off beside it.
    // In one of twenty clouds of 300, the base of a pyramid is turned over all the same.
    for (n, n_seeds, flipped, off) in [(300, 20, 0.03, 0.04), (1000, 3, 0.01, 0.03), (4000, 3, 0.01, 0.01)] {
        for of in [cone, pyramid] {
            let cases: Vec<Case> = (1..=n_seeds).map(|seed| of(n, seed)).collect();
            let tallies = cases.iter().map(|case| SideTally::local(&case.sided));
            let tally = tallies.reduce(|a, b| a.with(&b)).unwrap();
            assert!(tally.wrong_of_unflagged() <= flipped, "{}: {tally:?}", cases[0].name);
            assert!(tally.off_unflagged() <= off, "{}: {tally:?}", cases[0].name);
            assert!(tally.ambiguous() <= 0.1, "{}: {tally:?}", cases[0].name);
        }
    }
}
