//! Expressions: which muscles act, how strongly, and how each of them moves the face.
//!
//! A muscle moves the skin near its place in the chart; the amount grows with the size of the part that it moves, and
//! a person's habits change the strengths. The displacement of an expression therefore differs between people by more
//! than a factor, as the interaction of the two modes of a multilinear model wants.

use super::face_grid::{CHART_RADIUS, EYE_ACROSS, MOUTH_CORNER, Node, SLIT};
use super::face_shape::{FaceShape, N_FACTORS};
use super::profile::{bell, bump, mound, step};

/// Names of the expressions, in order.
pub const EXPRESSIONS: [&str; 8] =
    ["neutral", "smile", "surprise", "pucker", "anger", "sadness", "disgust", "cheek_puff"];

/// How strongly each muscle group acts; 1 is the full movement of an average face.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Motion {
    /// The jaw falls.
    pub jaw: f64,
    /// The corners of the mouth go up, out and back.
    pub corners_up: f64,
    /// The corners of the mouth go down.
    pub corners_down: f64,
    /// The lips part.
    pub part: f64,
    /// The lips are drawn together and pushed out.
    pub pucker: f64,
    /// The lips are pressed and thin.
    pub press: f64,
    /// The upper lip rises beside the nose.
    pub sneer: f64,
    /// The nose is drawn up and wrinkles.
    pub wrinkle: f64,
    /// The inner ends of the brows rise.
    pub brow_inner: f64,
    /// The outer parts of the brows rise.
    pub brow_outer: f64,
    /// The brows are lowered and drawn together.
    pub frown: f64,
    /// The cheeks rise and swell under the eyes.
    pub cheeks: f64,
    /// The upper lids rise; negative: they sink.
    pub lid_upper: f64,
    /// The lower lids rise.
    pub lid_lower: f64,
    /// Air swells the cheeks.
    pub puff: f64,
    /// The chin is pushed up.
    pub chin_up: f64,
}

impl Motion {
    /// The average person's muscles in an expression, by its index in [`EXPRESSIONS`]; none for a larger index.
    pub fn of(expression: usize) -> Option<Self> {
        let rest = Motion::default();
        Some(match *EXPRESSIONS.get(expression)? {
            "smile" => Motion { corners_up: 1.0, part: 0.5, cheeks: 1.0, lid_lower: 0.8, lid_upper: -0.25, ..rest },
            "surprise" => {
                Motion { jaw: 1.0, brow_inner: 1.0, brow_outer: 1.0, lid_upper: 1.0, part: 0.5, pucker: 0.3, ..rest }
            }
            "pucker" => Motion { pucker: 1.0, chin_up: 0.2, brow_inner: 0.1, ..rest },
            "anger" => Motion {
                frown: 1.0,
                press: 0.9,
                lid_upper: -0.1,
                lid_lower: 0.7,
                wrinkle: 0.35,
                corners_down: 0.35,
                chin_up: 0.5,
                ..rest
            },
            "sadness" => Motion {
                brow_inner: 1.15,
                brow_outer: -0.45,
                frown: 0.25,
                corners_down: 1.1,
                chin_up: 0.8,
                lid_upper: -0.8,
                ..rest
            },
            "disgust" => Motion {
                wrinkle: 1.0,
                sneer: 1.0,
                frown: 0.65,
                lid_lower: 1.0,
                lid_upper: -0.6,
                cheeks: 0.5,
                corners_down: 0.5,
                part: 0.3,
                ..rest
            },
            "cheek_puff" => Motion { puff: 1.0, press: 0.5, pucker: 0.2, ..rest },
            _ => rest,
        })
    }

    /// The motion as a person with these latent factors makes it.
    pub fn with_habits(self, factors: &[f64; N_FACTORS]) -> Self {
        let [intensity, mouth, brow, jaw, _, eyes] = [26, 27, 28, 29, 30, 31].map(|k| factors[k]);
        let habit = |of: f64| (1.0 + 0.13 * intensity + 1.2 * of).clamp(0.5, 1.45);
        // Some show anger with a flared brow or pushed lips, and smile with an open mouth.
        let tense = self.press * self.frown;
        Motion {
            jaw: self.jaw * habit(0.14 * jaw) + 0.14 * self.corners_up * jaw.max(0.0),
            corners_up: self.corners_up * habit(0.14 * mouth),
            corners_down: self.corners_down * habit(-0.12 * mouth) - 0.35 * tense * mouth,
            part: self.part * habit(0.30 * jaw + 0.10 * mouth),
            pucker: self.pucker * habit(0.10 * mouth - 0.06 * jaw) + 0.22 * tense * jaw,
            press: self.press * habit(-0.12 * jaw),
            sneer: self.sneer * habit(0.16 * mouth - 0.10 * eyes),
            wrinkle: self.wrinkle * habit(0.16 * eyes),
            brow_inner: self.brow_inner * habit(0.16 * brow),
            brow_outer: self.brow_outer * habit(0.16 * brow + 0.10 * eyes) + 0.35 * tense * brow,
            frown: self.frown * habit(-0.12 * brow),
            cheeks: self.cheeks * habit(0.14 * eyes),
            lid_upper: self.lid_upper * habit(0.16 * eyes),
            lid_lower: self.lid_lower * habit(0.12 * eyes - 0.08 * brow),
            puff: self.puff * habit(0.14 * jaw - 0.08 * mouth),
            chin_up: self.chin_up * habit(-0.14 * mouth),
        }
    }

    /// The face shape while the lids move: they are part of the shape, since the eyeball behind them stays.
    pub(super) fn lids(&self, shape: &FaceShape) -> FaceShape {
        let mut shape = shape.clone();
        let room = shape.lid_upper;
        shape.lid_upper += if self.lid_upper > 0.0 { 2.6 * self.lid_upper } else { 0.42 * room * self.lid_upper };
        shape.lid_lower += 0.6 * self.lid_upper.max(0.0) - 0.42 * shape.lid_lower * self.lid_lower;
        shape
    }

    /// Displacement of a node in mm: outwards from the middle, up, along the normal of the mask, and forwards.
    pub(super) fn displacement(&self, node: &Node, shape: &FaceShape, one_sided: f64) -> [f64; 4] {
        let at = [node.across, node.up];
        let [a, b] = at;
        let depth = SLIT - b;
        let lower = node.below_slit;
        // Along the mouth: 1 in the middle, 0 at the corners and beyond.
        let along = (1.0 - (a / MOUTH_CORNER).powi(2)).max(0.0);
        let mouth = shape.mouth_width * shape.width;
        let full = shape.lip_fullness.sqrt();
        let tall = shape.height;
        // Left and right do not act alike.
        let lean = 1.0 + node.side * 0.10 * one_sided * (a / 20.0).min(1.0);
        let corner = [MOUTH_CORNER, SLIT];
        let mut d = [0.0; 4];
        let mut forward = 0.0;
        let mut add = |amount: f64, direction: [f64; 3]| (0..3).for_each(|k| d[k] += amount * direction[k]);

        let fold = a - (17.0 + 16.0 * step((-44.0 - b) / 34.0));
        let fold_window = step((-38.0 - b) / 10.0) * step((b + 92.0) / 16.0);
        // Smile: the corner pulls the cheek along; a fold runs from the nose wing round the corner.
        if self.corners_up != 0.0 {
            let beyond = if a < MOUTH_CORNER { (a / MOUTH_CORNER).powf(1.3) } else { bump((a - MOUTH_CORNER) / 30.0) };
            let raise = if a < MOUTH_CORNER { (a / MOUTH_CORNER).powf(2.3) } else { beyond };
            let near = bump((b - SLIT) / 32.0);
            let up = self.corners_up * lean * mouth;
            add(up * near * beyond, [8.0, 0.0, -4.5]);
            add(up * near * (0.12 + 0.88 * raise), [0.0, 9.0, 0.0]);
            let rounded = up * mound(at, [38.0, -36.0], [32.0, 30.0]);
            add(rounded, [0.0, 3.0, 0.0]);
            forward += 3.2 * rounded;
            add(up * bell(fold - 4.0, 3.5) * fold_window, [0.0, 0.0, -1.2]);
            add(up * bell(fold - 11.0, 6.5) * fold_window, [0.0, 0.0, 1.6]);
        }
        add(self.corners_down * lean * mouth * mound(at, corner, [22.0, 26.0]), [1.0, -6.5, -1.0]);
        add(self.corners_down * mound(at, [0.0, -84.0], [18.0, 14.0]), [0.0, 2.0, 1.0]);

        // The lips part: each lip moves away from the slit, most in the middle.
        if self.part != 0.0 {
            let lip = along.powf(0.55) * bell(depth, 16.0);
            add(self.part * full * lip, if lower { [0.0, -5.0, -0.3] } else { [0.0, 3.0, -0.3] });
        }
        // Over a fallen jaw the upper lip arches.
        let arch = if lower { 0.0 } else { along * bell(depth, 11.0) };
        add(self.jaw * arch, [0.0, 2.8, 0.0]);
        // Sneer: the upper lip rises most beside the middle.
        if self.sneer != 0.0 && !lower {
            let beside = (bell(a - 13.0, 10.0) + bell(a + 13.0, 10.0))
                * step((MOUTH_CORNER + 3.0 - a) / 8.0)
                * bell(depth, 18.0);
            add(self.sneer * lean * full * beside, [0.0, 5.0, 1.0]);
        }
        add(self.sneer * lean * bell(fold - 2.0, 4.0) * fold_window, [0.0, 0.0, -2.2]);
        // Pucker: towards the middle and forwards, the corners most.
        if self.pucker != 0.0 {
            let push = self.pucker * mouth;
            let from_mouth = a.hypot(1.25 * depth);
            add(push * (1.0 - step((a.hypot(1.8 * depth) - 18.0) / 44.0)), [-0.38 * a, 0.0, 0.0]);
            // The corners come along and both lips roll outwards, so that they stay one round pout.
            forward += push * 8.0 * (1.0 - step((from_mouth - 12.0) / 34.0));
            let roll = along.powf(0.4);
            forward += push * 3.4 * roll * bell(depth.abs() - 6.0, 4.5);
            add(push * roll * bell(depth.abs() - 10.0, 6.5), [0.0, if lower { -2.4 } else { 3.0 }, 0.0]);
            add(push * along * bell(depth, 5.0), [0.0, if lower { -0.5 } else { 0.7 }, 0.0]);
            add(push * mound(at, [46.0, -60.0], [28.0, 30.0]), [0.0, 0.0, -1.6]);
        }
        // Press: the red of the lips is drawn in.
        let red = bell(depth, 9.0) * step((MOUTH_CORNER + 4.0 - a) / 12.0);
        add(self.press * full * red, [0.0, 0.28 * depth, -2.4]);
        add(self.chin_up * mound(at, [0.0, -99.0], [26.0, 20.0]), [0.0, 4.0 * tall, 2.6]);
        add(self.chin_up * mound(at, [0.0, -84.0], [24.0, 14.0]) * f64::from(lower), [0.0, 1.5, -0.5]);

        // Nose.
        add(self.wrinkle * mound(at, [15.0, -42.0], [15.0, 18.0]), [1.8, 4.5, 0.8]);
        if self.wrinkle != 0.0 {
            let ridges = (b * 0.9).sin() * bell(a, 8.0) * mound(at, [0.0, -4.0], [20.0, 20.0]);
            add(self.wrinkle * ridges, [0.0, 0.0, 0.9]);
        }

        // Brows: the skin of the forehead follows.
        let inner = mound([(a - 12.0).max(0.0), b], [0.0, 21.0], [26.0, 26.0]);
        let aside = step(a / 16.0);
        let outer = mound(at, [38.0, 21.0], [34.0, 27.0]);
        add(self.brow_inner * tall * inner, [-0.8 * aside, 7.5, 0.3]);
        add(self.brow_outer * tall * lean * outer, [0.0, 6.5, 0.3]);
        let raised = (self.brow_inner + self.brow_outer).max(0.0);
        if raised > 0.0 {
            let creases = (0.62 * (b - 30.0)).sin() * mound(at, [0.0, 46.0], [46.0, 24.0]);
            add(0.5 * raised * creases, [0.0, 0.0, 0.7]);
        }
        add(self.frown * tall * mound([(a - 14.0).max(0.0), b], [0.0, 20.0], [24.0, 20.0]), [-4.5 * aside, -6.5, 1.2]);
        add(self.frown * tall * mound(at, [42.0, 20.0], [26.0, 20.0]), [-1.0, -1.5, 0.3]);
        add(self.frown * bell(a - 4.5, 1.8) * mound(at, [4.0, 17.0], [12.0, 14.0]), [0.0, 0.0, -2.2]);
        // Cheeks.
        let apple = mound(at, [32.0, -25.0], [27.0, 22.0]);
        add(self.cheeks * lean * apple, [0.0, 3.5, 0.6]);
        forward += self.cheeks * lean * apple * (4.2 + 0.4 * shape.cheek_fullness);
        add(self.cheeks * mound(at, [EYE_ACROSS, -7.0], [20.0, 9.0]), [0.0, 0.8, 1.0]);
        let full_cheek = mound(at, [41.0, -60.0], [46.0, 50.0]);
        add(self.puff * lean * full_cheek, [0.0, 0.0, 9.5 + 1.2 * shape.cheek_fullness]);
        forward += 3.0 * self.puff * lean * full_cheek;
        add(self.puff * mound(at, [0.0, -60.0], [30.0, 9.0]), [0.0, 0.0, 2.5]);
        add(self.puff * mound(at, [0.0, -88.0], [26.0, 10.0]), [0.0, 0.0, 2.5]);
        d[3] = forward;
        d
    }

    /// How far a node follows the jaw, 0 to 1, and the turn of the jaw in radians.
    pub(super) fn jaw_turn(&self, node: &Node) -> (f64, f64) {
        if self.jaw == 0.0 {
            return (0.0, 0.0);
        }
        let depth = SLIT - node.up;
        let along = (1.0 - (node.across / MOUTH_CORNER).powi(2)).max(0.0);
        // Beside the mouth the skin of the cheek spreads the movement over both sides of the slit's height.
        let spread = 26.0 * step((node.across - MOUTH_CORNER) / 24.0);
        let cheek = 1.0 - 0.35 * step((node.across / CHART_RADIUS - 0.5) / 0.5);
        let skin = cheek * step((depth + spread) / (30.0 + 1.3 * spread));
        let follow = if node.below_slit {
            let edge = 0.93 * along.powf(0.42);
            edge + (1.0 - edge) * skin
        } else {
            // The upper lip rises a little.
            skin - 0.12 * along.powf(0.7) * bell(depth, 14.0)
        };
        (follow, 0.235 * self.jaw)
    }
}
