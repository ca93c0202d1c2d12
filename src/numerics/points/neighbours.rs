//! Nearest neighbours in a cloud, by a k-d tree.

use rayon::prelude::*;

use super::cloud::{Cloud, squared_distance};
use crate::numerics::machine::heap::vec_bytes;
use crate::numerics::machine::small::{Small, zeros};

/// Points per leaf: scanning 12 points costs about what two more levels of descent do.
const LEAF_SIZE: usize = 12;

/// A k-d tree over the points of a cloud (Bentley 1975), any dimension.
///
/// Built in O(n log n) by median splits of the widest coordinate, and asked together with the cloud it was built from. Ties of
/// distance are broken by the smaller index, so answers do not depend on the tree.
#[derive(Debug, Clone)]
pub struct Neighbours {
    /// Points leaf by leaf.
    order: Vec<u32>,
    /// Their coordinates in that order, `[n, d]`.
    coordinates: Vec<f64>,
    nodes: Vec<Node>,
}

#[derive(Debug, Clone, Copy)]
enum Node {
    Leaf {
        start: u32,
        end: u32,
    },
    /// The left child follows its parent, `right` is the index of the other.
    Split {
        axis: u32,
        at: f64,
        right: u32,
    },
}

/// A neighbour and its squared distance (unit L²).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    pub point: usize,
    pub squared_distance: f64,
}

impl Neighbours {
    /// Builds the tree. Clouds beyond 2³² points are out of reach of every solver and of the service's limits.
    pub fn of(cloud: &Cloud) -> Self {
        let mut order: Vec<u32> = (0..cloud.n_points() as u32).collect();
        let mut nodes = Vec::new();
        split(cloud, &mut order, 0, &mut nodes);
        // Of its size from the start: a list that grows takes up to three times as much.
        let mut coordinates = Vec::with_capacity(cloud.coordinates().len());
        order.iter().for_each(|&point| coordinates.extend_from_slice(cloud.point(point as usize)));
        Self { order, coordinates, nodes }
    }

    /// The `count` nearest points to `x`, nearest first; fewer if the cloud has fewer.
    pub fn nearest(&self, cloud: &Cloud, x: &[f64], count: usize) -> Vec<Neighbour> {
        let mut found = Vec::new();
        self.search(cloud, x, count, 0.0, &mut found);
        found
    }

    /// [`Neighbours::nearest`] into a list that is there already.
    pub fn nearest_into(&self, cloud: &Cloud, x: &[f64], count: usize, found: &mut Vec<Neighbour>) {
        self.search(cloud, x, count, 0.0, found);
    }

    /// The `count` nearest points that do not coincide with `x`, nearest first.
    pub fn nearest_elsewhere(&self, cloud: &Cloud, x: &[f64], count: usize) -> Vec<Neighbour> {
        let mut found = Vec::new();
        self.search(cloud, x, count, f64::from_bits(1), &mut found);
        found
    }

    /// The `count` nearest positions, each by its first point, nearest first: repeated observations count once.
    pub fn nearest_positions(&self, cloud: &Cloud, x: &[f64], count: usize) -> Vec<Neighbour> {
        let mut found = Vec::new();
        self.positions(cloud, x, count, 0.0, &mut found);
        found
    }

    /// [`Neighbours::nearest_positions`] into a list that is there already.
    pub fn nearest_positions_into(&self, cloud: &Cloud, x: &[f64], count: usize, found: &mut Vec<Neighbour>) {
        self.positions(cloud, x, count, 0.0, found);
    }

    fn positions(&self, cloud: &Cloud, x: &[f64], count: usize, at_least: f64, found: &mut Vec<Neighbour>) {
        let mut n_asked = count;
        loop {
            self.search(cloud, x, n_asked, at_least, found);
            let n_found = found.len();
            keep_positions(cloud, found);
            if found.len() >= count || n_found < n_asked {
                found.truncate(count);
                return;
            }
            n_asked *= 2;
        }
    }

    /// The least and the mean distance from a point to its `count` nearest positions elsewhere, unit L, with a list to put them
    /// into; `None` if there are none.
    pub fn nearest_and_mean(
        &self,
        cloud: &Cloud,
        point: usize,
        count: usize,
        found: &mut Vec<Neighbour>,
    ) -> Option<(f64, f64)> {
        self.positions(cloud, cloud.point(point), count, f64::from_bits(1), found);
        let distances = found.iter().map(|n| n.squared_distance.sqrt());
        Some((distances.clone().next()?, distances.sum::<f64>() / found.len() as f64))
    }

    /// Distance from every point to the nearest point elsewhere, unit L; empty if all points coincide.
    pub fn spacings(&self, cloud: &Cloud) -> Vec<f64> {
        let nearest = |point: usize| self.nearest_elsewhere(cloud, cloud.point(point), 1).first().copied();
        (0..cloud.n_points())
            .into_par_iter()
            .filter_map(|p| Some(nearest(p)?.squared_distance.sqrt()))
            .collect()
    }

    fn search(&self, cloud: &Cloud, x: &[f64], count: usize, at_least: f64, found: &mut Vec<Neighbour>) {
        found.clear();
        if count == 0 {
            return;
        }
        let (d, reach) = (cloud.dimension(), f64::INFINITY);
        let mut search = Search { x, count, at_least, offsets: zeros(d), reach, found };
        match d {
            2 => self.visit::<2>(0, &mut search),
            3 => self.visit::<3>(0, &mut search),
            _ => self.visit::<0>(0, &mut search),
        }
    }

    /// D is the dimension where the compiler shall know it, else 0.
    fn visit<const D: usize>(&self, node: usize, search: &mut Search<'_>) {
        match self.nodes[node] {
            Node::Leaf { start, end } => {
                let d = if D == 0 { search.x.len() } else { D };
                let (start, end) = (start as usize, end as usize);
                let points = self.coordinates[start * d..end * d].chunks_exact(d);
                for (point, y) in self.order[start..end].iter().zip(points) {
                    let squared_distance = squared_distance(&search.x[..d], &y[..d]);
                    search.offer(Neighbour { point: *point as usize, squared_distance });
                }
            }
            Node::Split { axis, at, right } => {
                let offset = search.x[axis as usize] - at;
                let (near, far) =
                    if offset < 0.0 { (node + 1, right as usize) } else { (right as usize, node + 1) };
                self.visit::<D>(near, search);
                let before = std::mem::replace(&mut search.offsets[axis as usize], offset);
                if search.squared_distance_of_cell::<D>() <= search.reach {
                    self.visit::<D>(far, search);
                }
                search.offsets[axis as usize] = before;
            }
        }
    }

    /// Bytes held on the heap.
    pub fn n_bytes(&self) -> usize {
        vec_bytes(&self.order) + vec_bytes(&self.coordinates) + vec_bytes(&self.nodes)
    }
}

/// Appends the nodes of these points, which come after `start` others.
fn split(cloud: &Cloud, order: &mut [u32], start: usize, nodes: &mut Vec<Node>) {
    let (axis, extent) = widest_axis(cloud, order);
    if order.len() <= LEAF_SIZE || extent == 0.0 {
        nodes.push(Node::Leaf { start: start as u32, end: (start + order.len()) as u32 });
        return;
    }
    let coordinate = |point: u32| cloud.point(point as usize)[axis];
    let middle = order.len() / 2;
    let (_, &mut median, _) =
        order.select_nth_unstable_by(middle, |&a, &b| coordinate(a).total_cmp(&coordinate(b)));
    let (this, at) = (nodes.len(), coordinate(median));
    nodes.push(Node::Split { axis: axis as u32, at, right: 0 });
    let (left, right) = order.split_at_mut(middle);
    split(cloud, left, start, nodes);
    nodes[this] = Node::Split { axis: axis as u32, at, right: nodes.len() as u32 };
    split(cloud, right, start + middle, nodes);
}

struct Search<'a> {
    x: &'a [f64],
    count: usize,
    at_least: f64,
    /// From x to the cell at hand, along each axis (Arya and Mount 1993).
    offsets: Small,
    /// Squared distance beyond which nothing can be among the nearest any more.
    reach: f64,
    /// Sorted.
    found: &'a mut Vec<Neighbour>,
}

impl Search<'_> {
    /// At most that of any point in the cell, to the last bit: rounding is monotonic, and the terms are added in the same order.
    fn squared_distance_of_cell<const D: usize>(&self) -> f64 {
        let d = if D == 0 { self.offsets.len() } else { D };
        self.offsets[..d].iter().map(|offset| offset * offset).sum()
    }

    fn offer(&mut self, candidate: Neighbour) {
        if candidate.squared_distance < self.at_least || candidate.squared_distance > self.reach {
            return;
        }
        let key = |n: &Neighbour| (n.squared_distance, n.point);
        if self.found.len() < self.count {
            self.found.push(candidate);
        } else if key(&candidate) < key(&self.found[self.count - 1]) {
            self.found[self.count - 1] = candidate;
        } else {
            return;
        }
        let mut place = self.found.len() - 1;
        while place > 0 && key(&candidate) < key(&self.found[place - 1]) {
            self.found.swap(place - 1, place);
            place -= 1;
        }
        if self.found.len() == self.count {
            self.reach = self.found[self.count - 1].squared_distance;
        }
    }
}

/// Of sorted neighbours, those at a position that none before them has.
fn keep_positions(cloud: &Cloud, found: &mut Vec<Neighbour>) {
    let mut n_kept = 0;
    for at in 0..found.len() {
        let next = found[at];
        // Coinciding points are equally far.
        let peers = found[..n_kept].iter().rev().take_while(|d| d.squared_distance == next.squared_distance);
        let is_known = peers.into_iter().any(|d| cloud.point(d.point) == cloud.point(next.point));
        if !is_known {
            found[n_kept] = next;
            n_kept += 1;
        }
    }
    found.truncate(n_kept);
}

fn widest_axis(cloud: &Cloud, order: &[u32]) -> (usize, f64) {
    let mut widest = (0, 0.0);
    for axis in 0..cloud.dimension() {
        let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
        for &point in order {
            let x = cloud.point(point as usize)[axis];
            min = min.min(x);
            max = max.max(x);
        }
        if max - min > widest.1 {
            widest = (axis, max - min);
        }
    }
    widest
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn brute_force(cloud: &Cloud, x: &[f64], count: usize) -> Vec<Neighbour> {
        let mut all: Vec<Neighbour> = cloud
            .points()
            .enumerate()
            .map(|(point, y)| Neighbour { point, squared_distance: squared_distance(x, y) })
            .collect();
        all.sort_by(|a, b| {
            (a.squared_distance, a.point).partial_cmp(&(b.squared_distance, b.point)).unwrap()
        });
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
            let tree = Neighbours::of(&cloud);
            prop_assert_eq!(tree.nearest(&cloud, &query[..d], count), brute_force(&cloud, &query[..d], count));
            let grid: Vec<f64> = query[..d].iter().map(|x| x.round()).collect();
            prop_assert_eq!(tree.nearest(&cloud, &grid, count), brute_force(&cloud, &grid, count));
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
            let tree = Neighbours::of(&cloud);
            prop_assert_eq!(tree.nearest(&cloud, &query[..d], count), brute_force(&cloud, &query[..d], count));
        }
    }

    #[test]
    fn coinciding_points_are_not_neighbours_elsewhere() {
        let cloud = Cloud::new(vec![0.0, 0.0, 3.0], 1).unwrap();
        let tree = Neighbours::of(&cloud);
        assert_eq!(
            tree.nearest_elsewhere(&cloud, &[0.0], 4),
            [Neighbour { point: 2, squared_distance: 9.0 }]
        );
        assert_eq!(tree.spacings(&cloud), [3.0, 3.0, 3.0]);
        assert_eq!(tree.nearest_and_mean(&cloud, 2, 4, &mut Vec::new()), Some((3.0, 3.0)));
    }

    #[test]
    fn repeated_observations_count_once() {
        let cloud = Cloud::new(vec![0.0, 1.0, 1.0, -1.0, 1.0, 0.0, 5.0], 1).unwrap();
        let tree = Neighbours::of(&cloud);
        let points = |count| -> Vec<usize> {
            tree.nearest_positions(&cloud, &[0.0], count).iter().map(|found| found.point).collect()
        };
        assert_eq!(points(3), [0, 1, 3]);
        assert_eq!(points(9), [0, 1, 3, 6]);
        assert_eq!(tree.nearest_and_mean(&cloud, 0, 2, &mut Vec::new()), Some((1.0, 1.0)));
    }

    #[test]
    fn a_single_point_has_no_spacing() {
        let cloud = Cloud::new(vec![1.0, 2.0], 2).unwrap();
        assert_eq!(Neighbours::of(&cloud).nearest_and_mean(&cloud, 0, 4, &mut Vec::new()), None);
    }
}
