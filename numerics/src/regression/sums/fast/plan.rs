//! A product with given accuracy.

use rayon::prelude::*;

use super::FastSums;
use super::grid::Grid;
use super::lists::Lists;
use crate::error::Result;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::sums::expansion::Expansion;
use crate::regression::sums::many::values_of_each;

/// Points of a cluster, for each node of its grid, below which it is not halved. Pairs of points and pairs of
/// nodes then take about equal time.
const POINTS_PER_NODE: f64 = 0.8;

/// Clusters of a level whose nodes are counted.
const COUNTED: usize = 64;

/// Sources that are summed over at once: what they need fits into the nearest cache.
const SOURCES: usize = 1024;

/// The pairs of clusters, with the nodes of those that have well-separated pairs.
pub(crate) struct Plan<'a> {
    of: &'a FastSums,
    lists: Lists,
    /// Index of the first of the smallest clusters.
    smallest: usize,
    /// By index.
    grids: Vec<Option<Grid<'a>>>,
}

/// Places with k lists of weights.
struct Sources {
    /// `[r, d]`.
    coordinates: Vec<f64>,
    /// `[k][r]`.
    weights: Vec<Vec<f64>>,
}

impl<'a> Plan<'a> {
    pub(super) fn of(of: &'a FastSums, accuracy: f64) -> Self {
        let smallest = smallest(of, accuracy);
        let lists = Lists::of(&of.clusters, smallest);
        let grid = |(index, far): (usize, &Vec<u32>)| {
            (!far.is_empty()).then(|| Grid::of(of.clusters.at(index), accuracy))
        };
        Self { grids: lists.far.iter().enumerate().map(grid).collect(), of, lists, smallest }
    }

    /// Number of kernels that a product evaluates.
    pub(crate) fn n_pairs(&self) -> f64 {
        let n_points = |index: usize| self.of.clusters.at(index).points.len() as f64;
        let n_nodes = |index: usize| self.grids[index].as_ref().map_or(0, Grid::n_nodes) as f64;
        let near = pairs(&self.lists.near, n_points);
        near + pairs(&self.lists.far, n_nodes)
    }

    /// `Σ_j λ_j k(x_i, x_j)` at every point for columns of weights, `[n, k]`.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Overflow`], whose query is none of the points, if a sum leaves float64.
    /// [`crate::error::NumericsError::Cancelled`].
    pub(crate) fn times(&self, columns: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
        let order = &self.of.clusters.order;
        let n = order.len();
        let ordered = |column: &[f64]| order.iter().map(|&point| column[point as usize]).collect();
        let columns: Vec<Vec<f64>> = columns.chunks_exact(n).map(ordered).collect();
        let of_nodes = self.weights_of_nodes(&columns, observer)?;
        let at_nodes = self.fields_at_nodes(&of_nodes, observer)?;
        let leaves = (self.smallest..2 * self.smallest).into_par_iter();
        let sums = leaves.map(|leaf| self.sums_at(leaf, &columns, &at_nodes, observer));
        let sums: Vec<Vec<Vec<f64>>> = sums.collect::<Result<_>>()?;
        let mut products = vec![0.0; columns.len() * n];
        for (at, product) in products.chunks_exact_mut(n).enumerate() {
            let of_column = sums.iter().flat_map(|leaf| &leaf[at]);
            order.iter().zip(of_column).for_each(|(&point, sum)| product[point as usize] = *sum);
        }
        Ok(products)
    }

    /// Weights of the nodes of each cluster, by index, for each column.
    fn weights_of_nodes(&self, columns: &[Vec<f64>], observer: &dyn Observer) -> Result<Vec<Vec<Vec<f64>>>> {
        let clusters = &self.of.clusters;
        let grids = self.grids.par_iter().enumerate();
        let weights = grids.map(|(index, grid)| {
            let Some(grid) = grid else { return Ok(Vec::new()) };
            observer.checkpoint()?;
            let range = clusters.at(index).points.clone();
            let of = |column: &Vec<f64>| grid.weights(clusters.coordinates(index), &column[range.clone()]);
            Ok(columns.iter().map(of).collect())
        });
        weights.collect()
    }

    /// Values at the nodes of each cluster, by index, of all clusters that are well separated from it.
    fn fields_at_nodes(
        &self,
        of_nodes: &[Vec<Vec<f64>>],
        observer: &dyn Observer,
    ) -> Result<Vec<Vec<Vec<f64>>>> {
        let grids = self.grids.par_iter().enumerate();
        let fields = grids.map(|(index, grid)| {
            let Some(grid) = grid else { return Ok(Vec::new()) };
            let others = self.lists.far[index].iter().map(|&other| other as usize);
            let mut sources =
                Sources { coordinates: Vec::new(), weights: vec![Vec::new(); of_nodes[index].len()] };
            for other in others {
                self.grids[other].iter().for_each(|grid| sources.coordinates.extend(grid.nodes()));
                sources.weights.iter_mut().zip(&of_nodes[other]).for_each(|(to, weights)| to.extend(weights));
            }
            self.fields(&sources, grid.nodes(), observer)
        });
        fields.collect()
    }

    /// Sums at the points of one of the smallest clusters, for each column.
    fn sums_at(
        &self,
        leaf: usize,
        columns: &[Vec<f64>],
        at_nodes: &[Vec<Vec<f64>>],
        observer: &dyn Observer,
    ) -> Result<Vec<Vec<f64>>> {
        let clusters = &self.of.clusters;
        let own = clusters.coordinates(leaf);
        let mut sources = Sources { coordinates: Vec::new(), weights: vec![Vec::new(); columns.len()] };
        for other in self.lists.near[leaf].iter().map(|&other| other as usize) {
            let range = clusters.at(other).points.clone();
            sources.coordinates.extend(clusters.coordinates(other));
            let weights = sources.weights.iter_mut().zip(columns);
            weights.for_each(|(to, column)| to.extend(&column[range.clone()]));
        }
        let mut sums = self.fields(&sources, own.to_vec(), observer)?;
        // The cluster and all that it is part of.
        for index in std::iter::successors(Some(leaf), |index| (*index > 1).then_some(index / 2)) {
            let Some(grid) = &self.grids[index] else { continue };
            sums.iter_mut()
                .zip(&at_nodes[index])
                .for_each(|(sums, at_nodes)| grid.add_to(sums, own, at_nodes));
        }
        Ok(sums)
    }

    /// Values of the sources' kernels at places `[m, d]`, for each list of weights.
    fn fields(&self, sources: &Sources, places: Vec<f64>, observer: &dyn Observer) -> Result<Vec<Vec<f64>>> {
        let d = self.of.clusters.points.dimension();
        let (places, kernel) = (Cloud::new(places, d)?, &self.of.kernel);
        let mut fields = vec![vec![0.0; places.n_points()]; sources.weights.len()];
        for (block, coordinates) in sources.coordinates.chunks(SOURCES * d).enumerate() {
            let centres = Cloud::new(coordinates.to_vec(), d)?;
            let range = block * SOURCES..block * SOURCES + centres.n_points();
            let found = if let [weights] = &sources.weights[..] {
                Expansion { centres: &centres, kernel, weights: &weights[range] }
                    .values_at(&places, observer)?
            } else {
                let weights: Vec<&[f64]> =
                    sources.weights.iter().map(|weights| &weights[range.clone()]).collect();
                values_of_each(&centres, kernel, &weights.concat(), &places, observer)?
            };
            for (field, found) in fields.iter_mut().zip(found.chunks_exact(places.n_points())) {
                field.iter_mut().zip(found).for_each(|(sum, value)| *sum += value);
            }
        }
        Ok(fields)
    }
}

/// Sum of products of sizes over pairs.
fn pairs(lists: &[Vec<u32>], size: impl Fn(usize) -> f64) -> f64 {
    let others = |list: &Vec<u32>| list.iter().map(|&other| size(other as usize)).sum::<f64>();
    let lists = lists.iter().enumerate().filter(|(_, list)| !list.is_empty());
    lists.map(|(index, list)| size(index) * others(list)).sum()
}

/// Index of the first of the clusters that are not halved: those of the last level that has enough points.
fn smallest(of: &FastSums, accuracy: f64) -> usize {
    let clusters = &of.clusters;
    let has_enough = |first: usize| {
        let some = (first..2 * first).step_by(first.div_ceil(COUNTED));
        let (n_points, n_nodes) =
            some.map(|index| clusters.at(index)).fold((0, 0), |(points, nodes), cluster| {
                (points + cluster.points.len(), nodes + Grid::of(cluster, accuracy).n_nodes())
            });
        n_points as f64 >= POINTS_PER_NODE * n_nodes as f64
    };
    let levels = std::iter::successors(Some(2), |first| Some(2 * first));
    let levels = levels.take_while(|first| 2 * first <= clusters.indices().end && has_enough(*first));
    levels.last().unwrap_or(1)
}
