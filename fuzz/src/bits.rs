//! Equality of numbers by their bits; which of the many NaN a computation gives is not promised.

/// Fails at the first number whose bits differ.
#[track_caller]
pub fn assert_same(what: &str, found: &[f32], expected: &[f32]) {
    assert_eq!(found.len(), expected.len(), "{what}: length");
    let differs = |(a, b): (&f32, &f32)| a.to_bits() != b.to_bits() && !(a.is_nan() && b.is_nan());
    if let Some(index) = found.iter().zip(expected).position(differs) {
        panic!("{what}: number {index} is {:e}, expected {:e}", found[index], expected[index]);
    }
}

/// As [`assert_same`], for the attributes of meshes.
#[track_caller]
pub fn assert_same_numbers(what: &str, found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{what}: length");
    let differs = |(a, b): (&f64, &f64)| a.to_bits() != b.to_bits() && !(a.is_nan() && b.is_nan());
    if let Some(index) = found.iter().zip(expected).position(differs) {
        panic!("{what}: number {index} is {:e}, expected {:e}", found[index], expected[index]);
    }
}

/// As [`assert_same`], for the positions and normals of meshes.
#[track_caller]
pub fn assert_same_vectors(what: &str, found: &[[f64; 3]], expected: &[[f64; 3]]) {
    assert_eq!(found.len(), expected.len(), "{what}: length");
    let bits = |vector: &[f64; 3]| vector.map(f64::to_bits);
    if let Some(index) = found.iter().zip(expected).position(|(a, b)| bits(a) != bits(b)) {
        panic!("{what}: vector {index} is {:?}, expected {:?}", found[index], expected[index]);
    }
}

/// Fails at the first number that is NaN or infinite.
#[track_caller]
pub fn assert_finite(what: &str, numbers: &[f32]) {
    if let Some(index) = numbers.iter().position(|number| !number.is_finite()) {
        panic!("{what}: number {index} is {}", numbers[index]);
    }
}
