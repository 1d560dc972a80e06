//! The signed distance from a surface, sampled on a grid, negative inside; and the surface made anew from it.

use rayon::prelude::*;

use super::{TriangleTree, WindingTree};
use crate::Error;
use crate::mesh::field::{Field, Grid};
use crate::mesh::isosurface::{Border, isosurface};
use crate::mesh::topology::EdgeClass;
use crate::mesh::{Mesh, Topology};

/// Around a surface that is made anew, in spacings of the grid.
const MARGIN: f64 = 2.0;

/// The winding number above which a position is inside.
const INSIDE: f64 = 0.5;

/// What tells inside from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Inside {
    /// The pseudo-normal at the closest point (`baerentzen2005`): exact for closed meshes whose faces are all oriented outwards and
    /// do not pass through one another. Where they do, as in the folds of a noisy scan, it is wrong also far from the surface.
    PseudoNormal,
    /// Whether the generalised winding number (`jacobson2013`) is above 1/2: also for open, noisy and self-intersecting meshes.
    /// In a hole the sign changes away from the surface, so that the isosurface closes the hole with steps as wide as the grid.
    #[default]
    Winding,
}

/// How distances are sampled.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SignedDistanceOptions {
    /// What tells inside from outside.
    pub inside: Inside,
    /// The largest distance that is wanted, in the unit of the mesh: larger ones become this one, with their sign, and cost next to
    /// nothing. `None`: all distances.
    pub band: Option<f64>,
}

/// The distance of each sample of the grid from the mesh, negative inside.
///
/// Source: `baerentzen2005` for the sign by pseudo-normals. Beyond a band the distance of one sample tells how many of the
/// following ones are beyond it as well: the distance changes by at most the distance of the samples.
///
/// Cost: a search for the closest point at each sample within the band, each from the face of the sample before, on all threads;
/// with [`Inside::Winding`] a winding number besides, and for a mesh that is not closed at each sample of the grid. 8 bytes a sample. Determinism: the same result
/// for any number of threads.
///
/// # Errors
/// Those of [`Grid::check`] and [`TriangleTree::new`]; [`Error::Input`] for a band that is not positive, and, with
/// [`Inside::PseudoNormal`], for a mesh with edges that do not have exactly two faces that agree about the outside.
pub fn signed_distances(mesh: &Mesh, grid: Grid, options: &SignedDistanceOptions) -> Result<Field, Error> {
    grid.check()?;
    let band = options.band.unwrap_or(f64::INFINITY);
    if !(band > 0.0) {
        return Err(Error::input(format!("distances within a band of {band}: give one above 0, or none")));
    }
    let surface = TriangleTree::new(&mesh.positions, &mesh.faces)?;
    let winding = match options.inside {
        Inside::PseudoNormal => {
            check_closed(mesh)?;
            None
        }
        Inside::Winding => Some(WindingTree::of_mesh(&mesh.positions, &mesh.faces)?),
    };
    let is_closed = check_closed(mesh).is_ok();
    let mut values = vec![0.0; grid.n_samples()];
    let [nx, ny, _] = grid.size;
    values.par_chunks_mut(nx).enumerate().for_each(|(row, values)| {
        let place = |i: usize| grid.position([i, row % ny, row / ny]);
        let signed = |position: [f64; 3], distance: f64| match &winding {
            Some(tree) if tree.at(position) > INSIDE => -distance.abs(),
            Some(_) => distance.abs(),
            None => distance,
        };
        let (mut hint, mut beyond_until, mut beyond) = (u32::MAX, 0, band);
        for (i, value) in values.iter_mut().enumerate() {
            if i < beyond_until {
                // Only in a hole the sign can change where no surface is.
                *value = if is_closed { beyond } else { signed(place(i), beyond) };
                continue;
            }
            let closest = surface.closest_from(place(i), hint);
            hint = closest.face;
            *value = signed(place(i), closest.signed_distance(place(i)).clamp(-band, band));
            // A little less than it may be, for rounding. A distance that is not finite leaves nothing out.
            let n_beyond = ((closest.distance - band) / grid.spacing * (1.0 - 1e-9)).max(0.0) as usize;
            (beyond_until, beyond) = (i.saturating_add(n_beyond).saturating_add(1), *value);
        }
    });
    Ok(Field { grid, values })
}

/// The mesh made anew: the isosurface at 0 of its signed distances on a grid of this spacing, in the unit of the mesh. It is closed
/// and a manifold; what is thinner than the spacing, or nearer together, may merge or vanish.
///
/// # Errors
/// Those of [`signed_distances`] and [`isosurface`]; [`Error::Input`] when nothing is inside, as for a mesh that is turned inside
/// out or a sheet.
pub fn remeshed(mesh: &Mesh, spacing: f64, inside: Inside) -> Result<Mesh, Error> {
    mesh.check()?;
    let Some((low, high)) = mesh.bounding_box().filter(|_| !mesh.faces.is_empty()) else {
        return Err(Error::input("a cloud has no inside: give a mesh with faces"));
    };
    let grid = Grid::around(low, high, spacing, MARGIN * spacing)?;
    let options = SignedDistanceOptions { inside, band: Some(MARGIN * spacing) };
    let field = signed_distances(mesh, grid, &options)?;
    let surface = isosurface(&field, 0.0, Border::Open)?;
    // The first sample is a corner of the grid, beyond the mesh on all axes.
    if surface.faces.is_empty() || field.values[0] < 0.0 {
        return Err(Error::input(format!(
            "the mesh has no inside at a spacing of {spacing}: turn its faces outwards, or make the spacing finer"
        )));
    }
    Ok(surface)
}

/// Whether every edge has two faces that agree about the outside.
///
/// # Errors
/// [`Error::Input`] counts the other edges.
pub fn check_closed(mesh: &Mesh) -> Result<(), Error> {
    let topology = Topology::new(mesh.positions.len(), &mesh.faces);
    let [open, inconsistent, branching] =
        [EdgeClass::Boundary, EdgeClass::Inconsistent, EdgeClass::NonManifold].map(|class| topology.count(class));
    if open + inconsistent + branching == 0 {
        return Ok(());
    }
    Err(Error::input(format!(
        "the mesh is not closed: {open} edges have one face, {branching} more than two, at {inconsistent} the two faces \
         disagree about the outside; clean and close it, or let winding numbers tell the inside"
    )))
}

#[cfg(test)]
#[path = "distance_field_tests.rs"]
mod tests;
