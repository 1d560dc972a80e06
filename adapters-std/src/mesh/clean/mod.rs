//! Cleaning of meshes and clouds as scanners and other programs leave them (Part I, 1.2; Part II, 3.1; Part III, 3.1).
//!
//! A scan comes with vertices that are not numbers, the same vertex several times, faces without area, sheets that touch,
//! faces that look inwards, spikes between layers. What stands on geometry later wants an oriented manifold. Cleaning makes
//! one, changes nothing that needs no change, and tells every change in the numbers of the input.
//!
//! Data flow: [`clean`] removes what is not finite, then repeats passes of welding, removal of degenerate and duplicate
//! faces, cutting, orientation, removal of spikes and of components until a pass changes nothing; so cleaning what has been
//! cleaned changes nothing.

mod components;
mod cut;
mod draft;
mod faces;
mod non_finite;
mod orient;
mod outliers;
mod report;
mod scale;
mod spikes;
mod weld;

pub use report::{CleanComponent, CleanReport, Conflict, Finding, Size};

use super::{LARGEST_COORDINATE, Mesh, Topology};
use crate::Error;
use draft::{Draft, Settled};

/// Stands for "no index" in flat arrays.
const NONE: u32 = u32::MAX;

/// Passes at most. Two are usual: one that changes, one that finds nothing left.
const MAX_PASSES: usize = 50;

/// Faces at most: the number of their sides has 32 bits.
const MAX_FACES: usize = 1_000_000_000;

/// What cleaning does. The defaults change nothing of a sound mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct CleanOptions {
    /// Vertices at most so far apart become one, in the unit of the mesh. `None`: `1e-7 L`, with `L` the root of the area,
    /// or the extent of a cloud; 0: equal positions alone.
    pub weld: Option<f64>,
    /// An edge is long when it is so many times the median edge; only long faces can be spikes. Infinite: no spike is
    /// removed.
    pub spike_factor: f64,
    /// The components that stay.
    pub keep: Keep,
    /// A component with less than this share of the area is called debris; it stays unless `keep` says otherwise.
    pub debris: f64,
    /// Whether vertices without faces stay in a mesh that has faces.
    pub keep_unreferenced: bool,
    /// A point of a cloud is an outlier when its 8 neighbours are on average so many times farther than the median point's.
    pub outlier_factor: f64,
    /// Whether outliers are removed; else they are only reported.
    pub remove_outliers: bool,
}

impl Default for CleanOptions {
    fn default() -> Self {
        CleanOptions {
            weld: None,
            spike_factor: 10.0,
            keep: Keep::All,
            debris: 0.01,
            keep_unreferenced: false,
            outlier_factor: 4.0,
            remove_outliers: false,
        }
    }
}

/// The components that stay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Keep {
    /// All.
    All,
    /// The one with the largest area, of equal ones the first.
    Largest,
    /// Those with at least this share of the area, and the largest.
    Share(f64),
}

/// A cleaned mesh and how it came about.
#[derive(Debug, Clone)]
pub struct Cleaned {
    /// The mesh; it passes [`Mesh::check`], and its faces are an oriented manifold but for what the report calls
    /// unorientable.
    pub mesh: Mesh,
    /// What was found and changed.
    pub report: CleanReport,
    /// For each vertex of the input the vertex of the result that stands for it, if one does. Of the copies that cutting
    /// made that of the first face; `twins` has the others.
    pub vertex_of_old: Vec<Option<u32>>,
    /// For each vertex of the result the one of the input from which it has its properties.
    pub old_of_vertex: Vec<u32>,
    /// For each face of the result that of the input.
    pub old_of_face: Vec<u32>,
    /// Groups of vertices of the result that lie at one place and were parted there, so that a passage from one to the
    /// other may be allowed.
    pub twins: Vec<Vec<u32>>,
}

/// A cleaned mesh or cloud.
///
/// | step | meshes | clouds |
/// |---|---|---|
/// | vertices that are not finite | removed, with their faces | removed |
/// | vertices without faces | removed | |
/// | vertices at one place | welded to the first of them, which keeps its properties | the same |
/// | faces with a vertex twice, or below `1e-12 L^2` | removed | |
/// | faces with the vertices of an earlier one | removed | |
/// | edges with more than two faces, vertices with several fans | cut | |
/// | faces that disagree with their neighbours, closed components inside out | turned | |
/// | spikes | removed | |
/// | components | described, small ones called debris, removed if asked | |
/// | points far from all others | | reported, removed if asked |
///
/// Source: Part I, section 1.2; spikes: Part III, section 3.1, made safer (see the module of that name).
///
/// Cost: a pass is `O(n log d)` for `d` edges at a vertex, about 500 bytes a face; one or two passes.
/// Determinism: everything is done in the order of the input; of equal ones the first stays. One thread.
///
/// # Errors
/// [`Error::Input`] when faces, normals, colours or attributes do not fit the vertices, for a finite coordinate beyond
/// 1e70, when an option makes no sense, or when nothing is left.
pub fn clean(mesh: &Mesh, options: &CleanOptions) -> Result<Cleaned, Error> {
    check(mesh, options)?;
    let mut report = CleanReport { before: size(mesh), ..CleanReport::default() };
    let mut draft = Draft::new(mesh);
    let mut topology = None;
    non_finite::remove_non_finite(&mut draft, &mut report);
    if mesh.faces.is_empty() {
        clean_cloud(&mut draft, options, &mut report)?;
    } else {
        non_finite::remove_unreferenced(&mut draft, &mut report, options.keep_unreferenced);
        for _ in 0..MAX_PASSES {
            topology = pass(&mut draft, options, &mut report);
            // Where nothing is left, the distance of the round that removed it is for the message.
            if topology.is_some() || draft.faces.is_empty() {
                break;
            }
        }
    }
    report.scale /= draft.factor;
    report.weld_distance /= draft.factor;
    let is_gone = if mesh.faces.is_empty() { !draft.is_alive.contains(&true) } else { draft.faces.is_empty() };
    if is_gone {
        return Err(nothing_left(&report));
    }
    Ok(finished(&draft, topology, options, report))
}

/// What cleaning cannot repair: parts that do not belong together, and options that make no sense.
fn check(mesh: &Mesh, options: &CleanOptions) -> Result<(), Error> {
    let CleanOptions { weld, spike_factor, debris, outlier_factor, keep, .. } = options;
    let share = if let Keep::Share(share) = keep { *share } else { 0.0 };
    for (what, value) in [
        ("the distance of welding", weld.unwrap_or(0.0)),
        ("the factor of spikes", *spike_factor),
        ("the share of debris", *debris),
        ("the factor of outliers", *outlier_factor),
        ("the share of the components that stay", share),
    ] {
        if !(value >= 0.0) {
            return Err(Error::input(format!("{what} is {value}: give 0 or more")));
        }
    }
    for (what, value, least, most) in
        [("the share of debris", *debris, 0.0, 1.0), ("the factor of spikes", *spike_factor, 1.0, f64::INFINITY)]
    {
        if !(least..=most).contains(&value) {
            return Err(Error::input(format!("{what} is {value}: give {least} to {most}")));
        }
    }
    if weld.is_some_and(|distance| !distance.is_finite()) {
        return Err(Error::input("the distance of welding is not finite: give 0 or more"));
    }
    if mesh.faces.len() > MAX_FACES {
        let n = mesh.faces.len();
        return Err(Error::input(format!("a mesh of {n} faces: at most {MAX_FACES} can be cleaned; divide it")));
    }
    mesh.check_parts()?;
    // What is not finite is removed.
    let is_beyond = |position: &[f64; 3]| {
        position.iter().all(|x| x.is_finite()) && position.iter().any(|x| x.abs() > LARGEST_COORDINATE)
    };
    match mesh.positions.iter().position(is_beyond) {
        None => Ok(()),
        Some(vertex) => Err(Error::input(format!(
            "vertex {vertex} is at {:?}: coordinates must be at most {LARGEST_COORDINATE:e}; remove the vertex",
            mesh.positions[vertex]
        ))),
    }
}

fn size(mesh: &Mesh) -> Size {
    Size { vertices: mesh.positions.len(), faces: mesh.faces.len() }
}

fn clean_cloud(draft: &mut Draft<'_>, options: &CleanOptions, report: &mut CleanReport) -> Result<(), Error> {
    // What is welded no longer counts in the extent of the middle points: another round may find more.
    for _ in 0..MAX_PASSES {
        report.scale = scale::scale(draft);
        report.weld_distance = options.weld.map_or(1e-7 * report.scale, |distance| distance * draft.factor);
        let welded_to = weld::weld(&draft.positions, &draft.is_alive, report.weld_distance);
        let settled = draft.settle(&welded_to, &vec![false; draft.positions.len()]);
        note_settled(draft, &settled, report);
        if settled.welded.is_empty() {
            break;
        }
    }
    let points: Vec<u32> = (0..draft.now.len() as u32).filter(|&point| draft.is_alive[point as usize]).collect();
    let positions: Vec<_> = points.iter().map(|&point| draft.positions[point as usize]).collect();
    for outlier in outliers::outliers(&positions, options.outlier_factor)? {
        let point = points[outlier as usize];
        report.outliers.add(point);
        if options.remove_outliers {
            draft.is_alive[point as usize] = false;
            report.removed_outliers += 1;
        }
    }
    for now in draft.now.iter_mut().filter(|now| **now != NONE) {
        if !draft.is_alive[*now as usize] {
            *now = NONE;
        }
    }
    Ok(())
}

/// One round of all steps for meshes. Returns the connections of what is left, but for the sense of the faces, unless something
/// changed that could make another round find something.
fn pass(draft: &mut Draft<'_>, options: &CleanOptions, report: &mut CleanReport) -> Option<Topology> {
    draft.before.clone_from(&draft.faces);
    let mut was_named = vec![false; draft.positions.len()];
    draft.faces.iter().flatten().for_each(|&vertex| was_named[vertex as usize] = true);
    report.scale = scale::scale(draft);
    report.weld_distance = options.weld.map_or(1e-7 * report.scale, |distance| distance * draft.factor);
    let welded_to = weld::weld(&draft.positions, &was_named, report.weld_distance);
    draft.faces.iter_mut().flatten().for_each(|vertex| *vertex = welded_to[*vertex as usize]);
    let mut again = faces::drop_degenerate(draft, report.scale, report);
    let mut topology = draft.topology();
    if faces::drop_duplicates(draft, &topology, report) {
        again = true;
        topology = draft.topology();
    }
    again |= cut::cut(draft, &topology, report);
    if !draft.twins.is_empty() {
        topology = draft.topology();
    }
    orient::orient(draft, &topology, report);
    again |= spikes::drop_spikes(draft, &topology, options.spike_factor, report);
    if !again && options.keep != Keep::All && draft.faces == draft.before {
        again = components::drop_components(draft, &topology, options.keep, report);
    }
    let settled = draft.settle(&welded_to, &was_named);
    note_settled(draft, &settled, report);
    // Vertices that were welded to one at the very same place move nothing: no length, no area, no distance is another.
    let moved = |&[old, new]: &[u32; 2]| draft.positions[old as usize] != draft.positions[new as usize];
    again |= settled.welded.iter().any(moved) || !settled.orphaned.is_empty();
    // What components are kept is asked in a round that welds nothing, and new copies are cut once more.
    again |= !settled.welded.is_empty() && (options.keep != Keep::All || !draft.twins.is_empty());
    (!again).then_some(topology)
}

fn note_settled(draft: &Draft<'_>, settled: &Settled, report: &mut CleanReport) {
    let Settled { welded, orphaned } = settled;
    let input = draft.input;
    for pair in welded {
        let [old, new] = pair.map(|vertex| draft.origin[vertex as usize] as usize);
        report.welded_vertices.add(old as u32);
        let mut note = |name: &str| match report.conflicts.iter_mut().find(|conflict| conflict.name == name) {
            Some(conflict) => conflict.vertices += 1,
            None => report.conflicts.push(Conflict { name: name.to_owned(), vertices: 1 }),
        };
        if input.colours.get(old) != input.colours.get(new) {
            note("colour");
        }
        for attribute in &input.attributes {
            if attribute.values[old].to_bits() != attribute.values[new].to_bits() {
                note(&attribute.name);
            }
        }
    }
    for &vertex in orphaned {
        report.orphaned_vertices.add(draft.origin[vertex as usize]);
    }
}

fn nothing_left(report: &CleanReport) -> Error {
    let Size { vertices, faces } = report.before;
    let changes = report.changes().join("; ");
    // The corners of faces became one: of all or of those beside a vertex that is far from all others.
    let weld = match report.weld_distance {
        distance if distance > 0.0 && report.repeated_index_faces.count > 0 => format!(
            "; vertices within {distance:.3e} were welded: give a smaller distance (--weld), or remove the vertices that \
             are far from all others"
        ),
        _ => String::new(),
    };
    Error::input(match faces {
        0 => format!("nothing is left of the {vertices} points: {changes}; scan again"),
        _ => format!("nothing is left of the {faces} faces: {changes}{weld}; convert it as a cloud, or scan again"),
    })
}

/// The result with all its maps. `topology` is that of the last pass, when it left nothing to do.
fn finished(draft: &Draft<'_>, topology: Option<Topology>, options: &CleanOptions, mut report: CleanReport) -> Cleaned {
    let input = draft.input;
    let mut number = vec![NONE; draft.positions.len()];
    let mut old_of_vertex = Vec::new();
    for vertex in (0..draft.positions.len()).filter(|&vertex| draft.is_alive[vertex]) {
        number[vertex] = old_of_vertex.len() as u32;
        old_of_vertex.push(draft.origin[vertex]);
    }
    let renumbered = |vertex: u32| number[vertex as usize];
    let faces = draft.faces.iter().map(|face| face.map(renumbered)).collect();
    let mut mesh = input.rearranged(&old_of_vertex, faces);
    if mesh.normals.iter().flatten().any(|x| !x.is_finite()) {
        let others = mesh.vertex_normals();
        for ((normal, other), &old) in mesh.normals.iter_mut().zip(others).zip(&old_of_vertex) {
            if normal.iter().any(|x| !x.is_finite()) {
                *normal = other;
                report.non_finite_normals.add(old);
            }
        }
    }
    if !mesh.faces.is_empty() {
        let topology = topology.unwrap_or_else(|| draft.topology());
        orient::note_unorientable(draft, &topology.patches(), &mut report);
        report.components = components::described(&mesh, &topology, &draft.old_of_face, options.debris);
    }
    report.after = size(&mesh);
    let twins = draft.twins.iter().map(|group| group.iter().copied().map(renumbered).filter(|&v| v != NONE).collect());
    let vertex_of_old = draft.now.iter().map(|&now| (now != NONE).then(|| renumbered(now))).collect();
    Cleaned {
        twins: twins.filter(|group: &Vec<u32>| group.len() > 1).collect(),
        vertex_of_old,
        old_of_vertex,
        old_of_face: draft.old_of_face.clone(),
        mesh,
        report,
    }
}

#[cfg(test)]
mod tests;
