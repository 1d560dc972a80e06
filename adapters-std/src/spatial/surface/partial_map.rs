//! A map from a part of one surface to another: the image of each sample that has one, and why others have none (Part I, 1.5).

use super::Location;
use crate::Error;

/// A place with a direction on each of two surfaces: where a map begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientedPair {
    /// The place on the first surface and a direction in its frame, in radians.
    pub from: (Location, f64),
    /// The place on the second surface and the direction that corresponds.
    pub to: (Location, f64),
}

/// Whether a map keeps the sense of rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Orientation {
    /// It does, as between two poses.
    Preserving,
    /// It does not, as a mirror symmetry.
    Reversing,
}

impl Orientation {
    /// 1 or -1, the factor of angles.
    pub fn sign(self) -> f64 {
        match self {
            Orientation::Preserving => 1.0,
            Orientation::Reversing => -1.0,
        }
    }
}

/// Why a sample has no image (the tests of Part I, 4.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum RejectReason {
    /// The path to its image ended early (T1).
    Stopped,
    /// Its neighbours disagree about its image (T2).
    Disagreement,
    /// The map would stretch too much there (T3).
    Stretch,
    /// Distances over a wider range are not kept (T4).
    Range,
    /// Its image is that of a far sample (T5).
    Overlap,
    /// The descriptors of sample and image differ (T6).
    Descriptor,
}

/// The image of a sample and how it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// The sample of the first surface.
    pub sample: u32,
    /// Its image on the second.
    pub image: Location,
    /// The rotation from the frame of the sample to that of the image, in radians; after mirroring `v` where orientation reverses.
    pub rotation: f32,
    /// The sample from which it was reached; itself at the start.
    pub parent: u32,
    /// The distance from the start, in the unit of the first surface.
    pub distance: f32,
    /// The singular values of the map's derivative, the larger first.
    pub strain: [f32; 2],
    /// The spread of what its neighbours proposed, in the unit of the second surface.
    pub residual: f32,
}

/// A map from a part of one surface to another, as columns sorted by sample.
#[derive(Debug, Clone, PartialEq)]
pub struct PartialMap {
    seed: OrientedPair,
    orientation: Orientation,
    samples: Vec<u32>,
    images: Vec<Location>,
    rotations: Vec<f32>,
    parents: Vec<u32>,
    distances: Vec<f32>,
    strains: Vec<[f32; 2]>,
    residuals: Vec<f32>,
    rejected: Vec<(u32, RejectReason)>,
}

impl PartialMap {
    /// The map with these images, in any order, and with these samples without one.
    ///
    /// # Errors
    /// [`Error::Input`] when a sample comes twice, as an entry or as rejected or as both.
    pub fn new(
        seed: OrientedPair,
        orientation: Orientation,
        mut entries: Vec<Entry>,
        mut rejected: Vec<(u32, RejectReason)>,
    ) -> Result<PartialMap, Error> {
        entries.sort_by_key(|entry| entry.sample);
        rejected.sort_unstable();
        let mut named: Vec<u32> =
            entries.iter().map(|entry| entry.sample).chain(rejected.iter().map(|r| r.0)).collect();
        named.sort_unstable();
        if let Some(pair) = named.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(Error::input(format!("a map names sample {} twice: give it one image or one reason", pair[0])));
        }
        Ok(PartialMap {
            seed,
            orientation,
            samples: entries.iter().map(|entry| entry.sample).collect(),
            images: entries.iter().map(|entry| entry.image).collect(),
            rotations: entries.iter().map(|entry| entry.rotation).collect(),
            parents: entries.iter().map(|entry| entry.parent).collect(),
            distances: entries.iter().map(|entry| entry.distance).collect(),
            strains: entries.iter().map(|entry| entry.strain).collect(),
            residuals: entries.iter().map(|entry| entry.residual).collect(),
            rejected,
        })
    }

    /// Where it began.
    pub fn seed(&self) -> &OrientedPair {
        &self.seed
    }

    /// Whether it keeps the sense of rotation.
    pub fn orientation(&self) -> Orientation {
        self.orientation
    }

    /// The number of samples with an image.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether no sample has an image.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// The samples with an image, in order; the further columns are in the same order.
    pub fn samples(&self) -> &[u32] {
        &self.samples
    }

    /// Their images.
    pub fn images(&self) -> &[Location] {
        &self.images
    }

    /// The rotations from the frames of the samples to those of the images.
    pub fn rotations(&self) -> &[f32] {
        &self.rotations
    }

    /// The samples from which they were reached.
    pub fn parents(&self) -> &[u32] {
        &self.parents
    }

    /// Their distances from the start.
    pub fn distances(&self) -> &[f32] {
        &self.distances
    }

    /// The singular values of the map's derivative.
    pub fn strains(&self) -> &[[f32; 2]] {
        &self.strains
    }

    /// The spreads of what neighbours proposed.
    pub fn residuals(&self) -> &[f32] {
        &self.residuals
    }

    /// The samples that were tried and have no image, in order.
    pub fn rejected(&self) -> &[(u32, RejectReason)] {
        &self.rejected
    }

    /// The place of a sample in the columns.
    pub fn row(&self, sample: u32) -> Option<usize> {
        self.samples.binary_search(&sample).ok()
    }

    /// What is known of a sample with an image.
    pub fn entry(&self, sample: u32) -> Option<Entry> {
        let row = self.row(sample)?;
        Some(Entry {
            sample,
            image: self.images[row],
            rotation: self.rotations[row],
            parent: self.parents[row],
            distance: self.distances[row],
            strain: self.strains[row],
            residual: self.residuals[row],
        })
    }

    /// The rows of the samples that have an image in both maps, in the order of the samples: the row in this map, then in the other.
    ///
    /// Time: linear in the two maps.
    pub fn overlap<'a>(&'a self, other: &'a PartialMap) -> impl Iterator<Item = (usize, usize)> + 'a {
        let (mut here, mut there) = (0, 0);
        std::iter::from_fn(move || {
            loop {
                match self.samples.get(here)?.cmp(other.samples.get(there)?) {
                    std::cmp::Ordering::Less => here += 1,
                    std::cmp::Ordering::Greater => there += 1,
                    std::cmp::Ordering::Equal => {
                        (here, there) = (here + 1, there + 1);
                        return Some((here - 1, there - 1));
                    }
                }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::CloudPoint;
    use super::*;
    use proptest::prelude::*;

    fn location(anchor: u32) -> Location {
        Location::Cloud(CloudPoint { anchor, offset: [0.0; 2] })
    }

    fn map(samples: &[u32], rejected: &[u32]) -> Result<PartialMap, Error> {
        let seed = OrientedPair { from: (location(0), 0.0), to: (location(0), 0.0) };
        let entry = |&sample: &u32| Entry {
            sample,
            image: location(1000 + sample),
            rotation: sample as f32,
            parent: sample / 2,
            distance: 0.5,
            strain: [1.1, 0.9],
            residual: 0.0,
        };
        let rejected = rejected.iter().map(|&sample| (sample, RejectReason::Stretch)).collect();
        PartialMap::new(seed, Orientation::Preserving, samples.iter().map(entry).collect(), rejected)
    }

    #[test]
    fn columns_are_sorted_by_sample() {
        let map = map(&[7, 2, 5], &[9, 1]).expect("distinct samples");
        assert_eq!((map.samples(), map.rejected()[0].0, map.len()), (&[2, 5, 7][..], 1, 3));
        assert_eq!(map.images()[1], location(1005));
        let entry = map.entry(7).expect("an image");
        assert_eq!((entry.sample, entry.rotation, entry.parent), (7, 7.0, 3));
        assert_eq!((map.entry(1), map.row(6)), (None, None));
        assert_eq!((Orientation::Preserving.sign(), Orientation::Reversing.sign()), (1.0, -1.0));
    }

    #[test]
    fn a_sample_has_one_image_or_one_reason() {
        assert!(map(&[1, 2, 1], &[]).expect_err("must fail").to_string().contains("sample 1 twice"));
        assert!(map(&[1, 2], &[2]).expect_err("must fail").to_string().contains("sample 2 twice"));
        assert!(map(&[], &[4, 4]).is_err() && map(&[], &[]).expect("nothing").is_empty());
    }

    proptest! {
        #[test]
        fn the_overlap_is_that_of_the_sets(
            one in prop::collection::btree_set(0_u32..60, 0..40), other in prop::collection::btree_set(0_u32..60, 0..40),
        ) {
            let [a, b] = [&one, &other].map(|set| map(&set.iter().rev().copied().collect::<Vec<_>>(), &[]).expect("distinct"));
            let common: Vec<u32> = one.intersection(&other).copied().collect();
            let rows: Vec<(usize, usize)> = a.overlap(&b).collect();
            prop_assert_eq!(rows.iter().map(|row| a.samples()[row.0]).collect::<Vec<_>>(), common.clone());
            prop_assert_eq!(rows.iter().map(|row| b.samples()[row.1]).collect::<Vec<_>>(), common);
        }
    }
}
