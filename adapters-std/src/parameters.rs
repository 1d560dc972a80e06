//! The parameters of a shape in a JSON file: what a fit finds and `habitus generate` makes the shape of again.
//!
//! | key | content |
//! |---|---|
//! | `identity_deviations`, `expression_deviations` | weights in standard deviations; missing ones are 0 |
//! | `placement` | `scale`, `rotation` (rows), `translation`: from the model to where the shape lies; may be missing |
//!
//! Other keys are passed over, so the output of `habitus fit --json` and the `figures.json` of its page are such files too.

use std::path::Path;

use serde_json::{Value, json};

use crate::io::{self, atomic};
use crate::register::rigid::Similarity;
use crate::{Error, Place};

/// How far the rows of a rotation may be from unit length and right angles.
const ROTATION_TOLERANCE: f64 = 1e-4;

/// Weights and placement of a shape of a model.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Parameters {
    /// Identity weights, standard deviations.
    pub identity: Vec<f64>,
    /// Pose (expression) weights, standard deviations.
    pub expression: Vec<f64>,
    /// From the model (mm) to where the shape lies.
    pub placement: Option<Similarity>,
}

impl Parameters {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// [`Error::Read`], or [`Error::Malformed`] for what is no JSON object with weights, numbers that are none, a placement that is none.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::parse(&io::file_bytes(path)?, path)
    }

    /// [`Parameters::read`] of the bytes of a file; `path` is for the messages.
    ///
    /// # Errors
    /// [`Error::Malformed`].
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self, Error> {
        let malformed = |problem: String| Error::malformed(path, Place::Whole, problem);
        let document: Value = serde_json::from_slice(bytes).map_err(|error| {
            let place = Place::Column { line: error.line(), column: error.column() };
            Error::malformed(path, place, "no valid JSON: give what `habitus fit --parameters` has written")
        })?;
        let list = |key: &str| match &document[key] {
            Value::Null => Ok(None),
            found => numbers(found).map(Some).ok_or_else(|| malformed(format!("{key:?} is no list of numbers"))),
        };
        let (identity, expression) = (list("identity_deviations")?, list("expression_deviations")?);
        if identity.is_none() && expression.is_none() {
            return Err(malformed(
                "there are no \"identity_deviations\" and \"expression_deviations\" in it: give what `habitus fit --parameters` has written".into(),
            ));
        }
        let placement = match &document["placement"] {
            Value::Null => None,
            found => Some(placement(found).ok_or_else(|| {
                malformed(
                    "\"placement\" is none: it has a \"scale\" above 0, a \"rotation\" of three orthonormal rows and a \"translation\" of three numbers"
                        .into(),
                )
            })?),
        };
        Ok(Parameters { identity: identity.unwrap_or_default(), expression: expression.unwrap_or_default(), placement })
    }

    /// Writes the file at `path`, atomically.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let placement = self.placement.map(|placement| described(&placement));
        let document = json!({
            "identity_deviations": self.identity,
            "expression_deviations": self.expression,
            "placement": placement,
        });
        atomic::write(path, format!("{document:#}\n").as_bytes())
    }
}

/// A placement for programs.
pub fn described(placement: &Similarity) -> Value {
    json!({ "scale": placement.scale, "rotation": placement.rotation, "translation": placement.translation })
}

fn numbers(value: &Value) -> Option<Vec<f64>> {
    value.as_array()?.iter().map(Value::as_f64).collect()
}

fn placement(value: &Value) -> Option<Similarity> {
    let vector = |value: &Value| -> Option<[f64; 3]> { numbers(value)?.try_into().ok() };
    let rows: Vec<[f64; 3]> = value["rotation"].as_array()?.iter().map(vector).collect::<Option<_>>()?;
    let rotation: [[f64; 3]; 3] = rows.try_into().ok()?;
    let scale = value["scale"].as_f64().filter(|scale| *scale > 0.0 && scale.is_finite())?;
    let rows = rotation.map(glam::DVec3::from_array);
    let determinant = rows[0].cross(rows[1]).dot(rows[2]);
    let is_unit = rows.iter().all(|row| (row.length() - 1.0).abs() < ROTATION_TOLERANCE);
    // Of three unit rows the determinant is 1 only when they are orthogonal and turn the right way.
    (is_unit && (determinant - 1.0).abs() < ROTATION_TOLERANCE).then_some(())?;
    Some(Similarity { scale, rotation, translation: vector(&value["translation"])? })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(text: &str) -> String {
        Parameters::parse(text.as_bytes(), Path::new("p.json")).expect_err("refused").to_string()
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("p.json");
        let turned = Similarity {
            scale: 0.1,
            rotation: [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
            translation: [1.0, -2.5, 1e-3],
        };
        for placement in [Some(turned), None] {
            let parameters = Parameters { identity: vec![0.1, -2.0 / 3.0], expression: vec![], placement };
            parameters.write(&path).expect("written");
            assert_eq!(Parameters::read(&path).expect("read"), parameters);
        }
    }

    #[test]
    fn what_is_none_is_told() {
        assert!(said("{\"a\":").contains("p.json, line 1, column 5: no valid JSON"), "{}", said("{\"a\":"));
        assert!(said("[1]").contains("p.json: there are no \"identity_deviations\""));
        assert!(
            said("{\"identity_deviations\": [1, \"2\"]}").contains("\"identity_deviations\" is no list of numbers")
        );
        let mirrored = "{\"scale\": 1, \"rotation\": [[-1,0,0],[0,1,0],[0,0,1]], \"translation\": [0,0,0]}";
        for placement in [mirrored, "{\"scale\": 1}", "7"] {
            let text = format!("{{\"identity_deviations\": [], \"placement\": {placement}}}");
            assert!(said(&text).contains("\"placement\" is none: it has"), "{}", said(&text));
        }
    }
}
