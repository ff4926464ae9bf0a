//! Validated point sets.

use std::fmt;

/// A set of n ≥ 1 points in [0, 1]^d, d ≥ 1: what every measure of this module takes.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    dimension: usize,
    /// Point by point: coordinate k of point i at `i * dimension + k`.
    coordinates: Vec<f64>,
}

/// Why a list of numbers is no point set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PointsError {
    /// No points, or points without coordinates.
    Empty,
    /// The last point lacks coordinates.
    Ragged {
        /// How many numbers there are.
        count: usize,
        /// How many make a point.
        dimension: usize,
    },
    /// A coordinate is NaN or outside [0, 1].
    Outside {
        /// Which point, from 0.
        index: usize,
        /// Which coordinate, from 0.
        axis: usize,
        /// What it is.
        value: f64,
    },
}

impl fmt::Display for PointsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "expected at least one point, found none"),
            Self::Ragged { count, dimension } => {
                write!(f, "expected a multiple of {dimension} coordinates, found {count}")
            }
            Self::Outside { index, axis, value } => {
                write!(f, "point {index}, coordinate {axis}: expected a number in [0, 1], found {value}")
            }
        }
    }
}

impl std::error::Error for PointsError {}

impl Points {
    /// Takes coordinates point by point.
    ///
    /// # Errors
    /// An empty or ragged list, and the first coordinate that is NaN or outside [0, 1].
    pub fn new(dimension: usize, coordinates: Vec<f64>) -> Result<Self, PointsError> {
        if dimension == 0 || coordinates.is_empty() {
            return Err(PointsError::Empty);
        }
        if !coordinates.len().is_multiple_of(dimension) {
            return Err(PointsError::Ragged { count: coordinates.len(), dimension });
        }
        if let Some(i) = coordinates.iter().position(|v| !(0.0..=1.0).contains(v)) {
            return Err(PointsError::Outside { index: i / dimension, axis: i % dimension, value: coordinates[i] });
        }
        Ok(Self { dimension, coordinates })
    }

    /// Takes points of the plane.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn new_2d(points: &[[f64; 2]]) -> Result<Self, PointsError> {
        Self::new(2, points.as_flattened().to_vec())
    }

    /// How many points there are, at least 1.
    pub fn n(&self) -> usize {
        self.coordinates.len() / self.dimension
    }

    /// How many coordinates a point has, at least 1.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// The points, each a slice of `dimension` coordinates.
    pub fn iter(&self) -> std::slice::ChunksExact<'_, f64> {
        self.coordinates.chunks_exact(self.dimension)
    }

    /// Coordinate `axis` of every point, in order.
    pub(super) fn axis(&self, axis: usize) -> Vec<f64> {
        self.iter().map(|p| p[axis]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_point_set_is_refused_with_its_place() {
        assert_eq!(Points::new(2, vec![]), Err(PointsError::Empty));
        assert_eq!(Points::new(0, vec![0.5]), Err(PointsError::Empty));
        assert_eq!(Points::new(2, vec![0.5; 3]), Err(PointsError::Ragged { count: 3, dimension: 2 }));
        for value in [-1e-300, 1.0 + f64::EPSILON, f64::INFINITY] {
            let error = Points::new(2, vec![0.0, 1.0, 0.5, value]).expect_err("outside");
            assert_eq!(error, PointsError::Outside { index: 1, axis: 1, value });
        }
        let nan = Points::new(1, vec![f64::NAN]).expect_err("no number");
        assert_eq!(nan.to_string(), "point 0, coordinate 0: expected a number in [0, 1], found NaN");
    }

    #[test]
    fn both_ends_of_the_unit_interval_belong_to_it() {
        let corners = Points::new(2, vec![0.0, 1.0, 1.0, 0.0]).expect("valid");
        assert_eq!((corners.n(), corners.dimension()), (2, 2));
        assert_eq!(corners.axis(1), [1.0, 0.0]);
    }
}
