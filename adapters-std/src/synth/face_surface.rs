//! One point of a face: the mask, then eyes, nose, mouth and the rest upon it.
//!
//! The mask is a stack of half-ellipses along a profile; a feature displaces it forwards or along its normal. Where a
//! feature moves or grows with a person, the chart moves with it, so a vertex keeps its anatomical place.

use super::face_grid::rounded_corner;
use super::face_grid::{CHART_RADIUS, EYE_ACROSS, EYE_HALF_WIDTH, EYE_HEIGHT, LID_BAND, MOUTH_CORNER, Node, SLIT};
use super::face_motion::Motion;
use super::face_shape::FaceShape;
use super::profile::{bell, bump, mound, rounded_max, step, through};

/// Height in space along the profile, against height in the chart.
const PROFILE_Y: [[f64; 2]; 8] = [
    [-130.0, -112.0],
    [-124.0, -117.0],
    [-118.0, -118.5],
    [-112.0, -114.8],
    [-105.0, -107.0],
    [-97.0, -98.0],
    [-88.0, -88.0],
    [84.0, 84.0],
];
/// Depth of the middle of the mask.
const PROFILE_Z: [[f64; 2]; 15] = [
    [-130.0, -36.0],
    [-124.0, -21.0],
    [-118.0, -10.0],
    [-112.0, -4.0],
    [-105.0, -1.0],
    [-88.0, -1.5],
    [-72.0, -0.5],
    [-45.0, -3.0],
    [-25.0, -5.0],
    [-8.0, -6.0],
    [5.0, -4.5],
    [18.0, -0.5],
    [35.0, 1.5],
    [58.0, -2.5],
    [84.0, -17.0],
];
/// Depth of the side borders of the mask, before the section takes them back: they follow no brow and no chin.
const BORDER_Z: [[f64; 2]; 5] = [[-130.0, -16.0], [-112.0, -9.0], [-60.0, -3.0], [40.0, -3.0], [84.0, -13.0]];
/// Half-width of the mask.
const HALF_WIDTH: [[f64; 2]; 9] = [
    [-130.0, 46.0],
    [-112.0, 54.0],
    [-90.0, 60.0],
    [-60.0, 65.5],
    [-25.0, 70.5],
    [-5.0, 72.0],
    [30.0, 70.0],
    [60.0, 68.0],
    [84.0, 62.0],
];
/// Height of the nose over the mask.
const NOSE: [[f64; 2]; 14] = [
    [-63.0, 0.0],
    [-56.0, 2.0],
    [-50.5, 6.5],
    [-47.5, 12.5],
    [-45.0, 19.0],
    [-42.0, 23.0],
    [-38.5, 23.8],
    [-34.0, 21.3],
    [-27.0, 17.6],
    [-19.0, 14.0],
    [-9.0, 10.0],
    [0.0, 6.8],
    [9.0, 3.4],
    [20.0, 0.0],
];
/// How far beyond the margins the upper and the lower lid take the rows along, in the chart.
const LID_REACH: [f64; 2] = [20.0, 15.0];
/// Half-width of the nose.
const NOSE_HALF_WIDTH: [[f64; 2]; 6] =
    [[-52.0, 7.4], [-43.0, 9.4], [-36.0, 10.0], [-22.0, 9.8], [-4.0, 8.4], [14.0, 13.0]];

/// A node's place at rest: with the lids of an expression, before the muscles move it.
pub(super) struct Rest {
    /// Where the skin of the node is evaluated in the chart.
    skin: Node,
    place: Place,
}

impl Rest {
    pub(super) fn of(node: &Node, shape: &FaceShape) -> Self {
        let (across, up) = rounded_corner(node);
        let node = &Node { across, up, ..*node };
        // The chart's rows crowd at the corners of the eyes and along the closed mouth; what is smooth there is
        // evaluated at the crowded place, so that the rows lie on one surface.
        let skin = Node { up: crowded_height(node, shape), ..*node };
        let mut place = Place::on_mask(&skin, shape);
        place.cheeks_and_forehead(&skin, shape);
        place.muzzle(&skin, shape);
        place.lips(node, shape);
        place.nose(&skin, shape);
        place.eye(node, &skin, shape);
        Rest { skin, place }
    }

    /// The position of the node in mm: x to the subject's left, y up, z forward.
    pub(super) fn moved(&self, shape: &FaceShape, motion: &Motion, one_sided: f64) -> [f64; 3] {
        let skin = &self.skin;
        let mut place = self.place;
        let [out, up, along_normal, forward] = motion.displacement(skin, shape, one_sided);
        place.x += out;
        place.y += up;
        place.z += forward;
        place.push(along_normal);
        place.turn_jaw(skin, motion);

        // Whole-face proportions, then the small differences of the two sides.
        let [sine, cosine] = place.normal;
        let x = place.x * shape.width;
        let y = place.y * shape.height;
        let lower = step((20.0 - skin.up) / 120.0);
        let x = skin.side * x + shape.asymmetry_across * lower * cosine;
        [x, y + skin.side * shape.asymmetry_upwards * sine * bell(skin.up + 20.0, 80.0), place.z + 95.0]
    }
}

/// Whether the lids' opening moves a node at rest.
pub(super) fn follows_lids(node: &Node) -> bool {
    (node.across - EYE_ACROSS).abs() < EYE_HALF_WIDTH + 3.0
        && (node.up - EYE_HEIGHT).abs() < LID_REACH[0] + LID_BAND + 3.0
}

/// Height of the red of the lip that a node belongs to, in the chart, at its distance from the middle.
pub(super) fn lip_height(node: &Node) -> f64 {
    let a = node.across;
    let along = (1.0 - (a / MOUTH_CORNER).powi(2)).max(0.0);
    if node.below_slit {
        (9.6 * along.powf(0.55)).hypot(2.6)
    } else {
        let bow = 1.1 * bell(a - 5.5, 4.0) - 0.5 * bell(a, 2.5);
        (8.0 * along.powf(0.7) + bow).hypot(2.4)
    }
}

/// The height of the lid margin over (or depth under) the middle of the eye, and the height of a node that lies at
/// `t` half-widths from the middle of the eye and `beta` mm above it in the chart.
pub(super) fn lid_heights(t: f64, beta: f64, shape: &FaceShape) -> (f64, f64) {
    /// Half the opening that is left at the corners.
    const CANTHUS: f64 = 0.6;
    // The opening closes at the corners of the eye and lets go of the rows beyond.
    let open = |full: f64, skew: f64| {
        if t.abs() <= 1.0 {
            let almond = full * (1.0 - t * t).powf(0.8) * (1.0 - skew * t);
            almond.hypot(CANTHUS)
        } else {
            CANTHUS + (LID_BAND - CANTHUS) * step(t.abs() - 1.0)
        }
    };
    let (full, reach) = if beta > 0.0 {
        (open(shape.lid_upper, 0.16), LID_REACH[0])
    } else {
        (open(shape.lid_lower, -0.12), LID_REACH[1])
    };
    let share = beta / LID_BAND;
    let height = if share.abs() <= 1.0 {
        // The outermost rows within the opening crowd under the lid.
        full * share * (1.45 - 0.45 * share * share)
    } else {
        beta + beta.signum() * (full - LID_BAND) * (1.0 - step((beta.abs() - LID_BAND) / reach))
    };
    (full, height)
}

/// Height in the chart where the skin of a node lies once lids and lips have drawn the rows together.
fn crowded_height(node: &Node, shape: &FaceShape) -> f64 {
    if node.up > -30.0 {
        let (_, height) = lid_heights((node.across - EYE_ACROSS) / EYE_HALF_WIDTH, node.up - EYE_HEIGHT, shape);
        return EYE_HEIGHT + height;
    }
    const REACH: f64 = 1.7;
    let height = node.up - SLIT;
    let side = height.signum();
    let within = step((MOUTH_CORNER + 9.0 - node.across) / 9.0);
    // Half the distance of the lips: almost nothing, but the corners keep room for the skin to turn.
    let corner = step((node.across - 15.0) / 10.0);
    let (gap, thickness) = (0.04 + 0.10 * corner, 0.03 + 0.65 * corner);
    let shift = if height.abs() < REACH {
        (gap + thickness * height.abs() / REACH) * side - height
    } else {
        -side * (REACH - gap - thickness) * (1.0 - step((height.abs() - REACH) / 8.0))
    };
    node.up + within * shift
}

/// How much a node belongs to the brow, 0 to 1.
pub(super) fn brow_hair(node: &Node) -> f64 {
    let along = step((node.across - 8.0) / 6.0) * step((53.0 - node.across) / 22.0);
    along * bump((node.up - brow_line(node.across)) / 5.0)
}

/// Height of the brow in the chart.
fn brow_line(across: f64) -> f64 {
    20.0 + 3.0 * step((across - 8.0) / 26.0) - 6.0 * step((across - 38.0) / 22.0)
}

/// A point while features are added: x outwards from the middle, and the normal of the mask in the plane of x and z.
#[derive(Clone, Copy)]
struct Place {
    x: f64,
    y: f64,
    z: f64,
    normal: [f64; 2],
}

impl Place {
    fn push(&mut self, amount: f64) {
        self.x += amount * self.normal[0];
        self.z += amount * self.normal[1];
    }

    fn on_mask(node: &Node, shape: &FaceShape) -> Self {
        let sine = node.across / CHART_RADIUS;
        let cosine = (1.0 - sine * sine).sqrt();
        let up = node.up;
        let chin = step((SLIT - 8.0 - up) / 30.0);
        let jaw = step((-20.0 - up) / 60.0);
        let forehead = step((up - 16.0) / 60.0);
        let half_width = through(&HALF_WIDTH, up) + shape.jaw_width * jaw;
        let mut y = through(&PROFILE_Y, up);
        y -= shape.chin_length * chin;
        y += (shape.forehead_height - 1.0) * (up - 16.0).max(0.0);
        let aside = sine * sine;
        let middle = through(&PROFILE_Z, up);
        let mut z = middle + (through(&BORDER_Z, up) - middle) * aside;
        z -= shape.forehead_slope * forehead;
        z += shape.profile_curve * (1.0 - ((up + 20.0) / 75.0).powi(2)).max(-1.2);
        // The border of the mask follows the jaw below and the hairline above.
        y += (34.0 * step((-30.0 - up) / 90.0) - 18.0 * step((up + 10.0) / 94.0)) * aside;
        y -= (up + 118.0).min(0.0).abs() * 0.5 * aside;
        let depth = 77.0 - 9.0 * step((up - 40.0) / 44.0);
        Place {
            x: node.across + (half_width - CHART_RADIUS) * aside,
            y,
            z: z - depth * (1.0 - cosine),
            normal: [sine, cosine],
        }
    }

    fn cheeks_and_forehead(&mut self, node: &Node, shape: &FaceShape) {
        let at = [node.across, node.up];
        self.push(shape.cheekbones * mound(at, [47.0, -20.0], [30.0, 24.0]));
        self.push((shape.cheek_fullness - 1.6) * mound(at, [45.0, -58.0], [30.0, 34.0]));
        self.push(1.4 * mound(at, [28.0, -28.0], [20.0, 18.0]));
        self.push(-2.0 * mound(at, [54.0, 28.0], [20.0, 26.0]));
        self.push(1.8 * mound(at, [26.0, 54.0], [26.0, 26.0]));
        // The ridge over the eyes, and the brow upon it.
        let from_arch = node.up - brow_line(node.across);
        let ridge = (0.4 + 0.6 * step((node.across - 2.0) / 16.0)) * step((62.0 - node.across) / 24.0);
        self.push(shape.brow_ridge * ridge * bell(from_arch + 2.0, 9.0));
        self.push(1.5 * brow_hair(node));
        self.y += shape.brow_height * mound(at, [28.0, 18.0], [44.0, 30.0]);
        self.push(1.2 * mound(at, [0.0, 18.0], [16.0, 12.0]));
    }

    /// Around the lips: the teeth behind them, the groove under the nose, chin and folds.
    fn muzzle(&mut self, node: &Node, shape: &FaceShape) {
        let (a, b) = (node.across, node.up);
        let at = [a, b];
        // The teeth carry the lips forward.
        self.z += 6.5 * mound(at, [0.0, -71.0], [40.0, 34.0]);
        // Groove under the nose, hollow over the chin, chin.
        let groove = mound([0.0, b], [0.0, -57.0], [1.0, 9.0]);
        self.z += groove * (-1.2 * bell(a, 3.0) + 0.8 * bell(a - 5.5, 2.6));
        self.push(-3.4 * mound(at, [0.0, -89.5], [30.0, 9.0]));
        self.push((1.0 + shape.chin_projection) * mound(at, [0.0, -105.0], [29.0, 19.0]));
        // From the nose wing down past the corner of the mouth.
        let fold = a - (17.5 + 14.0 * step((-44.0 - b) / 34.0));
        let fold_window = step((-38.0 - b) / 10.0) * step((b + 88.0) / 16.0);
        self.z += fold_window * (-0.5 * bell(fold - 1.0, 3.4) + 0.7 * bell(fold - 8.0, 6.0));
        // The corner of the mouth lies deep.
        self.z -= 2.2 * bell(a - 26.0, 5.0) * bell(b - SLIT, 5.0);
        let wide = (shape.mouth_width - 1.0) * a.min(34.0);
        self.x += wide * mound(at, [0.0, SLIT], [58.0, 42.0]).sqrt();
    }

    fn lips(&mut self, node: &Node, shape: &FaceShape) {
        let a = node.across;
        let height = node.up - SLIT;
        // The red of the lips: distance from the slit in units of its height.
        let share = height.abs() / lip_height(node);
        let swell = if node.below_slit { 4.8 } else { 4.6 };
        let roll = if share < 0.42 { (share / 0.42 * std::f64::consts::FRAC_PI_2).sin() } else { 1.0 };
        let fade = 1.0 - step((share - 0.42) / 0.8);
        let body = step((MOUTH_CORNER + 3.0 - a) / 12.0);
        self.z += swell * shape.lip_fullness.sqrt() * body * (0.25 + 0.75 * roll) * fade;
        // A fine rim where the red begins.
        self.z += 0.9 * body * bell(share - 1.05, 0.15);
        // Towards the slit the lips roll inwards.
        self.z -= 6.5 * step((MOUTH_CORNER - 1.0 - a) / 7.0) * bell(height, 1.5);
        // Fuller lips take more height; the line between them bends down at the tubercle and up beside it.
        let grow = (shape.lip_fullness - 1.0) * height * (1.0 - step((height.abs() - 8.0) / 10.0));
        self.y += grow * body * step((height.abs() - 1.0) / 3.0);
        self.y += (0.5 * bell(a - 12.0, 8.0) - bell(a, 6.0)) * bell(height, 9.0);
    }

    fn nose(&mut self, node: &Node, shape: &FaceShape) {
        let (a, b) = (node.across, node.up);
        let at = [a, b];
        let half_width = through(&NOSE_HALF_WIDTH, b);
        let section = (-(a / half_width).abs().powf(1.9)).exp();
        // The base rises from the septum to the wings, so that the tip is a ball and not a block.
        let base = b - 4.4 * step(a / 12.0) * bell(b + 48.0, 12.0);
        let mut rise = through(&NOSE, base) * section * shape.nose_projection;
        rise += shape.nose_bridge * section * bump((b + 14.0) / 22.0);
        rise += 3.2 * mound(at, [0.0, -39.5], [12.5, 9.5]);
        let wing = mound(at, [12.6, -43.8], [8.8, 9.0]);
        rise += 3.0 * mound(at, [7.0, -42.5], [7.5, 7.5]);
        self.z += rise + 8.6 * wing * shape.nose_projection;
        // The crease round the wing.
        let ring = (((a - 12.6) / 7.2).powi(2) + ((b + 43.8) / 8.2).powi(2)).sqrt();
        self.z -= 1.5 * bell(ring - 1.0, 0.22) * step((a - 9.0) / 7.0) * step((b + 53.0) / 6.0);
        self.x += (1.5 * wing + (shape.nose_width - 1.0) * a)
            * step((30.0 - a) / 16.0)
            * mound([0.0, b], [0.0, -34.0], [1.0, 44.0]);
        // Nostrils, under the wings.
        let nostril = mound(at, [7.4, -49.0], [4.8, 3.6]);
        self.z -= 5.5 * nostril;
        self.y += 1.6 * nostril;
        // The tip hangs over, the base rises or falls with the length of the nose.
        let low = mound(at, [0.0, -41.0], [17.0, 14.0]);
        self.y -= shape.nose_droop * low;
        self.y += 1.0 * mound(at, [0.0, -51.5], [9.0, 5.0]);
        self.y -= shape.nose_length * mound(at, [0.0, -46.0], [36.0, 42.0]);
        // From the side of the nose the mask falls towards the inner corner of the eye.
        self.z -= 1.2 * mound(at, [17.0, -8.0], [11.0, 16.0]);
    }

    fn eye(&mut self, node: &Node, skin: &Node, shape: &FaceShape) {
        let (a, b) = (skin.across, skin.up);
        let t = (a - EYE_ACROSS) / EYE_HALF_WIDTH;
        let beta = node.up - EYE_HEIGHT;
        let socket = mound([a, b], [30.0, 3.0], [27.0, 21.0]);
        self.z -= shape.eye_depth * 1.25 * socket + 1.5 * mound([a, b], [18.0, 4.0], [11.0, 13.0]);
        // The outer rim of the socket lies far behind the root of the nose.
        self.z -= 3.6 * mound([a, b], [48.0, 1.0], [17.0, 17.0]);

        let share = beta / LID_BAND;
        let (full, height) = lid_heights(t, beta, shape);

        // The ball of the eye, and the lids, which lie on a slightly larger one.
        let apex = -11.5 - shape.eye_depth;
        let from_centre = [EYE_HALF_WIDTH * t, height];
        let turn = -0.16 * from_centre[0].clamp(-20.0, 20.0);
        let dome = |radii: [f64; 3]| {
            let rest = 1.0 - (from_centre[0] / radii[0]).powi(2) - (from_centre[1] / radii[1]).powi(2);
            // Near its rim the dome goes on along its tangent, so that it meets the skin without a cliff.
            const RIM: f64 = 0.3;
            let root = if rest > RIM { rest.sqrt() } else { (rest + RIM) / (2.0 * RIM.sqrt()) };
            turn + radii[2] * (root - 1.0)
        };
        // Iris and pupil are carved, as sculptors do, so that bare clay looks somewhere.
        let from_pupil = from_centre[0].hypot(from_centre[1] - 0.6);
        let carved = 0.5 * bell(from_pupil - 5.2, 1.7) - 1.9 * bell(from_pupil, 2.8);
        let ball = apex + 0.5 + dome([17.0, 13.0, 13.0]) + carved;
        let lid = apex + 1.9 + dome([18.5, 14.5, 13.5]);
        let window = step((1.9 - t.abs()) / 0.7) * step((22.0 - height.abs()) / 8.0);
        let skin = self.z + window * (rounded_max(self.z, lid, 4.5) - self.z);
        let within = step((1.03 - t.abs()) / 0.12) * step((0.98 - share.abs()) / 0.2);
        self.z = skin + within * (ball - skin);
        // The fold of the upper lid.
        let above = height - (full + 3.4);
        let fold = if beta > 0.0 { step((1.25 - t.abs()) / 0.5) } else { 0.0 };
        self.z += fold * (-1.5 * bell(above, 1.3) + 0.9 * bell(above - 3.4, 2.4));
        // Size, distance and tilt move eye and socket together.
        let near = mound([a, b], [EYE_ACROSS, EYE_HEIGHT], [29.0, 24.0]).sqrt();
        let grow = (shape.eye_size - 1.0) * EYE_HALF_WIDTH * t.clamp(-1.6, 1.6);
        self.x += near * (shape.eye_spacing + grow);
        self.y += near * (shape.eye_tilt * EYE_HALF_WIDTH * t + (shape.eye_size - 1.0) * height);
    }

    /// Turns the point with the jaw about the axis through both jaw joints.
    fn turn_jaw(&mut self, node: &Node, motion: &Motion) {
        let (follow, angle) = motion.jaw_turn(node);
        if angle == 0.0 {
            return;
        }
        let (sine, cosine) = (follow * angle).sin_cos();
        let (y, z) = (self.y + 12.0, self.z + 88.0);
        self.y = -12.0 + cosine * y - sine * z;
        self.z = -88.0 + cosine * z + sine * y;
    }
}
