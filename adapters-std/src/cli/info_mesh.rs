//! `habitus info` of a mesh file: what is in it, and how sound it is.

use std::fmt::Write;
use std::path::Path;

use glam::DVec3;
use serde_json::{Value, json};

use super::Console;
use crate::Error;
use crate::io::mesh::{MeshFile, NonFinite, ReadOptions, read_file};
use crate::mesh::topology::{EdgeClass, NoGenus};
use crate::mesh::{Attribute, Mesh, Topology};

/// Describes the mesh file at `path`. Coordinates that are not finite are counted, not refused.
pub(super) fn run(path: &Path, console: &Console) -> Result<(), Error> {
    let file = read_file(path, &ReadOptions { non_finite: NonFinite::Keep })?;
    let mesh = &file.mesh;
    let soundness = Soundness::of(mesh);
    let extent = Extent::of(mesh);
    let mut text = format!("{}: {} vertices, ", path.display(), mesh.positions.len());
    let _ = match mesh.faces.len() {
        0 => writeln!(text, "no faces"),
        n if soundness.is_closed() => writeln!(text, "{n} faces, closed"),
        n => writeln!(text, "{n} faces, open"),
    };
    if let Some(Extent { low, high, diagonal }) = &extent {
        let _ = writeln!(text, "box {low:?} to {high:?}, diagonal {diagonal} (unit of the file)");
    }
    let _ = writeln!(text, "normals: {}, colours: {}", yes(!mesh.normals.is_empty()), yes(!mesh.colours.is_empty()));
    for attribute in &mesh.attributes {
        let Range { low, high, n_other } = Range::of(attribute);
        let _ = write!(text, "attribute {:?} ({:?}): ", attribute.name, attribute.scalar);
        let _ = match (attribute.values.len() - n_other, n_other) {
            (0, n) => writeln!(text, "{n} numbers, none finite"),
            (_, 0) => writeln!(text, "{low} to {high}"),
            (_, n) => writeln!(text, "{low} to {high}, and {n} not finite"),
        };
    }
    if !file.morphs.is_empty() {
        let _ = writeln!(text, "morph targets: {}", names(morph_names(&file)));
    }
    if file.skin.is_some() {
        let _ = writeln!(text, "joints: {}", names(joint_names(&file)));
    }
    text += &soundness.sentence();
    for (n, what) in soundness.counts() {
        if n > 0 {
            let _ = writeln!(text, "{n} {what}");
        }
    }
    for clause in &file.left_out {
        let _ = writeln!(text, "also in the file, not kept: {clause}");
    }
    console.result(&text, described(&file, &soundness, extent.as_ref()))
}

fn described(file: &MeshFile, soundness: &Soundness, extent: Option<&Extent>) -> Value {
    let mesh = &file.mesh;
    let attribute = |attribute: &Attribute| {
        let Range { low, high, n_other } = Range::of(attribute);
        json!({
            "name": attribute.name,
            "type": format!("{:?}", attribute.scalar),
            "low": low,
            "high": high,
            "non_finite": n_other,
        })
    };
    json!({
        "kind": if mesh.faces.is_empty() { "cloud" } else { "mesh" },
        "vertices": mesh.positions.len(),
        "faces": mesh.faces.len(),
        "edges": soundness.n_edges,
        "closed": soundness.is_closed(),
        "box_low": extent.map(|extent| extent.low),
        "box_high": extent.map(|extent| extent.high),
        "box_diagonal": extent.map(|extent| extent.diagonal),
        "normals": !mesh.normals.is_empty(),
        "colours": !mesh.colours.is_empty(),
        "attributes": mesh.attributes.iter().map(attribute).collect::<Vec<_>>(),
        "morph_targets": morph_names(file),
        "joints": joint_names(file),
        "non_finite_vertices": soundness.n_non_finite,
        "unreferenced_vertices": soundness.n_unreferenced,
        "degenerate_faces": soundness.n_degenerate,
        "boundary_edges": soundness.n_boundary,
        "non_manifold_edges": soundness.n_non_manifold,
        "non_manifold_vertices": soundness.n_non_manifold_vertices,
        "inconsistent_edges": soundness.n_inconsistent,
        "components": soundness.n_components,
        "boundary_loops": soundness.n_loops,
        "genus": soundness.genus.ok(),
        "no_genus": soundness.genus.err().map(|reason| reason.to_string()),
        "area": soundness.area,
        "volume": soundness.volume,
        "not_kept": file.left_out,
    })
}

/// How the faces of a mesh hang together, and counts of what keeps it from being a closed surface.
struct Soundness {
    n_faces: usize,
    n_edges: usize,
    n_non_finite: usize,
    /// Vertices of a mesh that no face names.
    n_unreferenced: usize,
    /// Faces that name a vertex twice or have no area.
    n_degenerate: usize,
    n_boundary: usize,
    n_non_manifold: usize,
    /// Vertices with several fans of faces.
    n_non_manifold_vertices: usize,
    /// Edges whose two faces disagree about the outside.
    n_inconsistent: usize,
    n_components: usize,
    /// Boundary loops of all components.
    n_loops: usize,
    /// Handles of all components, or why the first that has no genus has none.
    genus: Result<u64, NoGenus>,
    /// Sum of the areas of the faces whose corners are finite, in the square of the unit.
    area: Option<f64>,
    /// The signed volume of a closed mesh whose faces agree about the outside, in the cube of the unit.
    volume: Option<f64>,
}

impl Soundness {
    fn of(mesh: &Mesh) -> Self {
        let topology = Topology::new(mesh.positions.len(), &mesh.faces);
        let components = topology.components().all;
        let n_inconsistent = topology.count(EdgeClass::Inconsistent);
        let is_finite = |face: usize| mesh.triangle(face).iter().flatten().all(|x| x.is_finite());
        let areas = mesh.face_areas().into_iter().enumerate().filter(|(face, _)| is_finite(*face));
        // Adding 0.0 makes a sum of nothing 0, not -0.
        let area = 0.0 + areas.map(|(_, area)| area).sum::<f64>();
        let has_volume = !components.is_empty() && topology.is_closed() && n_inconsistent == 0;
        let mut is_referenced = vec![mesh.faces.is_empty(); mesh.positions.len()];
        mesh.faces.iter().flatten().for_each(|&vertex| is_referenced[vertex as usize] = true);
        let is_degenerate = |face: &usize| {
            let [a, b, c] = mesh.triangle(*face).map(DVec3::from_array);
            // Also where a corner is not finite: such a face has no area either.
            !((b - a).cross(c - a).length() > 0.0)
        };
        Soundness {
            n_faces: mesh.faces.len(),
            n_edges: topology.edges().len(),
            n_non_finite: mesh.positions.iter().filter(|p| p.iter().any(|x| !x.is_finite())).count(),
            n_unreferenced: is_referenced.iter().filter(|referenced| !**referenced).count(),
            n_degenerate: (0..mesh.faces.len()).filter(is_degenerate).count(),
            n_boundary: topology.count(EdgeClass::Boundary),
            n_non_manifold: topology.count(EdgeClass::NonManifold),
            n_non_manifold_vertices: topology.non_manifold_vertices().len(),
            n_inconsistent,
            n_components: components.len(),
            n_loops: components.iter().map(|component| component.n_boundary_loops).sum(),
            genus: components.iter().map(|component| component.genus()).sum(),
            area: (!mesh.faces.is_empty() && area.is_finite()).then_some(area),
            volume: has_volume.then(|| mesh.signed_volume()).filter(|volume| volume.is_finite()),
        }
    }

    /// Whether every edge has two faces.
    fn is_closed(&self) -> bool {
        self.n_components > 0 && self.n_boundary == 0 && self.n_non_manifold == 0
    }

    /// One line on how the faces hang together; nothing of a cloud.
    fn sentence(&self) -> String {
        if self.n_faces == 0 {
            return String::new();
        }
        let genus = match self.genus {
            Ok(genus) => format!("genus {genus}"),
            Err(reason) => format!("no genus ({reason})"),
        };
        let mut text = format!("components: {}, boundary loops: {}, {genus}", self.n_components, self.n_loops);
        for (what, value) in [("area", self.area), ("volume", self.volume)] {
            if let Some(value) = value {
                let _ = write!(text, ", {what} {value}");
            }
        }
        text + "\n"
    }

    fn counts(&self) -> [(usize, &'static str); 7] {
        [
            (self.n_non_finite, "vertices with coordinates that are not finite (`habitus clean` removes them)"),
            (self.n_unreferenced, "vertices that no face names"),
            (self.n_degenerate, "faces without area"),
            (self.n_boundary, "edges at a boundary"),
            (self.n_non_manifold, "edges of more than two faces"),
            (self.n_non_manifold_vertices, "vertices where several fans of faces meet"),
            (self.n_inconsistent, "edges whose two faces disagree about the outside"),
        ]
    }
}

/// The box around the vertices whose coordinates are finite.
struct Extent {
    low: [f64; 3],
    high: [f64; 3],
    diagonal: f64,
}

impl Extent {
    fn of(mesh: &Mesh) -> Option<Self> {
        let finite = mesh.positions.iter().filter(|p| p.iter().all(|x| x.is_finite())).copied();
        let (low, high) = Mesh { positions: finite.collect(), ..Mesh::default() }.bounding_box()?;
        Some(Extent { low, high, diagonal: DVec3::from_array(low).distance(DVec3::from_array(high)) })
    }
}

/// The finite values of an attribute; no bounds when there are none.
struct Range {
    low: f64,
    high: f64,
    n_other: usize,
}

impl Range {
    fn of(attribute: &Attribute) -> Self {
        let mut range = Range { low: f64::INFINITY, high: f64::NEG_INFINITY, n_other: 0 };
        for &value in &attribute.values {
            if value.is_finite() {
                (range.low, range.high) = (range.low.min(value), range.high.max(value));
            } else {
                range.n_other += 1;
            }
        }
        range
    }
}

fn morph_names(file: &MeshFile) -> Vec<&str> {
    file.morphs.iter().map(|morph| &morph.name[..]).collect()
}

fn joint_names(file: &MeshFile) -> Vec<&str> {
    file.skin.iter().flat_map(|skin| &skin.joints).map(|joint| &joint.name[..]).collect()
}

/// The number of names, and the names.
fn names(names: Vec<&str>) -> String {
    format!("{}: {}", names.len(), names.join(", "))
}

fn yes(is: bool) -> &'static str {
    if is { "yes" } else { "no" }
}
