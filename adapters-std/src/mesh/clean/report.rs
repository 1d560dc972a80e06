//! What cleaning found and changed, in the numbers of the input.

use serde::Serialize;

/// How many, and the first few of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding<T = u32> {
    /// How many there are.
    pub count: usize,
    /// The first of them, as indices of the input; at most [`Finding::EXAMPLES`].
    pub examples: Vec<T>,
}

impl<T> Default for Finding<T> {
    fn default() -> Self {
        Finding { count: 0, examples: Vec::new() }
    }
}

impl<T> Finding<T> {
    /// The number of examples that are kept.
    pub const EXAMPLES: usize = 10;

    pub(super) fn add(&mut self, example: T) {
        self.count += 1;
        if self.examples.len() < Self::EXAMPLES {
            self.examples.push(example);
        }
    }
}

/// Numbers of vertices and faces.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Size {
    /// Vertices or points.
    pub vertices: usize,
    /// Faces.
    pub faces: usize,
}

/// Vertices that were welded although they differed in a colour or an attribute.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Conflict {
    /// `"colour"`, or the name of the attribute.
    pub name: String,
    /// How many vertices lost a value that differs from that of the vertex they were welded to.
    pub vertices: usize,
}

/// A component of the cleaned mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CleanComponent {
    /// Its first face, as index of the input.
    pub first_face: u32,
    /// Number of its vertices.
    pub vertices: usize,
    /// Number of its faces.
    pub faces: usize,
    /// Its area, in the square of the unit.
    pub area: f64,
    /// Its share of the area of the mesh.
    pub area_share: f64,
    /// Whether its share is below [`super::CleanOptions::debris`].
    pub is_debris: bool,
    /// Its Euler number.
    pub euler: i64,
    /// Number of its boundary loops.
    pub boundary_loops: usize,
    /// Number of its handles; `None` when it cannot be oriented.
    pub genus: Option<u64>,
    /// The volume that it encloses; `None` when it has a boundary or cannot be oriented.
    pub volume: Option<f64>,
}

/// Everything that cleaning found and changed. Indices are those of the input.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct CleanReport {
    /// The input.
    pub before: Size,
    /// The result.
    pub after: Size,
    /// The length to which tolerances are relative: the root of the area, or the extent of a cloud.
    pub scale: f64,
    /// Vertices at most so far apart were welded.
    pub weld_distance: f64,
    /// Vertices with a coordinate that is not finite: removed, and their faces.
    pub non_finite_vertices: Finding,
    /// Faces of such vertices: removed.
    pub non_finite_faces: Finding,
    /// Normals that are not finite: replaced by those of the faces, or by zero.
    pub non_finite_normals: Finding,
    /// Vertices without faces in a mesh with faces: removed unless [`super::CleanOptions::keep_unreferenced`].
    pub unreferenced_vertices: Finding,
    /// How many of them were removed.
    pub removed_unreferenced: usize,
    /// Vertices that were replaced by an earlier one at the same place.
    pub welded_vertices: Finding,
    /// Welded vertices that differed in more than position.
    pub conflicts: Vec<Conflict>,
    /// Faces that name a vertex twice, before or after welding: removed.
    pub repeated_index_faces: Finding,
    /// Faces without area: removed.
    pub zero_area_faces: Finding,
    /// Faces with the vertices of an earlier one, in the same sense: removed.
    pub duplicate_faces: Finding,
    /// Faces with the vertices of an earlier one, in the other sense: removed.
    pub opposite_faces: Finding,
    /// Edges with more than two faces: cut, or paired as two sheets.
    pub non_manifold_edges: Finding<[u32; 2]>,
    /// How many of them were paired as two sheets that touch.
    pub paired_edges: usize,
    /// Vertices with several fans of faces, the ends of cut edges among them: one copy per fan.
    pub non_manifold_vertices: Finding,
    /// Vertices that were added for them.
    pub added_vertices: usize,
    /// Faces that were turned.
    pub turned_faces: Finding,
    /// Closed components that were inside out throughout.
    pub components_turned_outward: usize,
    /// Components whose sides cannot be told apart, by their first faces: left as they are.
    pub unorientable_components: Finding,
    /// Faces that bridge layers of a scan or run to a stray vertex: removed.
    pub spikes: Finding,
    /// Other faces that are as long: kept, because they do not look like spikes.
    pub long_faces: Finding,
    /// Components that were not kept ([`super::CleanOptions::keep`]), by their first faces.
    pub removed_components: Finding,
    /// Faces of such components.
    pub removed_component_faces: usize,
    /// Vertices that lost all their faces: removed.
    pub orphaned_vertices: Finding,
    /// Points of a cloud that lie far from all others: kept unless [`super::CleanOptions::remove_outliers`].
    pub outliers: Finding,
    /// How many outliers were removed.
    pub removed_outliers: usize,
    /// The components of the result, the largest area first.
    pub components: Vec<CleanComponent>,
}

impl CleanReport {
    /// Whether the result is the input, bit for bit.
    pub fn is_unchanged(&self) -> bool {
        self.before == self.after
            && self.non_finite_normals.count + self.turned_faces.count + self.added_vertices == 0
            && self.non_manifold_vertices.count + self.welded_vertices.count == 0
    }

    /// The number of components whose share of the area is small.
    pub fn n_debris(&self) -> usize {
        self.components.iter().filter(|component| component.is_debris).count()
    }

    /// A clause for each kind of change, such as `"12 duplicate faces removed (first: 7, 9)"`, in the order of the steps.
    pub fn changes(&self) -> Vec<String> {
        let mut clauses = Vec::new();
        let mut say = |finding: &Finding, what: &str| {
            if finding.count != 0 {
                clauses.push(format!("{} {what}{}", finding.count, examples(finding)));
            }
        };
        say(&self.non_finite_vertices, "vertices with coordinates that are not finite removed");
        say(&self.non_finite_faces, "faces of vertices that are not finite removed");
        say(&self.non_finite_normals, "normals that are not finite replaced");
        say(&self.welded_vertices, "vertices welded to an earlier one at their place");
        say(&self.repeated_index_faces, "faces with a vertex twice removed");
        say(&self.zero_area_faces, "faces without area removed");
        say(&self.duplicate_faces, "duplicate faces removed");
        say(&self.opposite_faces, "faces on the back of another removed");
        say(&self.non_manifold_vertices, "vertices with several fans of faces parted");
        say(&self.turned_faces, "faces turned to agree with their neighbours or to face outwards");
        say(&self.spikes, "spikes removed");
        say(&self.removed_components, "components removed");
        say(&self.orphaned_vertices, "vertices without a face that is left removed");
        if self.non_manifold_edges.count != 0 {
            let Finding { count, .. } = self.non_manifold_edges;
            let paired = self.paired_edges;
            let examples = examples(&self.non_manifold_edges);
            clauses.push(format!(
                "{count} edges with more than two faces cut, {paired} of them into two sheets{examples}"
            ));
        }
        if self.added_vertices != 0 {
            clauses.push(format!("{} vertices added by cutting", self.added_vertices));
        }
        if self.removed_unreferenced != 0 {
            let examples = examples(&self.unreferenced_vertices);
            clauses.push(format!("{} vertices without faces removed{examples}", self.removed_unreferenced));
        }
        if self.removed_outliers != 0 {
            clauses.push(format!("{} outliers removed{}", self.removed_outliers, examples(&self.outliers)));
        }
        for Conflict { name, vertices } in &self.conflicts {
            clauses.push(format!("{vertices} welded vertices had another {name:?} than the vertex that stays"));
        }
        clauses
    }

    /// A clause for each kind of thing that was found and left.
    pub fn remarks(&self) -> Vec<String> {
        let mut clauses = Vec::new();
        let mut say = |finding: &Finding, what: &str| {
            if finding.count != 0 {
                clauses.push(format!("{} {what}{}", finding.count, examples(finding)));
            }
        };
        say(&self.unorientable_components, "components cannot be oriented; first faces");
        say(&self.long_faces, "long faces kept, which do not look like spikes");
        if self.removed_unreferenced == 0 {
            say(&self.unreferenced_vertices, "vertices without faces");
        }
        if self.removed_outliers == 0 {
            say(&self.outliers, "points lie far from all others");
        }
        if self.n_debris() != 0 {
            clauses.push(format!("{} components are debris", self.n_debris()));
        }
        clauses
    }
}

fn examples<T: std::fmt::Debug>(finding: &Finding<T>) -> String {
    let shown: Vec<String> = finding.examples.iter().take(4).map(|example| format!("{example:?}")).collect();
    let more = if finding.count > shown.len() { ", ..." } else { "" };
    format!(" ({}{more})", shown.join(", "))
}
