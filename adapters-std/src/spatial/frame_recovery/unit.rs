//! The unit of length of a scan, told from its size.

/// A unit in which scans are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Unit {
    Millimetre,
    Centimetre,
    Metre,
    Inch,
    Foot,
}

impl Unit {
    /// All units.
    pub const ALL: [Unit; 5] = [Unit::Millimetre, Unit::Centimetre, Unit::Metre, Unit::Inch, Unit::Foot];

    /// Its length in millimetres.
    pub fn millimetres(self) -> f64 {
        match self {
            Unit::Millimetre => 1.0,
            Unit::Centimetre => 10.0,
            Unit::Metre => 1000.0,
            Unit::Inch => 25.4,
            Unit::Foot => 304.8,
        }
    }

    /// Its symbol: `mm`, `cm`, `m`, `in`, `ft`.
    pub fn symbol(self) -> &'static str {
        match self {
            Unit::Millimetre => "mm",
            Unit::Centimetre => "cm",
            Unit::Metre => "m",
            Unit::Inch => "in",
            Unit::Foot => "ft",
        }
    }

    /// The unit of this symbol.
    pub fn of_symbol(symbol: &str) -> Option<Unit> {
        Self::ALL.into_iter().find(|unit| unit.symbol() == symbol)
    }
}

/// A unit and the size that the scan has in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SizeCandidate {
    /// The unit.
    pub unit: Unit,
    /// The diagonal of the scan's bounding box in this unit, mm.
    pub diagonal: f64,
    /// The same over the diagonal of the template.
    pub ratio: f64,
    /// Whether the ratio lies in the window.
    pub fits: bool,
}

/// The size in each unit of a scan whose diagonal is `diagonal` of it.
pub(super) fn sizes(diagonal: f64, of_template: f64, window: [f64; 2]) -> Vec<SizeCandidate> {
    let size = |unit: Unit| {
        let diagonal = diagonal * unit.millimetres();
        let ratio = diagonal / of_template;
        SizeCandidate { unit, diagonal, ratio, fits: ratio >= window[0] && ratio <= window[1] }
    };
    Unit::ALL.into_iter().map(size).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_unit_fits_a_size() {
        let fitting = |diagonal| {
            let sizes = sizes(diagonal, 2000.0, [0.6, 1.5]);
            sizes.into_iter().filter(|size| size.fits).map(|size| size.unit.symbol()).collect::<Vec<_>>()
        };
        assert_eq!(fitting(1.9), ["m"]);
        assert_eq!(fitting(190.0), ["cm"]);
        assert_eq!(fitting(1900.0), ["mm"]);
        assert_eq!(fitting(1900.0 / 25.4), ["in"]);
        assert_eq!(fitting(1900.0 / 304.8), ["ft"]);
        assert!(fitting(20.0).is_empty());
        assert!(Unit::ALL.into_iter().all(|unit| Unit::of_symbol(unit.symbol()) == Some(unit)));
    }
}
