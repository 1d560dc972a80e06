//! Contact sheets: a grid of meshes, every one in a cell of its own at the same scale.

use super::picture::Image;
use super::scene::Scene;
use super::view::{Frame, View};
use crate::mesh::Mesh;
use rayon::prelude::*;

/// One picture of many meshes: a line of cells per row of `rows`, each cell `cell` = [width, height] pixels.
///
/// All cells share the frame that holds every mesh, so sizes can be compared. Rows may differ in length.
///
/// | argument | shape | note |
/// |---|---|---|
/// | `rows` | rows of meshes | drawn from the top, from left to right |
/// | `views` | one or more | each mesh is shown from each view, side by side |
/// | `lining` | sRGB | what is seen through enclosed holes, see [`Scene::lining`] |
pub fn contact_sheet(rows: &[Vec<Mesh>], views: &[View], cell: [usize; 2], lining: Option<[u8; 3]>) -> Image {
    let points = rows.iter().flatten().flat_map(|mesh| mesh.positions.iter().copied());
    let frame = Frame::holding(points, views);
    let columns = views.len() * rows.iter().map(Vec::len).max().unwrap_or(0);
    let mut sheet = Image::filled(columns * cell[0], rows.len() * cell[1], Scene::new([]).background);
    let cells: Vec<(usize, usize, &Mesh)> = rows
        .iter()
        .enumerate()
        .flat_map(|(row, meshes)| meshes.iter().enumerate().map(move |(column, mesh)| (row, column, mesh)))
        .collect();
    let pictures: Vec<Image> = cells
        .par_iter()
        .map(|(_, _, mesh)| Scene { frame: Some(frame), lining, ..Scene::new([*mesh]) }.shaded(views, cell))
        .collect();
    for ((row, column, _), picture) in cells.iter().zip(&pictures) {
        sheet.paste(picture, column * picture.width, row * cell[1]);
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mesh_fills_its_own_cell() {
        let triangle = |size: f64| Mesh {
            positions: vec![[-size, -size, 0.0], [size, -size, 0.0], [0.0, size, 0.0]],
            faces: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let rows = vec![vec![triangle(10.0), triangle(2.0)], vec![triangle(10.0)]];
        let sheet = contact_sheet(&rows, &[View::FRONT], [20, 20], None);
        assert_eq!((sheet.width, sheet.height), (40, 40));
        let background = Scene::new([]).background;
        let drawn = |left: usize, top: usize| {
            let cells = (0..400).map(|k| sheet.pixels[(top + k / 20) * 40 + left + k % 20]);
            cells.filter(|pixel| *pixel != background).count()
        };
        assert!(drawn(0, 0) > 100, "{}", drawn(0, 0));
        assert!(drawn(20, 0) > 0 && drawn(20, 0) < drawn(0, 0) / 4, "one scale for all cells");
        assert_eq!(drawn(0, 0), drawn(0, 20));
        assert_eq!(drawn(20, 20), 0, "a cell without a mesh stays empty");
    }
}
