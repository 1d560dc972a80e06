//! The proportions of a face and the latent factors that vary them between people.
//!
//! Sizes are those of an adult face in mm; every factor is a standard deviation away from it, so a face is drawn by
//! drawing [`IDENTITY_FACTORS`] standard normal numbers.

/// Names of the identity factors, in the order of a latent vector. The last six are habits of expression: they leave
/// the neutral face as it is.
pub const IDENTITY_FACTORS: [&str; 32] = [
    "face_width",
    "face_height",
    "jaw_width",
    "chin_length",
    "chin_projection",
    "nose_length",
    "nose_width",
    "nose_projection",
    "nose_bridge",
    "nose_tip_height",
    "lip_fullness",
    "mouth_width",
    "eye_size",
    "eye_spacing",
    "eye_depth",
    "eye_tilt",
    "lid_opening",
    "brow_ridge",
    "brow_height",
    "cheek_fullness",
    "cheekbones",
    "forehead_slope",
    "forehead_height",
    "profile_curve",
    "asymmetry_across",
    "asymmetry_upwards",
    "habit_intensity",
    "habit_mouth",
    "habit_brow",
    "habit_jaw",
    "habit_one_sided",
    "habit_eyes",
];

/// Number of identity factors.
pub const N_FACTORS: usize = IDENTITY_FACTORS.len();

/// The sizes that make one neutral face, in mm unless said otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceShape {
    /// Factor of all widths.
    pub width: f64,
    /// Factor of all heights.
    pub height: f64,
    /// Added to the half-width of the jaw.
    pub jaw_width: f64,
    /// Added to the height of the chin.
    pub chin_length: f64,
    /// How far the chin stands out.
    pub chin_projection: f64,
    /// Added to the length of the nose.
    pub nose_length: f64,
    /// Factor of the width of the nose.
    pub nose_width: f64,
    /// Factor of the projection of the nose.
    pub nose_projection: f64,
    /// Added to the bridge of the nose (a hump when positive).
    pub nose_bridge: f64,
    /// How far the tip hangs down.
    pub nose_droop: f64,
    /// Factor of the height and swell of the red of the lips.
    pub lip_fullness: f64,
    /// Factor of the width of the mouth.
    pub mouth_width: f64,
    /// Factor of the width of the eyes.
    pub eye_size: f64,
    /// Added to the distance of each eye from the middle.
    pub eye_spacing: f64,
    /// How deep the eyes lie in their sockets.
    pub eye_depth: f64,
    /// Rise of the outer corner of the eye over its width (a slope).
    pub eye_tilt: f64,
    /// Height of the upper lid's margin over the middle of the eye.
    pub lid_upper: f64,
    /// Depth of the lower lid's margin under the middle of the eye.
    pub lid_lower: f64,
    /// How far the ridge over the eyes stands out.
    pub brow_ridge: f64,
    /// Added to the height of the brows.
    pub brow_height: f64,
    /// Swell of the cheeks.
    pub cheek_fullness: f64,
    /// How far the cheekbones stand out.
    pub cheekbones: f64,
    /// How far the top of the forehead leans back from upright.
    pub forehead_slope: f64,
    /// Factor of the height of the forehead.
    pub forehead_height: f64,
    /// How far the middle of the face stands forward of forehead and chin.
    pub profile_curve: f64,
    /// Sideways bend of the lower face.
    pub asymmetry_across: f64,
    /// How much higher the left side stands than the right.
    pub asymmetry_upwards: f64,
}

impl FaceShape {
    /// The face with these latent factors, in standard deviations, in the order of [`IDENTITY_FACTORS`].
    pub fn of(factors: &[f64; N_FACTORS]) -> Self {
        let z = factors;
        FaceShape {
            width: 1.0 + 0.056 * z[0],
            height: 1.0 + 0.042 * z[1],
            jaw_width: 5.0 * z[2],
            chin_length: 3.4 * z[3],
            chin_projection: 5.5 + 2.5 * z[4],
            nose_length: 2.9 * z[5],
            nose_width: 1.0 + 0.14 * z[6],
            nose_projection: 1.0 + 0.12 * z[7],
            nose_bridge: 1.9 * z[8],
            nose_droop: 4.8 - 1.4 * z[9],
            lip_fullness: 1.0 + 0.25 * z[10],
            mouth_width: 1.0 + 0.09 * z[11],
            eye_size: 1.0 + 0.07 * z[12],
            eye_spacing: 1.9 * z[13],
            eye_depth: 3.4 + 1.0 * z[14],
            eye_tilt: 0.045 + 0.05 * z[15],
            lid_upper: 6.9 + 0.7 * z[16],
            lid_lower: 5.1 + 0.25 * z[16],
            brow_ridge: 2.5 + 1.6 * z[17],
            brow_height: 2.0 * z[18],
            cheek_fullness: 3.4 * z[19],
            cheekbones: 3.6 + 1.5 * z[20],
            forehead_slope: 4.5 * z[21],
            forehead_height: 1.0 + 0.06 * z[22],
            profile_curve: 2.0 * z[23],
            asymmetry_across: 0.9 * z[24],
            asymmetry_upwards: 0.7 * z[25],
        }
    }
}
