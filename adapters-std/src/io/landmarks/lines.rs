//! Landmarks in text: a labelled list, rows with or without a name, fields between commas, or numbers alone.

use std::path::Path;

use super::{FACE_LANDMARKS, LandmarkFile, beyond_places, is_place, standard_names};
use crate::io::text::{integer, not_finite, numbered_lines, real, shown, vector, words};
use crate::{Error, Place};

/// A line with its number.
type Line<'a> = (usize, &'a [u8]);

/// The landmarks of a text without its byte order mark. Lines that begin with `#` are comments.
pub(super) fn landmarks(bytes: &[u8], path: &Path) -> Result<LandmarkFile, Error> {
    let says_something = |(_, text): &Line<'_>| !matches!(text.trim_ascii_start().first(), None | Some(b'#'));
    let mut lines: Vec<Line<'_>> = numbered_lines(bytes).filter(says_something).collect();
    let has_commas = lines.iter().any(|(_, text)| text.contains(&b','));
    let has_header = lines.first().is_some_and(|(_, text)| is_header(text));
    if has_header {
        lines.remove(0);
    }
    if lines.is_empty() {
        let last = Place::Line(numbered_lines(bytes).count());
        return Err(Error::malformed(path, last, "there is no landmark in it"));
    }
    if let Some((line, _)) = lines.iter().find(|(_, text)| text.contains(&b';')) {
        let problem =
            "a semicolon: put commas between name, x, y and z, and a point into the numbers where they have a comma";
        return Err(Error::malformed(path, Place::Line(*line), problem));
    }
    if has_commas {
        return table(&lines, path, fields);
    }
    let label = lines.iter().find(|(_, text)| words(text).next().is_some_and(starts_label));
    match label {
        // A label in front of numbers is one of a row; the count comes before the others.
        Some((_, text)) if words(text).count() > 1 && integer::<usize>(lines[0].1.trim_ascii()).is_none() => {
            table(&lines, path, row)
        }
        Some(_) => labelled_list(&lines, path),
        None if has_header => table(&lines, path, row),
        None => unlabelled(&lines, path),
    }
}

fn starts_label(word: &[u8]) -> bool {
    let first = word.first().copied().unwrap_or(b' ');
    let is_letter = first.is_ascii_alphabetic() || first > 0x7f;
    is_letter && !["nan", "inf", "infinity"].contains(&&*shown(word).to_ascii_lowercase())
}

/// Whether it is `x y z` or `name x y z`, also with commas.
fn is_header(line: &[u8]) -> bool {
    let line = line.to_ascii_lowercase();
    let found: Vec<&[u8]> = line
        .split(|&byte| byte == b',' || byte.is_ascii_whitespace())
        .map(|word| match word.trim_ascii() {
            [b'"', inner @ .., b'"'] => inner,
            word => word,
        })
        .filter(|word| !word.is_empty())
        .collect();
    let coordinates = match found.split_first() {
        Some((&(b"name" | b"label" | b"landmark"), coordinates)) => coordinates,
        _ => &found[..],
    };
    coordinates == [&b"x"[..], b"y", b"z"]
}

/// The name of a row and its coordinates, as words.
type Cells<'a> = (Option<&'a [u8]>, Vec<&'a [u8]>);

/// The fields of a line between commas.
fn fields(line: &[u8]) -> Result<Cells<'_>, String> {
    let unquoted = |field: &'_ [u8]| -> std::ops::Range<usize> {
        let trimmed = field.trim_ascii();
        let start = field.len() - field.trim_ascii_start().len();
        match trimmed {
            [b'"', inner @ .., b'"'] => start + 1..start + 1 + inner.len(),
            _ => start..start + trimmed.len(),
        }
    };
    let fields: Vec<&[u8]> = line.split(|&byte| byte == b',').map(|field| &field[unquoted(field)]).collect();
    match fields.len() {
        3 => Ok((None, fields)),
        4 => Ok((Some(fields[0]), fields[1..].to_vec())),
        n => Err(format!("{n} fields between commas where name,x,y,z or x,y,z is expected")),
    }
}

/// The words of a line: the label, which may have several, and three numbers.
fn row(line: &[u8]) -> Result<Cells<'_>, String> {
    let all: Vec<&[u8]> = words(line).collect();
    let label = all.iter().take_while(|word| real(word).is_none()).count();
    // A number in the label could also be a coordinate, and a word behind it a number that is mistyped.
    let (label, numbers) = match all.len().checked_sub(3) {
        Some(first) if label > first && starts_label(all[0]) => all.split_at(first.max(1)),
        Some(0) => (&[][..], &all[..]),
        _ if label > 0 && starts_label(all[0]) => all.split_at(label),
        _ => return Err(format!("{:?} where name x y z or x y z is expected", shown(line))),
    };
    if numbers.len() > 3 {
        return Err(format!(
            "{} numbers behind the name where x y z are expected; put commas between name, x, y and z",
            numbers.len()
        ));
    }
    let name = label.first().zip(label.last()).and_then(|(first, last)| {
        let at = |word: &[u8]| word.as_ptr() as usize - line.as_ptr() as usize;
        line.get(at(first)..at(last) + last.len())
    });
    Ok((name, numbers.to_vec()))
}

/// Rows of which each has a name, or none has.
fn table(
    lines: &[Line<'_>],
    path: &Path,
    cells: impl for<'a> Fn(&'a [u8]) -> Result<Cells<'a>, String>,
) -> Result<LandmarkFile, Error> {
    let (mut names, mut points): (Vec<String>, Vec<[f64; 3]>) = Default::default();
    for &(line, text) in lines {
        let malformed = |problem: String| Error::malformed(path, Place::Line(line), problem);
        let (name, numbers) = cells(text).map_err(malformed)?;
        let called = match name {
            Some(name) if !starts_label(name) => {
                return Err(malformed(format!("{:?} where a name is expected, such as nose_tip", shown(name))));
            }
            Some(name) => {
                push_name(&mut names, name).map_err(malformed)?;
                format!("landmark {}", shown(name))
            }
            None => "landmark".into(),
        };
        points.push(place(&mut numbers.into_iter(), &called, path, line)?);
        if !names.is_empty() && names.len() != points.len() {
            let (has, first) = if name.is_some() { ("a", "no") } else { ("no", "a") };
            return Err(malformed(format!(
                "the landmark has {has} name, the one before it {first} name: name all or none"
            )));
        }
    }
    let names = if names.is_empty() { standard_names(points.len()) } else { Some(names) };
    Ok(LandmarkFile::Points { names, points })
}

/// Appends a name that must be new.
fn push_name(names: &mut Vec<String>, name: &[u8]) -> Result<(), String> {
    let name = String::from_utf8(name.to_vec()).map_err(|_| format!("the label {:?} is not UTF-8", shown(name)))?;
    if names.contains(&name) {
        return Err(format!("the landmark {name:?} is there twice"));
    }
    names.push(name);
    Ok(())
}

/// The next three numbers as a place.
fn place<'a>(
    numbers: &mut impl Iterator<Item = &'a [u8]>,
    called: &str,
    path: &Path,
    line: usize,
) -> Result<[f64; 3], Error> {
    let point = vector(numbers, called, path, line)?;
    if is_place(&point) {
        return Ok(point);
    }
    Err(Error::malformed(path, Place::Line(line), beyond_places(&format!("the {called}"))))
}

/// The count, then for each landmark a line with its label and one with its coordinates.
fn labelled_list(lines: &[Line<'_>], path: &Path) -> Result<LandmarkFile, Error> {
    let malformed = |line, problem: String| Error::malformed(path, Place::Line(line), problem);
    let (first, header) = lines[0];
    let n: usize = integer(header.trim_ascii()).ok_or_else(|| {
        let problem = "where the number of the landmarks is expected, or a name and its x y z on one line";
        malformed(first, format!("{:?} {problem}", shown(header)))
    })?;
    let mut names: Vec<String> = Vec::new();
    let mut points = Vec::new();
    for pair in lines[1..].chunks(2) {
        let (line, text) = pair[0];
        let label = text.trim_ascii();
        if !starts_label(label) || words(label).any(|word| real(word).is_some()) {
            let problem = format!("{:?} where a label alone is expected, such as nose_tip", shown(text));
            return Err(malformed(line, problem));
        }
        push_name(&mut names, label).map_err(|problem| malformed(line, problem))?;
        let name = shown(label);
        let Some(&(line, text)) = pair.get(1) else {
            return Err(malformed(line, format!("the file ends before the coordinates of {name}")));
        };
        let mut coordinates = words(text);
        points.push(place(&mut coordinates, &format!("landmark {name}"), path, line)?);
        if let Some(word) = coordinates.next() {
            return Err(malformed(line, format!("{:?} follows the coordinates x y z of {name}", shown(word))));
        }
    }
    if points.len() != n {
        let problem = format!("{n} landmarks are announced, but {} follow: correct the number", points.len());
        return Err(malformed(first, problem));
    }
    Ok(LandmarkFile::Points { names: Some(names), points })
}

/// Numbers in lines of any length, three for each landmark.
fn unlabelled(lines: &[Line<'_>], path: &Path) -> Result<LandmarkFile, Error> {
    let mut numbers = Vec::new();
    let mut last = 0;
    for &(line, text) in lines {
        last = line;
        for word in words(text) {
            let number = real(word).ok_or_else(|| not_finite("landmark", word, path, Place::Line(line)))?;
            if !is_place(&[number; 3]) {
                let called = format!("landmark {} (counted from 0)", numbers.len() / 3);
                return Err(Error::malformed(path, Place::Line(line), beyond_places(&called)));
            }
            numbers.push(number);
        }
    }
    let (points, rest) = numbers.as_chunks::<3>();
    if !rest.is_empty() {
        let problem = format!("{} numbers; three for each landmark are expected", numbers.len());
        return Err(Error::malformed(path, Place::Line(last), problem));
    }
    let names = standard_names(points.len());
    debug_assert!(names.as_ref().is_none_or(|names| names.len() == FACE_LANDMARKS.len()));
    Ok(LandmarkFile::Points { names, points: points.to_vec() })
}
