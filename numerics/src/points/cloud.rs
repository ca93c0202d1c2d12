//! Point lists: finite, rectangular, flat. Clouds and queries both have the type [`Cloud`].

use crate::error::{NumericsError, Result};
use crate::machine::heap::vec_bytes;

/// Largest coordinate accepted, in magnitude. Squared distances, and length scales chosen from them, then
/// stay well inside float64.
pub(crate) const MAX_COORDINATE: f64 = 1e100;

/// A list of n ≥ 1 points with d ≥ 1 finite coordinates each.
///
/// Row-major storage, shape `[n, d]`, unit L (the client's length unit). The order of the points is the
/// client's and is preserved in every answer. `-0.0` is stored as `0.0`, so equal points have equal bytes.
///
/// ```
/// use gramian_numerics::points::cloud::Cloud;
///
/// let cloud = Cloud::new(vec![0.0, 0.0, 3.0, 4.0], 2)?; // two points of the plane, row by row
/// assert_eq!((cloud.n_points(), cloud.point(1)), (2, &[3.0, 4.0][..]));
/// assert!(Cloud::new(vec![0.0, f64::NAN], 2).is_err());
/// # Ok::<(), gramian_numerics::error::NumericsError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Cloud {
    coordinates: Vec<f64>,
    dimension: usize,
}

impl Cloud {
    /// Builds a cloud from coordinates, row by row.
    ///
    /// # Errors
    /// [`NumericsError::ZeroDimension`] if `dimension` is 0. [`NumericsError::EmptyCloud`] if there are no
    /// coordinates. [`NumericsError::RaggedPoints`] if their number is not a multiple of `dimension`.
    /// [`NumericsError::NonFiniteCoordinate`] and [`NumericsError::CoordinateTooLarge`] with the first
    /// offending coordinate.
    pub fn new(mut coordinates: Vec<f64>, dimension: usize) -> Result<Self> {
        if dimension == 0 {
            return Err(NumericsError::ZeroDimension);
        }
        if coordinates.is_empty() {
            return Err(NumericsError::EmptyCloud);
        }
        let remainder = coordinates.len() % dimension;
        if remainder != 0 {
            let point = coordinates.len() / dimension;
            return Err(NumericsError::RaggedPoints { point, expected: dimension, found: remainder });
        }
        if let Some(at) = coordinates.iter().position(|x| !x.is_finite()) {
            return Err(NumericsError::NonFiniteCoordinate {
                point: at / dimension,
                coordinate: at % dimension,
            });
        }
        if let Some(at) = coordinates.iter().position(|x| x.abs() > MAX_COORDINATE) {
            return Err(NumericsError::CoordinateTooLarge {
                point: at / dimension,
                coordinate: at % dimension,
            });
        }
        for x in &mut coordinates {
            // -0.0 + 0.0 is 0.0. Every other number stays as it is.
            *x += 0.0;
        }
        Ok(Self { coordinates, dimension })
    }

    /// Number of points, n.
    pub fn n_points(&self) -> usize {
        self.coordinates.len() / self.dimension
    }

    /// Number of coordinates of each point, d.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// All coordinates, row-major `[n, d]`.
    pub fn coordinates(&self) -> &[f64] {
        &self.coordinates
    }

    /// Returns the cloud of the given points, in the given order.
    pub(crate) fn select(&self, points: &[usize]) -> Self {
        let coordinates = points.iter().flat_map(|&point| self.point(point)).copied().collect();
        Self { coordinates, dimension: self.dimension }
    }

    /// Returns the cloud with each axis multiplied by its factor. No factor may exceed 1.
    pub(crate) fn stretched(&self, factors: &[f64]) -> Self {
        let stretched =
            |point: &[f64]| -> Vec<f64> { point.iter().zip(factors).map(|(x, s)| x * s + 0.0).collect() };
        Self { coordinates: self.points().flat_map(stretched).collect(), dimension: self.dimension }
    }

    /// Returns the cloud without spare capacity beyond its points. Meant for clouds that are kept.
    ///
    /// A parser may have reserved more than the points need. `Vec::shrink_to_fit` may leave a block as it is,
    /// whereas a copy is exactly as large as the points.
    pub fn compact(mut self) -> Self {
        if self.coordinates.capacity() > self.coordinates.len() {
            self.coordinates = self.coordinates.as_slice().to_vec();
        }
        self
    }

    /// Bytes held on the heap.
    pub fn n_bytes(&self) -> usize {
        vec_bytes(&self.coordinates)
    }

    /// The coordinates of one point.
    pub fn point(&self, point_idx: usize) -> &[f64] {
        &self.coordinates[point_idx * self.dimension..][..self.dimension]
    }

    /// Iterates over the points in order.
    pub fn points(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.coordinates.chunks_exact(self.dimension)
    }

    /// Least and greatest value of each coordinate, as two lists `[d]`.
    pub fn bounding_box(&self) -> (Vec<f64>, Vec<f64>) {
        let mut min = self.point(0).to_vec();
        let mut max = min.clone();
        for point in self.points() {
            for (c, &x) in point.iter().enumerate() {
                min[c] = min[c].min(x);
                max[c] = max[c].max(x);
            }
        }
        (min, max)
    }

    /// Half the diagonal of the bounding box, unit L. Default length scales are chosen relative to it.
    pub fn radius(&self) -> f64 {
        let (min, max) = self.bounding_box();
        0.5 * min.iter().zip(&max).map(|(a, b)| (b - a) * (b - a)).sum::<f64>().sqrt()
    }

    /// Checks that `other` has as many coordinates per point as this cloud.
    ///
    /// # Errors
    /// [`NumericsError::DimensionMismatch`] if it does not.
    pub(crate) fn check_same_dimension(&self, other: &Cloud) -> Result<()> {
        let (expected, found) = (self.dimension, other.dimension);
        if expected == found { Ok(()) } else { Err(NumericsError::DimensionMismatch { expected, found }) }
    }

    /// Checks that `entries` has one entry per point.
    ///
    /// # Errors
    /// [`NumericsError::LengthMismatch`] if it does not.
    pub(crate) fn check_one_per_point<T>(&self, entries: &[T]) -> Result<()> {
        let (expected, found) = (self.n_points(), entries.len());
        if expected == found { Ok(()) } else { Err(NumericsError::LengthMismatch { expected, found }) }
    }
}

/// Squared Euclidean distance, computed from coordinate differences. |x|² + |y|² − 2x·y would cancel far from
/// the origin.
pub(crate) fn squared_distance(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(a, b)| (a - b) * (a - b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_zero_is_stored_as_zero() {
        let cloud = Cloud::new(vec![-0.0, 1.0], 2).unwrap();
        assert!(cloud.point(0)[0].is_sign_positive());
    }

    #[test]
    fn refusals_name_the_offending_point() {
        assert_eq!(Cloud::new(vec![], 3), Err(NumericsError::EmptyCloud));
        assert_eq!(Cloud::new(vec![1.0], 0), Err(NumericsError::ZeroDimension));
        assert_eq!(
            Cloud::new(vec![0.0, 1.0, 2.0], 2),
            Err(NumericsError::RaggedPoints { point: 1, expected: 2, found: 1 })
        );
        assert_eq!(
            Cloud::new(vec![0.0, 1.0, 2.0, f64::NAN], 2),
            Err(NumericsError::NonFiniteCoordinate { point: 1, coordinate: 1 })
        );
        assert_eq!(
            Cloud::new(vec![0.0, -1e101], 1),
            Err(NumericsError::CoordinateTooLarge { point: 1, coordinate: 0 })
        );
    }

    #[test]
    fn the_radius_is_half_the_diagonal() {
        let cloud = Cloud::new(vec![1.0, 1.0, 4.0, 5.0], 2).unwrap();
        assert_eq!(cloud.radius(), 2.5);
        assert_eq!(cloud.bounding_box(), (vec![1.0, 1.0], vec![4.0, 5.0]));
    }
}
