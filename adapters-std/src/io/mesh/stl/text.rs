//! Text STL: `solid`, for each triangle `facet normal`, `outer loop`, three `vertex`, `endloop`, `endfacet`; `endsolid`.
//! Solids may follow one another; they are joined.

use std::path::Path;

use super::super::ReadOptions;
use super::super::coordinates::Coordinates;
use super::super::losses::Losses;
use super::corners::Corners;
use crate::io::text::{Words, numbered_lines, shown, words};
use crate::{Error, Place};

/// What may come next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Within {
    File,
    Solid,
    Facet,
    Loop,
}

/// Reads the triangles of all solids; returns the last line.
pub(super) fn read(
    bytes: &[u8],
    path: &Path,
    options: &ReadOptions,
    corners: &mut Corners,
    losses: &mut Losses,
) -> Result<usize, Error> {
    let coordinates = Coordinates::new(path, options);
    let (mut within, mut last) = (Within::File, 1);
    let (mut n_solids, mut n_divided) = (0, 0);
    let mut normal = [0.0; 3];
    let mut polygon: Vec<[f64; 3]> = Vec::new();
    for (line, text) in numbered_lines(bytes) {
        last = line;
        let mut words = words(text);
        while let Some(word) = words.next() {
            let malformed = |problem: String| Err(Error::malformed(path, Place::Line(line), problem));
            match (within, &word.to_ascii_lowercase()[..]) {
                // The name takes the rest of the line.
                (Within::File, b"solid") => {
                    (within, n_solids) = (Within::Solid, n_solids + 1);
                    break;
                }
                (Within::Solid, b"endsolid") => {
                    within = Within::File;
                    break;
                }
                (Within::Solid, b"facet") => {
                    normal = facet_normal(&mut words, path, line)?;
                    within = Within::Facet;
                }
                (Within::Facet, b"outer") => {
                    if !words.next().is_some_and(|word| word.eq_ignore_ascii_case(b"loop")) {
                        return malformed("\"loop\" is expected behind \"outer\"".into());
                    }
                    polygon.clear();
                    within = Within::Loop;
                }
                (Within::Loop, b"vertex") => polygon.push(coordinates.vector(&mut words, "vertex", line)?),
                (Within::Loop, b"endloop") => {
                    if polygon.len() < 3 {
                        return malformed(format!("a facet of {} corners; 3 are expected", polygon.len()));
                    }
                    n_divided += usize::from(polygon.len() > 3);
                    for pair in polygon[1..].windows(2) {
                        corners.push([polygon[0], pair[0], pair[1]], normal);
                    }
                    within = Within::Facet;
                }
                (Within::Facet, b"endfacet") => within = Within::Solid,
                _ => {
                    let expected = match within {
                        Within::File => "solid",
                        Within::Solid => "facet or endsolid",
                        Within::Facet => "outer loop or endfacet",
                        Within::Loop => "vertex or endloop",
                    };
                    return malformed(format!("{:?} where {expected} is expected", shown(word)));
                }
            }
        }
    }
    if within != Within::File {
        let problem = "the file ends before \"endsolid\": is it truncated?";
        return Err(Error::malformed(path, Place::Line(last), problem));
    }
    losses.note_divided(n_divided);
    if n_solids > 1 {
        losses.say(format!("the division into {n_solids} solids (joined)"));
    }
    Ok(last)
}

/// The normal behind `facet`; numbers that are none make it unknown, as some programs write for flat triangles.
fn facet_normal(words: &mut Words<'_>, path: &Path, line: usize) -> Result<[f64; 3], Error> {
    if !words.next().is_some_and(|word| word.eq_ignore_ascii_case(b"normal")) {
        return Err(Error::malformed(path, Place::Line(line), "\"normal\" is expected behind \"facet\""));
    }
    let mut normal = [0.0; 3];
    for number in &mut normal {
        let Some(word) = words.next() else {
            return Err(Error::malformed(path, Place::Line(line), "the normal of the facet has fewer than 3 numbers"));
        };
        let value = crate::io::text::any_real(word).ok_or_else(|| {
            let problem = format!("the normal of the facet has {:?} where a number is expected", shown(word));
            Error::malformed(path, Place::Line(line), problem)
        })?;
        *number = value;
    }
    Ok(normal)
}
