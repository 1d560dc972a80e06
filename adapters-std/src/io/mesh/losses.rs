//! The clauses that say what a reader does not keep and what a format cannot hold, each with its number.

use super::{Formatted, MeshFile};
use crate::mesh::Mesh;

/// What is left out of one file.
#[derive(Debug, Default)]
pub(super) struct Losses(Vec<String>);

impl Losses {
    /// Notes `n` of what has this name when there is one and when there are several; nothing when there is none.
    pub(super) fn note(&mut self, n: usize, one: &str, several: &str) {
        match n {
            0 => {}
            1 => self.0.push(format!("1 {one}")),
            _ => self.0.push(format!("{n} {several}")),
        }
    }

    /// Notes a clause.
    pub(super) fn say(&mut self, clause: String) {
        self.0.push(clause);
    }

    /// Notes the polygons that became several triangles.
    pub(super) fn note_divided(&mut self, n: usize) {
        self.note(
            n,
            "polygon with more than 3 corners (divided into triangles)",
            "polygons with more than 3 corners (divided into triangles)",
        );
    }

    /// Notes the polygons that are no area.
    pub(super) fn note_small(&mut self, n: usize) {
        self.note(n, "face of fewer than 3 corners", "faces of fewer than 3 corners");
    }

    /// Notes colours whose channels were not whole numbers of 0 to 255.
    pub(super) fn note_rounded_colours(&mut self, n: usize) {
        self.note(n, "colour finer than 8 bits a channel (rounded)", "colours finer than 8 bits a channel (rounded)");
    }

    /// Notes the attributes, for formats without names for numbers of vertices.
    pub(super) fn note_attributes(&mut self, mesh: &Mesh) {
        for attribute in &mesh.attributes {
            self.say(format!("the attribute {:?} of {} vertices", attribute.name, mesh.positions.len()));
        }
    }

    /// Notes what beside the mesh the content has, for formats of meshes alone.
    pub(super) fn note_beyond_mesh(&mut self, file: &MeshFile) {
        self.note(file.morphs.len(), "morph target", "morph targets");
        let joints = file.skin.as_ref().map_or(0, |skin| skin.joints.len());
        self.note(joints, "joint of the skin and its weights", "joints of the skin and their weights");
    }

    /// The clauses.
    pub(super) fn into_clauses(self) -> Vec<String> {
        self.0
    }

    /// The bytes of a file with what they leave out.
    pub(super) fn formatted(self, bytes: Vec<u8>) -> Formatted {
        Formatted { bytes, left_out: self.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{MorphTarget, Skin};
    use super::*;
    use crate::mesh::{Attribute, Scalar};

    #[test]
    fn clauses_have_numbers_and_nothing_has_none() {
        let mut losses = Losses::default();
        losses.note(0, "a", "b");
        losses.note(1, "line", "lines");
        losses.note_divided(2);
        let attribute = Attribute { name: "label".into(), scalar: Scalar::U8, values: vec![1.0] };
        let mesh = Mesh { positions: vec![[0.0; 3]], attributes: vec![attribute], ..Mesh::default() };
        losses.note_attributes(&mesh);
        let morphs = vec![MorphTarget { name: "a".into(), displacements: vec![] }];
        losses.note_beyond_mesh(&MeshFile {
            mesh,
            morphs,
            skin: Some(Skin { joints: vec![], influences: vec![] }),
            left_out: vec![],
        });
        assert_eq!(
            losses.into_clauses(),
            [
                "1 line",
                "2 polygons with more than 3 corners (divided into triangles)",
                "the attribute \"label\" of 1 vertices",
                "1 morph target"
            ]
        );
    }
}
