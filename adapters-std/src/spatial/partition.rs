//! Divides boxes in two, again and again, by the surface area heuristic: the binary tree under all search structures here.

use rayon::join;

/// Ranges with more items than this are divided on two threads.
const PARALLEL: usize = 8192;

/// Bins in which the middles of the boxes are counted along an axis.
const BINS: usize = 16;

/// From this depth on a range is halved by count, so that no input makes the tree deep.
const DEEP: usize = 40;

/// The largest depth: [`DEEP`], then one level for each doubling of the count.
pub(super) const MAX_DEPTH: usize = DEEP + 32;

/// An axis-parallel box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub low: [f32; 3],
    pub high: [f32; 3],
}

impl Bounds {
    /// The box around nothing.
    pub const NONE: Bounds = Bounds { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };

    fn around(self, other: Bounds) -> Bounds {
        Bounds {
            low: std::array::from_fn(|axis| self.low[axis].min(other.low[axis])),
            high: std::array::from_fn(|axis| self.high[axis].max(other.high[axis])),
        }
    }

    /// Half the surface; 0 for the box around nothing.
    pub fn half_area(&self) -> f32 {
        let [x, y, z]: [f32; 3] = std::array::from_fn(|axis| (self.high[axis] - self.low[axis]).max(0.0));
        x * y + y * z + z * x
    }

    /// Twice the middle.
    fn middle(&self, axis: usize) -> f32 {
        self.low[axis] + self.high[axis]
    }
}

/// A range of items and how it is divided. The first child follows its parent in the list.
#[derive(Debug, Clone, Copy)]
pub(super) struct Branch {
    pub bounds: Bounds,
    /// The range in the order of [`Partition`].
    pub start: u32,
    pub len: u32,
    /// How far behind this branch the second child is; 0 without children.
    pub second: u32,
}

/// A tree over items: an order of them, and branches each of which holds a range of it. The root is the first.
#[derive(Debug)]
pub(super) struct Partition {
    pub order: Vec<u32>,
    pub branches: Vec<Branch>,
}

#[derive(Debug, Clone, Copy)]
struct Item {
    bounds: Bounds,
    index: u32,
}

/// The tree over the items with these boxes, of which there is at least one, with at most `leaf` items in a range that is not divided.
///
/// The same for any number of threads: ranges are divided by their content alone.
pub(super) fn partition(bounds: &[Bounds], leaf: usize) -> Partition {
    let mut items: Vec<Item> =
        bounds.iter().enumerate().map(|(index, &bounds)| Item { bounds, index: index as u32 }).collect();
    let mut branches = Vec::new();
    divide(&mut items, 0, 0, leaf.max(1), &mut branches);
    Partition { order: items.iter().map(|item| item.index).collect(), branches }
}

/// Appends the branches of a range that begins at `start` in the whole.
fn divide(items: &mut [Item], start: u32, depth: usize, leaf: usize, branches: &mut Vec<Branch>) {
    let bounds = items.iter().fold(Bounds::NONE, |all, item| all.around(item.bounds));
    let at = branches.len();
    branches.push(Branch { bounds, start, len: items.len() as u32, second: 0 });
    if items.len() <= leaf {
        return;
    }
    let middle = division(items, depth);
    let (first, rest) = items.split_at_mut(middle);
    let behind = start + middle as u32;
    if first.len() + rest.len() > PARALLEL {
        let mut others = Vec::new();
        join(|| divide(first, start, depth + 1, leaf, branches), || divide(rest, behind, depth + 1, leaf, &mut others));
        branches[at].second = (branches.len() - at) as u32;
        branches.append(&mut others);
    } else {
        divide(first, start, depth + 1, leaf, branches);
        branches[at].second = (branches.len() - at) as u32;
        divide(rest, behind, depth + 1, leaf, branches);
    }
}

/// Reorders two or more items and tells how many belong to the first part; neither part is empty.
fn division(items: &mut [Item], depth: usize) -> usize {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for item in items.iter() {
        for axis in 0..3 {
            low[axis] = low[axis].min(item.bounds.middle(axis));
            high[axis] = high[axis].max(item.bounds.middle(axis));
        }
    }
    let extent: [f32; 3] = std::array::from_fn(|axis| high[axis] - low[axis]);
    let widest = (1..3).fold(0, |best, axis| if extent[axis] > extent[best] { axis } else { best });
    if items.len() > 4 && depth < DEEP && extent[widest] > 0.0 {
        let axes = if items.len() > 32 { 0..3 } else { widest..widest + 1 };
        let best = axes
            .filter(|&axis| extent[axis] > 0.0)
            .filter_map(|axis| cheapest(items, axis, low[axis], BINS as f32 / extent[axis]))
            .min_by(|a, b| a.cost.total_cmp(&b.cost));
        if let Some(cut) = best {
            let middle = parted(items, |item| bin(item, cut.axis, low[cut.axis], cut.scale) < cut.bin);
            if middle > 0 && middle < items.len() {
                return middle;
            }
        }
    }
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        a.bounds.middle(widest).total_cmp(&b.bounds.middle(widest)).then(a.index.cmp(&b.index))
    });
    middle
}

/// A plane between two bins and the expected cost of dividing there.
struct Cut {
    axis: usize,
    bin: usize,
    scale: f32,
    cost: f32,
}

fn bin(item: &Item, axis: usize, low: f32, scale: f32) -> usize {
    (((item.bounds.middle(axis) - low) * scale) as usize).min(BINS - 1)
}

/// The cheapest plane across an axis; none if all items fall into one bin.
fn cheapest(items: &[Item], axis: usize, low: f32, scale: f32) -> Option<Cut> {
    let mut bins = [(Bounds::NONE, 0_u32); BINS];
    for item in items {
        let (bounds, count) = &mut bins[bin(item, axis, low, scale)];
        *bounds = bounds.around(item.bounds);
        *count += 1;
    }
    let mut above = [0.0; BINS];
    let (mut bounds, mut count) = (Bounds::NONE, 0);
    for at in (1..BINS).rev() {
        bounds = bounds.around(bins[at].0);
        count += bins[at].1;
        above[at] = if count == 0 { f32::INFINITY } else { bounds.half_area() * count as f32 };
    }
    let mut best: Option<Cut> = None;
    let (mut bounds, mut count) = (Bounds::NONE, 0);
    for at in 1..BINS {
        bounds = bounds.around(bins[at - 1].0);
        count += bins[at - 1].1;
        let cost = bounds.half_area() * count as f32 + above[at];
        if count > 0 && cost.is_finite() && best.as_ref().is_none_or(|best| cost < best.cost) {
            best = Some(Cut { axis, bin: at, scale, cost });
        }
    }
    best
}

/// Moves the items that satisfy `first` to the front, the same way each time, and counts them.
fn parted(items: &mut [Item], first: impl Fn(&Item) -> bool) -> usize {
    let mut middle = 0;
    for at in 0..items.len() {
        if first(&items[at]) {
            items.swap(middle, at);
            middle += 1;
        }
    }
    middle
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Whether branches are inside their parents and leaves cover the order once; the depth.
    fn checked(tree: &Partition, bounds: &[Bounds], leaf: usize, at: usize, depth: usize) -> usize {
        let branch = tree.branches[at];
        let range = branch.start as usize..(branch.start + branch.len) as usize;
        let all = tree.order[range].iter().fold(Bounds::NONE, |all, &i| all.around(bounds[i as usize]));
        assert_eq!(all, branch.bounds);
        if branch.second == 0 {
            assert!((1..=leaf).contains(&(branch.len as usize)));
            return depth;
        }
        let (first, second) = (tree.branches[at + 1], tree.branches[at + branch.second as usize]);
        assert_eq!((first.start, first.start + first.len), (branch.start, second.start));
        assert_eq!(first.len + second.len, branch.len);
        let below = |child| checked(tree, bounds, leaf, child, depth + 1);
        below(at + 1).max(below(at + branch.second as usize))
    }

    fn point(p: [f32; 3]) -> Bounds {
        Bounds { low: p, high: p }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn ranges_hold_every_item_once(points in prop::collection::vec(prop::array::uniform3(-3_i8..3), 1..200), leaf in 1_usize..5) {
            let bounds: Vec<Bounds> = points.iter().map(|p| point(p.map(f32::from))).collect();
            let tree = partition(&bounds, leaf);
            checked(&tree, &bounds, leaf, 0, 0);
            let mut order = tree.order;
            order.sort_unstable();
            prop_assert_eq!(order, (0..bounds.len() as u32).collect::<Vec<_>>());
        }
    }

    #[test]
    fn depth_stays_bounded_where_every_cut_splits_off_one_item() {
        // Each coordinate is 40 times the one before: all but the last fall into the first bin.
        let bounds: Vec<Bounds> =
            (0..20_000).map(|i| point([40_f32.powi(i % 23), (i / 23) as f32 * 1e-30, 0.0])).collect();
        let tree = partition(&bounds, 1);
        assert!(checked(&tree, &bounds, 1, 0, 0) <= MAX_DEPTH);
    }

    #[test]
    fn equal_items_are_halved() {
        let bounds = vec![point([1.0, 2.0, 3.0]); 1000];
        assert_eq!(checked(&partition(&bounds, 1), &bounds, 1, 0, 0), 10);
    }
}
