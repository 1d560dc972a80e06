//! A cloud of points with normals as a surface: its samples are the points, its geometry that of their neighbourhoods.

mod march;
mod neighbourhoods;
mod soup;
#[cfg(test)]
mod tests;

use glam::DVec3;
use rayon::prelude::*;

use super::angles::{angle_of, frame_towards, positive};
use super::{CloudPoint, Frame, Location, Neighbouring, Surface, Trace, log};
use crate::Error;
use crate::mesh::{Mesh, unit};
use crate::spatial::PointTree;
use neighbourhoods::{Neighbourhood, Oriented, Star};

pub use soup::SoupTriangle;

/// An oriented point cloud that can be walked on.
///
/// The neighbours of a point are those of the 16 nearest that lie on the same sheet: with a normal within about 70 degrees of its own and
/// not steeply above it, so that the arm is no neighbour of the trunk at any gap, nor a layer of the same side at a gap of 1.5 spacings;
/// 24 where 16 leave a gap that 24 do not. Whose neighbour a point is, that is its neighbour. Areas come from the triangles of all local Delaunay triangulations ([`Self::triangles`]). A point is on the boundary where its neighbours
/// leave a gap of more than 120 degrees. Edges are as long as the arc of a circle with the normals at its ends.
///
/// Directions count from the neighbour with the smallest index.
///
/// Source: Part I, 1.4.
///
/// Memory: about 0.9 kB a point. Time of building: `n log n`, the neighbourhoods on all threads.
#[derive(Debug)]
pub struct CloudSurface {
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
    frames: Vec<Frame>,
    /// The neighbours of point `i`: `edges[first[i]..first[i + 1]]`.
    first: Vec<usize>,
    edges: Vec<Neighbouring>,
    triangles: Vec<SoupTriangle>,
    areas: Vec<f64>,
    boundary: Vec<bool>,
    /// The spacing at each point, at least that of the whole.
    spacings: Vec<f64>,
    spacing: f64,
    components: Vec<u32>,
    n_components: usize,
    tree: PointTree,
}

impl CloudSurface {
    /// The surface of the vertices of a mesh, whose faces do not matter.
    ///
    /// # Errors
    /// [`Error::Input`] without normals, for one without a direction, for two points at one place, and when no point has a neighbour;
    /// those of [`Mesh::check`] and [`PointTree::new`].
    pub fn new(cloud: &Mesh) -> Result<CloudSurface, Error> {
        cloud.check()?;
        if cloud.normals.is_empty() {
            return Err(Error::input(
                "a cloud is a surface only with a normal at each point: `habitus clean --normals` estimates them",
            ));
        }
        let points: Vec<DVec3> = cloud.positions.iter().copied().map(DVec3::from_array).collect();
        let normals: Vec<DVec3> = cloud.normals.iter().map(|&normal| DVec3::from_array(unit(normal))).collect();
        if let Some(point) = normals.iter().position(|&normal| normal == DVec3::ZERO) {
            return Err(Error::input(format!(
                "the normal of point {point} has no direction: remove the point or estimate it by `habitus clean --normals`"
            )));
        }
        let tree = PointTree::new(&cloud.positions)?;
        let oriented = Oriented { points: &points, normals: &normals, tree: &tree };
        let all = (0..points.len() as u32).into_par_iter();
        let neighbourhoods: Vec<Neighbourhood> = all.clone().map(|point| oriented.neighbourhood(point)).collect();
        for (point, neighbourhood) in neighbourhoods.iter().enumerate() {
            if let Some(&other) =
                neighbourhood.neighbours.first().filter(|&&other| points[other as usize] == points[point])
            {
                return Err(Error::input(format!(
                    "the points {point} and {other} are at one place: run `habitus clean` first"
                )));
            }
        }
        let found: Vec<f64> = neighbourhoods.iter().map(|n| n.spacing).filter(|&spacing| spacing > 0.0).collect();
        if found.is_empty() {
            return Err(Error::input(
                "no point of the cloud has a neighbour on the same sheet: check that its normals are right",
            ));
        }
        let spacing = found.iter().sum::<f64>() / found.len() as f64;
        let (first, pairs) = symmetric(&neighbourhoods);
        let star = |point: u32| {
            let at = point as usize;
            oriented.star(point, &pairs[first[at]..first[at + 1]], neighbourhoods[at].spacing)
        };
        let stars: Vec<Star> = all.map(star).collect();
        let triangles = soup::soup(&stars);
        let (components, n_components) = components(&first, &pairs);
        let (frames, edges) = graph(&points, &normals, &first, &pairs);
        Ok(CloudSurface {
            areas: areas(&points, &triangles),
            boundary: stars.iter().map(|star| star.is_boundary).collect(),
            spacings: neighbourhoods.iter().map(|n| n.spacing.max(spacing)).collect(),
            points,
            normals,
            frames,
            first,
            edges,
            triangles,
            spacing,
            components,
            n_components,
            tree,
        })
    }

    /// The triangles of the local triangulations, sorted by their points. They overlap where points disagree; with their weights they
    /// cover the surface about once.
    pub fn triangles(&self) -> &[SoupTriangle] {
        &self.triangles
    }

    fn checked(&self, at: &Location) -> Option<CloudPoint> {
        let Location::Cloud(point) = at else { return None };
        let reach = march::REACH * self.spacings.get(point.anchor as usize)?;
        let [x, y] = point.offset;
        (x.hypot(y) <= reach).then_some(*point)
    }
}

/// The neighbours of each point and those whose neighbour it is, one behind the other and sorted, and where each point's begin.
fn symmetric(neighbourhoods: &[Neighbourhood]) -> (Vec<usize>, Vec<u32>) {
    let mut pairs: Vec<(u32, u32)> = Vec::new();
    for (point, neighbourhood) in neighbourhoods.iter().enumerate() {
        pairs.extend(neighbourhood.neighbours.iter().flat_map(|&other| [(point as u32, other), (other, point as u32)]));
    }
    pairs.sort_unstable();
    pairs.dedup();
    let first =
        (0..=neighbourhoods.len()).map(|point| pairs.partition_point(|pair| (pair.0 as usize) < point)).collect();
    (first, pairs.into_iter().map(|pair| pair.1).collect())
}

/// The component of each point, numbered by first points, and their number.
fn components(first: &[usize], neighbours: &[u32]) -> (Vec<u32>, usize) {
    let mut of_point = vec![u32::MAX; first.len() - 1];
    let mut n = 0;
    let mut waiting = Vec::new();
    for start in 0..of_point.len() {
        if of_point[start] != u32::MAX {
            continue;
        }
        of_point[start] = n;
        waiting.push(start);
        while let Some(point) = waiting.pop() {
            for &other in &neighbours[first[point]..first[point + 1]] {
                if of_point[other as usize] == u32::MAX {
                    of_point[other as usize] = n;
                    waiting.push(other as usize);
                }
            }
        }
        n += 1;
    }
    (of_point, n as usize)
}

/// The frames of the points and the edges of the metric graph with their directions.
fn graph(points: &[DVec3], normals: &[DVec3], first: &[usize], neighbours: &[u32]) -> (Vec<Frame>, Vec<Neighbouring>) {
    let around = |point: usize| &neighbours[first[point]..first[point + 1]];
    let frames: Vec<Frame> = (0..points.len())
        .map(|point| {
            let towards = around(point).first().map_or(DVec3::ZERO, |&other| points[other as usize] - points[point]);
            frame_towards(normals[point], towards)
        })
        .collect();
    let direction =
        |from: usize, to: usize| angle_of(frames[from].coordinates((points[to] - points[from]).to_array()).into());
    let mut edges = Vec::with_capacity(neighbours.len());
    for point in 0..points.len() {
        let start = edges.len();
        edges.extend(around(point).iter().enumerate().map(|(at, &j)| {
            let other = j as usize;
            let bend = normals[point].angle_between(normals[other]);
            Neighbouring {
                j,
                length: points[point].distance(points[other]) * (1.0 + bend * bend / 24.0),
                // That of the first is 0 by definition, whatever the rounding.
                angle_i: if at == 0 { 0.0 } else { direction(point, other) },
                angle_j: direction(other, point),
            }
        }));
        edges[start..].sort_by(|a, b| positive(a.angle_i).total_cmp(&positive(b.angle_i)).then(a.j.cmp(&b.j)));
    }
    (frames, edges)
}

/// A third of the weighted areas of the triangles at each point.
fn areas(points: &[DVec3], triangles: &[SoupTriangle]) -> Vec<f64> {
    let mut areas = vec![0.0; points.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.points.map(|point| points[point as usize]);
        let area = (b - a).cross(c - a).length() / 2.0;
        triangle.points.iter().for_each(|&point| areas[point as usize] += triangle.weight * area / 3.0);
    }
    areas
}

impl Surface for CloudSurface {
    fn n_samples(&self) -> usize {
        self.points.len()
    }

    fn spacing(&self) -> f64 {
        self.spacing
    }

    fn area(&self, sample: u32) -> f64 {
        self.areas[sample as usize]
    }

    fn is_boundary(&self, sample: u32) -> bool {
        self.boundary[sample as usize]
    }

    fn n_components(&self) -> usize {
        self.n_components
    }

    fn component(&self, sample: u32) -> u32 {
        self.components[sample as usize]
    }

    fn neighbours(&self, sample: u32) -> &[Neighbouring] {
        &self.edges[self.first[sample as usize]..self.first[sample as usize + 1]]
    }

    fn sample(&self, sample: u32) -> Location {
        Location::Cloud(CloudPoint { anchor: sample, offset: [0.0; 2] })
    }

    fn nearest_sample(&self, at: &Location) -> Option<u32> {
        self.checked(at).map(|point| point.anchor)
    }

    fn frame(&self, sample: u32) -> Frame {
        self.frames[sample as usize]
    }

    fn frame_at(&self, at: &Location) -> Option<Frame> {
        Some(self.foot(&self.checked(at)?).1)
    }

    fn position(&self, at: &Location) -> Option<[f64; 3]> {
        Some(self.foot(&self.checked(at)?).0.to_array())
    }

    fn locate(&self, position: [f64; 3]) -> Location {
        self.closest(position)
    }

    fn trace(&self, from: &Location, angle: f64, length: f64) -> Trace {
        self.march(from, angle, length)
    }

    fn local_log(&self, at: &Location, to: &Location, longest: f64) -> Option<[f64; 2]> {
        log::by_shooting(self, at, to, longest)
    }
}
