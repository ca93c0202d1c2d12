use proptest::prelude::*;

use super::*;
use crate::machine::random::Random;
use crate::observer::Unobserved;
use crate::points::cloud::squared_distance;

fn tree_of(cloud: &Cloud) -> Neighbours {
    Neighbours::of(cloud, &Unobserved).unwrap()
}

fn brute_force(cloud: &Cloud, x: &[f64], count: usize) -> Vec<Neighbour> {
    let mut all: Vec<Neighbour> = cloud
        .points()
        .enumerate()
        .map(|(point, y)| Neighbour { point, squared_distance: squared_distance(x, y) })
        .collect();
    all.sort_by(|a, b| (a.squared_distance, a.point).partial_cmp(&(b.squared_distance, b.point)).unwrap());
    all.truncate(count);
    all
}

proptest! {
    #[test]
    fn nearest_agrees_with_a_scan(
        d in 1usize..5,
        cells in prop::collection::vec(0i8..6, 12..400),
        query in prop::collection::vec(-1.0f64..7.0, 5),
        count in 1usize..9,
    ) {
        // Small integer coordinates make ties and duplicates common.
        let n = cells.len() / d;
        let cloud = Cloud::new(cells[..n * d].iter().map(|&c| f64::from(c)).collect(), d).unwrap();
        let tree = tree_of(&cloud);
        prop_assert_eq!(tree.nearest(&query[..d], count), brute_force(&cloud, &query[..d], count));
        let grid: Vec<f64> = query[..d].iter().map(|x| x.round()).collect();
        prop_assert_eq!(tree.nearest(&grid, count), brute_force(&cloud, &grid, count));
        for scale in [1.0, 1e-140] {
            let cloud = Cloud::new(cloud.coordinates().iter().map(|x| scale * x).collect(), d).unwrap();
            let tree = tree_of(&cloud);
            let (mut walk, mut found) = (Walk::over(&tree), Vec::new());
            for x in [&query[..d], &grid, &grid, cloud.point(0), &[100.0; 5][..d], cloud.point(n - 1)] {
                let x: Vec<f64> = x.iter().map(|x| scale * x).collect();
                walk.points_into(&x, count, &mut found);
                prop_assert_eq!(&found, &tree.nearest_positions(&x, count));
            }
        }
    }
}

proptest! {
    #[test]
    fn nearest_agrees_with_a_scan_to_the_last_bit(
        d in 1usize..5,
        coordinates in prop::collection::vec(-1.0f64..1.0, 60..400),
        query in prop::collection::vec(-1.5f64..1.5, 5),
        count in 1usize..20,
    ) {
        let n = coordinates.len() / d;
        let cloud = Cloud::new(coordinates[..n * d].to_vec(), d).unwrap();
        let tree = tree_of(&cloud);
        prop_assert_eq!(tree.nearest(&query[..d], count), brute_force(&cloud, &query[..d], count));
        let (mut walk, mut found) = (Walk::over(&tree), Vec::new());
        for x in cloud.points() {
            walk.points_into(x, count, &mut found);
            prop_assert_eq!(&found, &brute_force(&cloud, x, count));
        }
    }
}

#[test]
fn halves_that_are_split_at_the_same_time_make_one_tree() {
    // Large enough for three levels of them, with copies.
    let mut raw = vec![0.0; 3 * 30_000];
    Random::of(7, 0).fill_normal(&mut raw);
    raw.extend_from_within(..3000);
    let cloud = Cloud::new(raw, 3).unwrap();
    let tree = tree_of(&cloud);
    assert_eq!(tree.n_positions(), 30_000);
    for x in cloud.points().step_by(1571) {
        assert_eq!(tree.nearest(x, 8), brute_force(&cloud, x, 8));
    }
}

#[test]
fn coinciding_points_are_not_neighbours_elsewhere() {
    let tree = tree_of(&Cloud::new(vec![0.0, 0.0, 3.0], 1).unwrap());
    let both = Some(Distances { nearest: 3.0, mean: 3.0 });
    assert_eq!([0, 1].map(|position| tree.distances(position, 4, &mut Vec::new())), [both, both]);
}

#[test]
fn repeated_observations_count_once() {
    let tree = tree_of(&Cloud::new(vec![0.0, 1.0, 1.0, -1.0, 1.0, 0.0, 5.0], 1).unwrap());
    let points = |count| -> Vec<usize> {
        tree.nearest_positions(&[0.0], count).iter().map(|found| found.point).collect()
    };
    assert_eq!(points(3), [0, 1, 3]);
    assert_eq!(points(9), [0, 1, 3, 6]);
    assert_eq!(tree.n_positions(), 4);
    assert!((0..4).any(|position| tree.points_at(position) == [1, 2, 4]));
}

#[test]
fn a_single_position_has_no_distances() {
    for n in [1, 50] {
        let tree = tree_of(&Cloud::new([1.0, 2.0].repeat(n), 2).unwrap());
        assert_eq!(tree.distances(0, 4, &mut Vec::new()), None);
        assert_eq!(tree.nearest(&[0.0, 2.0], 3).len(), n.min(3));
    }
}

#[test]
fn positions_whose_distance_underflows_are_one() {
    let tiny: Vec<f64> = (0..600).map(|i| 1e-310 * f64::from(i)).collect();
    let tree = tree_of(&Cloud::new(tiny, 3).unwrap());
    assert_eq!(tree.n_positions(), 1);
    assert_eq!(tree.nearest(&[0.0; 3], 2)[1], Neighbour { point: 1, squared_distance: 0.0 });
    // Powers of a half are distinct until their squares underflow.
    let powers: Vec<f64> = (0..1000).map(|i| 0.5f64.powi(i)).collect();
    let tree = tree_of(&Cloud::new(powers, 1).unwrap());
    // The positions are 2⁰ to 2⁻⁵¹¹ and 0. 2⁻⁵¹² is half a step and is rounded up.
    assert_eq!(tree.n_positions(), 513);
    assert!((0..tree.n_positions()).all(|p| tree.distances(p, 4, &mut Vec::new()).unwrap().nearest > 0.0));
}
