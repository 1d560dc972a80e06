//! Colours of numbers: a scalar field becomes one colour per vertex.

/// A sequence of colours in which equal steps of the number look equally large.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ColourMap {
    /// Cream over orange and purple to dark violet, magma from its pale end: amounts on surfaces, whose form stays visible
    /// where little is to be shown.
    #[default]
    PaleMagma,
    /// Dark violet over green to yellow: amounts.
    Viridis,
    /// Black over red to pale yellow: amounts.
    Inferno,
    /// Blue over white to red: signed amounts, zero in the middle.
    BlueRed,
}

impl ColourMap {
    /// The sRGB colour at `t`, 0 at the low end and 1 at the high one; what lies beyond is at the ends.
    pub fn colour(self, t: f64) -> [u8; 3] {
        let t = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) };
        let colour = match self {
            // The darkest fifth would hide the shading.
            ColourMap::PaleMagma => colorous::MAGMA.eval_continuous(1.0 - 0.8 * t),
            ColourMap::Viridis => colorous::VIRIDIS.eval_continuous(t),
            ColourMap::Inferno => colorous::INFERNO.eval_continuous(t),
            ColourMap::BlueRed => colorous::RED_BLUE.eval_continuous(1.0 - t),
        };
        [colour.r, colour.g, colour.b]
    }
}

/// Which number has which colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourScale {
    /// The colours from `low` to `high`.
    pub map: ColourMap,
    /// The number at the low end.
    pub low: f64,
    /// The number at the high end.
    pub high: f64,
    /// sRGB colour of numbers below `low`.
    pub below: [u8; 3],
    /// sRGB colour of numbers above `high`.
    pub above: [u8; 3],
    /// sRGB colour where there is no number (NaN).
    pub missing: [u8; 3],
}

impl ColourScale {
    /// Amounts from `low` to `high` in pale magma; blue above, green below, grey where there is none.
    pub fn sequential(low: f64, high: f64) -> Self {
        let (below, above) = ([60, 160, 90], [0, 130, 220]);
        ColourScale { map: ColourMap::PaleMagma, low, high, below, above, missing: [150, 150, 150] }
    }

    /// Signed amounts from `-limit` in blue to `limit` in red; violet above, green below, khaki where there is none.
    pub fn signed(limit: f64) -> Self {
        let (below, above) = ([0, 140, 110], [160, 0, 150]);
        ColourScale { map: ColourMap::BlueRed, low: -limit, high: limit, below, above, missing: [200, 184, 100] }
    }

    /// The sRGB colour of a number.
    pub fn colour(&self, value: f64) -> [u8; 3] {
        if value.is_nan() {
            self.missing
        } else if value > self.high {
            self.above
        } else if value < self.low {
            self.below
        } else {
            // Halves first: the span of two finite numbers need not be one.
            self.map.colour((value / 2.0 - self.low / 2.0) / (self.high / 2.0 - self.low / 2.0))
        }
    }

    /// The colours of numbers, in their order.
    pub fn colours(&self, values: &[f64]) -> Vec<[u8; 3]> {
        values.iter().map(|value| self.colour(*value)).collect()
    }
}

/// The smallest of the numbers 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten that is not below `value`: a round end for a
/// scale. 1 where `value` is not positive and finite.
pub fn rounded_up(value: f64) -> f64 {
    if !(value > 1e-290 && value < 1e290) {
        return 1.0;
    }
    let exponent = value.log10().floor() as i32;
    // The logarithm may be off by one step at powers of ten.
    let candidates = (exponent - 1..=exponent + 1).flat_map(|exponent| {
        [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]
            .map(|digit| if exponent < 0 { digit / 10.0_f64.powi(-exponent) } else { digit * 10.0_f64.powi(exponent) })
    });
    candidates.filter(|candidate| *candidate >= value).fold(f64::INFINITY, f64::min).min(10.0 * value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_beyond_the_ends_and_missing_ones_have_colours_of_their_own() {
        for scale in [ColourScale::sequential(0.0, 2.0), ColourScale::signed(2.0)] {
            assert_eq!(scale.colour(2.0), scale.map.colour(1.0));
            assert_eq!(scale.colour(2.0001), scale.above);
            assert_eq!(scale.colour(f64::INFINITY), scale.above);
            assert_eq!(scale.colour(scale.low), scale.map.colour(0.0));
            assert_eq!(scale.colour(-2.1), scale.below);
            assert_eq!(scale.colour(f64::NAN), scale.missing);
        }
        let point = ColourScale::sequential(1.0, 1.0);
        assert_eq!(point.colour(1.0), point.map.colour(0.0));
        let all = ColourScale::sequential(-f64::MAX, f64::MAX);
        assert_eq!(all.colour(0.0), all.map.colour(0.5));
    }

    #[test]
    fn the_signed_map_is_blue_below_white_at_and_red_above_zero() {
        let scale = ColourScale::signed(1.0);
        let (low, middle, high) = (scale.colour(-1.0), scale.colour(0.0), scale.colour(1.0));
        assert!(low[2] > 2 * low[0] && high[0] > 2 * high[2], "{low:?} {high:?}");
        assert!(middle.iter().all(|channel| *channel > 235), "{middle:?}");
    }

    #[test]
    fn sequential_maps_grow_lighter_or_darker_all_the_way() {
        let lightness = |[r, g, b]: [u8; 3]| 0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b);
        for map in [ColourMap::Viridis, ColourMap::Inferno] {
            let steps: Vec<f64> = (0..=20).map(|k| lightness(map.colour(f64::from(k) / 20.0))).collect();
            assert!(steps.windows(2).all(|pair| pair[1] > pair[0]), "{map:?} {steps:?}");
        }
        let steps: Vec<f64> = (0..=20).map(|k| lightness(ColourMap::PaleMagma.colour(f64::from(k) / 20.0))).collect();
        assert!(steps.windows(2).all(|pair| pair[1] < pair[0]), "{steps:?}");
    }

    #[test]
    fn ends_are_round() {
        for (value, end) in [(0.93, 1.0), (1.0, 1.0), (1.01, 1.5), (2.4, 3.0), (81.0, 100.0), (0.0021, 0.003)] {
            assert_eq!(rounded_up(value), end);
        }
        for value in [0.0, -3.0, f64::NAN, f64::INFINITY, 1e300, 1e-300] {
            assert_eq!(rounded_up(value), 1.0);
        }
    }
}
