//! Colours: sRGB (IEC 61966-2-1) in meshes, linear fractions in glTF.

/// An sRGB channel as a linear fraction.
pub(super) fn linear(channel: u8) -> f64 {
    let encoded = f64::from(channel) / 255.0;
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The sRGB channel nearest to a linear fraction; what is outside 0 to 1 is taken to the nearer end.
pub(super) fn srgb(fraction: f64) -> u8 {
    let fraction = fraction.clamp(0.0, 1.0);
    let encoded = if fraction <= 0.0031308 { 12.92 * fraction } else { 1.055 * fraction.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

/// The fraction in 65535 parts: eight bits would lose the dark colours on the way to linear.
pub(super) fn linear_u16(channel: u8) -> u16 {
    (linear(channel) * 65535.0).round() as u16
}

/// Whether the channel stands for the fraction as well as a number of `steps` steps can.
pub(super) fn stands_for(channel: u8, fraction: f64, steps: f64) -> bool {
    (linear(channel) - fraction).abs() * steps <= 0.5 + 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_survives_the_way_to_linear_and_back() {
        for channel in 0..=255 {
            let fraction = f64::from(linear_u16(channel)) / 65535.0;
            assert_eq!(srgb(fraction), channel);
            assert!(stands_for(channel, fraction, 65535.0));
        }
        assert_eq!((linear_u16(0), linear_u16(255), srgb(-1.0), srgb(7.0)), (0, 65535, 0, 255));
        assert!(!stands_for(1, 0.0, 65535.0));
    }

    #[test]
    fn both_branches_meet() {
        assert!((linear(10) - 10.0 / 255.0 / 12.92).abs() < 1e-12);
        assert!((linear(188) - 0.502_886_458_033).abs() < 1e-6);
    }
}
