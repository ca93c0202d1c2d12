//! The tree from a cloud.

use std::borrow::Cow;
use std::cmp::Ordering;

use super::grid::{is_on_grid, on_grid};
use super::{LEAF_SIZE, Neighbours, Node};
use crate::error::NumericsError;
use crate::observer::Observer;
use crate::points::cloud::Cloud;

pub(super) fn tree(cloud: &Cloud, observer: &dyn Observer) -> Result<Neighbours, NumericsError> {
    let cloud = cloud_on_grid(cloud)?;
    let cloud = cloud.as_ref();
    let mut order: Vec<u32> = (0..cloud.n_points() as u32).collect();
    let mut builder = Builder { cloud, observer, nodes: Vec::new(), starts: Vec::new() };
    builder.split(&mut order, 0)?;
    let Builder { nodes, mut starts, .. } = builder;
    // A list of its size from the start: one that grows takes up to three times as much.
    let mut coordinates = Vec::with_capacity(starts.len() * cloud.dimension());
    for &start in &starts {
        let first = order[start as usize];
        coordinates.extend_from_slice(cloud.point(first as usize));
    }
    starts.push(order.len() as u32);
    starts.shrink_to_fit();
    Ok(Neighbours { dimension: cloud.dimension(), coordinates, points: order, starts, nodes })
}

/// The cloud with coordinates that are on the grid, as those of nearly every cloud are.
fn cloud_on_grid(cloud: &Cloud) -> Result<Cow<'_, Cloud>, NumericsError> {
    if is_on_grid(cloud.coordinates()) {
        return Ok(Cow::Borrowed(cloud));
    }
    let coordinates = cloud.coordinates().iter().map(|&x| on_grid(x)).collect();
    Cloud::new(coordinates, cloud.dimension()).map(Cow::Owned)
}

struct Builder<'a> {
    cloud: &'a Cloud,
    observer: &'a dyn Observer,
    nodes: Vec<Node>,
    /// Where the points of each position begin, leaf by leaf.
    starts: Vec<u32>,
}

/// The axis along which some points spread most, the first of several.
struct Widest {
    axis: usize,
    extent: f64,
}

impl Builder<'_> {
    /// Appends the nodes of these points, which come after `start` others.
    fn split(&mut self, order: &mut [u32], start: usize) -> Result<(), NumericsError> {
        self.observer.checkpoint()?;
        let Widest { axis, extent } = self.widest(order);
        if order.len() <= LEAF_SIZE || extent == 0.0 {
            self.push_leaf(order, start);
            return Ok(());
        }
        let n_left = self.partition(order, axis);
        let this = self.nodes.len();
        let (left, right) = order.split_at_mut(n_left);
        let below = left.iter().map(|&point| self.at(point, axis)).fold(f64::NEG_INFINITY, f64::max);
        let above = right.iter().map(|&point| self.at(point, axis)).fold(f64::INFINITY, f64::min);
        let node = |right: usize| Node::Split { axis: axis as u32, right: right as u32, below, above };
        self.nodes.push(node(0));
        self.split(left, start)?;
        self.nodes[this] = node(self.nodes.len());
        self.split(right, start + n_left)
    }

    /// Orders points along an axis into two parts without a coordinate in common, neither empty, and says how many are in the first.
    ///
    /// The border is one of the two at the median, whichever halves better. Were points with the median itself in both parts, a cloud
    /// with many of them would have parts that lie on top of each other, all of which each search must visit.
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

    /// Appends a leaf, its points ordered by position and index.
    fn push_leaf(&mut self, order: &mut [u32], start: usize) {
        let position = |point: u32| self.cloud.point(point as usize);
        order.sort_unstable_by(|&a, &b| {
            // Coordinates are numbers, so that there always is an order.
            let by_position = position(a).partial_cmp(position(b)).unwrap_or(Ordering::Equal);
            by_position.then(a.cmp(&b))
        });
        let first = self.starts.len() as u32;
        let mut at = start;
        for points in order.chunk_by(|&a, &b| position(a) == position(b)) {
            self.starts.push(at as u32);
            at += points.len();
        }
        self.nodes.push(Node::Leaf { start: first, end: self.starts.len() as u32 });
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

/// Moves the points for which `belongs` holds to the front, and says how many there are.
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
