//! What a range of the results of one lifting step depends on.

/// One step along one axis: coarse nodes `0..=last`, details `0..last`, results `0..=2 last`, of which the range `out` is wanted.
///
/// An even result `2i` depends on coarse nodes `i-1..=i+1` and details `i-2..=i+1`, an odd one `2i+1` on coarse nodes `i..=i+1` and
/// details `i-1..=i+1`: this is the reach of the cubic wavelet; the bilinear one, which needs less, uses the same ranges.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    /// Index of the last coarse node.
    pub(crate) last: usize,
    pub(crate) out: Interval,
    pub(crate) coarse: Interval,
    pub(crate) detail: Interval,
}

/// Indices `from..to`, in a form that can be copied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Interval {
    pub(crate) from: usize,
    pub(crate) to: usize,
}

impl Interval {
    #[inline(always)]
    pub(crate) const fn len(&self) -> usize {
        self.to.saturating_sub(self.from)
    }
}

const fn min(a: usize, b: usize) -> usize {
    if a < b { a } else { b }
}

impl Span {
    /// The step from `coarse_size` nodes (two at least) whose results `out`, not empty, are wanted.
    #[inline(always)]
    pub(crate) const fn new(coarse_size: usize, out: Interval) -> Self {
        let last = coarse_size - 1;
        let coarse = Interval { from: out.from.saturating_sub(1) / 2, to: min(last, out.to.div_ceil(2)) + 1 };
        let detail = Interval { from: coarse.from.saturating_sub(1), to: min(last, coarse.to) };
        Span { last, out, coarse, detail }
    }

    /// The range of coarse nodes begins at an end of the axis.
    #[inline(always)]
    pub(crate) const fn starts(&self) -> bool {
        self.coarse.from == 0
    }

    /// The range of coarse nodes stops at the other end.
    #[inline(always)]
    pub(crate) const fn ends(&self) -> bool {
        self.coarse.to > self.last
    }
}
