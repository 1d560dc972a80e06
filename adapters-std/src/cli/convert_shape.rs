//! `habitus convert` with `--remesh`, `--faces` or `--points`: the shape made of other triangles, or of points.

use clap::Args;
use serde_json::{Map, Value, json};

use crate::Error;
use crate::io::mesh::MeshFile;
use crate::mesh::Mesh;
use crate::mesh::decimation::{DecimationOptions, decimated};
use crate::mesh::sampling::{farthest_points, interpolated, poisson_disk_points};
use crate::spatial::distance_field::{Inside, check_closed, remeshed};

/// Arguments of `convert` on the shape; carried out in this order.
#[derive(Debug, Args)]
pub(super) struct ShapeArgs {
    /// Make a mesh anew as a closed surface from its signed distances on a grid of this spacing, in the unit of the file
    /// (holes are closed; what is thinner than the spacing may vanish)
    #[arg(long, value_name = "SPACING", value_parser = super::measure_distance::positive)]
    remesh: Option<f64>,
    /// Come down to N faces
    #[arg(long, value_name = "N")]
    faces: Option<u32>,
    /// Write a cloud of N points instead: spread evenly over the area of a mesh, with normals; of a cloud those that are
    /// farthest from one another
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    points: Option<u32>,
    /// Seed of the points on a mesh
    #[arg(long, default_value_t = 1, requires = "points")]
    seed: u64,
}

/// What became of the shape.
#[derive(Default)]
pub(super) struct Reshaped {
    /// A line for people for each step.
    pub text: String,
    /// An object for programs for each step, by its name.
    pub steps: Map<String, Value>,
    /// What should be known, a sentence each.
    pub warnings: Vec<String>,
}

impl ShapeArgs {
    /// Carries out what is asked for. What belongs to the old vertices beside the mesh is left out, with a warning.
    pub(super) fn applied(&self, file: &mut MeshFile) -> Result<Reshaped, Error> {
        let mut done = Reshaped::default();
        if let Some(spacing) = self.remesh {
            file.mesh = anew(&file.mesh, spacing, &mut done)?;
        }
        if let Some(n) = self.faces {
            file.mesh = fewer(&file.mesh, n as usize, &mut done)?;
        }
        if let Some(n) = self.points {
            file.mesh = points(&file.mesh, n as usize, self.seed, &mut done)?;
        }
        let has_more = !file.morphs.is_empty() || file.skin.is_some();
        if has_more && !done.steps.is_empty() {
            let joints = file.skin.take().map_or(0, |skin| skin.joints.len());
            let morphs = std::mem::take(&mut file.morphs).len();
            done.warnings.push(format!(
                "not kept: {morphs} morph targets and {joints} joints, which belong to the vertices that were there"
            ));
        }
        Ok(done)
    }
}

fn anew(mesh: &Mesh, spacing: f64, done: &mut Reshaped) -> Result<Mesh, Error> {
    if let Err(error) = check_closed(mesh) {
        done.warnings.push(format!("holes are closed: {error}"));
    }
    if !(mesh.normals.is_empty() && mesh.colours.is_empty() && mesh.attributes.is_empty()) {
        done.warnings.push("not kept: normals, colours and attributes of the vertices that were there".into());
    }
    let surface = remeshed(mesh, spacing, Inside::Winding)?;
    done.text += &format!("made anew at a spacing of {spacing}: {} faces\n", surface.faces.len());
    done.steps.insert("remesh".into(), json!({ "spacing": spacing, "faces": surface.faces.len() }));
    Ok(surface)
}

fn fewer(mesh: &Mesh, n_faces: usize, done: &mut Reshaped) -> Result<Mesh, Error> {
    let result = decimated(mesh, &DecimationOptions::to_faces(n_faces))?;
    let n = result.mesh.faces.len();
    if n > n_faces {
        done.warnings
            .push(format!("{n} faces are left: fewer would change how the surface hangs together, or turn faces"));
    }
    done.text += &format!("{} faces became {n}, largest error {:.3e}\n", mesh.faces.len(), result.largest_error);
    done.steps.insert("decimation".into(), json!({ "faces": n, "largest_error": result.largest_error }));
    Ok(result.mesh)
}

fn points(mesh: &Mesh, n: usize, seed: u64, done: &mut Reshaped) -> Result<Mesh, Error> {
    let (cloud, way) = match mesh.faces.is_empty() {
        false => (interpolated(mesh, &poisson_disk_points(mesh, n, seed)?)?, "evenly by area"),
        true => {
            mesh.check()?;
            let chosen = farthest_points(&mesh.positions, n)?;
            let indices: Vec<u32> = chosen.iter().map(|point| point.index).collect();
            (mesh.rearranged(&indices, Vec::new()), "farthest from one another")
        }
    };
    if cloud.positions.len() < n {
        done.warnings.push(format!("only {} different points are there", cloud.positions.len()));
    }
    done.text += &format!("{} points, {way}\n", cloud.positions.len());
    done.steps.insert("sampling".into(), json!({ "points": cloud.positions.len(), "chosen": way }));
    Ok(cloud)
}
