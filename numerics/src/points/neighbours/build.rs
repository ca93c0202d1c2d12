//! Construction of the k-d tree.

use std::borrow::Cow;
use std::cmp::Ordering;

use super::grid::{is_on_grid, on_grid};
use super::{LEAF_SIZE, Neighbours, Node};
use crate::error::Result;
use crate::observer::Observer;
use crate::points::cloud::Cloud;

pub(super) fn tree(cloud: &Cloud, observer: &dyn Observer) -> Result<Neighbours> {
    let cloud = cloud_on_grid(cloud)?;
    let cloud = cloud.as_ref();
    let mut order: Vec<u32> = (0..cloud.n_points() as u32).collect();
    let mut tree = Part::default();
    Builder { cloud, observer }.split(&mut tree, &mut order, 0)?;
    let Part { nodes, mut starts } = tree;
    // Allocated at its final size: a growing list takes up to three times as much.
    let mut coordinates = Vec::with_capacity(starts.len() * cloud.dimension());
    for &start in &starts {
        let first = order[start as usize];
        coordinates.extend_from_slice(cloud.point(first as usize));
    }
    starts.push(order.len() as u32);
    starts.shrink_to_fit();
    Ok(Neighbours { dimension: cloud.dimension(), coordinates, points: order, starts, nodes })
}

/// Returns the cloud with its coordinates rounded to the grid. Nearly every cloud lies on it already and is
/// borrowed.
fn cloud_on_grid(cloud: &Cloud) -> Result<Cow<'_, Cloud>> {
    if is_on_grid(cloud.coordinates()) {
        return Ok(Cow::Borrowed(cloud));
    }
    let coordinates = cloud.coordinates().iter().map(|&x| on_grid(x)).collect();
    Cloud::new(coordinates, cloud.dimension()).map(Cow::Owned)
}

/// Points of the smaller half from which both halves are split at the same time.
const TOGETHER: usize = 4096;

struct Builder<'a> {
    cloud: &'a Cloud,
    observer: &'a dyn Observer,
}

/// A part of a tree.
#[derive(Default)]
struct Part {
    nodes: Vec<Node>,
    /// First point of each position, as an index into the order of the points, leaf by leaf.
    starts: Vec<u32>,
}

impl Part {
    /// Appends a part whose nodes and positions were counted from 0.
    fn append(&mut self, other: &mut Self) {
        let (n_nodes, n_positions) = (self.nodes.len() as u32, self.starts.len() as u32);
        for node in &mut other.nodes {
            match node {
                Node::Leaf { start, end } => (*start, *end) = (*start + n_positions, *end + n_positions),
                Node::Split { right, .. } => *right += n_nodes,
            }
        }
        self.nodes.append(&mut other.nodes);
        self.starts.append(&mut other.starts);
    }
}

/// The axis with the greatest extent of some points. Ties go to the first axis.
struct Widest {
    axis: usize,
    extent: f64,
}

impl Builder<'_> {
    /// Appends the nodes of these points. `start` points come before them.
    fn split(&self, tree: &mut Part, order: &mut [u32], start: usize) -> Result<()> {
        self.observer.checkpoint()?;
        let Widest { axis, extent } = self.widest(order);
        if order.len() <= LEAF_SIZE || extent == 0.0 {
            self.push_leaf(tree, order, start);
            return Ok(());
        }
        let n_left = self.partition(order, axis);
        let this = tree.nodes.len();
        let (left, right) = order.split_at_mut(n_left);
        let below = left.iter().map(|&point| self.at(point, axis)).fold(f64::NEG_INFINITY, f64::max);
        let above = right.iter().map(|&point| self.at(point, axis)).fold(f64::INFINITY, f64::min);
        let node = |right: usize| Node::Split { axis: axis as u32, right: right as u32, below, above };
        tree.nodes.push(node(0));
        if left.len().min(right.len()) < TOGETHER {
            self.split(tree, left, start)?;
            tree.nodes[this] = node(tree.nodes.len());
            return self.split(tree, right, start + n_left);
        }
        let (mut of_left, mut of_right) = (Part::default(), Part::default());
        let (on_left, on_right) = rayon::join(
            || self.split(&mut of_left, left, start),
            || self.split(&mut of_right, right, start + n_left),
        );
        on_left.and(on_right)?;
        tree.append(&mut of_left);
        tree.nodes[this] = node(tree.nodes.len());
        tree.append(&mut of_right);
        Ok(())
    }

    /// Partitions points along an axis into two non-empty parts that share no coordinate, and returns the
    /// size of the first.
    ///
    /// The border lies just below or just above the median, whichever halves better. If both parts held
    /// points at the median, many such points would make the parts overlap. Every search would have to visit
    /// both.
    fn partition(&self, order: &mut [u32], axis: usize) -> usize {
        let middle = order.len() / 2;
        let compare = |&a: &u32, &b: &u32| self.at(a, axis).total_cmp(&self.at(b, axis));
        let (_, &mut median, _) = order.select_nth_unstable_by(middle, compare);
        let median = self.at(median, axis);
        let n_below = gather(&mut order[..middle], |point| self.at(point, axis) < median);
        let n_more = gather(&mut order[middle..], |point| self.at(point, axis) <= median);
        let n_up_to = middle + n_more;
        let n_smaller = |n_left: usize| n_left.min(order.len() - n_left);
        if n_smaller(n_below) >= n_smaller(n_up_to) { n_below } else { n_up_to }
    }

    /// Appends a leaf. Its points are ordered by position, then by index.
    fn push_leaf(&self, tree: &mut Part, order: &mut [u32], start: usize) {
        let position = |point: u32| self.cloud.point(point as usize);
        order.sort_unstable_by(|&a, &b| {
            // Coordinates are never NaN, so there always is an order.
            let by_position = position(a).partial_cmp(position(b)).unwrap_or(Ordering::Equal);
            by_position.then(a.cmp(&b))
        });
        let first = tree.starts.len() as u32;
        let mut at = start;
        for points in order.chunk_by(|&a, &b| position(a) == position(b)) {
            tree.starts.push(at as u32);
            at += points.len();
        }
        tree.nodes.push(Node::Leaf { start: first, end: tree.starts.len() as u32 });
    }

    fn at(&self, point: u32, axis: usize) -> f64 {
        self.cloud.point(point as usize)[axis]
    }

    fn widest(&self, order: &[u32]) -> Widest {
        let mut widest = Widest { axis: 0, extent: 0.0 };
        for axis in 0..self.cloud.dimension() {
            let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
            for &point in order {
                let x = self.at(point, axis);
                min = min.min(x);
                max = max.max(x);
            }
            if max - min > widest.extent {
                widest = Widest { axis, extent: max - min };
            }
        }
        widest
    }
}

/// Moves the points for which `belongs` holds to the front and returns their number.
fn gather(order: &mut [u32], belongs: impl Fn(u32) -> bool) -> usize {
    let mut n_in_front = 0;
    for at in 0..order.len() {
        if belongs(order[at]) {
            order.swap(at, n_in_front);
            n_in_front += 1;
        }
    }
    n_in_front
}
