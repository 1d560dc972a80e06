//! Smooth functions of one and two variables from which shapes are composed.

/// 0 up to `t` = 0, 1 from `t` = 1 on, with a continuous slope between.
pub(super) fn step(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// 1 in the middle, 0 from `|t|` = 1 on, with two continuous derivatives.
pub(super) fn bump(t: f64) -> f64 {
    (1.0 - t * t).max(0.0).powi(3)
}

/// [`bump`] of the elliptic distance of `at` from `centre`, 0 beyond `radii`.
pub(super) fn mound(at: [f64; 2], centre: [f64; 2], radii: [f64; 2]) -> f64 {
    let (x, y) = ((at[0] - centre[0]) / radii[0], (at[1] - centre[1]) / radii[1]);
    (1.0 - x * x - y * y).max(0.0).powi(3)
}

/// Bell curve of half-width `width` (0.37 there).
pub(super) fn bell(t: f64, width: f64) -> f64 {
    let square = (t / width).powi(2);
    // Below the resolution of any length in mm.
    if square > 40.0 { 0.0 } else { (-square).exp() }
}

/// The larger of two values, rounded off where they differ by less than `radius`.
pub(super) fn rounded_max(p: f64, q: f64, radius: f64) -> f64 {
    let blend = (radius - (p - q).abs()).max(0.0) / radius;
    p.max(q) + blend * blend * radius / 4.0
}

/// Monotone cubic interpolation (Fritsch and Carlson 1980) through knots of ascending abscissa; constant outside.
pub(super) fn through<const N: usize>(knots: &[[f64; 2]; N], t: f64) -> f64 {
    let slope = |k: usize| (knots[k + 1][1] - knots[k][1]) / (knots[k + 1][0] - knots[k][0]);
    if t <= knots[0][0] {
        return knots[0][1];
    }
    if t >= knots[N - 1][0] {
        return knots[N - 1][1];
    }
    let k = (1..N - 1).rev().find(|k| knots[*k][0] <= t).unwrap_or(0);
    // Harmonic mean of the neighbouring slopes; flat at a turn, the secant at an end.
    let tangent = |k: usize| {
        if k == 0 {
            return slope(0);
        }
        if k == N - 1 {
            return slope(N - 2);
        }
        let (left, right) = (slope(k - 1), slope(k));
        if left * right <= 0.0 { 0.0 } else { 2.0 * left * right / (left + right) }
    };
    let width = knots[k + 1][0] - knots[k][0];
    let s = (t - knots[k][0]) / width;
    let (p, q) = (knots[k][1], knots[k + 1][1]);
    let (dp, dq) = (width * tangent(k), width * tangent(k + 1));
    p + s * (dp + s * (3.0 * (q - p) - 2.0 * dp - dq + s * (2.0 * (p - q) + dp + dq)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn through_meets_its_knots_and_stays_monotone() {
        let knots = [[0.0, 0.0], [1.0, 1.0], [2.0, 8.0], [5.0, 8.0], [6.0, 20.0]];
        knots.iter().for_each(|[t, value]| assert!((through(&knots, *t) - value).abs() < 1e-12));
        let values: Vec<f64> = (-10..=70).map(|k| through(&knots, f64::from(k) / 10.0)).collect();
        assert!(values.is_sorted());
    }

    #[test]
    fn rounded_max_is_exact_away_from_the_seam() {
        assert_eq!(rounded_max(1.0, 5.0, 2.0), 5.0);
        assert!(rounded_max(3.0, 3.0, 2.0) > 3.0);
    }
}
