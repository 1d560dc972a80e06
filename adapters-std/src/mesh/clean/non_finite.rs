//! Vertices with coordinates that are not finite, and vertices without faces: what is removed before geometry begins.

use super::draft::Draft;
use super::{CleanReport, NONE};

/// Removes vertices that are not finite, and their faces.
pub(super) fn remove_non_finite(draft: &mut Draft<'_>, report: &mut CleanReport) {
    for vertex in 0..draft.now.len() {
        if !draft.positions[vertex].is_finite() {
            draft.is_alive[vertex] = false;
            draft.now[vertex] = NONE;
            report.non_finite_vertices.add(vertex as u32);
        }
    }
    if report.non_finite_vertices.count == 0 {
        return;
    }
    let faces = std::mem::take(&mut draft.faces);
    for (face, corners) in faces.into_iter().enumerate() {
        if corners.iter().all(|&vertex| draft.is_alive[vertex as usize]) {
            draft.old_of_face[draft.faces.len()] = face as u32;
            draft.faces.push(corners);
        } else {
            report.non_finite_faces.add(face as u32);
        }
    }
    draft.old_of_face.truncate(draft.faces.len());
}

/// Removes the vertices of a mesh that no face names, unless they are to be kept. Vertices of faces that were just removed
/// count as orphaned.
pub(super) fn remove_unreferenced(draft: &mut Draft<'_>, report: &mut CleanReport, is_kept: bool) {
    let named_by = |faces: &[[u32; 3]]| {
        let mut is_named = vec![false; draft.positions.len()];
        faces.iter().flatten().for_each(|&vertex| is_named[vertex as usize] = true);
        is_named
    };
    let (was_named, is_named) = (named_by(&draft.input.faces), named_by(&draft.faces));
    for vertex in 0..draft.now.len() {
        if is_named[vertex] || !draft.is_alive[vertex] {
            continue;
        }
        if was_named[vertex] {
            report.orphaned_vertices.add(vertex as u32);
        } else {
            report.unreferenced_vertices.add(vertex as u32);
        }
        if was_named[vertex] || !is_kept {
            report.removed_unreferenced += usize::from(!was_named[vertex]);
            draft.is_alive[vertex] = false;
            draft.now[vertex] = NONE;
        }
    }
}
