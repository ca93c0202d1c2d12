//! Points in space: finite, rectangular, flat. Clouds and queries are both of this type.

use crate::error::NumericsError;
use crate::machine::heap::vec_bytes;

/// Coordinates up to here have squared distances, and length scales chosen from them, well inside float64.
pub const MAX_COORDINATE: f64 = 1e100;

/// A list of n ≥ 1 points with d ≥ 1 finite coordinates each.
///
/// Row-major storage, shape `[n, d]`, unit L (the client's length unit). The order of the points is the client's and is
/// preserved in every answer. `-0.0` is stored as `0.0`, so equal points have equal bytes.
#[derive(Debug, Clone, PartialEq)]
pub struct Cloud {
    coordinates: Vec<f64>,
    dimension: usize,
}

impl Cloud {
    /// Takes coordinates row by row.
    ///
    /// # Errors
    /// [`NumericsError::EmptyCloud`], [`NumericsError::ZeroDimension`], [`NumericsError::RaggedPoints`] when the length is
    /// no multiple of `dimension`, [`NumericsError::NonFiniteCoordinate`] and [`NumericsError::CoordinateTooLarge`] with the
    /// first offender.
    pub fn new(mut coordinates: Vec<f64>, dimension: usize) -> Result<Self, NumericsError> {
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
            // -0.0 + 0.0 is 0.0; every other number is left as it is.
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

    /// Some of its points, in this order.
    pub(crate) fn select(&self, points: &[usize]) -> Self {
        let coordinates = points.iter().flat_map(|&point| self.point(point)).copied().collect();
        Self { coordinates, dimension: self.dimension }
    }

    /// Its coordinates times a factor for each axis, none greater than 1.
    pub(crate) fn stretched(&self, factors: &[f64]) -> Self {
        let stretched =
            |point: &[f64]| -> Vec<f64> { point.iter().zip(factors).map(|(x, s)| x * s + 0.0).collect() };
        Self { coordinates: self.points().flat_map(stretched).collect(), dimension: self.dimension }
    }

    /// The same cloud without what a parser reserved beyond its points: for clouds that are kept.
    ///
    /// `Vec::shrink_to_fit` may leave a block as it is; a copy is the size of the points.
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

    /// The points in order.
    pub fn points(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.coordinates.chunks_exact(self.dimension)
    }

    /// Least and greatest value of each coordinate.
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

    /// Half the diagonal of the bounding box, the size against which default length scales are chosen. Unit L.
    pub fn radius(&self) -> f64 {
        let (min, max) = self.bounding_box();
        0.5 * min.iter().zip(&max).map(|(a, b)| (b - a) * (b - a)).sum::<f64>().sqrt()
    }

    /// # Errors
    /// [`NumericsError::DimensionMismatch`] unless `other` has the dimension of this cloud.
    pub fn check_same_dimension(&self, other: &Cloud) -> Result<(), NumericsError> {
        let (expected, found) = (self.dimension, other.dimension);
        if expected == found { Ok(()) } else { Err(NumericsError::DimensionMismatch { expected, found }) }
    }

    /// # Errors
    /// [`NumericsError::LengthMismatch`] unless there is one entry per point.
    pub fn check_one_per_point<T>(&self, entries: &[T]) -> Result<(), NumericsError> {
        let (expected, found) = (self.n_points(), entries.len());
        if expected == found { Ok(()) } else { Err(NumericsError::LengthMismatch { expected, found }) }
    }
}

/// Squared Euclidean distance, from coordinate differences: never |x|² + |y|² − 2x·y, which cancels far from the origin.
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
