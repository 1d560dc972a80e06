//! Points of a cloud, each as far as possible from those before it.

use rayon::prelude::*;

use crate::Error;

/// Points that one task looks through; fewer are not worth a second thread.
const CHUNK: usize = 16384;

/// A chosen point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FarthestPoint {
    /// Index of the point.
    pub index: u32,
    /// Its distance from the nearest of those before it; infinite for the first. All points of the cloud are at most this
    /// far from the chosen ones before it.
    pub distance: f64,
}

/// `n` of the points, each the farthest from those before it, in straight lines; the first is the farthest from the mean.
///
/// Fewer are given when the cloud has fewer distinct points. Of equally far points the one with the smallest index is
/// taken. Any first `m` of the result are the result for `m`.
///
/// Source: Gonzalez 1985 (`gonzalez1985`): the cover radius is at most twice the best possible.
///
/// Cost: `n` passes over the points, parallel. Determinism: the mean is summed in order, the rest are comparisons.
///
/// # Errors
/// [`Error::Input`] for a point that is not finite.
pub fn farthest_points(positions: &[[f64; 3]], n: usize) -> Result<Vec<FarthestPoint>, Error> {
    if let Some(index) = positions.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        return Err(Error::input(format!("point {index} is not finite: remove it")));
    }
    let share = 1.0 / positions.len().max(1) as f64;
    let mean = positions.iter().fold([0.0; 3], |sum, p| std::array::from_fn(|a| sum[a] + p[a] * share));
    let mut squares = vec![f64::INFINITY; positions.len()];
    let mut from = mean;
    let mut chosen = Vec::new();
    while chosen.len() < n.min(positions.len()) {
        let Some((square, index)) = farthest(positions, &mut squares, from) else { break };
        if chosen.is_empty() {
            // The distances from the mean chose the first point and count no more.
            squares.fill(f64::INFINITY);
            chosen.push(FarthestPoint { index: index as u32, distance: f64::INFINITY });
        } else if square == 0.0 {
            break;
        } else {
            chosen.push(FarthestPoint { index: index as u32, distance: square.sqrt() });
        }
        from = positions[index];
    }
    Ok(chosen)
}

/// Lowers the squared distances to those from `from`; the largest then, and the first index that has it.
fn farthest(positions: &[[f64; 3]], squares: &mut [f64], from: [f64; 3]) -> Option<(f64, usize)> {
    let larger = |a: (f64, usize), b: (f64, usize)| if b.0 > a.0 || (b.0 == a.0 && b.1 < a.1) { b } else { a };
    let chunk = |(number, (squares, positions)): (usize, (&mut [f64], &[[f64; 3]]))| {
        let mut best = (-1.0, usize::MAX);
        for (offset, (square, p)) in squares.iter_mut().zip(positions).enumerate() {
            let [x, y, z] = [p[0] - from[0], p[1] - from[1], p[2] - from[2]];
            *square = square.min(x * x + y * y + z * z);
            if *square > best.0 {
                best = (*square, number * CHUNK + offset);
            }
        }
        best
    };
    let chunks = squares.par_chunks_mut(CHUNK).zip(positions.par_chunks(CHUNK)).enumerate();
    chunks.map(chunk).reduce_with(larger)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn corners_of_a_line_come_before_its_middle() {
        let line: Vec<[f64; 3]> = [0.0, 1.0, 2.0, 3.0, 4.0, 4.0].map(|x| [x, 0.0, 0.0]).to_vec();
        let chosen = farthest_points(&line, 10).unwrap();
        let indices: Vec<u32> = chosen.iter().map(|point| point.index).collect();
        // The mean is 7/3; 0 is farther from it than 4. The second of the two equal points adds nothing.
        assert_eq!(indices, [0, 4, 2, 1, 3]);
        let distances: Vec<f64> = chosen.iter().map(|point| point.distance).collect();
        assert_eq!(distances, [f64::INFINITY, 4.0, 2.0, 1.0, 1.0]);
        assert_eq!(farthest_points(&line, 2).unwrap(), chosen[..2]);
        assert!(farthest_points(&[], 3).unwrap().is_empty());
        assert!(farthest_points(&[[0.0, f64::NAN, 0.0]], 1).unwrap_err().to_string().contains("point 0"));
    }

    #[test]
    fn several_chunks_give_the_first_of_equal_points() {
        let mut positions = vec![[0.0; 3]; 3 * CHUNK];
        for index in [CHUNK - 1, 2 * CHUNK + 5] {
            positions[index] = [1.0, 0.0, 0.0];
        }
        assert_eq!(farthest_points(&positions, 1).unwrap()[0].index as usize, CHUNK - 1);
    }

    proptest! {
        #[test]
        fn all_points_are_covered(points in proptest::collection::vec(proptest::array::uniform3(-9.0..9.0f64), 1..40), n in 1usize..8) {
            let chosen = farthest_points(&points, n + 1).unwrap();
            prop_assert!(chosen.windows(2).all(|pair| pair[1].distance <= pair[0].distance));
            if let Some(last) = chosen.get(n) {
                for p in &points {
                    let distance = |c: &FarthestPoint| {
                        let q = points[c.index as usize];
                        (0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>().sqrt()
                    };
                    let nearest = chosen[..n].iter().map(distance).fold(f64::INFINITY, f64::min);
                    prop_assert!(nearest <= last.distance * (1.0 + 1e-15));
                }
            }
        }
    }
}
