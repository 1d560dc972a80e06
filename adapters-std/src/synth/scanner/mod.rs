//! A virtual depth scanner: of any mesh the faulty scans that a real one would take, with the truth.
//!
//! A ray goes through each pixel of each view; what it meets first is seen, so what is hidden is missing. Grazing rays do not return,
//! the depth along the ray has noise, some returns are flying points, there are holes, clutter hides the subject and is scanned with it,
//! and several views are laid together with a small error. Each point knows from where on the subject it comes.
//!
//! Random numbers come from ChaCha streams, one for each purpose; the same seed gives the same bits on any number of threads.

mod camera;
mod chance;
pub mod files;
mod options;
mod range_image;
mod room;

pub use options::{Projection, ScanOptions, Viewpoint};

use glam::DVec3;
use rand::RngExt;
use rand::seq::SliceRandom;

use crate::Error;
use crate::mesh::sampling::SurfacePoint;
use crate::mesh::{Attribute, Mesh, Scalar};
use crate::register::rigid::Similarity;
use camera::Camera;
use chance::{Purpose, between, motion, stream};
use range_image::RangeImage;
use room::Room;

/// Most pixels of all views together: 13 GB.
const MOST_PIXELS: usize = 1 << 26;

/// What a point of a scan is; its number is the value of the attribute `label`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Label {
    /// A point of the subject, with noise.
    Surface = 0,
    /// A point of something else.
    Clutter = 1,
    /// A flying point.
    Outlier = 2,
}

/// A scan and its truth. Lengths in mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// The points of all views together, and triangles when asked for, with two attributes: `label` (0 surface, 1 clutter, 2 outlier)
    /// and `view` (from 0).
    pub mesh: Mesh,
    /// For each point where on the subject it comes from; none for clutter and outliers.
    pub truth: Vec<Option<SurfacePoint>>,
    /// From the frame of the subject to that of the scan: rigid.
    pub placement: Similarity,
    /// One for each viewpoint, in order.
    pub views: Vec<ViewRecord>,
    /// The holes, in the frame of the subject.
    pub holes: Vec<Hole>,
}

/// What a view did.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewRecord {
    /// From where.
    pub viewpoint: Viewpoint,
    /// Columns and rows of its image.
    pub size: [usize; 2],
    /// Its error: by that motion, in the frame of the subject, all its points are misplaced.
    pub calibration: Similarity,
    /// Points of the scan that it gave.
    pub points: usize,
    /// Rays that did not return as they met something at a grazing angle.
    pub grazing: usize,
    /// Rays that did not return as they met a face from behind.
    pub from_behind: usize,
    /// Returns that the holes took away.
    pub in_holes: usize,
}

/// A ball in which nothing returns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hole {
    /// A point that would have been scanned.
    pub centre: [f64; 3],
    /// Radius, mm.
    pub radius: f64,
}

impl Scan {
    /// The number of points with this label.
    pub fn count(&self, label: Label) -> usize {
        let labels = self.mesh.attributes.first().map_or(&[][..], |labels| &labels.values);
        labels.iter().filter(|&&value| value == f64::from(label as u8)).count()
    }

    /// The distance of each point that has one from its true place, in the order of the points. `subject` is what was scanned.
    pub fn errors(&self, subject: &Mesh) -> Vec<f64> {
        let error = |(point, truth): (&[f64; 3], &Option<SurfacePoint>)| {
            let place = self.placement.point(truth.as_ref()?.position(subject));
            Some((DVec3::from_array(*point) - DVec3::from_array(place)).length())
        };
        self.mesh.positions.iter().zip(&self.truth).filter_map(error).collect()
    }
}

/// A scan of a mesh in mm, y up.
///
/// Cost: one ray for each pixel, over all threads; about 200 bytes for each pixel of all views while it works.
/// Determinism: the same bits for the same seed on any number of threads.
///
/// # Errors
/// [`Error::Input`] for options that fail [`ScanOptions::check`], for a mesh that fails [`Mesh::check`] or has no faces, for images of
/// more than 2^24 pixels or 2^26 together, for a mesh smaller than a pixel, and for a scan without any point.
pub fn scanned(subject: &Mesh, options: &ScanOptions) -> Result<Scan, Error> {
    options.check()?;
    let room = Room::around(subject, options)?;
    if room.radius < options.pixel {
        return Err(Error::input(format!(
            "a mesh {:.4} mm across cannot be scanned with pixels of {} mm: tell its unit, or take smaller pixels",
            2.0 * room.radius,
            options.pixel
        )));
    }
    let cameras =
        (0..options.views.len()).map(|index| Camera::of(options, index, &room)).collect::<Result<Vec<_>, _>>()?;
    let n_pixels: usize = cameras.iter().map(Camera::n_pixels).sum();
    if n_pixels > MOST_PIXELS {
        return Err(Error::input(format!(
            "{n_pixels} pixels in all views: at most {MOST_PIXELS} fit; take larger pixels or fewer views"
        )));
    }
    let mut images: Vec<RangeImage> =
        cameras.into_iter().map(|camera| RangeImage::taken(&room, options, camera)).collect();
    let (holes, in_holes) = pierce(&mut images, options);
    let mut random = stream(options.seed, Purpose::Placement);
    let turn = options.placement_turn_deg.to_radians() * random.random::<f64>();
    let shift = options.placement_shift * random.random::<f64>();
    let placement = motion(&mut random, room.centre, turn, shift);
    let mut scan = Scan { mesh: Mesh::default(), truth: Vec::new(), placement, views: Vec::new(), holes };
    let (mut labels, mut views) = (Vec::new(), Vec::new());
    for (index, mut image) in images.into_iter().enumerate() {
        image.spoil(options, index);
        let calibration = match index {
            0 => Similarity::IDENTITY,
            _ => motion(
                &mut stream(options.seed, Purpose::Calibration(index)),
                room.centre,
                options.calibration_turn_deg.to_radians(),
                options.calibration_shift,
            ),
        };
        let before = scan.truth.len();
        // The vertex of each pixel; meaningless for one without.
        let mut vertices = vec![0_u32; image.returns.len()];
        for (vertex, found) in vertices.iter_mut().zip(&image.returns) {
            let Some(found) = found else { continue };
            *vertex = scan.truth.len() as u32;
            scan.mesh.positions.push(placement.point(calibration.point(found.point.to_array())));
            scan.truth.push(found.truth);
            labels.push(f64::from(found.label as u8));
            views.push(index as f64);
        }
        if options.triangles {
            let triangles = image.triangles(options.longest_edge);
            scan.mesh.faces.extend(triangles.into_iter().map(|triangle| triangle.map(|pixel| vertices[pixel])));
        }
        scan.views.push(ViewRecord {
            viewpoint: options.views[index],
            size: image.camera.size,
            calibration,
            points: scan.truth.len() - before,
            grazing: image.grazing,
            from_behind: image.from_behind,
            in_holes: in_holes[index],
        });
    }
    if scan.truth.is_empty() {
        let behind: usize = scan.views.iter().map(|view| view.from_behind).sum();
        return Err(Error::input(format!(
            "no ray returned from a mesh {:.4} mm across, {behind} met it from behind: check its unit against pixels of {} mm, its \
             orientation, the viewpoints and the limit of grazing rays",
            2.0 * room.radius,
            options.pixel
        )));
    }
    for (name, values) in [("label", labels), ("view", views)] {
        scan.mesh.attributes.push(Attribute { name: name.into(), scalar: Scalar::U8, values });
    }
    if options.shuffle {
        shuffle(&mut scan, options.seed);
    }
    Ok(scan)
}

/// Takes away what lies in the holes; returns them, and how many returns each view lost.
fn pierce(images: &mut [RangeImage], options: &ScanOptions) -> (Vec<Hole>, Vec<usize>) {
    let of_subject: Vec<DVec3> = images
        .iter()
        .flat_map(|image| image.returns.iter().flatten())
        .filter(|found| found.truth.is_some())
        .map(|found| found.met)
        .collect();
    let mut random = stream(options.seed, Purpose::Holes);
    let n_holes = if of_subject.is_empty() { 0 } else { options.holes };
    let hole = |_| {
        let centre = of_subject[random.random_range(0..of_subject.len())].to_array();
        Hole { centre, radius: between(&mut random, options.hole_radius) }
    };
    let holes: Vec<Hole> = (0..n_holes).map(hole).collect();
    let in_hole = |met: DVec3| {
        let inside = |hole: &Hole| (met - DVec3::from_array(hole.centre)).length() < hole.radius;
        holes.iter().any(inside)
    };
    let lost = |image: &mut RangeImage| {
        let gone = image.returns.iter_mut().filter(|found| found.is_some_and(|found| in_hole(found.met)));
        gone.map(|found| *found = None).count()
    };
    let lost = images.iter_mut().map(lost).collect();
    (holes, lost)
}

/// Puts the points in random order.
fn shuffle(scan: &mut Scan, seed: u64) {
    let mut order: Vec<u32> = (0..scan.truth.len() as u32).collect();
    order.shuffle(&mut stream(seed, Purpose::Order));
    let mut place = vec![0_u32; order.len()];
    for (new, &old) in order.iter().enumerate() {
        place[old as usize] = new as u32;
    }
    let faces = scan.mesh.faces.iter().map(|face| face.map(|vertex| place[vertex as usize])).collect();
    scan.mesh = scan.mesh.rearranged(&order, faces);
    scan.truth = order.iter().map(|&old| scan.truth[old as usize]).collect();
}

#[cfg(test)]
mod tests;
