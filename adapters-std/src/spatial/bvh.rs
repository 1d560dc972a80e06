//! Boxes within boxes, four at a time: the tree that finds the items which may be nearest, or which a ray may meet.
//!
//! Boxes are 32-bit numbers in a frame of their own, a little larger than what they hold; so a box is never judged farther than its
//! items are, and the items themselves are judged in 64 bits by the caller.

use glam::DVec3;

use super::partition::{Bounds, MAX_DEPTH, Partition, partition};

/// Children of a node.
const WIDTH: usize = 4;

/// An unused child.
const NONE: u32 = u32::MAX;

/// Marks a child as an item.
const ITEM: u32 = 1 << 31;

/// The most items in a tree.
pub(super) const MOST: usize = (ITEM - 1) as usize;

/// Boxes wait in the stack: at most three beside the one taken at each level.
const STACK: usize = 3 * MAX_DEPTH + WIDTH;

pub(super) use crate::mesh::LARGEST_COORDINATE as LARGEST;

/// A shift and a power of two that take the items into the cube from -1 to 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    centre: DVec3,
    scale: f64,
    /// By how much boxes are enlarged: more than the rounding errors of distances computed in 64 bits.
    margin: f32,
}

impl Frame {
    pub fn of(points: impl Iterator<Item = DVec3>) -> Self {
        let (low, high) =
            points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let centre = low * 0.5 + high * 0.5;
        let half = (high * 0.5 - low * 0.5).max_element();
        // The power of two is made from the bits: the next above the exponent of the half width.
        let exponent = if half > 1e-150 { (half.to_bits() >> 52) as i64 - 1023 + 1 } else { 0 };
        let scale = f64::from_bits(((1023 - exponent) as u64) << 52);
        let largest = low.abs().max(high.abs()).max_element() * scale;
        let margin = (3e-7 + 1e-14 * largest).min(f64::from(f32::MAX)) as f32;
        Frame { centre, scale, margin }
    }

    fn local(&self, p: DVec3) -> [f64; 3] {
        ((p - self.centre) * self.scale).to_array()
    }

    /// A squared distance in the frame's unit, rounded up.
    fn squared(&self, squared: f64) -> f32 {
        ((squared * self.scale * self.scale) as f32).next_up()
    }

    pub fn bounds(&self, points: &[DVec3]) -> Bounds {
        points.iter().fold(Bounds::NONE, |Bounds { low, high }, &p| {
            let p = self.local(p).map(|x| x as f32);
            Bounds {
                low: std::array::from_fn(|k| low[k].min((p[k] - self.margin).next_down())),
                high: std::array::from_fn(|k| high[k].max((p[k] + self.margin).next_up())),
            }
        })
    }
}

/// Four boxes and what is in them.
#[derive(Debug, Clone, Copy)]
struct Node {
    low: [[f32; WIDTH]; 3],
    high: [[f32; WIDTH]; 3],
    children: [u32; WIDTH],
}

/// The tree. Items are numbered as in `order` of [`Bvh::new`].
#[derive(Debug)]
pub(super) struct Bvh {
    frame: Frame,
    nodes: Vec<Node>,
}

impl Bvh {
    /// The tree over items that are given by their corners, and the order in which it keeps them. There is at least one item and at
    /// most [`MOST`]; coordinates are at most [`LARGEST`].
    pub fn new<const N: usize>(items: &[[DVec3; N]]) -> (Self, Vec<u32>) {
        let frame = Frame::of(items.iter().flatten().copied());
        let bounds: Vec<Bounds> = items.iter().map(|item| frame.bounds(item)).collect();
        let tree = partition(&bounds, 1);
        let mut nodes = Vec::with_capacity(items.len() / 2 + 1);
        collapse(&tree, 0, &mut nodes);
        (Bvh { frame, nodes }, tree.order)
    }

    /// The bytes that it occupies.
    pub fn n_bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
    }

    /// Shows to `visit` every item whose box is not farther from `p` than the bound, near boxes first. The bound, a squared distance,
    /// is `bound` at first, then what `visit` returns.
    #[inline]
    pub fn nearest(&self, p: DVec3, bound: f64, mut visit: impl FnMut(usize) -> f64) {
        let local = self.frame.local(p);
        let low = local.map(|x| (x as f32).next_down());
        let high = local.map(|x| (x as f32).next_up());
        let mut limit = self.frame.squared(bound);
        // A pending child and the lower bound of its squared distance, the bound in the upper half: sorted by it.
        let mut stack = [0_u64; STACK];
        let mut n_pending = 1;
        while n_pending > 0 {
            n_pending -= 1;
            let pending = stack[n_pending];
            if f32::from_bits((pending >> 32) as u32) > limit {
                continue;
            }
            let child = pending as u32;
            if child & ITEM != 0 {
                limit = self.frame.squared(visit((child & !ITEM) as usize));
                continue;
            }
            let node = &self.nodes[child as usize];
            let mut keys = [u64::MAX; WIDTH];
            for (key, (squared, child)) in keys.iter_mut().zip(node.squared(low, high).into_iter().zip(node.children)) {
                if squared <= limit && child != NONE {
                    *key = u64::from(squared.to_bits()) << 32 | u64::from(child);
                }
            }
            // Farthest first, so that the nearest is on top.
            for (i, j) in [(0, 1), (2, 3), (0, 2), (1, 3), (1, 2)] {
                (keys[i], keys[j]) = (keys[i].max(keys[j]), keys[i].min(keys[j]));
            }
            for key in keys {
                stack[n_pending] = key;
                n_pending += usize::from(key != u64::MAX);
            }
        }
    }

    /// Shows to `visit` every item whose box the ray enters at `t` between 0 and the bound, near boxes first. The bound is `bound` at
    /// first, then what `visit` returns.
    pub fn along(&self, origin: DVec3, direction: DVec3, bound: f64, mut visit: impl FnMut(usize) -> f64) {
        let local = self.frame.local(origin);
        let largest = direction.abs().max_element();
        // In units of the frame, t as given. A component of 0 becomes one that is too small to matter: no 0 * infinity.
        let inverse = direction.to_array().map(|d| {
            let least = largest * 1e-30;
            1.0 / (if d.abs() < least { least.copysign(d) } else { d } * self.frame.scale)
        });
        if !(local.iter().chain(&inverse).all(|x| x.is_finite()) && largest > 0.0 && largest < f64::INFINITY) {
            return;
        }
        let mut limit = bound;
        let mut stack = [(0.0_f64, 0_u32); STACK];
        let mut n_pending = 1;
        while n_pending > 0 {
            n_pending -= 1;
            let (enters, child) = stack[n_pending];
            if enters > limit {
                continue;
            }
            if child & ITEM != 0 {
                limit = visit((child & !ITEM) as usize);
                continue;
            }
            let node = &self.nodes[child as usize];
            let first = n_pending;
            for (slot, (enters, leaves)) in node.crossed(local, inverse).into_iter().enumerate() {
                // The margin of the boxes covers what the frame rounds, the factor what the slabs do.
                let enters = enters * (1.0 - 1e-12);
                if node.children[slot] == NONE || !(enters <= leaves && enters <= limit) {
                    continue;
                }
                let mut at = n_pending;
                while at > first && stack[at - 1].0 < enters {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = (enters, node.children[slot]);
                n_pending += 1;
            }
        }
    }
}

impl Node {
    const EMPTY: Node =
        Node { low: [[f32::INFINITY; WIDTH]; 3], high: [[f32::NEG_INFINITY; WIDTH]; 3], children: [NONE; WIDTH] };

    /// Lower bounds of the squared distances of the boxes from a position that lies between `low` and `high`.
    #[inline(always)]
    fn squared(&self, low: [f32; 3], high: [f32; 3]) -> [f32; WIDTH] {
        let mut sum = [0.0_f32; WIDTH];
        for axis in 0..3 {
            for (slot, sum) in sum.iter_mut().enumerate() {
                // Comparisons, not `max`: these are single instructions.
                let (below, above) = (self.low[axis][slot] - high[axis], low[axis] - self.high[axis][slot]);
                let outside = if below > above { below } else { above };
                let outside = if outside > 0.0 { outside } else { 0.0 };
                *sum += outside * outside;
            }
        }
        // Each term and the sum are rounded a few times; 16 half units in the last place are more than all of them.
        sum.map(|squared| squared * (1.0 - 1e-6))
    }

    /// The `t` at which the ray enters each box, at least 0, and leaves it.
    fn crossed(&self, origin: [f64; 3], inverse: [f64; 3]) -> [(f64, f64); WIDTH] {
        std::array::from_fn(|slot| {
            (0..3).fold((0.0, f64::INFINITY), |(enters, leaves), axis| {
                let one = (f64::from(self.low[axis][slot]) - origin[axis]) * inverse[axis];
                let other = (f64::from(self.high[axis][slot]) - origin[axis]) * inverse[axis];
                (one.min(other).max(enters), one.max(other).min(leaves))
            })
        })
    }
}

/// Appends the node of a branch and all below it; returns its index.
fn collapse(tree: &Partition, root: usize, nodes: &mut Vec<Node>) -> u32 {
    // Opens the largest child until there are four.
    let mut open = [root; WIDTH];
    let mut n_open = 1;
    while n_open < WIDTH {
        let widest = (0..n_open)
            .filter(|&k| tree.branches[open[k]].second != 0)
            .max_by(|&i, &j| area(tree, open[i]).total_cmp(&area(tree, open[j])).then(j.cmp(&i)));
        let Some(k) = widest else { break };
        let branch = open[k];
        open[k] = branch + 1;
        open[n_open] = branch + tree.branches[branch].second as usize;
        n_open += 1;
    }
    let at = nodes.len();
    nodes.push(Node::EMPTY);
    for (slot, &branch) in open[..n_open].iter().enumerate() {
        let Bounds { low, high } = tree.branches[branch].bounds;
        let child = match tree.branches[branch].second {
            0 => ITEM | tree.branches[branch].start,
            _ => collapse(tree, branch, nodes),
        };
        let node = &mut nodes[at];
        for axis in 0..3 {
            node.low[axis][slot] = low[axis];
            node.high[axis][slot] = high[axis];
        }
        node.children[slot] = child;
    }
    at as u32
}

fn area(tree: &Partition, branch: usize) -> f32 {
    tree.branches[branch].bounds.half_area()
}
