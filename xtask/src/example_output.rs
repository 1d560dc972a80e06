//! What the examples for C and C++ must print and write, however they were built.

use crate::c_program::Language;
use crate::process::project;
use std::path::PathBuf;

/// Most that the fitted face may be away from the known one, millimetres: landmarks without noise and gentle priors leave less.
const CLOSE: f32 = 0.2;

/// Most that the posture found may leave between vertices, millimetres: landmarks without noise determine it.
const CLOSE_POSTURE: f32 = 0.5;

/// One of the two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Example {
    /// examples/c.
    C,
    /// examples/cpp.
    Cpp,
}

impl Example {
    /// Its folder below examples/.
    pub fn folder(self) -> &'static str {
        match self {
            Example::C => "c",
            Example::Cpp => "cpp",
        }
    }

    /// Its folder.
    pub fn source_folder(self) -> PathBuf {
        project().join("examples").join(self.folder())
    }

    /// The source of one of its programs: `face`, `body`, `wavelet`.
    pub fn source(self, program: &str) -> PathBuf {
        self.source_folder().join(format!("{program}.{}", self.folder()))
    }

    /// The language that it is compiled as.
    pub fn language(self) -> Language {
        match self {
            Example::C => Language::C99,
            Example::Cpp => Language::Cpp17,
        }
    }

    /// CMake's name of the language.
    pub fn cmake_language(self) -> &'static str {
        match self {
            Example::C => "C",
            Example::Cpp => "CXX",
        }
    }

    /// Make's variable for the compiler's flags.
    pub fn flags_variable(self) -> &'static str {
        match self {
            Example::C => "CFLAGS",
            Example::Cpp => "CXXFLAGS",
        }
    }
}

/// What was found in a few words, or the fault.
pub fn found(example: Example, text: &str, obj: &str) -> Result<String, String> {
    let mut counts = numbers(text.lines().next().unwrap_or_default()).into_iter();
    let (Some(vertices), Some(faces)) = (counts.next(), counts.next()) else {
        return Err(String::from("the first line has no counts"));
    };
    let line = |start: &str| {
        let line = text.lines().find(|line| line.starts_with(start));
        line.ok_or_else(|| format!("no line begins with `{start}`"))
    };
    let fit = line("fit: ")?;
    if !fit.ends_with(", converged") {
        return Err(String::from("the fit did not converge"));
    }
    let mut distances = vec![line("mesh: ")?];
    if example == Example::Cpp {
        distances.push(line("next picture: ")?);
    }
    let mut shown = Vec::new();
    for line in distances {
        let distance = numbers(line).first().copied().ok_or_else(|| format!("no distance in `{line}`"))?;
        if !(distance < CLOSE) {
            return Err(format!("`{line}` where less than {CLOSE} mm was expected"));
        }
        shown.push(format!("{distance} mm"));
    }
    let [.., depth] = mesh(obj, vertices as usize, faces as usize)?;
    // As the example places it, 40 cm away.
    if !((300.0..500.0).contains(&depth)) {
        return Err(format!("the OBJ lies {depth:.0} mm away"));
    }
    Ok(format!("{vertices} vertices, {}", shown.join(", ")))
}

/// The same of the program that fits a wavelet model: its surface doubles from level to level, its window has the bits of the whole, and its fit halves the distance at least.
pub fn wavelet(text: &str, obj: &str) -> Result<String, String> {
    let counts = numbers(text.lines().next().unwrap_or_default());
    let [width, height, levels, ..] = *counts.as_slice() else {
        return Err(String::from("the first line has no counts"));
    };
    let surfaces: Vec<Vec<f32>> = text.lines().filter(|line| line.starts_with("level ")).map(numbers).collect();
    let last = surfaces.last().and_then(|line| line.first().copied());
    if surfaces.len() as f32 != levels + 1.0 || last != Some(width * height) {
        return Err(String::from("the levels do not lead to the whole surface"));
    }
    if !text.contains("the node in the middle is that of its window") {
        return Err(String::from("the window differs from the whole"));
    }
    let fit = text.lines().find(|line| line.contains(" landmarks: ")).map(numbers).unwrap_or_default();
    let [_, rms, start_rms] = *fit.as_slice() else {
        return Err(String::from("no line says how the fit ended"));
    };
    if !(rms < start_rms / 2.0) {
        return Err(format!("a fit of {rms} mm from {start_rms} mm"));
    }
    let vertices = (width * height) as usize;
    mesh(obj, vertices, 2 * (width as usize - 1) * (height as usize - 1))?;
    Ok(format!("{levels} levels, {rms} mm"))
}

/// The same of the program that poses a body.
pub fn body(example: Example, text: &str, obj: &str) -> Result<String, String> {
    let counts = numbers(text.lines().next().unwrap_or_default());
    let [vertices, faces, _, angles, joints] = *counts.as_slice() else {
        return Err(String::from("the first line has no counts"));
    };
    let (mut n_joints, mut n_angles, mut moved) = (0.0, 0.0, 0);
    for line in text.lines().filter(|line| line.starts_with("joint ")) {
        let values = numbers(line);
        let [number, weights, from @ .., x, y, z] = values.as_slice() else {
            return Err(format!("`{line}` lacks numbers"));
        };
        if *number != n_joints || from.len() != 3 {
            return Err(format!("`{line}` where joint {n_joints} and two places were expected"));
        }
        n_joints += 1.0;
        n_angles += *weights;
        moved += usize::from(from != [*x, *y, *z]);
    }
    if (n_joints, n_angles) != (joints, angles) || moved == 0 {
        return Err(format!("{n_joints} joints with {n_angles} angles, {moved} of them moved"));
    }
    let mut shown = format!("{joints} joints");
    if example == Example::Cpp {
        let line = text.lines().find(|line| line.starts_with("mesh: ")).ok_or("no line begins with `mesh: `")?;
        let distance = numbers(line).first().copied().ok_or_else(|| format!("no distance in `{line}`"))?;
        if !(distance < CLOSE_POSTURE) {
            return Err(format!("`{line}` where less than {CLOSE_POSTURE} mm was expected"));
        }
        shown += &format!(", {distance} mm");
    }
    mesh(obj, vertices as usize, faces as usize)?;
    Ok(shown)
}

/// The mean position, unless a text is no mesh of so many vertices and triangles.
fn mesh(obj: &str, vertices: usize, faces: usize) -> Result<[f64; 3], String> {
    let (mut n_vertices, mut n_faces, mut sum) = (0, 0, [0.0; 3]);
    for (number, line) in obj.lines().enumerate() {
        let values = numbers(line);
        let fits = match (line.get(..2), values.as_slice()) {
            (Some("v "), [_, _, _]) if values.iter().all(|value| value.is_finite()) => {
                n_vertices += 1;
                sum.iter_mut().zip(&values).for_each(|(sum, value)| *sum += f64::from(*value));
                true
            }
            (Some("f "), [_, _, _]) => {
                n_faces += 1;
                values.iter().all(|value| *value >= 1.0 && *value <= vertices as f32)
            }
            _ => false,
        };
        if !fits {
            return Err(format!("line {} of the OBJ is neither vertex nor triangle: `{line}`", number + 1));
        }
    }
    if (n_vertices, n_faces) != (vertices, faces) {
        return Err(format!("the OBJ has {n_vertices} vertices and {n_faces} triangles"));
    }
    Ok(sum.map(|sum| sum / n_vertices as f64))
}

/// The numbers among the words of a line.
fn numbers(line: &str) -> Vec<f32> {
    line.split_whitespace().filter_map(|word| word.trim_matches(',').parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "3 vertices, 1 triangles, 6 identity weights\nfit: 0.041 mm over 13 landmarks, converged\nmesh: 0.058 mm away\n";
    const OBJ: &str = "v 0 0 400\nv 1 0 400\nv 0 1 400\nf 1 2 3\n";

    #[test]
    fn a_fitted_wavelet_model_is_found_and_a_fault_is_named() {
        let text = "3 x 2 nodes in 1 levels, 4 + 4 weights\nlevel 0: 2 vertices\nlevel 1: 6 vertices\n\
            the node in the middle is that of its window\n5 landmarks: 0.250 mm, after placing alone 1.000 mm\n";
        let vertices = "v 0 0 0\n".repeat(6);
        let obj = vertices + &"f 1 2 3\n".repeat(4);
        assert_eq!(wavelet(text, &obj).unwrap(), "1 levels, 0.25 mm");
        for (from, to) in [
            ("level 0: 2 vertices\n", ""),
            ("1: 6", "1: 5"),
            ("is that of", "differs from"),
            ("0.250", "0.750"),
            ("5 landmarks", "fit"),
        ] {
            assert!(wavelet(&text.replace(from, to), &obj).is_err(), "{from}");
        }
        assert!(wavelet(text, "v 0 0 0\n").is_err());
    }

    #[test]
    fn a_posed_body_is_found_and_a_fault_is_named() {
        let text = "3 vertices, 1 triangles, 2 identity weights, 4 angles, 2 joints\n\
            joint 0 hip, 3 angles, from 0.0 9.0 0.0 to 0.0 9.0 0.0\njoint 1 , 1 angles, from 0.0 9.0 1.0 to 0.0 9.5 1.0\nmesh: 0.1 mm\n";
        assert_eq!(body(Example::C, text, OBJ).unwrap(), "2 joints");
        assert_eq!(body(Example::Cpp, text, OBJ).unwrap(), "2 joints, 0.1 mm");
        for (from, to) in
            [("9.5", "9.0"), ("joint 1", "joint 2"), ("3 angles", "2 angles"), ("mesh", "far"), ("0.1 mm", "9 mm")]
        {
            assert!(body(Example::Cpp, &text.replace(from, to), OBJ).is_err(), "{from}");
        }
    }

    #[test]
    fn a_sound_run_is_found_and_a_fault_is_named() {
        assert_eq!(found(Example::C, TEXT, OBJ).unwrap(), "3 vertices, 0.058 mm");
        assert!(found(Example::Cpp, TEXT, OBJ).unwrap_err().contains("next picture"));
        assert!(found(Example::C, &TEXT.replace("0.058", "nan"), OBJ).is_err());
        assert!(found(Example::C, &TEXT.replace(", conv", ", not conv"), OBJ).is_err());
        for (from, to) in [("f 1", "f 4"), ("v 1 0 400", "v 1 0"), ("400", "4"), ("v 0 0 400\n", "")] {
            assert!(found(Example::C, TEXT, &OBJ.replace(from, to)).is_err(), "{from}");
        }
    }
}
