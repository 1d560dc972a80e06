//! What the properties of the vertices of a PLY file become in a mesh.

/// Names of the single numbers that have a place of their own in a mesh; of colours there are two spellings.
pub(super) const FIELDS: [&[&str]; 9] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx"],
    &["ny"],
    &["nz"],
    &["red", "diffuse_red"],
    &["green", "diffuse_green"],
    &["blue", "diffuse_blue"],
];

/// What one property becomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// The number at this place of [`FIELDS`].
    Field(usize),
    /// An attribute of its name.
    Attribute,
    /// Nothing: it is a list, or its name is taken.
    LeftOut,
}

/// The roles of properties of these names, in their order; lists are marked.
///
/// A normal or a colour needs all three of its numbers; else each is an attribute.
pub(super) fn roles(properties: &[(&[u8], bool)]) -> Vec<Role> {
    let mut is_named = std::collections::HashSet::new();
    let mut roles: Vec<Role> = properties
        .iter()
        .map(|&(name, is_list)| if !is_list && is_named.insert(name) { Role::Attribute } else { Role::LeftOut })
        .collect();
    let at = FIELDS.map(|names| {
        let is_field =
            |&at: &usize| roles[at] == Role::Attribute && names.iter().any(|name| name.as_bytes() == properties[at].0);
        (0..properties.len()).find(is_field)
    });
    for (first, triple) in at.as_chunks::<3>().0.iter().enumerate() {
        // Without its z a vertex is none, but which of the three is missing is for the error to say.
        if first == 0 || triple.iter().all(Option::is_some) {
            for (axis, property) in triple.iter().enumerate() {
                if let Some(property) = *property {
                    roles[property] = Role::Field(3 * first + axis);
                }
            }
        }
    }
    roles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triples_are_fields_and_what_remains_is_an_attribute() {
        let names = ["z", "x", "y", "x", "nx", "ny", "blue", "diffuse_green", "red", "green", "label", "label"];
        let mut properties: Vec<(&[u8], bool)> = names.iter().map(|name| (name.as_bytes(), false)).collect();
        properties.push((b"nz", true));
        use Role::{Attribute, Field, LeftOut};
        let expected = [
            Field(2),
            Field(0),
            Field(1),
            LeftOut,
            Attribute,
            Attribute,
            Field(8),
            Field(7),
            Field(6),
            Attribute,
            Attribute,
            LeftOut,
            LeftOut,
        ];
        assert_eq!(roles(&properties), expected);
    }
}
