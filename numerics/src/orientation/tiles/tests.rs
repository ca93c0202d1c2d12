//! Sides of clouds in tiles whose sides are known.

use super::{Border, Region, SignedPoints, Tile, TileRegions, Tiling, TilingSize, regions_of, sides_price};
use crate::error::NumericsError;
use crate::observer::Unobserved;
use crate::points::cloud::{Cloud, squared_distance};
use crate::points::sampling::Sampling;
use crate::testing::{Random, StopAt};

/// Reach of the points around a tile.
const REACH: f64 = 0.2;

/// A cloud with its normals, and where its signature function is defined.
struct Scene {
    points: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    /// Minus the gradient of the signature function.
    directions: Vec<[f64; 3]>,
    coarse: Vec<usize>,
}

impl Scene {
    /// A scene in which the signature function agrees with the normals, from a fiftieth of the points.
    fn of(points: Vec<[f64; 3]>, normals: Vec<[f64; 3]>) -> Self {
        let coarse = (0..points.len()).step_by(50).collect();
        Self { points, directions: normals.clone(), normals, coarse }
    }

    fn sphere(n: usize, seed: u64) -> Vec<[f64; 3]> {
        let mut random = Random(seed);
        (0..n).map(|_| unit([random.normal(), random.normal(), random.normal()])).collect()
    }

    /// Random points of a torus of radius 1 with a slim tube.
    fn ring(n: usize) -> Self {
        let mut random = Random(0);
        let (mut points, mut normals) = (Vec::new(), Vec::new());
        for _ in 0..n {
            let [u, v] = [(); 2].map(|()| std::f64::consts::TAU * random.uniform());
            let normal = [v.cos() * u.cos(), v.cos() * u.sin(), v.sin()];
            points.push([u.cos() + normal[0] / 30.0, u.sin() + normal[1] / 30.0, normal[2] / 30.0]);
            normals.push(normal);
        }
        Self::of(points, normals)
    }

    /// Signs of the normals, found in tiles, and whether these are doubtful.
    fn sides(&self, cell_of: impl Fn(&[f64; 3]) -> usize) -> Vec<(f64, bool)> {
        let cells: Vec<usize> = self.points.iter().map(cell_of).collect();
        let n_cells = cells.iter().max().unwrap() + 1;
        let mut tiles = Vec::new();
        // Of each point the regions of all tiles that see it, that of its own tile first.
        let mut regions = vec![Vec::new(); self.points.len()];
        let mut n_regions = 0;
        for cell in 0..n_cells {
            let is_own = |point: usize| cells[point] == cell;
            let is_near = |&point: &usize| {
                let near =
                    |other: usize| squared_distance(&self.points[point], &self.points[other]) < REACH * REACH;
                is_own(point) || n_cells > 1 && (0..cells.len()).any(|other| is_own(other) && near(other))
            };
            let near: Vec<usize> = (0..cells.len()).filter(is_near).collect();
            let found = self.regions(&near, is_own);
            for (&point, label) in near.iter().zip(found.labels) {
                let Some(label) = label else { continue };
                let at = if is_own(point) { 0 } else { regions[point].len() };
                regions[point].insert(at, n_regions + label);
            }
            n_regions += found.tile.regions.len();
            tiles.push(found.tile);
        }
        let links =
            regions.iter().flat_map(|of_point| of_point[1..].iter().map(|&other| [of_point[0], other]));
        let links: Vec<[usize; 2]> = links.collect();
        let sides = tiled(&tiles, &links).unwrap().sides(&Unobserved).unwrap();
        regions.iter().map(|of_point| (sides[of_point[0]].sign, sides[of_point[0]].is_doubtful)).collect()
    }

    fn regions(&self, near: &[usize], is_own: impl Fn(usize) -> bool) -> super::LabelledRegions {
        let rows = |of: &[[f64; 3]]| near.iter().flat_map(|&point| of[point]).collect::<Vec<f64>>();
        let cloud = Cloud::new(rows(&self.points), 3).unwrap();
        let sampling = Sampling::of(&cloud, &Unobserved).unwrap();
        let along = |&point: &usize| -> f64 {
            self.normals[point].iter().zip(self.directions[point]).map(|(a, b)| a * b).sum()
        };
        let has_sign: Vec<bool> = near.iter().map(|point| along(point).abs() > 0.2).collect();
        let places = |is_such: &dyn Fn(usize) -> bool| -> Vec<usize> {
            (0..near.len()).filter(|&at| is_such(near[at])).collect()
        };
        let (own, coarse) = (places(&is_own), places(&|point| self.coarse.contains(&point)));
        let normals = rows(&self.normals);
        let signed =
            SignedPoints { cloud: &cloud, sampling: &sampling, normals: &normals, has_sign: &has_sign };
        regions_of(&signed, &Tile { own: &own, coarse: &coarse }, &Unobserved).unwrap()
    }
}

fn unit(x: [f64; 3]) -> [f64; 3] {
    let length = x.iter().map(|c| c * c).sum::<f64>().sqrt();
    x.map(|c| c / length)
}

fn times(factor: f64, x: [f64; 3]) -> [f64; 3] {
    x.map(|c| factor * c)
}

fn in_one_tile(_: &[f64; 3]) -> usize {
    0
}

fn in_three_tiles(x: &[f64; 3]) -> usize {
    usize::from(x[0] > -0.4) + usize::from(x[0] > 0.4)
}

#[test]
fn flipped_regions_are_turned_outward() {
    let outward = Scene::sphere(3000, 0);
    let expected = |x: &[f64; 3]| if x[2] > 0.2 { -1.0 } else { 1.0 };
    let mut random = Random(1);
    // The function says little at a tenth of the points.
    let says: Vec<f64> = outward.iter().map(|_| if random.uniform() < 0.9 { 1.0 } else { 0.1 }).collect();
    for (side, cell_of) in [
        (1.0, in_one_tile as fn(&[f64; 3]) -> usize),
        (-1.0, in_one_tile),
        (1.0, in_three_tiles),
        (-1.0, in_three_tiles),
    ] {
        let normals: Vec<[f64; 3]> = outward.iter().map(|x| times(side * expected(x), *x)).collect();
        let mut scene = Scene::of(outward.clone(), normals.clone());
        scene.directions = normals.iter().zip(&says).map(|(normal, says)| times(*says, *normal)).collect();
        for (x, (sign, is_doubtful)) in outward.iter().zip(scene.sides(cell_of)) {
            assert_eq!((sign, is_doubtful), (side * expected(x), false));
        }
    }
}

#[test]
fn sides_that_few_coarse_points_choose_are_doubtful() {
    for (n_coarse, are_doubtful) in [(3, true), (40, false)] {
        for side in [1.0, -1.0] {
            let mut scene = Scene::ring(4000);
            scene.normals.iter_mut().for_each(|normal| *normal = times(side, *normal));
            scene.directions.clone_from(&scene.normals);
            scene.coarse = (0..n_coarse).map(|at| at * 3999 / (n_coarse - 1)).collect();
            // The side is that of the function: so slim a ring has almost no volume.
            assert!(scene.sides(in_one_tile).iter().all(|side| *side == (1.0, are_doubtful)));
        }
    }
}

#[test]
fn sides_of_which_the_function_says_both_are_doubtful() {
    let mut scene = Scene::ring(4000);
    let sign = |x: &[f64; 3]| if x[0] > 0.1 { -1.0 } else { 1.0 };
    scene.normals =
        scene.points.iter().zip(&scene.normals).map(|(x, normal)| times(sign(x), *normal)).collect();
    scene.directions.clone_from(&scene.normals);
    let sides = scene.sides(in_one_tile);
    // The volume is positive with the signs that are expected.
    assert!(scene.points.iter().zip(&sides).all(|(x, side)| *side == (sign(x), true)));
}

#[test]
fn pieces_inside_of_another_are_not_turned_by_their_volume() {
    // A hollow shell, the normals of which point away from its material.
    let (outer, inner) = (Scene::sphere(4000, 0), Scene::sphere(1000, 1));
    let points = outer.iter().copied().chain(inner.iter().map(|x| times(0.5, *x))).collect();
    let normals = outer.iter().copied().chain(inner.iter().map(|x| times(-1.0, *x))).collect();
    let mut scene = Scene::of(points, normals);
    assert!(scene.sides(in_one_tile).iter().all(|side| *side == (1.0, false)));
    scene.coarse = (0..4000).step_by(50).chain([4000, 4500]).collect();
    let doubts: Vec<bool> = scene.sides(in_one_tile).iter().map(|side| side.1).collect();
    assert!(doubts[..4000].iter().all(|is_doubtful| !is_doubtful));
    assert!(doubts[4000..].iter().all(|&is_doubtful| is_doubtful));
}

#[test]
fn a_few_points_on_a_surface_are_not_doubtful() {
    let outer = Scene::sphere(4000, 0);
    let few = outer[..9].iter();
    // Their normals lie across, so that they share no edge with the others.
    let points = outer.iter().copied().chain(few.clone().map(|x| times(1.3, *x))).collect();
    let normals = outer.iter().copied().chain(few.map(|x| [x[2], x[0], x[1]])).collect();
    assert!(Scene::of(points, normals).sides(in_one_tile).iter().all(|side| !side.1));
}

#[test]
fn surfaces_that_touch_keep_their_sides() {
    // A sphere lies above another. Normals are opposite where they touch. If they were joined there, one of
    // them would be inside out.
    let (upper, lower) = (Scene::sphere(3000, 0), Scene::sphere(3000, 1));
    let points = upper.iter().copied().chain(lower.iter().map(|x| [x[0], x[1], x[2] + 2.0])).collect();
    let normals = upper.iter().chain(&lower).copied().collect();
    assert!(Scene::of(points, normals).sides(in_one_tile).iter().all(|side| *side == (1.0, false)));
}

fn tiled<'a>(tiles: &'a [TileRegions], links: &'a [[usize; 2]]) -> Result<Tiling<'a>, NumericsError> {
    Tiling::of(tiles, links, &Unobserved)
}

#[test]
fn what_leads_to_no_region_is_refused_by_its_place() {
    let sphere = Scene::sphere(100, 0);
    let scene = Scene::of(sphere.clone(), sphere);
    let all: Vec<usize> = (0..100).collect();
    let whole = scene.regions(&all, |_| true).tile;
    assert_eq!(tiled(&[], &[]).unwrap().sides(&Unobserved), Ok(Vec::new()));
    let far = tiled(std::slice::from_ref(&whole), &[[0, 0], [0, 9]]).err().unwrap();
    assert_eq!(far, NumericsError::InvalidLink { link: 1 });
    let refused = |change: &dyn Fn(&mut TileRegions)| {
        let mut changed = whole.clone();
        change(&mut changed);
        tiled(&[whole.clone(), changed], &[]).err()
    };
    let is_tile = |error| matches!(error, Some(NumericsError::InvalidTile { tile: 1, .. }));
    let is_region = |error| matches!(error, Some(NumericsError::InvalidRegion { tile: 1, region: 0, .. }));
    assert!(is_tile(refused(&|tile| tile.borders[0].regions[1] = 9)));
    assert!(is_tile(refused(&|tile| tile.n_edges += 1)));
    assert!(is_region(refused(&|tile| tile.regions[0].n_points = usize::MAX)));
    assert!(is_region(refused(&|tile| tile.regions[0].n_signed += 1)));
    assert!(is_region(refused(&|tile| tile.regions[0].n_coarse = 101)));
    assert!(is_region(refused(&|tile| {
        tile.regions[0].lower.pop();
    })));
    assert_eq!(refused(&|_| {}), None);
}

/// Tiles with so many regions of no point, with borders and links between them.
fn empty_regions(n: usize) -> (TileRegions, Vec<[usize; 2]>) {
    let region = |at: usize| Region {
        n_points: 0,
        n_signed: 0,
        n_coarse: 0,
        area: 0.0,
        centre: vec![at as f64; 3],
        spread: 0.0,
        normal: vec![0.0; 3],
        volume: 0.0,
        lower: vec![at as f64; 3],
        upper: vec![at as f64; 3],
    };
    let border = |at: usize| Border { regions: [at, (at * 7) % n], agreeing: 1.0, opposing: 0.5 };
    let tile = TileRegions {
        regions: (0..n).map(region).collect(),
        borders: (0..n).step_by(2).map(border).collect(),
        n_edges: 0,
    };
    (tile, (0..n / 4).map(|at| [at, at + 1]).collect())
}

#[test]
fn sides_stop_at_every_checkpoint_and_have_more_for_more_regions() {
    let n_checkpoints = |n: usize, last: usize| {
        let (tile, links) = empty_regions(n);
        let observer = StopAt::checkpoint(last);
        let tiles = [tile];
        let sides = Tiling::of(&tiles, &links, &observer).and_then(|tiling| tiling.sides(&observer));
        (sides.map(|sides| sides.len()), observer.n_checkpoints())
    };
    let (sides, few) = n_checkpoints(2000, usize::MAX);
    assert_eq!(sides, Ok(2000));
    let (sides, many) = n_checkpoints(20_000, usize::MAX);
    assert_eq!(sides, Ok(20_000));
    assert!(many > 5 * few, "{few} and {many}");
    for last in (0..few).step_by(few.div_ceil(40)) {
        assert_eq!(n_checkpoints(2000, last).0, Err(NumericsError::Cancelled), "{last}");
    }
}

#[test]
fn prices_grow_as_the_regions_and_what_each_is_compared_with() {
    let flops = |n_regions: usize| {
        let size = TilingSize { n_regions, n_borders: n_regions, n_coordinates: 12 * n_regions };
        sides_price(size).flops
    };
    // Below a hundred regions each may be compared with each, and beyond that with a hundred.
    assert!(flops(100) > 12.0 * flops(10));
    assert!((flops(1_000_000) / flops(100_000) - 10.0).abs() < 1.5);
}
