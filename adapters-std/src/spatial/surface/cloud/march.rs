//! Walking on a cloud: steps in the tangent plane, each followed by a projection to the surface that the nearby points describe
//! (Part I, 2.4).

use std::f64::consts::PI;

use glam::DVec3;
use smallvec::SmallVec;

use super::super::angles::{angle_of, carried, wrapped};
use super::super::{CloudPoint, Frame, LONGEST, Location, Stop, Trace};
use super::CloudSurface;

/// Points that the surface at a place is computed from.
const NEAREST: usize = 12;

/// The length of a step, as a share of the spacing.
const STEP: f64 = 0.5;

/// So many spacings from a point of the boundary the surface ends.
const BORDER: f64 = 1.5;

/// So many spacings from any point the surface ends, and a location names no place.
pub(super) const REACH: f64 = 3.0;

/// Projections after which a place on the surface is found.
const PROJECTIONS: usize = 3;

impl CloudSurface {
    /// The nearest point that is reached from `start` by going to ever nearer neighbours; so it is on the same sheet.
    fn anchored(&self, p: DVec3, start: u32) -> u32 {
        let squared = |point: u32| self.points[point as usize].distance_squared(p);
        let mut best = (squared(start), start);
        loop {
            let before = best.1;
            for edge in super::Surface::neighbours(self, before) {
                let distance = squared(edge.j);
                if distance < best.0 || (distance == best.0 && edge.j < best.1) {
                    best = (distance, edge.j);
                }
            }
            if best.1 == before {
                return before;
            }
        }
    }

    /// The height of a place above the surface and the normal there, from the point `anchor` and its neighbours nearest to the place.
    ///
    /// A moving least squares plane with the Gaussian weights of the spacing, less the weight of the first point that is left out, so
    /// that points come and go without a jump. The mean height above the points along the common normal is too low on a sphere by as much as
    /// the mean of their heights along their own normals is too high; so the two are averaged.
    fn plane(&self, p: DVec3, anchor: u32) -> (f64, DVec3) {
        let around = super::Surface::neighbours(self, anchor).iter().map(|edge| edge.j);
        let mut near: SmallVec<[(f64, u32); 32]> = std::iter::once(anchor)
            .chain(around)
            .map(|point| (self.points[point as usize].distance_squared(p), point))
            .collect();
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        // Relative to the nearest, so that far from the cloud not all weights are zero.
        let (least, width) = (near[0].0, self.spacings[anchor as usize]);
        let gauss = |squared: f64| (-(squared - least) / (width * width)).exp();
        let cut = near.get(NEAREST).map_or(0.0, |&(squared, _)| gauss(squared));
        near.truncate(NEAREST);
        let (mut sum, mut normal, mut own, mut centre) = (0.0, DVec3::ZERO, 0.0, DVec3::ZERO);
        for &(squared, point) in &near {
            // All as far as the first that is left out: then all count alike.
            let weight = if cut < 1.0 { gauss(squared) - cut } else { 1.0 };
            let (there, n) = (p - self.points[point as usize], self.normals[point as usize]);
            sum += weight;
            normal += n * weight;
            own += there.dot(n) * weight;
            centre += there * weight;
        }
        let normal = normal.try_normalize().unwrap_or(self.normals[anchor as usize]);
        (0.5 * (own + centre.dot(normal)) / sum, normal)
    }

    /// Where a location lies and its frame: the place of the surface above or below the point of the anchor's tangent plane, and the
    /// anchor's frame turned by the smallest rotation between the normals.
    pub(super) fn foot(&self, at: &CloudPoint) -> (DVec3, Frame) {
        let frame = &self.frames[at.anchor as usize];
        let own = DVec3::from_array(frame.normal);
        let mut p = self.points[at.anchor as usize] + DVec3::from_array(frame.vector(at.offset));
        let mut normal = own;
        for _ in 0..PROJECTIONS {
            let height;
            (height, normal) = self.plane(p, self.anchored(p, at.anchor));
            // Normals of a neighbourhood are within about 70 degrees.
            p -= own * (height / normal.dot(own).max(0.3));
        }
        let u = carried(DVec3::from_array(frame.u), own, normal);
        (p, Frame { u: u.to_array(), v: normal.cross(u).to_array(), normal: normal.to_array() })
    }

    /// A place on the surface as a location.
    fn location(&self, p: DVec3, anchor: u32) -> CloudPoint {
        let chord = p - self.points[anchor as usize];
        CloudPoint { anchor, offset: self.frames[anchor as usize].coordinates(chord.to_array()) }
    }

    /// Drops a place to the surface; returns the normal there.
    fn project(&self, p: &mut DVec3, anchor: &mut u32) -> DVec3 {
        let mut normal = self.normals[*anchor as usize];
        for _ in 0..2 {
            let height;
            (height, normal) = self.plane(*p, *anchor);
            *p -= normal * height;
            *anchor = self.anchored(*p, *anchor);
        }
        normal
    }

    /// See [`super::Surface::trace`].
    pub(super) fn march(&self, from: &Location, angle: f64, length: f64) -> Trace {
        let start = self.checked(from).filter(|_| angle.is_finite() && length.abs() <= LONGEST * self.spacing);
        let Some(start) = start else {
            return Trace { end: *from, turn: 0.0, length: 0.0, stopped: Some(Stop::NoStart) };
        };
        let angle = wrapped(if length < 0.0 { angle + PI } else { angle });
        let n_steps = (length.abs() / (STEP * self.spacing)).ceil() as u64;
        if n_steps == 0 {
            return Trace { end: *from, turn: 0.0, length: 0.0, stopped: None };
        }
        let step = length.abs() / n_steps as f64;
        let (mut p, frame) = self.foot(&start);
        let mut normal = DVec3::from_array(frame.normal);
        let mut ahead = DVec3::from_array(frame.vector([angle.cos(), angle.sin()]));
        let mut anchor = self.anchored(p, start.anchor);
        let (mut walked, mut stopped) = (0, None);
        while walked < n_steps {
            let mut next = p + ahead * step;
            let mut beside = self.anchored(next, anchor);
            let (distance, spacing) = (next.distance(self.points[beside as usize]), self.spacings[beside as usize]);
            if distance > REACH * spacing || (distance > BORDER * spacing && self.boundary[beside as usize]) {
                stopped = Some(Stop::Boundary);
                break;
            }
            let there = self.project(&mut next, &mut beside);
            let turned = carried(ahead, normal, there);
            let Some(turned) = (turned - there * turned.dot(there)).try_normalize() else {
                stopped = Some(Stop::DegenerateFace);
                break;
            };
            (p, anchor, normal, ahead) = (next, beside, there, turned);
            walked += 1;
        }
        let end = self.location(p, anchor);
        let frame = self.foot(&end).1;
        let arriving = carried(ahead, normal, DVec3::from_array(frame.normal));
        let arriving = angle_of(frame.coordinates(arriving.to_array()).into());
        let length = if stopped.is_none() { length.abs() } else { walked as f64 * step };
        Trace { end: Location::Cloud(end), turn: wrapped(arriving - angle), length, stopped }
    }

    /// See [`super::Surface::locate`].
    pub(super) fn closest(&self, position: [f64; 3]) -> Location {
        let p = DVec3::from_array(position);
        let nearest = self.tree.nearest(position);
        let mut anchor = nearest.index;
        if !nearest.distance.is_finite() {
            return super::Surface::sample(self, anchor);
        }
        let mut foot = self.points[anchor as usize];
        for _ in 0..PROJECTIONS {
            let normal = self.plane(foot, anchor).1;
            let along = p - foot;
            let along = (along - normal * normal.dot(along)).clamp_length_max(self.spacings[anchor as usize]);
            foot += along;
            self.project(&mut foot, &mut anchor);
        }
        let mut end = self.location(foot, anchor);
        // Beside the border the closest place is about the nearest point.
        let reach = self.spacings[anchor as usize];
        let [x, y] = end.offset;
        let excess = x.hypot(y) / reach;
        if excess > 1.0 {
            end.offset = [x / excess, y / excess];
        }
        Location::Cloud(end)
    }
}
