//! Faces agree about the outside.

use super::CleanReport;
use super::draft::Draft;
use crate::mesh::Topology;
use crate::mesh::topology::Patches;

/// What is known of a patch.
#[derive(Clone, Copy, Default)]
struct Patch {
    first_face: Option<usize>,
    n_faces: usize,
    n_turned: usize,
    has_border: bool,
    /// Six times the volume when its faces agree with the first.
    volume: f64,
}

/// Turns faces: in a closed patch such that its volume is positive, in one with a boundary, where inside and outside mean
/// nothing, the fewer of the two kinds (of equally many not the first). Patches that cannot be oriented stay as they are.
///
/// `topology` must have no edge with more than two faces. Returns whether a face was turned.
pub(super) fn orient(draft: &mut Draft<'_>, topology: &Topology, report: &mut CleanReport) -> bool {
    let Patches { of_face, is_turned, is_orientable } = topology.patches();
    let mut patches = vec![Patch::default(); is_orientable.len()];
    for (face, &number) in of_face.iter().enumerate() {
        let patch = &mut patches[number as usize];
        let first = *patch.first_face.get_or_insert(face);
        patch.n_faces += 1;
        patch.n_turned += usize::from(is_turned[face]);
        patch.has_border |=
            topology.edges_of_face(face as u32).iter().any(|&edge| topology.edges()[edge as usize].faces.len() != 2);
        let origin = draft.positions[draft.faces[first][0] as usize];
        let [a, b, c] = draft.corners(draft.faces[face]).map(|corner| corner - origin);
        // The product changes but its sign when the face is turned, bit for bit.
        let product = a.dot((b - a).cross(c - a));
        patch.volume += if is_turned[face] { -product } else { product };
    }
    let turns_all: Vec<bool> = patches
        .iter()
        .map(|patch| if patch.has_border { 2 * patch.n_turned > patch.n_faces } else { patch.volume < 0.0 })
        .collect();
    for (patch, (&all, _)) in patches.iter().zip(turns_all.iter().zip(&is_orientable)).filter(|(_, (_, is))| **is) {
        report.components_turned_outward += usize::from(all && !patch.has_border && patch.n_turned == 0);
    }
    let mut changed = false;
    for (face, &number) in of_face.iter().enumerate() {
        if is_orientable[number as usize] && is_turned[face] != turns_all[number as usize] {
            draft.faces[face].swap(1, 2);
            draft.before[face].swap(1, 2);
            report.turned_faces.add(draft.old_of_face[face]);
            changed = true;
        }
    }
    changed
}

/// Reports the components that cannot be oriented.
pub(super) fn note_unorientable(draft: &Draft<'_>, patches: &Patches, report: &mut CleanReport) {
    let mut is_noted = vec![false; patches.is_orientable.len()];
    for (face, &number) in patches.of_face.iter().enumerate() {
        let Some(noted) = is_noted.get_mut(number as usize) else { continue };
        if !patches.is_orientable[number as usize] && !*noted {
            *noted = true;
            report.unorientable_components.add(draft.old_of_face[face]);
        }
    }
}
