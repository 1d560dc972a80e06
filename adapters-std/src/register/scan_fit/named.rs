//! Landmarks of a file in the order of a model, by their names.

use habitus_core::format::Model;

use crate::Error;

/// `points` in the order of the model's landmarks, `None` where the file has none of that name, and the names that the model does not know.
///
/// Without `names` there must be one point for each landmark of the model, in its order.
///
/// # Errors
/// [`Error::Input`] for a model without landmarks, another number of points without names, names of which the model knows none.
#[allow(clippy::type_complexity)]
pub fn in_model_order(
    model: &Model<'_>,
    names: Option<&[String]>,
    points: &[[f64; 3]],
) -> Result<(Vec<Option<[f64; 3]>>, Vec<String>), Error> {
    let n = model.landmarks().map_or(0, |landmarks| landmarks.len());
    if n == 0 {
        return Err(Error::input(
            "the model has no landmarks, so it cannot be placed in a scan; train it with --landmarks",
        ));
    }
    let of_model: Vec<&str> = model.landmark_names().map(|names| names.iter().collect()).unwrap_or_default();
    let (Some(names), false) = (names, of_model.is_empty()) else {
        if points.len() != n {
            return Err(Error::input(format!(
                "{} landmarks without names were given; the model has {n}: give all of them in its order, or a labelled list",
                points.len()
            )));
        }
        return Ok((points.iter().map(|&point| Some(point)).collect(), Vec::new()));
    };
    let of_name = |name: &&str| names.iter().position(|known| known == name).and_then(|at| points.get(at).copied());
    let ordered: Vec<Option<[f64; 3]>> = of_model.iter().map(of_name).collect();
    if ordered.iter().all(Option::is_none) {
        return Err(Error::input(format!(
            "none of the landmarks ({}) is one of the model's ({}); name them so",
            names.join(", "),
            of_model.join(", ")
        )));
    }
    let unknown = names.iter().filter(|name| !of_model.contains(&name.as_str())).cloned().collect();
    Ok((ordered, unknown))
}
