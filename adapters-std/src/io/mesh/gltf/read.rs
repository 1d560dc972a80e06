//! The meshes that a document shows, joined into one in the order of the scene.
//!
//! A primitive's vertices follow those of the one before; primitives of a mesh that share their vertices, as the parts
//! of different materials do, have them once. What only some primitives have: vertices without a normal get the zero
//! vector, those without a colour white, as the format has it; an attribute that vertices lack is left out.

use std::collections::BTreeMap;

use glam::DAffine3;

use super::super::losses::Losses;
use super::super::{MeshFile, MorphTarget, NonFinite, ReadOptions, Skin};
use super::accessor::Document;
use super::json::Object;
use super::nodes::{Nodes, used};
use super::placement::Placement;
use super::primitive::{Vertices, triangles};
use super::problem::{Problem, Within};
use super::skin::{ReadSkin, influences, skin};
use super::tally::Tally;
use crate::mesh::{Attribute, Mesh};

/// The content of the document.
pub(super) fn content(document: &Document<'_>, options: &ReadOptions, losses: Losses) -> Result<MeshFile, Problem> {
    let nodes = Nodes::of(document)?;
    let n_meshes = document.root.list("meshes")?.len();
    let mut joined = Joined { losses, shown: vec![false; n_meshes], ..Joined::default() };
    if nodes.objects.is_empty() {
        // A file of meshes alone, which no node places.
        let placement = Placement::of(DAffine3::IDENTITY);
        for mesh in 0..n_meshes {
            joined.mesh(document, mesh, &placement, None, options)?;
        }
    }
    let mut skins: BTreeMap<usize, (ReadSkin, u32)> = BTreeMap::new();
    for &index in &nodes.shown {
        let node = nodes.objects[index];
        let place = || format!("nodes[{index}]");
        let mesh = used(document, node, "mesh", "meshes").within(place)?;
        let skin_index = used(document, node, "skin", "skins").within(place)?;
        joined.node(node).within(place)?;
        let Some(mesh) = mesh else { continue };
        let Some(skin_index) = skin_index else {
            joined.mesh(document, mesh, &Placement::of(nodes.worlds[index]), None, options)?;
            continue;
        };
        if let std::collections::btree_map::Entry::Vacant(entry) = skins.entry(skin_index) {
            let skin = skin(document, &nodes, skin_index as u64).within(|| format!("nodes[{index}].skin"))?;
            joined.tally.note(
                skin.n_posed,
                "joint in another pose than the bind pose (the mesh is in the bind pose)",
                "joints in another pose than the bind pose (the mesh is in the bind pose)",
            );
            let first = joined.joints.len() as u32;
            joined.joints.extend(skin.joints.iter().cloned().map(|mut joint| {
                joint.parent = joint.parent.map(|parent| parent + first);
                joint
            }));
            entry.insert((skin, first));
        }
        if let Some((skin, first)) = skins.get(&skin_index) {
            joined.mesh(document, mesh, &skin.placement, Some((skin, *first)), options)?;
        }
    }
    let unused = document.root.list("skins")?.len() - skins.len();
    joined.tally.note(unused, "skin that no mesh uses", "skins that no mesh uses");
    joined.finished(document)
}

/// An attribute and how many vertices have it so far: the first ones.
struct Partial {
    attribute: Attribute,
    /// Vertices that lack it.
    n_missing: usize,
}

/// The joined mesh while it grows.
#[derive(Default)]
struct Joined {
    mesh: Mesh,
    n_without_normal: usize,
    n_without_colour: usize,
    attributes: Vec<Partial>,
    /// Targets by what makes them one across meshes: their name and how many of the mesh have had it before, or the
    /// mesh and the number of one without a name.
    targets: BTreeMap<(String, usize, usize), usize>,
    morphs: Vec<MorphTarget>,
    joints: Vec<super::super::Joint>,
    influences: Vec<Vec<(u32, f64)>>,
    /// Whether the scene shows a mesh.
    shown: Vec<bool>,
    n_parts: usize,
    n_names: usize,
    tally: Tally,
    losses: Losses,
}

impl Joined {
    /// Notes what a node has beside its mesh.
    fn node(&mut self, node: Object<'_>) -> Result<(), Problem> {
        let has_mesh = node.value("mesh").is_some();
        self.n_names += usize::from(has_mesh && node.text("name")?.is_some_and(|name| !name.is_empty()));
        self.note_weights(node)
    }

    /// Notes weights with which morph targets are shown.
    fn note_weights(&mut self, object: Object<'_>) -> Result<(), Problem> {
        let moved = object.list("weights")?.iter().filter(|weight| weight.as_f64() != Some(0.0)).count();
        self.tally.note(
            moved,
            "weight of a morph target (the shape without it is kept)",
            "weights of morph targets (the shape without them is kept)",
        );
        Ok(())
    }

    /// Appends a mesh of the document.
    fn mesh(
        &mut self,
        document: &Document<'_>,
        index: usize,
        placement: &Placement,
        skin: Option<(&ReadSkin, u32)>,
        options: &ReadOptions,
    ) -> Result<(), Problem> {
        let (_, mesh) = document.listed("meshes", index as u64)?;
        let place = || format!("meshes[{index}]");
        if !std::mem::replace(&mut self.shown[index], true) {
            self.n_names += usize::from(mesh.text("name").within(place)?.is_some_and(|name| !name.is_empty()));
            self.note_weights(mesh).within(place)?;
        }
        let names = target_names(mesh);
        // Where the vertices of each list of attributes begin, and their number.
        let mut known: BTreeMap<String, (usize, usize)> = BTreeMap::new();
        for (number, primitive) in mesh.list("primitives").within(place)?.iter().enumerate() {
            let mut part = || -> Result<(), Problem> {
                // Also a primitive without numbers is work.
                document.charge(16)?;
                let primitive = Object::of(primitive)?;
                let key = format!("{:?} {:?}", primitive.value("attributes"), primitive.value("targets"));
                let (start, n) = match known.get(&key) {
                    Some(&vertices) => vertices,
                    None => {
                        let vertices = Vertices::of(document, primitive, options, &mut self.tally)?;
                        let start = self.mesh.positions.len();
                        let n = vertices.positions.len();
                        let names = names.clone().or_else(|| target_names(primitive)).unwrap_or_default();
                        self.append(document, vertices, index, &names, placement, options)?;
                        self.append_influences(document, primitive, n, skin)?;
                        known.insert(key, (start, n));
                        (start, n)
                    }
                };
                let faces = triangles(document, primitive, n, &mut self.tally)?;
                let beyond = |_| Problem::here("more vertices than can be indexed");
                let first = u32::try_from(start + n).map_err(beyond)? - n as u32;
                self.mesh.faces.extend(faces.into_iter().map(|face| {
                    let [a, b, c] = face.map(|vertex| vertex + first);
                    if placement.mirrors() { [a, c, b] } else { [a, b, c] }
                }));
                self.n_parts += 1;
                Ok(())
            };
            part().within(|| format!("meshes[{index}].primitives[{number}]"))?;
        }
        Ok(())
    }

    fn append(
        &mut self,
        document: &Document<'_>,
        vertices: Vertices,
        mesh: usize,
        names: &[String],
        placement: &Placement,
        options: &ReadOptions,
    ) -> Result<(), Problem> {
        let (start, n) = (self.mesh.positions.len(), vertices.positions.len());
        for (vertex, position) in vertices.positions.iter().enumerate() {
            let placed = placement.point(*position);
            if options.non_finite == NonFinite::Refuse && !placed.iter().all(|x| x.is_finite()) {
                let problem = format!(
                    "vertex {vertex} is placed at {placed:?}, which is not finite: are the transforms of the nodes right?"
                );
                return Err(Problem::at("attributes.POSITION", problem));
            }
            self.mesh.positions.push(placed);
        }
        match vertices.normals {
            Some(normals) => {
                self.mesh.normals.resize(start, [0.0; 3]);
                self.mesh.normals.extend(normals.into_iter().map(|normal| placement.normal(normal)));
            }
            None => self.n_without_normal += n,
        }
        match vertices.colours {
            Some(colours) => {
                self.mesh.colours.resize(start, [255; 3]);
                self.mesh.colours.extend(colours);
            }
            None => self.n_without_colour += n,
        }
        self.append_attributes(document, vertices.attributes, start, n)?;
        self.append_targets(document, vertices.targets, mesh, names, placement, start)
    }

    fn append_attributes(
        &mut self,
        document: &Document<'_>,
        attributes: Vec<Attribute>,
        start: usize,
        n: usize,
    ) -> Result<(), Problem> {
        let mut new: BTreeMap<String, Attribute> =
            attributes.into_iter().map(|attribute| (attribute.name.clone(), attribute)).collect();
        document.charge(self.attributes.len() as u64)?;
        for Partial { attribute, n_missing } in &mut self.attributes {
            match new.remove(&attribute.name) {
                Some(more) if attribute.scalar == more.scalar => attribute.values.extend(more.values),
                Some(_) | None => *n_missing += n,
            }
        }
        self.attributes.extend(new.into_values().map(|attribute| Partial { attribute, n_missing: start }));
        Ok(())
    }

    fn append_targets(
        &mut self,
        document: &Document<'_>,
        targets: Vec<Vec<[f64; 3]>>,
        mesh: usize,
        names: &[String],
        placement: &Placement,
        start: usize,
    ) -> Result<(), Problem> {
        let mut had: BTreeMap<&str, usize> = BTreeMap::new();
        for (number, displacements) in targets.into_iter().enumerate() {
            let name = names.get(number).map(String::as_str).unwrap_or_default();
            let key = if name.is_empty() {
                (String::new(), mesh, number)
            } else {
                let before = had.entry(name).or_default();
                *before += 1;
                (name.to_owned(), 0, *before)
            };
            let target = *self.targets.entry(key).or_insert_with(|| {
                self.morphs.push(MorphTarget { name: name.to_owned(), displacements: Vec::new() });
                self.morphs.len() - 1
            });
            let all = &mut self.morphs[target].displacements;
            document.charge(3 * (start - all.len()) as u64)?;
            all.resize(start, [0.0; 3]);
            for (vertex, displacement) in displacements.into_iter().enumerate() {
                let placed = placement.displacement(displacement);
                if !placed.iter().all(|x| x.is_finite()) {
                    let problem = format!("vertex {vertex} is displaced by {placed:?}, which is not finite");
                    return Err(Problem::at(format!("targets[{number}].POSITION"), problem));
                }
                all.push(placed);
            }
        }
        Ok(())
    }

    fn append_influences(
        &mut self,
        document: &Document<'_>,
        primitive: Object<'_>,
        n: usize,
        skin: Option<(&ReadSkin, u32)>,
    ) -> Result<(), Problem> {
        let start = self.mesh.positions.len() - n;
        let attributes = primitive.object("attributes")?.filter(|attributes| {
            attributes.entries().any(|(key, _)| key.starts_with("JOINTS_") || key.starts_with("WEIGHTS_"))
        });
        match (attributes, skin) {
            (Some(attributes), Some((skin, first))) => {
                let (influences, n_divided) =
                    influences(document, attributes, n, &skin.slots).within(|| "attributes".into())?;
                self.tally.note(
                    n_divided,
                    "vertex whose weights did not sum to 1 (divided by their sum)",
                    "vertices whose weights did not sum to 1 (divided by their sum)",
                );
                let shifted =
                    |influences: Vec<(u32, f64)>| influences.into_iter().map(|(j, w)| (j + first, w)).collect();
                self.influences.resize(start, Vec::new());
                self.influences.extend(influences.into_iter().map(shifted));
            }
            (Some(_), None) => self.tally.note(
                n,
                "vertex with joints that no skin gives a meaning",
                "vertices with joints that no skin gives a meaning",
            ),
            (None, _) => {}
        }
        Ok(())
    }

    /// The content, with everything that was not kept.
    fn finished(mut self, document: &Document<'_>) -> Result<MeshFile, Problem> {
        let (n, tally) = (self.mesh.positions.len(), &mut self.tally);
        if self.n_without_normal < n {
            self.mesh.normals.resize(n, [0.0; 3]);
            tally.note(self.n_without_normal, "vertex without a normal", "vertices without a normal");
        }
        if self.n_without_colour < n {
            self.mesh.colours.resize(n, [255; 3]);
            let names = ["vertex without a colour (white)", "vertices without a colour (white)"];
            tally.note(self.n_without_colour, names[0], names[1]);
        }
        for Partial { attribute, n_missing } in self.attributes {
            if n_missing == 0 {
                self.mesh.attributes.push(attribute);
            } else {
                let names = [
                    "value of an attribute that other vertices lack,",
                    "values of an attribute that other vertices lack,",
                ];
                tally.note_named(attribute.values.len(), names[0], names[1], &attribute.name);
            }
        }
        for morph in &mut self.morphs {
            document.charge(3 * (n - morph.displacements.len()) as u64).within(|| "meshes".into())?;
            morph.displacements.resize(n, [0.0; 3]);
        }
        if self.n_parts > 1 {
            tally.note(self.n_parts, "part", "parts that are joined");
        }
        tally.note(self.n_names, "name of a node or mesh", "names of nodes and meshes");
        let hidden = self.shown.iter().filter(|shown| !**shown).count();
        tally.note(hidden, "mesh that the scene does not show", "meshes that the scene does not show");
        note_appearance(document.root, tally)?;
        self.tally.into_losses(&mut self.losses);
        if !self.joints.is_empty() {
            self.influences.resize(n, Vec::new());
        }
        let skin = (!self.joints.is_empty()).then_some(Skin { joints: self.joints, influences: self.influences });
        Ok(MeshFile { mesh: self.mesh, morphs: self.morphs, skin, left_out: self.losses.into_clauses() })
    }
}

/// The names of morph targets, a convention outside the typed part of the format.
fn target_names(object: Object<'_>) -> Option<Vec<String>> {
    let names = object.object("extras").ok()??.list("targetNames").ok()?;
    Some(names.iter().map(|name| name.as_str().unwrap_or_default().to_owned()).collect())
}

/// Notes what concerns the look and the motion of the scene alone.
fn note_appearance(root: Object<'_>, tally: &mut Tally) -> Result<(), Problem> {
    for (key, one, several) in [
        ("animations", "animation", "animations"),
        ("cameras", "camera", "cameras"),
        ("images", "image", "images"),
        ("materials", "material", "materials"),
        ("textures", "texture", "textures"),
    ] {
        tally.note(root.list(key)?.len(), one, several);
    }
    for extension in root.list("extensionsUsed")? {
        if let Some(name) = extension.as_str().filter(|name| *name != super::QUANTIZATION) {
            tally.note_named(1, "extension of the format,", "extensions of the format,", name);
        }
    }
    Ok(())
}
