//! Batches of neighbourhoods, one in each lane of a register.

/// Neighbourhoods side by side, with `count` places each. A neighbourhood with fewer points leaves the last
/// places empty.
pub(crate) struct Batch {
    pub dimension: usize,
    pub count: usize,
    pub lanes: usize,
    /// Tangential coordinates and height in units of the radius, `[d, count, lanes]`.
    pub(super) coordinates: Vec<f64>,
    /// Terms of second order: means of ½t_a² and t_a t_b over the points of a mean,
    /// `[k(k+1)/2, count, lanes]`.
    pub(super) products: Vec<f64>,
    /// Entailed heights, which were subtracted from the heights: what curvature implies beyond second order,
    /// `[count, lanes]`.
    pub(super) entailed: Vec<f64>,
    /// Weights w: 1 over the number of points of a mean, `[count, lanes]`.
    pub(super) weights: Vec<f64>,
    /// 1 for a point, 0 for an empty place, `[count, lanes]`.
    pub(super) is_point: Vec<f64>,
}

impl Batch {
    pub(crate) fn new(dimension: usize, count: usize, lanes: usize) -> Self {
        let k = dimension - 1;
        Self {
            dimension,
            count,
            lanes,
            coordinates: vec![0.0; dimension * count * lanes],
            products: vec![0.0; k * (k + 1) / 2 * count * lanes],
            entailed: vec![0.0; count * lanes],
            weights: vec![1.0; count * lanes],
            is_point: vec![0.0; count * lanes],
        }
    }

    pub(crate) fn set_point(&mut self, j: usize, lane: usize, is_point: bool) {
        self.is_point[j * self.lanes + lane] = f64::from(u8::from(is_point));
    }

    pub(crate) fn set_coordinate(&mut self, axis: usize, j: usize, lane: usize, value: f64) {
        self.coordinates[(axis * self.count + j) * self.lanes + lane] = value;
    }

    pub(crate) fn set_product(&mut self, term: usize, j: usize, lane: usize, value: f64) {
        self.products[(term * self.count + j) * self.lanes + lane] = value;
    }

    pub(crate) fn set_entailed(&mut self, j: usize, lane: usize, value: f64) {
        self.entailed[j * self.lanes + lane] = value;
    }

    pub(crate) fn set_weight(&mut self, j: usize, lane: usize, weight: f64) {
        self.weights[j * self.lanes + lane] = weight;
    }

    /// Empties the places of a lane from `n_kept` on.
    pub(crate) fn keep(&mut self, lane: usize, n_kept: usize) {
        for j in n_kept..self.count {
            self.set_point(j, lane, false);
        }
    }

    /// Copies one lane into an unused one, so that the unused lane holds valid numbers.
    pub(crate) fn copy_lane(&mut self, from: usize, to: usize) {
        let lanes = self.lanes;
        for list in [
            &mut self.coordinates,
            &mut self.products,
            &mut self.entailed,
            &mut self.weights,
            &mut self.is_point,
        ] {
            list.chunks_exact_mut(lanes).for_each(|row| row[to] = row[from]);
        }
    }
}
