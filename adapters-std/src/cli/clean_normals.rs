//! `habitus clean --normals`: normals for what was cleaned.

use clap::Args;
use serde_json::{Value, json};

use super::Console;
use crate::Error;
use crate::mesh::Mesh;
use crate::spatial::{CloudNormalOptions, CloudNormals, Outside, cloud_normals};

/// Below this certainty a part may as well be turned the other way.
const UNCERTAIN: f64 = 0.1;

/// Arguments of `clean` on normals.
#[derive(Debug, Args)]
pub(super) struct NormalsArgs {
    /// Give every vertex a normal: that of its faces, or in a cloud that of the plane of its neighbours, turned outwards.
    /// Takes the place of normals that are there
    #[arg(long)]
    normals: bool,
    /// Where the scanner was that saw the cloud, in the unit and axes of the file; normals point there
    #[arg(long, value_name = "X,Y,Z", requires = "normals", value_parser = position, allow_hyphen_values = true)]
    towards: Option<[f64; 3]>,
    /// Nearest points of a cloud whose plane gives the normal
    #[arg(long, default_value_t = 16, value_name = "N", requires = "normals", value_parser = clap::value_parser!(u16).range(3..=1000))]
    neighbours: u16,
}

fn position(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|number| number.trim().parse().ok()).collect();
    let all = <[f64; 3]>::try_from(numbers).ok().filter(|all| all.iter().all(|x| x.is_finite()));
    all.filter(|_| text.split(',').count() == 3).ok_or_else(|| format!("{text:?} is not three numbers: x,y,z"))
}

impl NormalsArgs {
    /// Whether normals are wanted.
    pub(super) fn is_given(&self) -> bool {
        self.normals
    }

    /// Normals of the mesh, with a line for people and an object for programs; warns about what is doubtful.
    pub(super) fn of(&self, mesh: &Mesh, console: &Console) -> Result<(Vec<[f64; 3]>, String, Value), Error> {
        if !mesh.faces.is_empty() {
            if self.towards.is_some() {
                return Err(Error::input(
                    "the faces of a mesh tell its outside; --towards is for clouds, leave it out",
                ));
            }
            let object = json!({ "from": "faces" });
            return Ok((mesh.vertex_normals(), "normals: from the faces, weighted by area\n".into(), object));
        }
        let outside = self.towards.map_or(Outside::Around, Outside::Towards);
        let options = CloudNormalOptions { n_neighbours: self.neighbours.into(), outside };
        let CloudNormals { normals, parts, n_without_normal } = cloud_normals(&mesh.positions, &options)?;
        if n_without_normal != 0 {
            console.warn(&format!(
                "{n_without_normal} points have no normal, as their neighbours lie in one place or on a line; theirs is zero"
            ));
        }
        let uncertain = || parts.iter().filter(|part| part.certainty < UNCERTAIN);
        let n_uncertain: usize = uncertain().map(|part| part.n_points).sum();
        if n_uncertain != 0 {
            console.warn(&format!(
                "{n_uncertain} points in {} of {} parts may as well face the other way; tell where the scanner was with \
                 --towards",
                uncertain().count(),
                parts.len()
            ));
        }
        let object = json!({
            "from": "neighbours",
            "parts": parts.len(),
            "points_without_normal": n_without_normal,
            "uncertain_points": n_uncertain,
            "largest_part": parts.first().map(|part| json!({ "points": part.n_points, "certainty": part.certainty })),
        });
        Ok((normals, format!("normals: from {} neighbours, in {} parts\n", self.neighbours, parts.len()), object))
    }
}
