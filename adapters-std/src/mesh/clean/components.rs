//! The components of the mesh: which are kept, and what is said of each.

use super::draft::Draft;
use super::report::CleanComponent;
use super::{CleanReport, Keep};
use crate::mesh::{Mesh, Topology};

/// Removes the components that are not to be kept. Returns whether there were any.
pub(super) fn drop_components(
    draft: &mut Draft<'_>,
    topology: &Topology,
    keep: Keep,
    report: &mut CleanReport,
) -> bool {
    let components = topology.components();
    let mut areas = vec![0.0; components.all.len()];
    for (face, &component) in components.of_face.iter().enumerate() {
        areas[component as usize] += draft.area(draft.faces[face]);
    }
    let total: f64 = areas.iter().sum();
    let mut largest = 0;
    for component in 1..areas.len() {
        if areas[component] > areas[largest] {
            largest = component;
        }
    }
    let stays = |component: usize| match keep {
        Keep::All => true,
        Keep::Largest => component == largest,
        // The largest stays whatever share is asked for.
        Keep::Share(share) => component == largest || areas[component] >= share * total,
    };
    let mut is_noted = vec![false; areas.len()];
    let n = draft.faces.len();
    draft.drop_faces(|face, old| {
        let component = components.of_face[face] as usize;
        let is_dropped = !stays(component);
        if is_dropped {
            report.removed_component_faces += 1;
            if !is_noted[component] {
                report.removed_components.add(old);
            }
            is_noted[component] = true;
        }
        is_dropped
    });
    draft.faces.len() != n
}

/// What is known of each component of the cleaned mesh, the largest area first, equal ones in the order of their faces.
pub(super) fn described(mesh: &Mesh, topology: &Topology, old_of_face: &[u32], debris: f64) -> Vec<CleanComponent> {
    let components = topology.components();
    let mut faces: Vec<Vec<usize>> = components.all.iter().map(|c| Vec::with_capacity(c.n_faces)).collect();
    for (face, &component) in components.of_face.iter().enumerate() {
        if let Some(faces) = faces.get_mut(component as usize) {
            faces.push(face);
        }
    }
    let all_areas = mesh.face_areas();
    let total: f64 = all_areas.iter().sum();
    let mut described: Vec<CleanComponent> = components
        .all
        .iter()
        .zip(faces)
        .map(|(component, faces)| {
            let area: f64 = faces.iter().map(|&face| all_areas[face]).sum();
            let area_share = if total > 0.0 { area / total } else { 0.0 };
            CleanComponent {
                first_face: faces.first().map_or(0, |&face| old_of_face[face]),
                vertices: component.n_vertices,
                faces: component.n_faces,
                area,
                area_share,
                is_debris: area_share < debris,
                euler: component.euler(),
                boundary_loops: component.n_boundary_loops,
                genus: component.genus().ok(),
                volume: (component.is_closed() && component.is_orientable)
                    .then(|| mesh.signed_volume_of(faces.iter().copied())),
            }
        })
        .collect();
    described.sort_by(|a, b| b.area.total_cmp(&a.area).then(a.first_face.cmp(&b.first_face)));
    described
}
