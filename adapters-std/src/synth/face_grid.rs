//! The quad grid on which every face is a displacement: its chart, its triangles, its mouth slit, its landmarks.
//!
//! Level l has (4 * 2^l + 1) columns and (6 * 2^l + 1) rows (design of the multilinear wavelet model), counted from
//! the subject's right and from under the chin. The nodes lie closer together at eyes, nose and mouth. The mouth is a
//! slit between two rows: no face spans it from corner to corner, and the two rows meet when the lips are closed.

use super::profile::through;
use crate::Error;

/// The names of the landmarks, in the order of the face files.
pub use crate::io::landmarks::FACE_LANDMARKS as LANDMARKS;

/// Half-width of the reference face in the chart: the angle of a column is asin(across / this).
pub(super) const CHART_RADIUS: f64 = 72.0;
/// Height of the line between the lips in the chart.
pub(super) const SLIT: f64 = -72.0;
/// Distance of the corner of the mouth from the middle in the chart.
pub(super) const MOUTH_CORNER: f64 = 25.0;
/// Height of the middle of the eye in the chart.
pub(super) const EYE_HEIGHT: f64 = 1.0;
/// Distance of the middle of the eye from the middle of the face in the chart.
pub(super) const EYE_ACROSS: f64 = 31.25;
/// Half the width of the eye in the chart.
pub(super) const EYE_HALF_WIDTH: f64 = 14.25;
/// Distance of either lid margin from the middle of the eye in the chart.
pub(super) const LID_BAND: f64 = 5.0;

/// Distance from the middle of the face against column, for 32 columns on each side.
const COLUMNS: [[f64; 2]; 5] = [[0.0, 0.0], [12.0, 18.5], [16.0, 25.0], [24.0, 44.0], [32.0, 71.3]];

/// Where a node lies in the chart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    /// Distance from the middle, in mm of the reference face; never negative.
    pub across: f64,
    /// Height over the line of the eyes, in mm of the reference face along its profile.
    pub up: f64,
    /// +1 on the subject's left, -1 on the right, 0 in the middle.
    pub side: f64,
    /// Whether the node belongs to the lower lip or what is below it.
    pub below_slit: bool,
}

/// Chart position of each landmark, in the order of [`LANDMARKS`]: signed distance to the left, height.
const LANDMARK_PLACES: [[f64; 2]; 13] = [
    [-EYE_ACROSS - EYE_HALF_WIDTH, EYE_HEIGHT],
    [-EYE_ACROSS + EYE_HALF_WIDTH, EYE_HEIGHT],
    [EYE_ACROSS - EYE_HALF_WIDTH, EYE_HEIGHT],
    [EYE_ACROSS + EYE_HALF_WIDTH, EYE_HEIGHT],
    [0.0, -39.0],
    [-17.0, -45.0],
    [17.0, -45.0],
    [0.0, -50.5],
    [-MOUTH_CORNER, SLIT],
    [MOUTH_CORNER, SLIT],
    [0.0, -64.0],
    [0.0, -81.0],
    [0.0, -114.0],
];

/// The chart position of a node once the corners of the chart, at the temples and under the jaw, are rounded off.
pub(super) fn rounded_corner(node: &Node) -> (f64, f64) {
    let (a, b) = (node.across, node.up);
    const BEGIN: f64 = 34.0;
    let (from, reach) = if b > 0.0 { (16.0, 68.0) } else { (-66.0, -64.0) };
    let (p, q) = ((a - BEGIN) / (CHART_RADIUS - BEGIN), (b - from) / reach);
    if p <= 0.0 || q <= 0.0 {
        return (a, b);
    }
    // A square becomes a disc where the factor is a half (elliptical grid mapping); a little less keeps the last quad
    // from collapsing.
    const ROUNDING: f64 = 0.43;
    let (across, up) = (p * (1.0 - ROUNDING * q * q).sqrt(), q * (1.0 - ROUNDING * p * p).sqrt());
    (BEGIN + (CHART_RADIUS - BEGIN) * across, from + reach * up)
}

/// A grid of one level.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceGrid {
    /// Number of columns, from the subject's right to the left.
    pub columns: usize,
    /// Number of rows, from under the chin to the hairline. Vertex = row * columns + column.
    pub rows: usize,
    /// The last row of the lower lip; the upper lip begins with the next.
    pub slit_row: usize,
}

impl FaceGrid {
    /// The grid of a level, 3 (1,617 vertices) to 6 (98,945); level 4 has 65 x 97 = 6,305.
    pub fn of_level(level: u32) -> Result<Self, Error> {
        if !(3..=6).contains(&level) {
            return Err(Error::input(format!("a face grid has a level from 3 to 6, not {level}: the default is 4")));
        }
        let rows = (6 << level) + 1;
        // Row 28.5 of 96 is the slit.
        let slit_row = (rows - 1) * 57 / 192;
        Ok(FaceGrid { columns: (4 << level) + 1, rows, slit_row })
    }

    /// Number of vertices.
    pub fn n_vertices(&self) -> usize {
        self.columns * self.rows
    }

    /// The chart positions of all vertices.
    pub(super) fn nodes(&self) -> Vec<Node> {
        let slit = (self.slit_row as f64 + 0.5) * 96.0 / (self.rows - 1) as f64;
        let heights = [
            [0.0, -130.0],
            [5.0, -118.0],
            [16.0, -88.5],
            [slit, SLIT],
            [39.0, -61.0],
            [45.0, -50.5],
            [51.0, -42.5],
            [55.0, -34.5],
            [63.0, -11.5],
            [68.0, EYE_HEIGHT - LID_BAND],
            [76.0, EYE_HEIGHT + LID_BAND],
            [81.0, 13.0],
            [87.0, 27.5],
            [96.0, 84.0],
        ];
        let middle = (self.columns / 2) as f64;
        let mut nodes = Vec::with_capacity(self.n_vertices());
        for row in 0..self.rows {
            let up = through(&heights, row as f64 * 96.0 / (self.rows - 1) as f64);
            for column in 0..self.columns {
                let offset = column as f64 - middle;
                let across = through(&COLUMNS, offset.abs() * 32.0 / middle);
                let side = if offset == 0.0 { 0.0 } else { offset.signum() };
                nodes.push(Node { across, up, side, below_slit: row <= self.slit_row });
            }
        }
        nodes
    }

    /// Two triangles per quad, counter-clockwise from outside; none across the mouth slit. The diagonals mirror, and
    /// follow the curves: down to the sides beside nose and mouth, up to the sides round the chin.
    pub fn faces(&self) -> Vec<[u32; 3]> {
        const CHIN: f64 = -94.0;
        let nodes = self.nodes();
        let mut faces = Vec::with_capacity(2 * self.n_vertices());
        for row in 0..self.rows - 1 {
            for column in 0..self.columns - 1 {
                let at = row * self.columns + column;
                let in_mouth = |vertex: usize| nodes[vertex].across <= MOUTH_CORNER + 1e-9;
                if row == self.slit_row && in_mouth(at) && in_mouth(at + 1) {
                    continue;
                }
                let [a, b, c, d] = [at, at + 1, at + 1 + self.columns, at + self.columns].map(|v| v as u32);
                if (column < self.columns / 2) != (nodes[at].up < CHIN) {
                    faces.extend([[a, b, c], [a, c, d]]);
                } else {
                    faces.extend([[a, b, d], [b, c, d]]);
                }
            }
        }
        faces
    }

    /// The vertex at the same place on the other side, for every vertex.
    pub fn mirror(&self) -> Vec<u32> {
        let across = |vertex: usize| vertex - vertex % self.columns + self.columns - 1 - vertex % self.columns;
        (0..self.n_vertices()).map(|vertex| across(vertex) as u32).collect()
    }

    /// The vertices nearest to the landmarks' places in the chart, in the order of [`LANDMARKS`].
    pub fn landmarks(&self) -> [u32; 13] {
        let nodes = self.nodes();
        LANDMARK_PLACES.map(|[left, up]| {
            let distance = |node: &Node| (node.side * node.across - left).powi(2) + (node.up - up).powi(2);
            let nearest = (0..nodes.len()).min_by(|p, q| distance(&nodes[*p]).total_cmp(&distance(&nodes[*q])));
            nearest.unwrap_or(0) as u32
        })
    }
}
