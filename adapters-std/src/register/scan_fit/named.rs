//! Landmarks of a file in the order of a model, by their names.

use habitus_core::format::Model;

use crate::Error;

/// `points` in the order of the model's landmarks, `None` where the file has none of that name, and the names that the model does not know.
///
/// Names are equal also in other letters and with spaces or hyphens between their words. A point of three NaN is one that was not marked. Without `names` there must be one point for each landmark of the model, in its order.
///
/// # Errors
/// [`Error::Input`] for a model without landmarks, another number of points without names, names of which the model knows none, or that
/// are equal.
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
    let marked = |point: &[f64; 3]| Some(*point).filter(|point| !point.iter().all(|x| x.is_nan()));
    let of_model: Vec<&str> = model.landmark_names().map(|names| names.iter().collect()).unwrap_or_default();
    let (Some(names), false) = (names, of_model.is_empty()) else {
        if points.len() != n {
            return Err(Error::input(format!(
                "{} landmarks without names were given; the model has {n}: give all of them in its order, or a labelled list",
                points.len()
            )));
        }
        return Ok((points.iter().map(marked).collect(), Vec::new()));
    };
    let keys: Vec<String> = names.iter().map(|name| key(name)).collect();
    let place = |name: &&str| {
        names.iter().position(|known| known == name).or_else(|| keys.iter().position(|known| *known == key(name)))
    };
    if of_model.iter().all(|name| place(name).is_none()) {
        return Err(Error::input(format!(
            "none of the landmarks ({}) is one of the model's ({}); name them so",
            names.join(", "),
            of_model.join(", ")
        )));
    }
    let ordered = of_model.iter().map(|name| marked(points.get(place(name)?)?)).collect();
    let used: Vec<Option<usize>> = of_model.iter().map(place).collect();
    let mut unknown = Vec::new();
    for at in (0..names.len()).filter(|at| !used.contains(&Some(*at))) {
        if let Some(other) = used.iter().flatten().find(|other| keys[**other] == keys[at]) {
            return Err(Error::input(format!(
                "the landmarks {:?} and {:?} have the same name; leave one out",
                names[*other], names[at]
            )));
        }
        unknown.push(names[at].clone());
    }
    Ok((ordered, unknown))
}

/// What names have in common that are written in other ways: `Nose tip` and `nose_tip`.
fn key(name: &str) -> String {
    name.split([' ', '-', '_']).filter(|part| !part.is_empty()).collect::<Vec<_>>().join("_").to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::super::samples::model;
    use super::*;

    const A: [f64; 3] = [1.0, 2.0, 3.0];
    const B: [f64; 3] = [4.0, 5.0, 6.0];

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    #[test]
    fn names_order_the_points() {
        let (ordered, unknown) =
            in_model_order(&model(), Some(&names(&["chin", "ear", "nose_tip"])), &[A, B, B]).expect("known");
        assert_eq!((ordered.len(), ordered[12], ordered[4]), (13, Some(A), Some(B)));
        assert_eq!((ordered.iter().flatten().count(), unknown), (2, names(&["ear"])));
    }

    #[test]
    fn names_may_be_written_in_other_ways() {
        let ordered = |all: &[&str]| in_model_order(&model(), Some(&names(all)), &[A, B]);
        let (found, unknown) = ordered(&["Nose  tip", "Left-Eye-inner"]).expect("known");
        assert_eq!((found[4], found[2], unknown.len()), (Some(A), Some(B), 0));
        let said = ordered(&["nose tip", "nose_tip"]).expect_err("twice").to_string();
        assert!(said.contains("\"nose_tip\" and \"nose tip\" have the same name"), "{said}");
    }

    #[test]
    fn points_of_nan_are_not_marked_and_others_stay() {
        let half = [f64::NAN, 1.0, 2.0];
        let points: Vec<[f64; 3]> = (0..13).map(|k| [[f64::NAN; 3], half, A][k.min(2)]).collect();
        let (ordered, _) = in_model_order(&model(), None, &points).expect("thirteen");
        assert_eq!((ordered[0], ordered[2]), (None, Some(A)));
        assert!(ordered[1].is_some_and(|p| p[0].is_nan() && p[1] == 1.0));
        let (ordered, _) = in_model_order(&model(), Some(&names(&["chin"])), &[[f64::NAN; 3]]).expect("known");
        assert!(ordered.iter().all(Option::is_none));
    }

    #[test]
    fn what_cannot_be_ordered_is_refused() {
        let said = |names: Option<&[String]>, points: &[[f64; 3]]| {
            in_model_order(&model(), names, points).expect_err("refused").to_string()
        };
        assert!(said(None, &[A, B]).contains("2 landmarks without names were given; the model has 13"));
        assert!(
            said(Some(&names(&["ear"])), &[A])
                .contains("none of the landmarks (ear) is one of the model's (right_eye_outer")
        );
    }
}
