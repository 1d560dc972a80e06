//! The page of the demonstration.

use habitus_core::format::Model;
use rayon::prelude::*;
use serde_json::Value;

use super::figures::{DemoFigures, partial};
use super::files::{expressions, landmarks, name};
use super::fits::{FaceFit, Found};
use super::learned::Learned;
use super::scans::UnseenScan;
use crate::Error;
use crate::mesh::Mesh;
use crate::report::model_sections::{compactness_plot, curve_plots, modes};
use crate::report::page::{Block, Cell, Download, File, Page, Picture, Section, Strip, Table, bytes};
use crate::report::plot::{Cumulative, Histogram, Sample};
use crate::report::portrait::{LINING, PORTRAIT, Portraits};
use crate::report::{ColourBar, ColourScale, made_by, rounded_up};
use crate::synth::face_motion::EXPRESSIONS;

pub(super) fn of(
    model: &Model<'_>,
    learned: &Learned,
    scans: &[UnseenScan],
    fits: &[FaceFit],
    figures: &DemoFigures,
) -> Result<Page, Error> {
    let json = serde_json::to_value(figures).map_err(|error| Error::Internal(error.to_string()))?;
    let text = format!("{json:#}\n").into_bytes();
    let sections = vec![
        results(figures, &json),
        fitted(scans, fits, &json)?,
        errors(scans, fits)?,
        quality(model, learned, figures)?,
        modes(model)?,
        downloads(model, scans, fits, text)?,
    ];
    Ok(Page {
        title: "A face model, from nothing to fits of raw scans".into(),
        lead: vec![
            "The population is procedural: no person was scanned.".into(),
            format!(
                "A program drew {} people with {} expressions each. A multilinear model was learned from them and then fitted to simulated depth scans of {} other people. Since \
                 these people are procedural too, the truth behind every scan is known, and so is the error of every fit. The figures say how the program works, not how real faces are.",
                figures.identities,
                figures.expressions,
                scans.len()
            ),
        ],
        sections,
        footer: format!("{} Seed {}; the same seed gives the same figures.", made_by(), figures.seed),
        files: Vec::new(),
    })
}

fn row(figures: &Value, name: &str, pointer: &str, decimals: usize) -> Vec<Cell> {
    vec![name.into(), Cell::figure(figures, pointer, decimals)]
}

fn results(figures: &DemoFigures, json: &Value) -> Section {
    let error = |name: &str, pointer: &str| row(json, name, pointer, 3);
    let errors = Table {
        caption: "Mean distance between corresponding vertices and the truth, mm.".into(),
        head: vec!["what is compared with the truth".into(), "error, mm".into()],
        rows: vec![
            error("training faces, reproduced by the model", "training_error_mm"),
            error("unseen faces: the mean face, placed on them", "unseen_mean_face_error_mm"),
            error("unseen faces: fit to 13 landmarks alone", "unseen_landmark_fit_error_mm"),
            error("unseen faces: fit to the raw scan", "unseen_scan_fit_error_mm"),
            error("of this, where the scanner saw the face", "unseen_scan_fit_seen_error_mm"),
            error("of this, where it did not", "unseen_scan_fit_hidden_error_mm"),
            error("unseen faces: fit to all true points, the best that the model can do", "unseen_point_fit_error_mm"),
        ],
    };
    let count = |name: &str, pointer: &str| row(json, name, pointer, 0);
    let model = Table {
        caption: "The model.".into(),
        head: Vec::new(),
        rows: vec![
            count("people learned from", "identities"),
            count("expressions of each", "expressions"),
            count("vertices", "vertices"),
            count("identity weights", "identity_dim"),
            count("expression weights", "expression_dim"),
            vec!["size of the file".into(), bytes(figures.model_bytes as u64).into()],
        ],
    };
    let gain = figures.unseen_mean_face_error_mm / figures.unseen_scan_fit_error_mm.max(1e-9);
    let sentence = format!(
        "Fitted to a raw scan, the model is {:.2} mm from the truth on average, over the whole face: {gain:.1} times nearer than the mean face.",
        figures.unseen_scan_fit_error_mm
    );
    Section { title: "Result".into(), blocks: vec![Block::Text(sentence), Block::Table(errors), Block::Table(model)] }
}

/// Every unseen face: scan, fit, truth, error.
fn fitted(scans: &[UnseenScan], fits: &[FaceFit], json: &Value) -> Result<Section, Error> {
    let truths: Vec<_> = scans.iter().map(|scan| scan.upright(&scan.truth)).collect();
    let people: Vec<_> = scans.iter().map(UnseenScan::upright_person).collect();
    let cells = Portraits::holding(PORTRAIT, truths.iter().chain(&people), Some(LINING));
    let mut all: Vec<f64> = fits.iter().flat_map(|fit| fit.by_scan.errors.iter().copied()).collect();
    all.sort_by(f64::total_cmp);
    // Nearly all errors are on the scale; one of the worst vertices should not wash out the others.
    let scale = ColourScale::sequential(0.0, rounded_up(all.get(all.len() * 99 / 100).copied().unwrap_or(1.0)));
    let legend = cells.legend(&ColourBar::of(scale, "error, mm", &all));
    let mut legend = Picture::of(&legend, "pictures/error_legend.png", "Legend of the colours, mm", "")?;
    let mut blocks = vec![Block::Text(
        "Each person was scanned with another expression, as a mesh whose triangles are not those of the model, turned and moved at random. The scanner has noise, holes, flying points, errors between its \
         views, and cannot see what is hidden; on some scans there are other things. The fit knows the scan and landmarks that were marked with 1 mm of noise along each axis, and nothing else: \
         what is missing in the scan comes from the model."
            .into(),
    )];
    let strips: Vec<Strip> = (0..scans.len())
        .into_par_iter()
        .map(|number| strip(number, &scans[number], &fits[number], &cells, &scale, &json["scans"][number]))
        .collect::<Result<_, _>>()?;
    for mut strip in strips {
        strip.legend = Some(legend.clone());
        blocks.push(Block::Strip(strip));
        // It is written once.
        legend.file.bytes = None;
    }
    blocks.push(Block::Table(of_each(scans, json)));
    Ok(Section { title: "Unseen people: scan, fit, truth, error".into(), blocks })
}

fn strip(
    number: usize,
    scan: &UnseenScan,
    fit: &FaceFit,
    cells: &Portraits,
    scale: &ColourScale,
    figures: &Value,
) -> Result<Strip, Error> {
    let expression = EXPRESSIONS[scan.expression];
    let file = |what: &str| format!("pictures/unseen_{number}_{what}.png");
    let alt = |what: &str| format!("{what} of unseen person {}, {expression}", number + 1);
    let found = scan.upright(&fit.by_scan.mesh);
    let raw = cells.clay(&scan.upright(&scan.scan.mesh));
    let truth = cells.clay(&scan.upright(&scan.truth));
    let map = cells.coloured(&found, &scale.colours(&fit.by_scan.errors));
    let told = |pointer: &str, decimals| Cell::figure(figures, pointer, decimals).text;
    Ok(Strip {
        pictures: vec![
            Picture::of(&raw, file("scan"), alt("Raw scan"), "scan")?,
            Picture::of(&cells.clay(&found), file("fit"), alt("Fit to the scan"), "fit")?,
            Picture::of(&truth, file("truth"), alt("True face"), "truth")?,
            Picture::of(&map, file("error"), alt("Error of the fit"), "error, mm")?,
        ],
        legend: None,
        caption: format!(
            "Person {}, {expression}: mean error {} mm, 95 % within {} mm. The scan has {} points from {}; the scanner saw {} % of the face and {} of its landmarks.",
            number + 1,
            told("scan_fit/mean_mm", 2),
            told("scan_fit/quantile_95_mm", 2),
            told("points", 0),
            if scan.scan.views.len() == 1 { "1 view".to_owned() } else { format!("{} views", scan.scan.views.len()) },
            told("seen_percent", 0),
            told("landmarks", 0),
        ),
    })
}

/// The errors of each face.
fn of_each(scans: &[UnseenScan], json: &Value) -> Table {
    let row = |(number, scan): (usize, &UnseenScan)| {
        let cell = |field: &str, decimals| Cell::figure(json, &format!("scans/{number}/{field}"), decimals);
        vec![
            format!("{} {}", number + 1, EXPRESSIONS[scan.expression]).into(),
            cell("views", 0),
            cell("seen_percent", 1),
            cell("mean_face_error_mm", 2),
            cell("landmark_fit_error_mm", 2),
            cell("scan_fit/mean_mm", 2),
            cell("scan_fit/seen_mean_mm", 2),
            cell("scan_fit/hidden_mean_mm", 2),
            cell("scan_fit/quantile_95_mm", 2),
            cell("point_fit_error_mm", 2),
        ]
    };
    let head = [
        "person",
        "views",
        "seen, %",
        "mean face",
        "landmarks",
        "scan",
        "where seen",
        "where hidden",
        "95 % within",
        "all points",
    ];
    Table {
        caption: "Errors of each face in mm: of the mean face, of the fit to landmarks, of the fit to the scan (whole, where seen, where hidden, 95 % of the vertices), and of the fit to all true points.".into(),
        head: head.map(str::to_owned).to_vec(),
        rows: scans.iter().enumerate().map(row).collect(),
    }
}

fn errors(scans: &[UnseenScan], fits: &[FaceFit]) -> Result<Section, Error> {
    let sample = |name: &str, values: Vec<f64>| Sample { name: name.into(), values };
    let whole = |found: fn(&FaceFit) -> &Found| fits.iter().flat_map(|fit| found(fit).errors.iter().copied()).collect();
    let (x, counted) = ("error, mm".to_owned(), "vertices".to_owned());
    let seen = partial(scans, fits, true);
    let hidden = partial(scans, fits, false);
    let histogram = Histogram {
        x: x.clone(),
        counted: counted.clone(),
        samples: vec![sample("seen", seen), sample("hidden", hidden)],
    };
    let within = Cumulative {
        x,
        counted,
        samples: vec![
            sample("all true points", whole(|fit| &fit.by_points)),
            sample("raw scan", whole(|fit| &fit.by_scan)),
            sample("13 landmarks", whole(|fit| &fit.by_landmarks)),
            sample("mean face", whole(|fit| &fit.mean_face)),
        ],
    };
    let plots = vec![
        Picture::plot(
            histogram.svg()?,
            "plots/errors.svg",
            "Histogram of the errors of the fits to scans, at vertices that the scanner saw and at hidden ones",
            "Errors of the fits to raw scans at all vertices of all unseen faces: those that the scanner saw, and those that it did not. The axis ends where 99.5 % of either are within it.",
        ),
        Picture::plot(
            within.svg()?,
            "plots/within.svg",
            "Share of the vertices within each error, for fits to all points, to scans, to landmarks, and for the mean face",
            "Which share of all vertices is within which error, by what the fit knows. The axis ends where 99.5 % of each but the widest are within it.",
        ),
    ];
    Ok(Section { title: "How the errors are spread".into(), blocks: vec![Block::Plots(plots)] })
}

fn quality(model: &Model<'_>, learned: &Learned, figures: &DemoFigures) -> Result<Section, Error> {
    let (identity, expression) = (&learned.compactness.identity.percent, &learned.compactness.expression.percent);
    let mut plots = vec![compactness_plot(identity, expression)?];
    plots.extend(curve_plots(&learned.curves.general, &learned.curves.specific)?);
    let faces = expressions(model)?;
    let cells = Portraits::holding(PORTRAIT, &faces, Some(LINING));
    let picture = |(face, name): (_, &&str)| {
        Picture::of(&cells.clay(face), format!("pictures/mean_{name}.png"), format!("The mean face, {name}"), *name)
    };
    let pictures = faces.par_iter().zip(&EXPRESSIONS).map(picture).collect::<Result<Vec<_>, _>>()?;
    let mut blocks: Vec<Block> = pictures
        .chunks(4)
        .map(|pictures| Block::Strip(Strip { pictures: pictures.to_vec(), ..Strip::default() }))
        .collect();
    blocks.insert(0, Block::Text("The mean identity in every expression of the training data.".into()));
    blocks.push(Block::Text(format!(
        "How good the model is at which size. Compactness is that of all {} people; the other curves are measured on the first {} of them. Bars are standard errors.",
        figures.identities, figures.curve_identities
    )));
    blocks.push(Block::Plots(plots));
    Ok(Section { title: "The model".into(), blocks })
}

fn downloads(model: &Model<'_>, scans: &[UnseenScan], fits: &[FaceFit], figures: Vec<u8>) -> Result<Section, Error> {
    let download = |file: File, text: String| Download { file, text };
    let mut files = vec![
        download(File::there("face.hab"), "the model".into()),
        download(File::new("figures.json", figures), "every figure of this page".into()),
    ];
    for (name, face) in EXPRESSIONS.iter().zip(expressions(model)?) {
        let face = Mesh { normals: face.vertex_normals(), ..face };
        files.push(download(File::glb(format!("mean_{name}.glb"), &face)?, format!("the mean face, {name}")));
    }
    let mut of_people = Vec::new();
    for (number, (scan, fit)) in scans.iter().zip(fits).enumerate() {
        let (name, person) = (name(number, scan), number + 1);
        let marks = File::new(format!("{name}_landmarks.txt"), landmarks(scan).into_bytes());
        for (part, mesh, what) in [
            ("scan", &scan.scan.mesh, "the raw scan"),
            ("scan_fit", &fit.by_scan.mesh, "the fit to it"),
            ("truth", &scan.truth, "the true face"),
        ] {
            of_people
                .push(download(File::ply(format!("{name}_{part}.ply"), mesh)?, format!("person {person}: {what}")));
        }
        of_people.push(download(marks, format!("person {person}: landmarks on the scan")));
    }
    let text = "Meshes of the model (GLB) are in metres, as the format asks for. Those of people (PLY) are in millimetres, as habitus fit takes them; scan, landmarks, fit and truth of a \
        person lie in one frame. Beside them lie the fits to landmarks alone and to all points.";
    let blocks = vec![Block::Downloads(files), Block::Text(text.into()), Block::Downloads(of_people)];
    Ok(Section { title: "Files".into(), blocks })
}
