//! Rigid and similarity alignment of corresponding points in closed form, in one pass over them.

use crate::linalg::symmetric_eigen::diagonalise_in_place;
use crate::rotation::similarity::Similarity;
use crate::workspace::check_len;
use crate::{Error, Real};

/// Sums over weighted pairs of corresponding points; feed it with [`Moments::add`], then ask for the transform.
///
/// Source: B. K. P. Horn, Closed-form solution of absolute orientation using unit quaternions, J. Opt. Soc. Am. A 4, 1987. The rotation
/// is the eigenvector of the largest eigenvalue of a symmetric 4 x 4 matrix, hence never a reflection. The optimum is the one of the
/// singular value decomposition (Wuhrer ch. 8: shape is what is left after removing placement).
///
/// Points are taken relative to the first pair, which keeps the sums small for data far from the origin.
///
/// Order of operations, with `p`, `q` the relative pair and `w` its weight: the sums are of `w`, `w p`, `w q`, `(w p_i) q_j` and `(w p_i) p_j` for
/// i <= j, in the order of the pairs. Central moments subtract `(sum w p_i) (mean q_j)`, likewise for the second moments. The scale is
/// `sum_i sum_j R_ji H_ij`, row by row, over the trace of the sources' second moments; the translation is
/// `(q_0 + mean q) - s R (p_0 + mean p)`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moments<R> {
    origin: Option<([R; 3], [R; 3])>,
    weight: R,
    source: [R; 3],
    target: [R; 3],
    cross: [[R; 3]; 3],
    // Upper triangle of the source's second moments: xx, xy, xz, yy, yz, zz.
    spread: [R; 6],
}

/// Pairs side by side.
const LANES: usize = 16;

/// Groups of [`LANES`] pairs whose products are summed while the sums stay in registers; one where memory is short.
const GROUPS: usize = if cfg!(feature = "inline-kernels") { 16 } else { 1 };

/// One number of each of sixteen pairs.
type Lane<R> = [R; LANES];

/// Coordinates of one side, by axes.
type Axes<R> = [[Lane<R>; GROUPS]; 3];

/// Points against an origin, by axes; returns the groups, the rest of whose last is zero.
///
/// One loop of a length that the compiler does not know: it turns the axes apart with shuffles then, and number by number in a short one.
#[inline(always)]
fn relative<R: Real>(points: &[[R; 3]], [x0, y0, z0]: [R; 3], axes: &mut Axes<R>) -> usize {
    let [x, y, z] = axes.each_mut().map(|axis| axis.as_flattened_mut());
    for (((x, y), z), [a, b, c]) in x.iter_mut().zip(&mut *y).zip(&mut *z).zip(points) {
        (*x, *y, *z) = (*a - x0, *b - y0, *c - z0);
    }
    let groups = points.len().div_ceil(LANES);
    for axis in [x, y, z] {
        let spare = axis.iter_mut().take(groups * LANES).skip(points.len());
        spare.for_each(|number| *number = R::ZERO);
    }
    groups
}

/// The first groups of each axis.
#[inline(always)]
fn first_of<R>([x, y, z]: &Axes<R>, groups: usize) -> [&[Lane<R>]; 3] {
    [x, y, z].map(|axis| axis.get(..groups).unwrap_or_default())
}

/// Adds to the sums of three axes.
#[inline(always)]
fn add_values<R: Real>(sums: &mut [Lane<R>; 3], [x, y, z]: [&[Lane<R>]; 3]) {
    let mut local = *sums;
    let [s, t, u] = &mut local;
    for ((x, y), z) in x.iter().zip(y).zip(z) {
        add(s, x);
        add(t, y);
        add(u, z);
    }
    *sums = local;
}

/// Adds to the sums of products of pairs of axes.
#[inline(always)]
fn add_products<R: Real>(sums: &mut [Lane<R>; 3], pairs: [[&[Lane<R>]; 2]; 3]) {
    let mut local = *sums;
    let [s, t, u] = &mut local;
    let [[a, b], [c, d], [e, f]] = pairs;
    for (((((a, b), c), d), e), f) in a.iter().zip(b).zip(c).zip(d).zip(e).zip(f) {
        add_product(s, a, b);
        add_product(t, c, d);
        add_product(u, e, f);
    }
    *sums = local;
}

#[inline(always)]
fn add<R: Real>(sum: &mut Lane<R>, values: &Lane<R>) {
    for (sum, &value) in sum.iter_mut().zip(values) {
        *sum += value;
    }
}

#[inline(always)]
fn add_product<R: Real>(sum: &mut Lane<R>, a: &Lane<R>, b: &Lane<R>) {
    for ((sum, &a), &b) in sum.iter_mut().zip(a).zip(b) {
        *sum += a * b;
    }
}

/// Sums of the lanes.
struct Sums<R> {
    /// Of `p`, of `q`.
    points: [[Lane<R>; 3]; 2],
    /// Of `p_i q_j`.
    cross: [[Lane<R>; 3]; 3],
    /// Of `p_i p_j` for i <= j, by i.
    spread: [[Lane<R>; 3]; 2],
}

impl<R: Real> Sums<R> {
    #[inline(always)]
    fn zero() -> Self {
        let zero = [[R::ZERO; LANES]; 3];
        Sums { points: [zero; 2], cross: [zero; 3], spread: [zero; 2] }
    }

    #[inline(always)]
    fn add(&mut self, p: [&[Lane<R>]; 3], q: [&[Lane<R>]; 3]) {
        let [sum_p, sum_q] = &mut self.points;
        add_values(sum_p, p);
        add_values(sum_q, q);
        let ([a, b, c], [x, y, z]) = (p, q);
        let [by_x, by_y, by_z] = &mut self.cross;
        add_products(by_x, [[a, x], [a, y], [a, z]]);
        add_products(by_y, [[b, x], [b, y], [b, z]]);
        add_products(by_z, [[c, x], [c, y], [c, z]]);
        let [with_x, others] = &mut self.spread;
        add_products(with_x, [[a, a], [a, b], [a, c]]);
        add_products(others, [[b, b], [b, c], [c, c]]);
    }

    /// In the order of the fields.
    #[inline(always)]
    fn lanes(&self) -> impl Iterator<Item = &Lane<R>> {
        self.points.iter().chain(&self.cross).chain(&self.spread).flatten()
    }
}

impl<R: Real> Moments<R> {
    /// No pairs yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds the pair `source -> target` with a weight of at least zero.
    #[inline]
    pub fn add(&mut self, source: [R; 3], target: [R; 3], weight: R) {
        let (p0, q0) = *self.origin.get_or_insert((source, target));
        let [a, b, c] = [source[0] - p0[0], source[1] - p0[1], source[2] - p0[2]];
        let q = [target[0] - q0[0], target[1] - q0[1], target[2] - q0[2]];
        let p = [weight * a, weight * b, weight * c];
        self.weight += weight;
        for axis in 0..3 {
            self.source[axis] += p[axis];
            self.target[axis] += weight * q[axis];
        }
        for (row, p) in self.cross.iter_mut().zip(p) {
            for (sum, q) in row.iter_mut().zip(q) {
                *sum += p * q;
            }
        }
        let products = [p[0] * a, p[0] * b, p[0] * c, p[1] * b, p[1] * c, p[2] * c];
        for (sum, product) in self.spread.iter_mut().zip(products) {
            *sum += product;
        }
    }

    /// Adds many pairs of weight 1, side by side.
    ///
    /// Order of operations: as [`Moments::add`], but lane `l` of sixteen sums the pairs `l`, `l + 16`, .. from zero; then the lanes are added in order. The weight grows by their number.
    /// Errors: `DimensionMismatch` when there are not as many targets as sources. Panics: never.
    #[inline(always)]
    pub fn add_all(&mut self, sources: &[[R; 3]], targets: &[[R; 3]]) -> Result<(), Error> {
        check_len(sources.len(), targets.len())?;
        let (Some(&source), Some(&target)) = (sources.first(), targets.first()) else { return Ok(()) };
        let (p0, q0) = *self.origin.get_or_insert((source, target));
        let mut sums = Sums::zero();
        let (mut p, mut q) = ([[[R::ZERO; LANES]; GROUPS]; 3], [[[R::ZERO; LANES]; GROUPS]; 3]);
        // The others of the last sixteen stand at the origin and add nothing.
        for (sources, targets) in sources.chunks(GROUPS * LANES).zip(targets.chunks(GROUPS * LANES)) {
            let groups = relative(sources, p0, &mut p).min(relative(targets, q0, &mut q));
            sums.add(first_of(&p, groups), first_of(&q, groups));
        }
        let mut totals = sums.lanes().map(|lanes| lanes.iter().fold(R::ZERO, |sum, lane| sum + *lane));
        let cross = self.cross.iter_mut().flatten();
        for to in self.source.iter_mut().chain(&mut self.target).chain(cross).chain(&mut self.spread) {
            *to += totals.next().unwrap_or_default();
        }
        self.weight += R::from_f64(sources.len() as f64);
        Ok(())
    }

    /// The transform `x -> s R x + t` of the sources that minimises the weighted squared distance to the targets; `s = 1` unless
    /// `with_scale`.
    ///
    /// Accuracy: rotation to about 10 eps times the condition of the point set (test `recovers_the_transform`).
    /// Errors: `Degenerate` when fewer than three points or points on a line were added (second singular value of the centred sources
    /// below 1e-6 of the first in f64, 1e-3 in f32), or when the targets leave the rotation open, as those on a line do (the two largest
    /// eigenvalues of the quaternion's matrix are equal to 1e-12 in f64, 2e-6 in f32); `NotFinite`; `NotConverged`.
    /// Panics: never.
    pub fn similarity(&self, with_scale: bool) -> Result<Similarity<R>, Error> {
        let Some((p0, q0)) = self.origin else { return Err(Error::Degenerate) };
        if !(self.weight > R::ZERO) {
            return Err(Error::Degenerate);
        }
        let mean_p = self.source.map(|sum| sum / self.weight);
        let mean_q = self.target.map(|sum| sum / self.weight);
        let central = |i: usize, j: usize| self.cross[i][j] - self.source[i] * mean_q[j];
        let h = [
            [central(0, 0), central(0, 1), central(0, 2)],
            [central(1, 0), central(1, 1), central(1, 2)],
            [central(2, 0), central(2, 1), central(2, 2)],
        ];
        let [xx, xy, xz, yy, yz, zz] = self.spread;
        let [a, b, c] = self.source;
        let [u, v, w] = mean_p;
        let (xx, xy, xz) = (xx - a * u, xy - a * v, xz - a * w);
        let (yy, yz, zz) = (yy - b * v, yz - b * w, zz - c * w);
        self.refuse_line([xx, xy, xz, xy, yy, yz, xz, yz, zz])?;

        let [[sxx, sxy, sxz], [syx, syy, syz], [szx, szy, szz]] = h;
        #[rustfmt::skip]
        let mut matrix = [
            sxx + syy + szz, syz - szy,        szx - sxz,        sxy - syx,
            syz - szy,       sxx - syy - szz,  sxy + syx,        szx + sxz,
            szx - sxz,       sxy + syx,       -sxx + syy - szz,  syz + szy,
            sxy - syx,       szx + sxz,        syz + szy,       -sxx - syy + szz,
        ];
        let mut vectors = [R::ZERO; 16];
        diagonalise_in_place(&mut matrix, &mut vectors, 4)?;
        let [best, _, _, _, _, next, ..] = matrix;
        if !(best - next > R::from_f64(1e-12).max(R::EPSILON * R::from_f64(16.0)) * best) {
            return Err(Error::Degenerate);
        }
        let [q_w, q_x, q_y, q_z, ..] = vectors;
        let rotation = rotation_of_quaternion([q_w, q_x, q_y, q_z]);
        let scale = if with_scale {
            let spread = xx + yy + zz;
            let along = (0..3).fold(R::ZERO, |sum, i| (0..3).fold(sum, |sum, j| sum + rotation[j][i] * h[i][j]));
            along / spread
        } else {
            R::ONE
        };
        if !(scale > R::ZERO) {
            return Err(Error::Degenerate);
        }
        let start = Similarity { scale, rotation, translation: [R::ZERO; 3] };
        let from = start.applied([p0[0] + mean_p[0], p0[1] + mean_p[1], p0[2] + mean_p[2]]);
        let translation = [q0[0] + mean_q[0] - from[0], q0[1] + mean_q[1] - from[1], q0[2] + mean_q[2] - from[2]];
        let result = Similarity { scale, rotation, translation };
        if result.is_finite() { Ok(result) } else { Err(Error::NotFinite { index: 0 }) }
    }

    /// `Degenerate` when the centred sources lie on a line or in a point.
    fn refuse_line(&self, mut scatter: [R; 9]) -> Result<(), Error> {
        let mut vectors = [R::ZERO; 9];
        diagonalise_in_place(&mut scatter, &mut vectors, 3)?;
        let [first, _, _, _, second, ..] = scatter;
        // Squares of singular values; the moments themselves are known to eps only.
        let ratio = R::from_f64(1e-12).max(R::EPSILON * R::from_f64(8.0));
        if !(first > R::ZERO && second > ratio * first) {
            return Err(Error::Degenerate);
        }
        Ok(())
    }
}

fn rotation_of_quaternion<R: Real>([w, x, y, z]: [R; 4]) -> [[R; 3]; 3] {
    let two = R::from_f64(2.0);
    [
        [R::ONE - two * (y * y + z * z), two * (x * y - w * z), two * (x * z + w * y)],
        [two * (x * y + w * z), R::ONE - two * (x * x + z * z), two * (y * z - w * x)],
        [two * (x * z - w * y), two * (y * z + w * x), R::ONE - two * (x * x + y * y)],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn many_pairs_at_once_give_the_same_transform() {
        let points: Vec<[f64; 3]> =
            (0..53).map(|k| [f64::from(k * 7 % 11), f64::from(k * 5 % 13), f64::from(k * 3 % 17)]).collect();
        let moved: Vec<[f64; 3]> = points.iter().map(|[x, y, z]| [2.0 * y + 1.0, 3.0 - 2.0 * x, 2.0 * z]).collect();
        for count in [3, 15, 16, 17, 53] {
            let (mut one, mut all) = (Moments::new(), Moments::new());
            points.iter().zip(&moved).take(count).for_each(|(p, q)| one.add(*p, *q, 1.0));
            all.add_all(&points[..count], &moved[..count]).unwrap();
            let (one, all) = (one.similarity(true).unwrap(), all.similarity(true).unwrap());
            assert!((one.scale - all.scale).abs() < 1e-12 && (all.scale - 2.0).abs() < 1e-12);
            for (a, b) in one
                .rotation
                .iter()
                .flatten()
                .chain(&one.translation)
                .zip(all.rotation.iter().flatten().chain(&all.translation))
            {
                assert!((a - b).abs() < 1e-10, "{a} {b}");
            }
        }
        let error = Error::DimensionMismatch { expected: 2, found: 1 };
        assert_eq!(Moments::new().add_all(&points[..2], &moved[..1]), Err(error));
    }

    use crate::rotation::axis_angle::rotation_matrix;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn recovers_the_transform(
            points in proptest::collection::vec(proptest::array::uniform3(-100.0f64..100.0), 4..20),
            angles in proptest::array::uniform3(-3.0f64..3.0),
            shift in proptest::array::uniform3(-1e4f64..1e4),
            scale in 0.1f64..10.0,
        ) {
            let truth = Similarity { scale, rotation: rotation_matrix(angles), translation: shift };
            let mut moments = Moments::new();
            for (k, &point) in points.iter().enumerate() {
                moments.add(point, truth.applied(point), 1.0 + k as f64);
            }
            let found = moments.similarity(true).unwrap();
            for &point in &points {
                let (a, b) = (found.applied(point), truth.applied(point));
                prop_assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-6));
            }
        }

        #[test]
        fn never_a_reflection(
            pairs in proptest::collection::vec(proptest::array::uniform6(-100.0f32..100.0), 3..12),
        ) {
            let mut moments = Moments::new();
            for [a, b, c, d, e, f] in pairs {
                moments.add([a, b, c], [d, e, f], 1.0);
            }
            if let Ok(Similarity { rotation: [a, b, c], .. }) = moments.similarity(false) {
                let det = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
                prop_assert!((det - 1.0).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn refuses_what_does_not_determine_a_placement() {
        let mut moments = Moments::<f32>::new();
        assert_eq!(moments.similarity(true), Err(Error::Degenerate));
        for k in 0..5 {
            let x = k as f32 * 10.0;
            moments.add([x, 2.0 * x, 500.0 - x], [x, 0.0, 0.0], 1.0);
            assert_eq!(moments.similarity(true).unwrap_err(), Error::Degenerate);
        }
        // Sources in space, targets on a line or at one place: any turn about the line fits as well.
        let (mut line, mut place) = (Moments::<f32>::new(), Moments::<f32>::new());
        for (k, source) in
            [[0.0, 0.0, 0.0], [70.0, 3.0, 0.0], [0.0, 90.0, 10.0], [20.0, 30.0, 80.0]].into_iter().enumerate()
        {
            line.add(source, [400.0 + k as f32; 3], 1.0);
            place.add(source, [3.0, 4.0, 500.0], 1.0);
        }
        assert_eq!(line.similarity(false).unwrap_err(), Error::Degenerate);
        assert_eq!(place.similarity(false).unwrap_err(), Error::Degenerate);
        let mut flat = Moments::<f64>::new();
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
            flat.add([x, y, 0.0], [x, y, 0.0], 1.0);
        }
        assert!(flat.similarity(true).is_ok());
    }
}
